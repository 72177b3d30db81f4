//! What is asked of all methods, and how the engine is called.

/// 95 % of the tips are this near to the reference's, over the length.
pub const TOLERANCE: f64 = 1e-6;
/// The same for the chain of links, which does not get there: its matrix grows with the square of the links.
pub const CHAIN_TOLERANCES: [f64; 2] = [1e-3, 1e-4];
/// Samples of a batch of the engine.
pub const BATCH: usize = 4096;
/// Configurations of a call where several are continued: the points that control solves together.
pub const TOGETHER: usize = 8;
