//! Running a sweep: the pilot that chooses steps, the pipeline, second attempts, searches for branches, the spot check.
//!
//! Knows engines by the [`Backend`](crate::backend::Backend) trait only.

mod branches;
mod check;
mod error;
mod fallback;
mod manifest;
mod pilot;
mod pipeline;
mod reduced;
mod refine;
mod run;

pub use branches::{Branch, BranchSearch, BranchTools, Branches, Energy, Equilibria};
pub use check::{ErrorDistribution, SpotCheck, SpotCheckOptions};
pub use error::SweepError;
pub use fallback::{Fallback, run_with_fallback};
pub use pilot::{PilotChoice, STEPS, choose_method, choose_steps};
pub use reduced::SampleOrigin;
pub use run::{Progress, RunOptions, Shard, Summary, Timings, run};
