//! Runs a sweep: chunk after chunk through a backend into part files, resumable, in bounded memory.
//!
//! Four stages overlap: build batches, solve, finish rows, write. Each queue holds one item, so at most five batches
//! (three of them with solutions) and four chunks of rows are in memory, whatever the number of samples. The spot check
//! goes on beside them.

use super::branches::BranchSearch;
use super::check::spot_check;
use super::chunks::{Chunks, Jobs};
use super::error::SweepError;
use super::manifest::manifest;
use super::missing::Missing;
use super::on_device;
use super::options::RunOptions;
use super::pipeline::{Finisher, join, pipeline, spawn};
use super::refine::Refiners;
use super::second_path::{PathCheckOptions, SecondPaths};
use super::sink::{RowSink, RunEnd, RunHeader};
use super::stages::StageTimes;
use super::summary::Summary;
use super::tally::Tally;
use crate::backend::{Backend, BackendKind, Precision};
use crate::model::{BLOCK, Plan};
use crate::results::claims::Claims;
use crate::results::{Doubt, Layout, Reduction, RunRecord, SampleOrigin, SpotCheck, Verdict};
use crate::spec::{BranchChoice, Format, SolutionMethod, SweepSpec};
use crate::table::Table;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Samples of a batch there: enough to keep an engine busy, few enough to be heard of.
const BRANCH_BATCH: usize = 512;
/// The same on a CPU, for each of its threads: fewer stages stand still at either end of a run, and what one stage has
/// written the next one reads before it leaves the cache.
const THREAD_BATCH: usize = 16 * BLOCK;
/// Bytes that the inputs and solutions of one batch may take, whatever the backend asks for; five are alive at once.
const BATCH_BYTES: usize = 96 << 20;

