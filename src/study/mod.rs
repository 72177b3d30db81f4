//! Questions that take more than one solution a sample: plain data in, plain data out, engines through the trait.

mod branches;
mod control;
mod fit;
mod simulate;

pub use branches::{Branches, MakeEngine, find_branches};
pub use control::{
    Control, ControlError, ControlInput, ControlOptions, Controlled, MOST_INPUTS, Outcome, Redundancy, Target,
    TargetOptions,
};
pub use fit::{Direction, Fit, FitError, FitProblem, Fitted, ObservedPoint, ObservedShape, Strength, fit};
pub use simulate::{Imperfection, Played, Simulation, simulate};
