//! Sensitivity: which input matters, how uncertain an output is, what to measure.
//!
//! The numerics stand on plain numbers, each in its own file: [`PickFreeze`] designs, [`Cosines`] of any sample,
//! [`Chaos`] from values and slopes, exact sums on grids ([`GridSums`]), bounds by slopes, the choice of experiments.

mod analysis;
mod anova;
mod blocks;
mod bounds;
mod candidates;
mod chaos;
mod checks;
mod cholesky;
mod cosine;
mod design;
mod error;
mod estimator;
mod experiments;
mod failures;
mod identify;
mod indices;
mod inputs;
mod job;
mod json;
mod kept;
mod local;
mod moments;
mod nominal;
mod notes;
mod options;
mod outputs;
mod pass;
mod pick_freeze;
mod polynomials;
mod prepare;
mod quantiles;
mod result;
mod rows;
mod shapes;
mod spread;
mod sums;
mod tables;
mod text;
mod worst_case;

pub use anova::GridSums;
pub use blocks::{BLOCKS, Estimate};
pub use bounds::{poincare_constant, poincare_log_uniform, poincare_normal, poincare_uniform};
pub use chaos::{Chaos, ChaosRows, GOOD, MAX_DEGREE, MAX_INPUTS};
pub use cosine::{Cosines, Harmonics, JUMP_LIMIT, ORDERS, Source};
pub use error::SensitivityError;
pub use estimator::{BaseRow, Estimator, PickFreezeSums};
pub use experiments::{Choice, Measurements, Observability};
pub use failures::wilson;
pub use job::SensitivityJob;
pub use moments::Lumps;
pub use options::EstimatorChoice;
pub use pick_freeze::{PairedEstimate, PickFreeze};
pub use polynomials::{Basis, Family};
pub use result::{
    Chosen, Convergence, Identification, Index, Information, Local, Order, Polynomial, QUANTILES, Sensitivity, Slopes,
    Spread, StatusShare, WorstCase,
};
pub use sums::Share;