/// Runs a sweep on a backend that was made for its plan, and hands its rows to a sink.
///
/// # Errors
///
/// A sink that cannot be written, or a backend that fails as a whole; a sample that fails is a status.
pub fn run(
    spec: &SweepSpec,
    backend: &mut dyn Backend,
    options: &RunOptions,
    sink: &mut dyn RowSink,
) -> Result<Summary, SweepError> {
    let times = StageTimes::start();
    let plan = backend.plan().clone();
    check_plan(spec, &plan)?;
    let info = backend.info();
    // Where methods may differ, so may precisions, and columns hold what the finest of them gives.
    let precision = if options.mixed.is_some() { Precision::F64 } else { info.precision };
    let layout = Layout::new(spec, precision);
    let search = match (spec.branch, options.search) {
        (BranchChoice::FromRest, _) => None,
        (BranchChoice::All, None) => return Err(SweepError::NoSearch),
        (BranchChoice::All, Some(tools)) => Some(BranchSearch::new(&plan, tools)?),
    };
    let sample_count = options.limit.unwrap_or(u64::MAX).min(spec.sample_count);
    let method = options.method.unwrap_or_else(|| SolutionMethod::of(&info, &plan));
    let asked = SweepSpec { tolerance: options.mixed.unwrap_or(spec.tolerance), ..spec.clone() };
    let settled = if options.mixed.is_some() { None } else { Some(method) };
    let record = RunRecord::new(&asked, &layout.schema(), sample_count, options.chunk.max(1), settled);
    let mut reduction = Reduction::new(sample_count, spec.workspace.voxel, spec.format == Format::None);
    let header = RunHeader {
        spec: &asked,
        record: &record,
        columns: layout.empty(),
        engine: &info,
        method,
        shard: options.shard,
    };
    let sampler = spec.sampler();
    let check = |trusted| spot_check(sample_count, options.spot_check, layout.single_columns(), trusted, &times.check);
    let (mut spot_samples, checker) = options.trusted.map(check).unzip();
    let mut tally = Tally::new(&sampler, spec.tolerance, spec.branch == BranchChoice::All);
    let found = sink.open(&header, &mut |rows| {
        reduction.add(rows);
        tally.add_table(rows);
        spot_samples.iter_mut().for_each(|chosen| chosen.offer_table(rows, plan.output_count()));
    })?;
    let others = found.claims.as_ref().map(Claims::state);
    // What an earlier call has finished is checked.
    let finished = found.finished.filter(|_| found.quarantined.is_empty());
    let checker = checker.filter(|_| finished.is_none());
    let missing = Missing::new(&record, options.shard, &found.done);
    let (total, resumed) = (missing.samples_of_shard(), missing.samples_done());
    let second_paths = options
        .trusted
        .zip(options.second_path)
        .map(|(trusted, (factory, rows))| SecondPaths::new(sample_count, rows, factory, trusted));
    let finisher = Finisher {
        spec,
        plan: &plan,
        layout: &layout,
        sampler: &sampler,
        options,
        refiners: Refiners::new(options),
        second_paths,
        search,
        spot_samples,
        reduction,
        table: layout.empty().clone(),
        in_table: 0,
        total,
        resumed,
        others: others.clone(),
        start: Instant::now(),
        solved: 0,
        failed: 0,
        above_tolerance: 0,
        worst_residual: 0.0,
        worst_error_estimate: 0.0,
        tally,
        times: &times,
    };
    let is_given_up = AtomicBool::new(false);
    let ran = std::thread::scope(|scope| {
        // Owned here, so that what ends the run ends the queue of the check.
        let mut finisher = finisher;
        let (plan, sampler, is_given_up) = (&plan, &sampler, &is_given_up);
        let checker = checker.map(|checker| spawn(scope, move || checker.solve(plan, sampler, is_given_up)));
        let checker = checker.transpose()?;
        let stages = solve_parts(backend, &mut finisher, &record, missing, found.claims, sink);
        let seconds = finisher.start.elapsed().as_secs_f64();
        let interrupted = match &others {
            Some(others) => !others.complete.load(Ordering::Relaxed),
            None => finisher.solved < total - resumed,
        };
        is_given_up.store(interrupted || stages.is_err(), Ordering::Relaxed);
        if let Some(spot_samples) = finisher.spot_samples.take() {
            spot_samples.finish();
        }
        let origin = stages?;
        if resumed > 0 {
            finisher.reduction.sort_tips();
        }
        let checked = std::thread::scope(|scope| {
            let reduction = &finisher.reduction;
            if let (Some(rows_written), false) = (options.rows_written, interrupted) {
                spawn(scope, move || rows_written(spec, reduction))?;
            }
            let Some(checker) = checker.filter(|_| !interrupted) else { return Ok((None, Vec::new())) };
            finisher.report(true);
            let (check, doubts) = join(checker.join())?.compare(plan, sampler);
            Ok::<_, SweepError>((Some(check), doubts))
        })?;
        Ok::<_, SweepError>(Ran { finisher, origin, seconds, interrupted, checked })
    })?;
    let (timings, processor) = (times.wall(), times.processor());
    let Ran { finisher, origin, seconds, interrupted, checked } = ran;
    let (spot_check, doubts) = checked;
    let earlier = found.verdict.unwrap_or_default();
    let verdict = if finished.is_some() {
        earlier
    } else {
        let is_there = |sample: u64| found.done.contains(&(sample / record.chunk));
        let of_paths = finisher.second_paths.iter().flat_map(|paths| paths.doubts(&plan, &sampler)).collect();
        let mut now = verdict(&finisher, options, (spot_check.as_ref(), doubts), of_paths);
        let before = Verdict { doubts: earlier.kept(&is_there), ..Verdict::default() };
        now = Verdict::sum([&now, &before]);
        now
    };
    let path_check = finisher.second_paths.map(|paths| paths.found);
    let (spot_check, path_check, above_tolerance, worst_residual, worst_error_estimate) =
        match finished.and_then(|manifest| manifest.run) {
            Some(run) => {
                (run.spot_check, run.path_check, run.above_tolerance, run.worst_residual, run.worst_error_estimate)
            }
            None => {
                let Finisher { above_tolerance, worst_residual, worst_error_estimate, .. } = finisher;
                (spot_check, path_check, above_tolerance, worst_residual, worst_error_estimate)
            }
        };
    let summary = Summary {
        backend: info,
        total,
        solved: finisher.solved,
        resumed,
        rate: finisher.solved as f64 / seconds.max(1e-9),
        interrupted,
        drained: interrupted && options.is_draining() && !options.is_interrupted(),
        finished_run: others.as_ref().map_or(!interrupted, |others| others.finishes.load(Ordering::Relaxed)),
        attempts: finisher.refiners.attempts,
        refined: finisher.refiners.refined,
        above_tolerance,
        worst_residual,
        worst_error_estimate,
        spot_check,
        path_check,
        verdict,
        timings,
        processor,
        engine_timings: backend.timings(),
        rungs: backend.rungs().into_iter().chain(finisher.refiners.rungs()).collect(),
        notes: options.notes.iter().cloned().chain(backend.take_notes()).collect(),
        origin,
        quarantined: found.quarantined,
        reduction: finisher.reduction,
    };
    let manifest = manifest(spec, &plan, &record, options, &summary);
    sink.close(&RunEnd { spec: &asked, manifest: &manifest, reduction: &summary.reduction })?;
    Ok(summary)
}

