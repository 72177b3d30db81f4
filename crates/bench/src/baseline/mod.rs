//! Methods of the literature, for comparison: plain scalar f64, one rod at a time, apart from the engines.
//!
//! [`Paper`] is the analytic nine-number form of [H], [`Differences`] differences the same boundary value problem,
//! [`Adaptive`] leaves the integration, sensitivities included, to a crate with error control, [`Chain`] is a chain of
//! rigid links with elastic joints. All follow the loads from rest by [`from_rest`] and share
//! no arithmetic with the engines or the reference. Equations are those of `EQUATIONS.md`.
#![allow(non_snake_case)]

mod adaptive;
mod chain;
mod control;
mod differences;
mod method;
mod paper;
mod rod;

pub use adaptive::Adaptive;
pub use chain::Chain;
pub use control::{ControlStep, control_step, damped_least_squares};
pub use differences::{Differences, Scheme};
pub use method::{Column, Jacobian, Method, NewtonStep, Tip, from_rest, solve};
pub use paper::Paper;
pub use rod::{Input, Rod};

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
    Scene(#[from] rodsweep::model::SceneError),
    /// Newton's method does not get to the full load.
    #[error("Newton's method did not converge, at {:.1} % of the load: try more steps or less load", 100.0 * load)]
    NotConverged {
        /// Share of the load that it got to.
        load: f64,
    },
}
