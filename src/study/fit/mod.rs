//! Numbers of a rod from observed shapes: Levenberg and Marquardt's method on analytic derivatives, the covariance of
//! the answer, and what the observations cannot tell apart.
//!
//! Numbers that must be positive are fitted by their logarithm, so that sensitivities are relative and a ridge such as
//! "stiffness and magnetic moment scale together" is a straight line. Strongly bent rods are begun from several starts.

mod analysis;
mod error;
mod job;
mod model;
mod noise;
mod result;
mod solve;
mod starts;
mod text;

pub(super) use analysis::{analyse, findings};
pub use error::FitError;
pub use job::FitJob;
pub(super) use model::is_scale;
pub use result::{Direction, Fit, FittedParameter, Strength};
