//! rodsweep: batched static Cosserat rods with their Jacobians.

pub mod backend;
pub mod gpu;
pub mod lanes;
pub mod model;
pub mod reference;
