//! Reproducible random numbers, rods and scenes: everything follows from a seed.

mod chains;
mod numbers;
mod rods;

pub use chains::Chain;
pub use numbers::Random;
