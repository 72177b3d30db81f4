//! Which inputs bring the tip to where it should be: along a trajectory, or to many targets at once.
//!
//! [`ControlJob`] is one call for either: it chooses inputs, limits and engines, and gives a [`ControlRun`]. Below it
//! stands [`Controller`], which takes engines as they are given. Every equilibrium comes from an engine: from rest for
//! the first point, then continued from the last base moment. A step is taken only to a stable equilibrium close to the
//! one that the derivatives predict.

mod controller;
mod descent;
mod engines;
mod error;
mod inputs;
mod job;
mod least_squares;
mod options;
mod run;
mod run_table;
mod summary;
mod targets;
mod task;
mod text;
mod trajectory;
mod window;

pub use controller::Controller;
pub use error::ControlError;
pub use inputs::MOST_INPUTS;
pub use job::{CURRENT_LIMIT, ControlEvent, ControlJob};
pub use options::{ControlOptions, TargetOptions};
pub use run::{ControlRun, Outcome, TargetResult};
pub use summary::ControlSummary;
