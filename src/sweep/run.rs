//! Runs a sweep: chunk after chunk through a backend into part files, resumable, in bounded memory.
//!
//! Four stages overlap: build batches, solve, finish rows, write. Each queue holds one item, so at most five batches
//! (three of them with solutions) and four chunks of rows are in memory, whatever the number of samples.

use super::branches::{BranchSearch, BranchTools};
use super::check::{Kept, SpotCheck, SpotCheckOptions};
use super::directory::{self, RunRecord};
use super::error::SweepError;
use super::layout::Layout;
use super::manifest;
use super::pilot::PilotChoice;
use super::pipeline::{Finisher, pieces, pipeline};
use super::reduce::Reduction;
use super::reduced::{self, SampleOrigin};
use super::refine::Refiners;
use super::sink;
use super::spec::{BranchChoice, Format, SweepSpec};
use crate::backend::{Backend, BackendError, BackendInfo, BackendKind};
use crate::model::{BLOCK, Plan, Status};
use crate::table::Table;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Makes a backend for a plan.
pub type BackendFactory<'a> = &'a (dyn Fn(&Plan) -> Result<Box<dyn Backend>, BackendError> + Sync);

/// Samples in a part file.
pub const CHUNK: u64 = 65_536;
/// The same where every equilibrium is looked for.
pub const BRANCH_CHUNK: u64 = 2048;
/// Samples of a batch there: enough to keep an engine busy, few enough to be heard of.
const BRANCH_BATCH: usize = 512;
/// The same on a CPU, for each of its threads: fewer stages stand still at either end of a run, and what one stage has
/// written the next one reads before it leaves the cache.
const THREAD_BATCH: usize = 16 * BLOCK;
/// Bytes that the inputs and solutions of one batch may take, whatever the backend asks for; five are alive at once.
const BATCH_BYTES: usize = 96 << 20;

/// Part `index` (from 1) of `count`: every count-th chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Shard {
    pub index: u64,
    pub count: u64,
}

/// How to run a sweep.
#[derive(Clone)]
pub struct RunOptions<'a> {
    pub out: PathBuf,
    /// Go on with what `out` holds.
    pub resume: bool,
    pub shard: Shard,
    /// Only the first samples.
    pub limit: Option<u64>,
    /// Samples in a part.
    pub chunk: u64,
    /// Checked between batches; finished parts are kept.
    pub interrupt: Option<&'a AtomicBool>,
    pub progress: Option<&'a (dyn Fn(&Progress) + Sync)>,
    /// Second attempts for samples that failed or are doubtful, in order.
    pub refiners: Vec<BackendFactory<'a>>,
    /// Looks for the equilibria beside the one from rest, where the sweep asks for them.
    pub search: Option<BranchTools<'a>>,
    /// What the spot check believes.
    pub trusted: Option<BackendFactory<'a>>,
    pub spot_check: SpotCheckOptions,
    /// How the number of steps was chosen, for the manifest.
    pub pilot: Option<PilotChoice>,
    /// What happened before, for the manifest.
    pub notes: Vec<String>,
}

/// State of a run, reported after every batch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    pub done: u64,
    pub total: u64,
    /// As [`Summary::failed`], so far.
    pub failed: u64,
    /// Samples a second.
    pub rate: f64,
    pub left: Option<Duration>,
    /// Solving is over; samples are being solved again for the spot check.
    pub checking: bool,
}

/// Busy time of each stage [s]; stages overlap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Timings {
    pub build: f64,
    pub solve: f64,
    pub refine: f64,
    /// For equilibria beside those from rest.
    pub search: f64,
    pub rows: f64,
    pub write: f64,
    pub check: f64,
    /// From start to end.
    pub total: f64,
}

