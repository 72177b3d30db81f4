//! An equilibrium from passes: the path from rest, the curve to a fold, a search, and Newton's method on the fine grid. R4, C1 to C7

pub mod anchors;
pub mod bordered;
pub mod chord;
pub mod curve;
pub mod equations;
pub mod field;
pub mod fold;
pub mod path;
pub mod search;
pub mod solve;
pub mod start;
pub mod turn;
