//! What can stop a run.

use crate::backend::BackendError;
use crate::input::InputError;
use crate::model::PlanError;
use crate::results::ResultsError;

/// Why a run could not start or go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// The sweep file, or what it refers to.
    #[error(transparent)]
    Input(#[from] InputError),
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error(transparent)]
    Backend(#[from] BackendError),
    #[error(transparent)]
    Results(#[from] ResultsError),
    #[error("shard `{text}`: {reason}; write K/N with K from 1 to N, such as 2/8")]
    Shard { text: String, reason: &'static str },
    #[error("the backend was prepared for another plan: {what} differ")]
    WrongPlan { what: &'static str },
    #[error("the sweep asks for every equilibrium, and the run was given nothing to search with")]
    NoSearch,
}

impl SweepError {
    /// Whether the user's input or command is at fault (exit code 2) rather than the run (exit code 1).
    pub fn is_usage(&self) -> bool {
        match self {
            SweepError::Input(_) | SweepError::Plan(_) | SweepError::Shard { .. } => true,
            SweepError::Backend(BackendError::Unsupported { .. }) => true,
            SweepError::Results(error) => error.is_usage(),
            _ => false,
        }
    }
}