/// What came of a run.
#[derive(Clone, Debug)]
pub struct Summary {
    pub out: PathBuf,
    pub backend: BackendInfo,
    /// Samples of this shard.
    pub total: u64,
    /// Solved by this call.
    pub solved: u64,
    /// Found in parts that were already there.
    pub resumed: u64,
    /// Samples a second of this call, second attempts and files included, spot check excluded.
    pub rate: f64,
    pub interrupted: bool,
    /// Second attempts made and won.
    pub attempts: u64,
    pub refined: u64,
    /// Success rows of this call (converged ones, where every equilibrium was asked for) whose error estimate stays
    /// above the tolerance.
    pub above_tolerance: u64,
    /// Of the converged rows of this call, in units of the plan's moment.
    pub worst_residual: f64,
    /// Of the same rows.
    pub worst_error_estimate: f64,
    pub spot_check: Option<SpotCheck>,
    pub timings: Timings,
    /// The engine's own account of its time, by name [s]; stages overlap.
    pub engine_timings: Vec<(&'static str, f64)>,
    /// What happened to the engine on the way, such as a device that was lost and opened again.
    pub notes: Vec<String>,
    pub origin: SampleOrigin,
    /// Damaged parts that were moved away and solved again.
    pub quarantined: Vec<PathBuf>,
    /// Counts by status, extents, tips; parts that were already there included.
    pub reduction: Reduction,
}

impl Shard {
    pub const WHOLE: Shard = Shard { index: 1, count: 1 };

    /// Parses `K/N`, K from 1 to N.
    pub fn parse(text: &str) -> Result<Shard, SweepError> {
        let refused = |reason| SweepError::Shard { text: text.into(), reason };
        let (index, count) = text.split_once('/').ok_or_else(|| refused("it has no slash"))?;
        let number = |text: &str| text.trim().parse::<u64>().map_err(|_| refused("K and N are whole numbers"));
        let shard = Shard { index: number(index)?, count: number(count)? };
        if shard.index >= 1 && shard.index <= shard.count {
            Ok(shard)
        } else {
            Err(refused("K is not between 1 and N"))
        }
    }

    pub fn owns(&self, chunk: u64) -> bool {
        chunk % self.count == self.index - 1
    }
}

impl<'a> RunOptions<'a> {
    /// A whole run into a new directory, without second attempts and spot check.
    pub fn new(out: impl Into<PathBuf>) -> RunOptions<'a> {
        RunOptions {
            out: out.into(),
            resume: false,
            shard: Shard::WHOLE,
            limit: None,
            chunk: CHUNK,
            interrupt: None,
            progress: None,
            refiners: Vec::new(),
            search: None,
            trusted: None,
            spot_check: SpotCheckOptions::default(),
            pilot: None,
            notes: Vec::new(),
        }
    }

