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
    /// The sweep makes no plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The engine cannot be used, or failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// The rows cannot be written, or what is there not be resumed.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// The system gives no threads to run on.
    #[error("cannot start a thread: {reason}; raise the limit of processes, or run on fewer threads")]
    Threads {
        /// What the system says.
        reason: String,
    },
    /// The engine was prepared for another plan than the sweep's.
    #[error("the backend was prepared for another plan: {what} differ")]
    WrongPlan {
        /// What differs, in the plural.
        what: &'static str,
    },
    /// The run was begun by another method, or is to be as another run.
    #[error("the run is solved with {what} {settled}, asked for is {asked}; leave that out, or begin another run")]
    OtherMethod {
        /// What differs, such as `steps`.
        what: &'static str,
        /// As the run was begun.
        settled: String,
        /// As it was asked for.
        asked: String,
    },
    /// The sweep asks for every equilibrium, but [`RunOptions::search`](super::RunOptions::search) is empty.
    #[error("the sweep asks for every equilibrium, and the run was given nothing to search with")]
    NoSearch,
}

impl SweepError {
    /// Whether the user's input or command is at fault (exit code 2) rather than the run (exit code 1).
    pub fn is_usage(&self) -> bool {
        match self {
            SweepError::Input(_) | SweepError::Plan(_) => true,
            SweepError::Backend(BackendError::Unsupported { .. }) => true,
            SweepError::OtherMethod { .. } => true,
            SweepError::Results(error) => error.is_usage(),
            _ => false,
        }
    }
}
