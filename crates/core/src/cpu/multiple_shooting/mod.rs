//! Multiple shooting, for rods so limp or so taut that a single pass loses its digits. N1 to N4
//!
//! Orientation and moment are unknown at nodes all along the rod. Each interval between nodes is a pass of its own, and
//! block elimination from the tip joins them. Nothing grows along the whole rod.

mod answer;
mod drives;
mod elimination;
mod interval;
mod margin;
mod mesh;
mod newton;
mod path;
mod quick;
mod responses;
mod state;
#[cfg(test)]
mod tests;
mod traces;

pub use answer::solve_nodes;
pub use quick::{QuickEnd, follow_quickly};
pub use state::Nodes;