    pub(super) fn is_interrupted(&self) -> bool {
        self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

impl Summary {
    pub fn count(&self, status: Status) -> u64 {
        self.reduction.counts[status.code() as usize]
    }

    /// Rows whose status is no success; where every equilibrium was asked for, samples without any.
    pub fn failed(&self) -> u64 {
        self.reduction.failed()
    }
}

/// Runs a sweep on a backend that was made for its plan.
pub fn run(spec: &SweepSpec, backend: &mut dyn Backend, options: &RunOptions) -> Result<Summary, SweepError> {
    let start = Instant::now();
    let plan = backend.plan().clone();
    check_plan(spec, &plan)?;
    let info = backend.info();
    let layout = Layout::new(spec, info.precision);
    let search = match (spec.branch, options.search) {
        (BranchChoice::FromRest, _) => None,
        (BranchChoice::All, None) => return Err(SweepError::NoSearch),
        (BranchChoice::All, Some(tools)) => Some(BranchSearch::new(&plan, tools)?),
    };
    let sample_count = options.limit.unwrap_or(u64::MAX).min(spec.sample_count);
    let record = RunRecord::new(spec, &layout.schema(), sample_count, options.chunk.max(1), info.precision);
    directory::open(&options.out, &record, spec, options.resume)?;
    let metadata = directory::metadata(spec, &record);
    let sampler = spec.sampler();
    let mut reduction = Reduction::new(sample_count, spec.voxel, spec.format == Format::None);
    let mut quarantined = Vec::new();
    let mut missing: Vec<u64> = (0..record.chunk_count()).filter(|chunk| options.shard.owns(*chunk)).collect();
    let size = |chunks: &[u64]| chunks.iter().map(|chunk| record.chunk_range(*chunk).1).sum::<u64>();
    let total = size(&missing);
    if spec.format != Format::None {
        let parts = directory::parts(&options.out, &record)?;
        for (path, _) in parts.damaged {
            quarantined.push(sink::quarantine(&path)?);
        }
        let names = directory::plain_columns(layout.empty());
        for chunk in parts.sound.keys().filter(|chunk| options.shard.owns(**chunk)) {
            let path = directory::part_path(&options.out, *chunk, spec.format);
            reduction.add(&sink::read_part(&path, spec.format, &names, layout.empty())?);
        }
        missing.retain(|chunk| !parts.sound.contains_key(chunk));
    }
    let resumed = total - size(&missing);
    let mut finisher = Finisher {
        spec,
        plan: &plan,
        layout: &layout,
        sampler: &sampler,
        options,
        refiners: Refiners::new(&options.refiners),
        search,
        kept: options.trusted.map(|_| Kept::new(sample_count, options.spot_check)),
        reduction,
        table: layout.empty().clone(),
        in_table: 0,
        total,
        resumed,
        start: Instant::now(),
        solved: 0,
        failed: 0,
        above_tolerance: 0,
        worst_residual: 0.0,
        worst_error_estimate: 0.0,
        timings: Timings::default(),
    };
    let row_bytes = 8 * (plan.input_count + plan.output_count());
    let most = if spec.branch == BranchChoice::All { BRANCH_BATCH } else { BATCH_BYTES / row_bytes };
    let most = if info.kind == BackendKind::Cpu { most.min(rayon::current_num_threads() * THREAD_BATCH) } else { most };
    let batch_size = backend.batch_size().min(most).max(BLOCK);
    let has_rows = spec.format != Format::None || spec.branch == BranchChoice::All;
    let (origin, solve) = match has_rows {
        true => (SampleOrigin::Host, 0.0),
        false => reduced::reduce(backend, &mut finisher, &record, &missing)?,
    };
    let (build, solve, write) = match origin {
        SampleOrigin::Device => (0.0, solve, 0.0),
        _ => {
            let jobs = pieces(&record, &missing, batch_size as u64);
            let mut bytes = Vec::new();
            pipeline(jobs, backend, &mut finisher, |chunk, table: &Table| {
                let path = directory::part_path(&options.out, chunk, spec.format);
                sink::write_part(&path, table, spec.format, &metadata, &mut bytes).map(|_| ())
            })?
        }
    };
    let seconds = finisher.start.elapsed().as_secs_f64();
    let interrupted = finisher.solved < size(&missing);
    let mut timings = Timings { build, solve, write, ..finisher.timings };
    let mut spot_check = None;
    if let (Some(kept), Some(trusted), false) = (finisher.kept.take(), options.trusted, interrupted) {
        finisher.report(true);
        let begin = Instant::now();
        spot_check = Some(kept.compare(&plan, &sampler, trusted)?);
        timings.check = begin.elapsed().as_secs_f64();
    }
    timings.total = start.elapsed().as_secs_f64();
    let summary = Summary {
        out: options.out.clone(),
        backend: info,
        total,
        solved: finisher.solved,
        resumed,
        rate: finisher.solved as f64 / seconds.max(1e-9),
        interrupted,
        attempts: finisher.refiners.attempts,
        refined: finisher.refiners.refined,
        above_tolerance: finisher.above_tolerance,
        worst_residual: finisher.worst_residual,
        worst_error_estimate: finisher.worst_error_estimate,
        spot_check,
        timings,
        engine_timings: backend.timings(),
        notes: options.notes.iter().cloned().chain(backend.take_notes()).collect(),
        origin,
        quarantined,
        reduction: finisher.reduction,
    };
    manifest::write(spec, &plan, &record, options, &summary, &metadata)?;
    Ok(summary)
}

fn check_plan(spec: &SweepSpec, plan: &Plan) -> Result<(), SweepError> {
    let derivatives: Vec<_> = plan.derivatives.iter().map(|derivative| derivative.parameter).collect();
    let what = if plan.scene != spec.scene {
        "scenes"
    } else if plan.axes != spec.axis_parameters() {
        "axes"
    } else if spec.format != Format::None && derivatives != spec.wrt {
        "derivatives"
    } else {
        return Ok(());
    };
    Err(SweepError::WrongPlan { what })
}
