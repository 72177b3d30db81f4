//! What came of a run.

use crate::backend::{BackendInfo, RungCount};
use crate::model::Status;
use crate::results::{PathCheck, Reduction, SampleOrigin, SpotCheck, Timings, Verdict};
use std::path::PathBuf;

/// What came of a run.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Summary {
    /// What solved it.
    pub backend: BackendInfo,
    /// Samples of this shard.
    pub total: u64,
    /// Solved by this call.
    pub solved: u64,
    /// Found in parts that were already there.
    pub resumed: u64,
    /// Samples a second of this call, second attempts and files included, spot check excluded.
    pub rate: f64,
    /// Whether it was stopped before its end.
    pub interrupted: bool,
    /// Whether it was asked to finish what it had begun and then to stop, and did so.
    pub drained: bool,
    /// Whether every part of this shard is there, and this call, if workers share the run, wrote the manifest of all.
    pub finished_run: bool,
    /// Second attempts that were made.
    pub attempts: u64,
    /// Second attempts whose rows were taken.
    pub refined: u64,
    /// Success rows of this call (converged ones, where every equilibrium was asked for) whose error estimate stays
    /// above the tolerance.
    pub above_tolerance: u64,
    /// Largest residual of the converged rows of this call, in units of the plan's moment.
    pub worst_residual: f64,
    /// Largest error estimate of the same rows.
    pub worst_error_estimate: f64,
    /// What the spot check found; `None` where there was none.
    pub spot_check: Option<SpotCheck>,
    /// Rows whose path from rest was followed a second time; `None` where none was.
    pub path_check: Option<PathCheck>,
    /// Whether the rows can be trusted, those of earlier calls included; of a run that was interrupted, so far.
    pub verdict: Verdict,
    /// Where the time of the run went.
    pub timings: Timings,
    /// Processor seconds of the stages; the total is that of the whole process. `None`: the system does not tell.
    pub processor: Option<Timings>,
    /// The engine's own account of its time, by name (s); stages overlap.
    pub engine_timings: Vec<(&'static str, f64)>,
    /// Which methods took how many of the samples of this call, in their order: those of the engine, then attempts after it.
    pub rungs: Vec<RungCount>,
    /// What happened to the engine on the way, such as a device that was lost and opened again.
    pub notes: Vec<String>,
    /// Whether the host or the device made the samples.
    pub origin: SampleOrigin,
    /// Damaged parts that were moved away and solved again.
    pub quarantined: Vec<PathBuf>,
    /// Counts by status, extents, tips; parts that were already there included.
    pub reduction: Reduction,
}

impl Summary {
    /// Rows of a status.
    pub fn count(&self, status: Status) -> u64 {
        self.reduction.counts[status.code() as usize]
    }

    /// Whether the path of every row was followed twice.
    pub fn is_certain(&self) -> bool {
        self.path_check.as_ref().is_some_and(|check| check.all)
    }

    /// Rows whose status is no success; where every equilibrium was asked for, samples without any.
    pub fn failed(&self) -> u64 {
        self.reduction.failed()
    }
}
