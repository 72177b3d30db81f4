//! How to run a sweep, and how far it is.

use super::branches::BranchTools;
use super::check::SpotCheckOptions;
use super::second_path::PathCheckOptions;
use crate::backend::BackendFactory;
use crate::results::{PilotChoice, Reduction};
use crate::spec::{CHUNK, Shard, SolutionMethod, SweepSpec};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Takes a sweep and what its run has kept of the rows.
pub type RowsWritten<'a> = &'a (dyn Fn(&SweepSpec, &Reduction) + Sync);

/// How to run a sweep.
#[derive(Clone)]
pub struct RunOptions<'a> {
    /// Which part of the sweep.
    pub shard: Shard,
    /// By what the run is solved, where that was settled before; it is then solved by nothing else. Else what the
    /// backend does.
    pub method: Option<SolutionMethod>,
    /// Only the first samples.
    pub limit: Option<u64>,
    /// Samples in a part.
    pub chunk: u64,
    /// Checked between batches; finished parts are kept.
    pub interrupt: Option<&'a AtomicBool>,
    /// Checked between chunks: what has been begun is finished and kept, nothing else is begun.
    pub drain: Option<&'a AtomicBool>,
    /// Whether workers may solve the run by different methods, and then the tolerance that its sweep asks for.
    pub mixed: Option<f64>,
    /// Told after every batch.
    pub progress: Option<&'a (dyn Fn(&Progress) + Sync)>,
    /// Told once, beside the spot check, when every row is written: what the run has kept of them. Not told by a run that
    /// is interrupted.
    pub rows_written: Option<RowsWritten<'a>>,
    /// Tried before second attempts, on samples whose only doubt is their error estimate. A row of it counts where its
    /// own estimate keeps the tolerance.
    pub settle: Option<BackendFactory<'a>>,
    /// Solves doubtful samples on finer steps, each from the load at its own base; its plan is of searches.
    pub answer: Option<BackendFactory<'a>>,
    /// Solves samples that `answer` leaves above the tolerance, and rows of second attempts, from the load at their own base on the finest steps.
    pub finest_answer: Option<BackendFactory<'a>>,
    /// Second attempts for samples that failed or are doubtful, in order.
    pub refiners: Vec<BackendFactory<'a>>,
    /// Tried on samples whose error estimate misses the tolerance after the first of these.
    pub finer: Option<BackendFactory<'a>>,
    /// Looks for the equilibria beside the one from rest, where the sweep asks for them.
    pub search: Option<BranchTools<'a>>,
    /// What the spot check believes.
    pub trusted: Option<BackendFactory<'a>>,
    /// How many samples the spot check takes.
    pub spot_check: SpotCheckOptions,
    /// Follows paths from rest by other steps than the run, and which rows' paths; the spot check's backend decides where their ends
    /// differ.
    pub second_path: Option<(BackendFactory<'a>, PathCheckOptions)>,
    /// Samples that may fail; `None`: as the sweep says.
    pub max_failures: Option<u64>,
    /// How the number of steps was chosen, for the manifest.
    pub pilot: Option<PilotChoice>,
    /// What happened before, for the manifest.
    pub notes: Vec<String>,
}

/// State of a run, reported after every batch.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Progress {
    /// Samples that are solved, those of parts that were already there included.
    pub done: u64,
    /// Samples of this shard.
    pub total: u64,
    /// As [`Summary::failed`](super::Summary::failed), so far.
    pub failed: u64,
    /// Samples a second.
    pub rate: f64,
    /// Time that is left at this rate; `None` where it is not known.
    pub left: Option<Duration>,
    /// Solving is over; samples are being solved again for the spot check.
    pub checking: bool,
}

impl Default for RunOptions<'_> {
    fn default() -> Self {
        RunOptions::new()
    }
}

impl<'a> RunOptions<'a> {
    /// A whole run without second attempts and spot check.
    pub fn new() -> RunOptions<'a> {
        RunOptions {
            shard: Shard::WHOLE,
            method: None,
            limit: None,
            chunk: CHUNK,
            interrupt: None,
            drain: None,
            mixed: None,
            progress: None,
            rows_written: None,
            settle: None,
            answer: None,
            finest_answer: None,
            refiners: Vec::new(),
            finer: None,
            search: None,
            trusted: None,
            spot_check: SpotCheckOptions::default(),
            second_path: None,
            max_failures: None,
            pilot: None,
            notes: Vec::new(),
        }
    }

    pub(crate) fn is_draining(&self) -> bool {
        self.drain.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    pub(crate) fn is_interrupted(&self) -> bool {
        self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
