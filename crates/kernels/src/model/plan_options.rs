//! What a plan is told beside the scene.

use super::Stepper;
use super::path::ERROR_SHARE;

/// Choices that the scene does not make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanOptions {
    /// Target error of tip position over rod length and of tip rotation (rad).
    pub tolerance: f64,
    /// Target error of derivatives: of the worst column of a sample, over its norm.
    pub derivative_tolerance: f64,
    /// Integration method of the answer.
    pub stepper: Stepper,
    /// Steps over the whole rod, shared out by length.
    pub steps: usize,
    /// Error of an answer, which comes from twice the steps, over its difference to one on the steps: at most so much.
    pub error_share: f64,
    /// How derivatives are computed.
    pub sensitivity: Sensitivity,
    /// Whether derivatives include those of the base moment, which take three columns more.
    pub base_moment_rows: bool,
}

/// How derivatives are computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sensitivity {
    /// The cheaper of those that hold.
    #[default]
    Auto,
    /// A column for each parameter.
    Forward,
    /// Six columns for all parameters, and integrals along the rod; only where the tangent problem is self-adjoint.
    Reciprocity,
}

impl Default for PlanOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            derivative_tolerance: 1e-3,
            stepper: Stepper::Dop853,
            steps: 6,
            error_share: ERROR_SHARE,
            sensitivity: Sensitivity::Auto,
            base_moment_rows: true,
        }
    }
}
