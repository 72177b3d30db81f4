//! Why a fit is not possible.

use crate::backend::BackendError;
use crate::model::{ParameterError, PlanError};

/// Why a fit is not possible.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The scene and its parameters make no plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// An engine cannot be used, or failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// A name that the scene has not.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A parameter that is to be fitted twice.
    #[error("{0} is named twice")]
    NamedTwice(String),
    /// A parameter that is to be fitted, while its values are known.
    #[error("{0} is a column of known values; drop one of the two")]
    FreeAndKnown(String),
    /// Fewer numbers observed than fitted.
    #[error("{observations} observed numbers cannot determine {parameters} parameters: observe more, or free fewer")]
    TooFew {
        /// Observed coordinates and forces.
        observations: usize,
        /// Fitted numbers.
        parameters: usize,
    },
    /// Parameters that are to keep their ratio, one of which is not positive.
    #[error("`{0}` is zero and cannot be scaled: give it a value in the scene, or free its components one by one")]
    Zero(String),
    /// No equilibrium to begin from.
    #[error("with the scene's own values shape {shape} has no stable equilibrium ({status}): start from other values")]
    NoStart {
        /// From 1.
        shape: usize,
        /// How its solution ended.
        status: &'static str,
    },
    /// The method found no answer.
    #[error("the fit ended in vain: {0}")]
    Failed(String),
}
