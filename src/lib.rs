//! rodsweep: batched static Cosserat rods with their Jacobians.

pub mod backend;
pub mod model;
pub mod sweep;