/// What came of the stages and of the check.
struct Ran<'a> {
    finisher: Finisher<'a>,
    origin: SampleOrigin,
    seconds: f64,
    interrupted: bool,
    checked: (Option<SpotCheck>, Vec<Doubt>),
}

/// What is to be thought of the rows of this call and of the parts that it found.
fn verdict(
    finisher: &Finisher,
    options: &RunOptions,
    (check, doubts): (Option<&SpotCheck>, Vec<Doubt>),
    of_paths: Vec<Doubt>,
) -> Verdict {
    let Finisher { spec, plan, reduction, tally, .. } = finisher;
    let samples = reduction.sample_count;
    let [missed, failures] = tally.doubts(plan, samples);
    let asked = options.max_failures.map(|most| (most as f64 / samples.max(1) as f64).min(1.0));
    let verdict = Verdict {
        checked: check.map_or(0, |check| check.checked),
        samples,
        usable: samples.saturating_sub(reduction.failed()),
        allow_failures: asked.or(spec.allow_failures),
        failures,
        doubts: doubts.into_iter().chain(missed).collect(),
        ..Verdict::default()
    };
    let paths = Verdict { doubts: of_paths, ..Verdict::default() };
    Verdict::sum([&verdict.settled(), &paths])
}

/// Solves what is missing; says where samples were made.
fn solve_parts(
    backend: &mut dyn Backend,
    finisher: &mut Finisher,
    record: &RunRecord,
    missing: Missing<'_>,
    claims: Option<Claims>,
    sink: &mut dyn RowSink,
) -> Result<SampleOrigin, SweepError> {
    let (spec, options) = (finisher.spec, finisher.options);
    let batch_size = batch_size(spec, backend);
    // Samples that a device counts itself return no rows whose paths could be followed again.
    let is_certain = options.second_path.is_some_and(|(_, rows)| rows == PathCheckOptions::All);
    let has_rows = spec.format != Format::None || spec.branch == BranchChoice::All || is_certain;
    let origin = match has_rows {
        true => SampleOrigin::Host,
        false => on_device::run(backend, finisher, record, missing)?,
    };
    if origin == SampleOrigin::Device {
        return Ok(origin);
    }
    let is_over = AtomicBool::new(false);
    let chunks = match claims {
        Some(claims) => Chunks::Claimed(Box::new(claims)),
        None => Chunks::Listed(Box::new(missing.chunks())),
    };
    let jobs = Jobs::new(record, chunks, batch_size as u64, options, &is_over);
    let write = |chunk, table: &Table| sink.write(chunk, table);
    pipeline(jobs, &is_over, backend, finisher, write)?;
    Ok(origin)
}

/// Samples of a batch: what keeps the backend busy, in bounded memory.
fn batch_size(spec: &SweepSpec, backend: &dyn Backend) -> usize {
    let plan = backend.plan();
    let row_bytes = 8 * (plan.input_count + plan.output_count());
    let most = if spec.branch == BranchChoice::All { BRANCH_BATCH } else { BATCH_BYTES / row_bytes };
    let is_cpu = backend.info().kind == BackendKind::Cpu;
    let most = if is_cpu { most.min(rayon::current_num_threads() * THREAD_BATCH) } else { most };
    backend.batch_size().min(most).max(BLOCK)
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
