//! Running a sweep: the pilot that chooses steps, the pipeline, second attempts, searches for branches, the spot check.
//!
//! [`SweepJob`] puts all of it together. Only it knows the engines; all else knows the
//! [`Backend`](crate::backend::Backend) trait.

mod anchors;
mod branches;
mod check;
mod chunks;
mod columns;
mod cost;
mod error;
mod fallback;
mod job;
mod manifest;
mod missing;
mod on_device;
mod options;
mod pilot;
mod pipeline;
mod refine;
mod run;
mod samples;
mod second_path;
mod sink;
mod stages;
mod summary;
mod tally;

pub use anchors::with_anchors;
pub use branches::{Branch, BranchSearch, BranchTools, Branches, Energy, Equilibria};
pub use check::SpotCheckOptions;
pub use cost::Cost;
pub use error::SweepError;
pub use fallback::{Fallback, run_with_fallback};
pub use job::{PreparedSweep, SweepJob, branch_tools};
pub use options::{Progress, RowsWritten, RunOptions};
pub use pilot::{STEPS, choose_method, choose_steps, choose_steps_for, estimates_from};
pub use refine::ATTEMPTS;
pub use run::run;
pub use second_path::PathCheckOptions;
pub(crate) use second_path::{Decision, decide, is_same_end};
pub use sink::{Callback, Found, Memory, ResultDirectory, RowSink, RunEnd, RunHeader};
pub use summary::Summary;
