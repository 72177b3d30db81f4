//! Questions that take more than one solution a sample: plain data in, plain data out, engines through the trait.

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
};

use crate::backend::{Backend, BackendError};
use crate::model::Plan;

/// Prepares an engine for a plan.
pub type MakeEngine<'a> = dyn FnMut(&Plan) -> Result<Box<dyn Backend>, BackendError> + 'a;
