//! Methods of the literature, for comparison: plain scalar f64, one rod at a time, apart from the engines.
//!
//! [`Paper`] is the analytic nine-number form of Hao and others, [`Differences`] differences the same boundary value
//! problem, [`Adaptive`] leaves the integration, sensitivities included, to a crate with error control, [`Chain`] is a
//! chain of rigid links with elastic joints. All follow the loads from rest by [`from_rest`] and share no arithmetic with
//! the engines or the reference. Equations are those of `EQUATIONS.md`.
#![allow(non_snake_case)]

mod adaptive;
mod chain;
mod control;
mod differences;
mod error;
mod method;
mod paper;
mod rod;

pub use adaptive::Adaptive;
pub use chain::Chain;
pub use control::{ControlStep, control_step, damped_least_squares};
pub use differences::{Differences, Scheme};
pub use error::BaselineError;
pub use method::{Column, Jacobian, Method, NewtonStep, Tip, from_rest, solve};
pub use paper::Paper;
pub use rod::{Input, Rod};
