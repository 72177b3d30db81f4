//! Questions that users ask: one scene, control, fits, simulated experiments, replays.
//!
//! A job is built, run, and gives plain data: numbers, a table, JSON. [`figures`](crate::figures) draws it.

mod agreement;
mod columns;
pub mod contact;
mod control;
mod experiment;
mod experiment_text;
mod fit;
mod mesh;
mod pose_length;
mod replay;
mod rod_points;
pub mod sensitivity;
mod simulate;
mod solve;
mod witness;
pub mod workspace;

pub use agreement::{Agreement, agreement};
pub use control::{
    CURRENT_LIMIT, ControlError, ControlEvent, ControlJob, ControlOptions, ControlRun, ControlSummary, Controller,
    MOST_INPUTS, Outcome, TargetOptions, TargetResult,
};
pub use experiment::{Experiment, ExperimentRun, MEASURED, Measured, PlayedTrajectory};
pub use fit::{Direction, Fit, FitError, FitJob, FittedParameter, Strength};
pub use mesh::{Mesh, surface_nets};
pub use replay::{Replay, ReplayComparison};
pub use rod_points::RodPoints;
pub use simulate::{CommandedPath, Imperfection, Simulation, TRIALS, play, simulate};
pub use solve::{
    AllBranches, Explanation, FoldLoad, FoundBranch, Jacobian, PlannedPass, PlannedPiece, Rows, Shape, Solve,
    SolveError, Solved, along_segments, check_tolerance, evenly_spaced, smooth_count,
};

pub use witness::WitnessCheck;

use crate::backend::{Backend, BackendError};
use crate::model::Plan;

/// Prepares an engine for a plan.
pub type MakeEngine<'a> = dyn FnMut(&Plan) -> Result<Box<dyn Backend>, BackendError> + 'a;
