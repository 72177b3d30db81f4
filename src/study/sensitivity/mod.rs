//! Sensitivity: which input matters, how uncertain an output is, what to measure.
//!
//! The numerics stand on plain numbers, each in its own file: [`PickFreeze`] designs, [`Cosines`] of any sample,
//! [`Chaos`] from values and slopes, exact sums on grids ([`GridSums`]), bounds by slopes, the choice of experiments.

mod anova;
mod blocks;
mod bounds;
mod chaos;
mod cholesky;
mod cosine;
mod estimator;
pub mod experiments;
mod failures;
mod pick_freeze;
mod polynomials;
mod quantiles;
mod sums;

pub use anova::GridSums;
pub use blocks::{BLOCKS, Estimate};
pub use bounds::{poincare_constant, poincare_normal, poincare_uniform};
pub use chaos::{Chaos, ChaosRows, GOOD, MAX_DEGREE, MAX_INPUTS};
pub use cosine::{Cosines, Harmonics, JUMP_LIMIT, ORDERS, Source};
pub use estimator::{BaseRow, Estimator, PickFreezeSums};
pub use failures::wilson;
pub use pick_freeze::{PairedEstimate, PickFreeze};
pub use polynomials::{Basis, Family};
pub use sums::Share;
