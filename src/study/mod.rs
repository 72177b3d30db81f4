//! What users ask: one scene with its shape and all its equilibria; control and its simulation; fits. Plain data out.

mod agreement;
mod control;
mod fit;
mod shape;
mod simulate;
mod solve;

pub use agreement::{Agreement, agreement};
pub use control::{
    Control, ControlError, ControlInput, ControlOptions, Controlled, MOST_INPUTS, Outcome, Redundancy, Target,
    TargetOptions,
};
pub use fit::{Direction, Fit, FitError, FitProblem, Fitted, ObservedPoint, ObservedShape, Strength, fit};
pub use shape::{Shape, evenly_spaced};
pub use simulate::{Imperfection, Played, Simulation, play, simulate};
pub use solve::{
    AllBranches, Explanation, FoundBranch, Jacobian, PlannedPass, PlannedPiece, Rows, Solve, SolveError, Solved,
    check_tolerance,
};

use crate::backend::{Backend, BackendError};
use crate::model::Plan;

/// Prepares an engine for a plan.
pub type MakeEngine<'a> = dyn FnMut(&Plan) -> Result<Box<dyn Backend>, BackendError> + 'a;
