//! Why one scene could not be solved, or gives no answer to a question.

use crate::backend::BackendError;
use crate::model::{ParameterError, PlanError, Status, short_number};

/// Why a scene could not be solved, or why its solution does not answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// The target error is no number between 0 and 1.
    #[error("the tolerance is {tolerance}: give a number between 0 and 1, such as 1e-9")]
    Tolerance {
        /// What was asked for.
        tolerance: f64,
    },
    /// No parameter has the name of one to differentiate by.
    #[error("cannot differentiate: {0}")]
    Derivative(#[source] ParameterError),
    /// The scene makes no rod, or cannot be differentiated as asked.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The engine cannot be used.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// The rod has no equilibrium that could have a shape or neighbours.
    #[error("the rod has no known equilibrium at the full load ({}), so it has no shape", status.name())]
    NoEquilibrium {
        /// What became of the rod.
        status: Status,
    },
    /// A point beyond the ends of the rod.
    #[error("{} m is not on the rod, which is {} m long", short_number(*arc_length), short_number(*length))]
    OffTheRod {
        /// From the base (m)
        arc_length: f64,
        /// Of the rod (m)
        length: f64,
    },
    /// Points that do not reach from base to tip.
    #[error("{count} points do not reach from base to tip: give at least 2")]
    TooFewPoints {
        /// What was asked for.
        count: usize,
    },
    /// The reference cannot integrate the rod from the base moment that was found.
    #[error("the rod cannot be integrated")]
    NotIntegrable,
}

impl SolveError {
    /// Whether the question was wrong; else the machine could not answer it.
    pub fn is_usage(&self) -> bool {
        !matches!(self, SolveError::Backend(error) if error.is_of_device())
    }
}
