//! Why a baseline has no answer.

use rodsweep::model::SceneError;

/// Why a baseline has no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BaselineError {
    /// Something that these methods do not model.
    #[error("the baselines do not model `{key}`: {remedy}")]
    Unsupported {
        /// What it is, as scene files have it.
        key: String,
        /// What to do about it.
        remedy: &'static str,
    },
    /// A scene that is no rod.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Newton's method does not get to the full load.
    #[error("Newton's method did not converge, at {:.1} % of the load: try more steps or less load", 100.0 * load)]
    NotConverged {
        /// Share of the load that it got to.
        load: f64,
    },
}
