//! What a plan is told beside the scene.

use super::Stepper;
use super::tolerances::{ERROR_SHARE, NODE_FLOOR};

/// Choices that the scene does not make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanOptions {
    /// Target error of tip position over rod length and of tip rotation (rad).
    pub tolerance: f64,
    /// Target error of derivatives: of the worst column of a sample, over its norm.
    pub derivative_tolerance: f64,
    /// Integration method of the answer.
    pub stepper: Stepper,
    /// Steps over the whole rod, shared out by length, by rest curvature, and by how much stiffness changes.
    pub steps: usize,
    /// Each of these steps is cut into so many: grids of which one lies within the other.
    pub refinement: usize,
    /// Error of an answer, which comes from twice the steps, over its difference to one on the steps: at most so much.
    pub error_share: f64,
    /// Error estimates are at least this: along a sweep the difference between grids may pass through zero where the error does not.
    pub error_floor: f64,
    /// What error estimates of derivatives are made of.
    pub derivative_scale: DerivativeScale,
    /// How derivatives are computed.
    pub sensitivity: Sensitivity,
    /// Length of the first step of the path from rest, and of the corrections that it trusts, over the usual ones. A second path at
    /// another pace that ends elsewhere tells that one of them has left its branch.
    pub pace: f64,
    /// Whether derivatives include those of the base moment, which take three columns more.
    pub base_moment_rows: bool,
    /// Whether derivatives include those of the load of a fold.
    pub fold_rows: bool,
    /// Whether solutions hold the force at the base where the field varies, so that they can be started from again, and with
    /// `base_moment_rows` how it follows each parameter. The CPU engine alone tells it.
    pub base_force: bool,
    /// Whether paths without care are all, and trust narrow passes: for searches whose answers are solved again. What they do not lead
    /// to an equilibrium is pending. The CPU engine alone does so.
    pub bold: bool,
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
            refinement: 1,
            error_share: ERROR_SHARE,
            error_floor: 0.0,
            derivative_scale: DerivativeScale::default(),
            sensitivity: Sensitivity::Auto,
            pace: 1.0,
            base_moment_rows: true,
            fold_rows: false,
            base_force: false,
            bold: false,
        }
    }
}

/// Error estimate of derivatives: `floor`, or `share` times what tips on both grids and the step between their base moments
/// tell, whichever is more; and round-off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DerivativeScale {
    /// Over the difference between the grids.
    pub share: f64,
    /// At least that much: a straight rod's tip does not tell of its columns.
    pub floor: f64,
}

impl DerivativeScale {
    /// The difference itself.
    pub const BARE: DerivativeScale = DerivativeScale { share: 1.0, floor: 0.0 };

    /// The floor of methods that have an estimate of their own: none where nothing was measured, or nothing is known. Their rows have
    /// no share of a difference that would tell which of them are worse than most.
    pub fn known_floor(&self) -> f64 {
        if self.floor < 1.0 { NODE_FLOOR * self.floor } else { 0.0 }
    }
}

/// Nothing was measured, so nothing is said: 1.
impl Default for DerivativeScale {
    fn default() -> Self {
        DerivativeScale { share: 1.0, floor: 1.0 }
    }
}
