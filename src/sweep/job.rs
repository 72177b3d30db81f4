//! A sweep from specification to rows: engine, method, second attempts, witness and searches put together.

use super::anchors::{suit, with_anchors};
use super::branches::BranchTools;
use super::check::SpotCheckOptions;
use super::error::SweepError;
use super::fallback::{Fallback, run_with_fallback};
use super::options::{Progress, RowsWritten, RunOptions};
use super::pilot::{choose_method, measure_errors};
use super::second_path::PathCheckOptions;
use super::sink::RowSink;
use super::summary::Summary;
use crate::backend::{Backend, BackendError, BackendFactory, BackendKind, Precision};
use crate::engines::{
    Engine, EngineRequest, answer_on_finer_steps, answer_on_finest_steps, can_answer_again, cpu_f64, finer_attempt,
    for_second_path, second_attempt, witness,
};
use crate::model::{Plan, PlanOptions};
use crate::reference::energy;
use crate::results::{PilotChoice, ResultsError};
use crate::spec::{BranchChoice, PrecisionChoice, Shard, SolutionMethod, SweepSpec};
use std::sync::atomic::AtomicBool;

/// A sweep to be run.
///
/// ```no_run
/// use rodsweep::spec::SweepSpec;
/// use rodsweep::sweep::{Memory, ResultDirectory, SweepJob};
///
/// let spec = SweepSpec::read("sweeps/workspace.toml".as_ref())?;
/// let summary = SweepJob::new(spec.clone()).run(&mut ResultDirectory::new("results/workspace"))?;
/// println!("{} samples, {} failed", summary.solved, summary.failed());
///
/// let mut rows = Memory::new();
/// SweepJob::new(spec).limit(Some(1000)).run(&mut rows)?;
/// println!("{} rows", rows.into_table().row_count());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct SweepJob<'a> {
    spec: SweepSpec,
    request: EngineRequest,
    method: Option<SolutionMethod>,
    shard: Shard,
    limit: Option<u64>,
    part_size: Option<u64>,
    interrupt: Option<&'a AtomicBool>,
    drain: Option<&'a AtomicBool>,
    mixed: bool,
    progress: Option<&'a (dyn Fn(&Progress) + Sync)>,
    rows_written: Option<RowsWritten<'a>>,
    warn: Option<&'a dyn Fn(&str)>,
    spot_check: Option<SpotCheckOptions>,
    path_check: Option<PathCheckOptions>,
    max_failures: Option<u64>,
}

impl<'a> SweepJob<'a> {
    /// A whole sweep by whatever engine suits it, with second attempts and a spot check.
    pub fn new(spec: SweepSpec) -> SweepJob<'a> {
        SweepJob {
            spot_check: Some(SpotCheckOptions::of(&spec.scene)),
            path_check: Some(PathCheckOptions::Share),
            spec,
            request: EngineRequest::any(),
            method: None,
            shard: Shard::WHOLE,
            limit: None,
            part_size: None,
            interrupt: None,
            drain: None,
            mixed: false,
            progress: None,
            rows_written: None,
            warn: None,
            max_failures: None,
        }
    }

    /// What is asked of the engine.
    pub fn engine(self, request: EngineRequest) -> Self {
        SweepJob { request, ..self }
    }

    /// Engine, precision, stepper, steps and tolerance in full, for example those of another shard. `None`: the engine
    /// follows from the request, the rest from a pilot.
    pub fn method(self, method: Option<SolutionMethod>) -> Self {
        SweepJob { method, ..self }
    }

    /// A part of the sweep only.
    pub fn shard(self, shard: Shard) -> Self {
        SweepJob { shard, ..self }
    }

    /// The first samples only.
    pub fn limit(self, limit: Option<u64>) -> Self {
        SweepJob { limit, ..self }
    }

    /// Samples in a part; `None`: as many as suit the sweep. It belongs to the identity of a run.
    pub fn part_size(self, samples: Option<u64>) -> Self {
        SweepJob { part_size: samples, ..self }
    }

    /// A flag that ends the run: it is looked at between batches, and finished parts are kept.
    pub fn interrupt(self, flag: &'a AtomicBool) -> Self {
        SweepJob { interrupt: Some(flag), ..self }
    }

    /// A flag that ends the run when the chunks that were begun are finished and kept.
    pub fn drain(self, flag: &'a AtomicBool) -> Self {
        SweepJob { drain: Some(flag), ..self }
    }

    /// Whether workers may solve the run by different methods: engines, precisions, steps. Each part says by which. It
    /// belongs to the identity of a run.
    pub fn mixed_methods(self, mixed: bool) -> Self {
        SweepJob { mixed, ..self }
    }

    /// Called after every batch.
    pub fn progress(self, progress: Option<&'a (dyn Fn(&Progress) + Sync)>) -> Self {
        SweepJob { progress, ..self }
    }

    /// Called when every row is written, beside the spot check, so that figures need not wait for it. The run ends when
    /// both have ended. A run that is interrupted does not call it.
    pub fn rows_written(self, call: Option<RowsWritten<'a>>) -> Self {
        SweepJob { rows_written: call, ..self }
    }

    /// Called with what the user should know on the way, such as a device that failed.
    pub fn warn(self, warn: &'a dyn Fn(&str)) -> Self {
        SweepJob { warn: Some(warn), ..self }
    }

    /// How many samples are solved again by the reference; `None`: none.
    pub fn spot_check(self, options: Option<SpotCheckOptions>) -> Self {
        SweepJob { spot_check: options, ..self }
    }

    /// Which rows' paths are followed a second time, by other steps; `None`: no row's. Without a spot check there is none.
    pub fn path_check(self, options: Option<PathCheckOptions>) -> Self {
        SweepJob { path_check: options, ..self }
    }

    /// Samples that may fail, whatever share the sweep file allows; `None`: as it says.
    pub fn max_failures(self, samples: Option<u64>) -> Self {
        SweepJob { max_failures: samples, ..self }
    }

    /// Settles by what the sweep will be solved: as a run that the sink already holds, as asked for, or by a choice of
    /// engine and a pilot.
    ///
    /// # Errors
    ///
    /// No engine that suits, a plan that cannot be made, or a request that contradicts the run that is there.
    pub fn prepare(self, sink: &dyn RowSink) -> Result<PreparedSweep<'a>, SweepError> {
        let asked_tolerance = self.spec.tolerance;
        match sink.method()?.or(self.method) {
            Some(method) => self.prepare_as(method, asked_tolerance),
            None => self.prepare_anew(asked_tolerance),
        }
    }

    /// Prepares and runs.
    ///
    /// # Errors
    ///
    /// As [`SweepJob::prepare`] and [`PreparedSweep::run`].
    pub fn run(self, sink: &mut dyn RowSink) -> Result<Summary, SweepError> {
        self.prepare(sink)?.run(sink)
    }

    fn prepare_as(mut self, method: SolutionMethod, asked_tolerance: f64) -> Result<PreparedSweep<'a>, SweepError> {
        let SolutionMethod { engine, precision, .. } = method;
        let other = |what, settled: String, asked: String| Err(SweepError::OtherMethod { what, settled, asked });
        if let Some(asked) = self.request.asked_backend().filter(|asked| *asked != engine) {
            return other("engine", engine.to_string(), asked.to_string());
        }
        if let Some(asked) = self.request.asked_precision().filter(|asked| *asked != precision) {
            return other("precision", precision.to_string(), asked.to_string());
        }
        if let Some(asked) = self.spec.steps.filter(|asked| *asked != method.steps) {
            return other("number of steps", method.steps.to_string(), asked.to_string());
        }
        let engine = Engine::new(engine, precision, "as the run was begun");
        self.spec.tolerance = method.tolerance;
        let options = method.apply(PlanOptions::default());
        let mut plan = self.spec.plan(options)?;
        if method.anchors {
            plan = with_anchors(&self.spec, plan)?;
        }
        let plan = ready_for_answers(plan, &engine);
        Ok(PreparedSweep { job: self, engine, plan, pilot: None, method, asked_tolerance, is_settled: true })
    }

    fn prepare_anew(mut self, asked_tolerance: f64) -> Result<PreparedSweep<'a>, SweepError> {
        self.request = with_precision(self.request, self.spec.precision);
        let engine = match self.spec.tells_fold_slopes() {
            true => {
                let engine = fold_engine(&self.request, self.spec.branch)?;
                if self.spec.scene.wall.is_some() {
                    self.request.choose_for(&self.spec.scene, asked_tolerance)?;
                }
                engine
            }
            false => self.request.choose_for(&self.spec.scene, asked_tolerance)?,
        };
        self.spec.tolerance = engine.tolerance(asked_tolerance);
        let steppers = engine.steppers();
        let plan = self.spec.plan(PlanOptions { stepper: steppers[0], ..PlanOptions::default() })?;
        let sampler = self.spec.sampler();
        // The file may fix the number of steps.
        let pilot = match self.spec.steps {
            Some(_) => None,
            None => Some(choose_method(&plan, &sampler, &steppers[1..], &cpu_f64)?),
        };
        let options = match &pilot {
            Some(pilot) => pilot.options(&plan),
            None => measure_errors(&plan, &sampler, &cpu_f64)?,
        };
        let plan = plan.with_options(options);
        let plan = if suit(&self.spec, engine.kind()) { with_anchors(&self.spec, plan)? } else { plan };
        let plan = ready_for_answers(plan, &engine);
        let method = SolutionMethod::by(engine.kind(), engine.precision(), &plan);
        Ok(PreparedSweep { job: self, engine, plan, pilot, method, asked_tolerance, is_settled: false })
    }
}

/// The plan whose rows hold what they can be solved again from, where that is worth it. A path in single precision that is in doubt is
/// followed again: it may have led elsewhere.
fn ready_for_answers(plan: Plan, engine: &Engine) -> Plan {
    let is_sharp = (engine.kind(), engine.precision()) == (BackendKind::Cpu, Precision::F64);
    let base_force = is_sharp && can_answer_again(&plan);
    plan.with_options(PlanOptions { base_force, ..plan.options })
}

/// A sweep of which everything is settled but its rows.
pub struct PreparedSweep<'a> {
    job: SweepJob<'a>,
    engine: Engine,
    plan: Plan,
    pilot: Option<PilotChoice>,
    method: SolutionMethod,
    asked_tolerance: f64,
    /// Whether the method was there before.
    is_settled: bool,
}

impl<'a> PreparedSweep<'a> {
    /// The sweep, its tolerance the one that the engine is held to.
    pub fn spec(&self) -> &SweepSpec {
        &self.job.spec
    }

    /// The engine and why it was taken.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// What all samples share.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// How stepper and steps were chosen; `None` where the sweep file or a run before fixed them.
    pub fn pilot(&self) -> Option<&PilotChoice> {
        self.pilot.as_ref()
    }

    /// By what the sweep will be solved.
    pub fn method(&self) -> SolutionMethod {
        self.method
    }

    /// Whether the method is that of a run before.
    pub fn is_settled(&self) -> bool {
        self.is_settled
    }

    /// The tolerance that the sweep file asks for; f32 may not reach it.
    pub fn asked_tolerance(&self) -> f64 {
        self.asked_tolerance
    }

    /// Shows progress from now on; `None`: no more.
    pub fn set_progress(&mut self, progress: Option<&'a (dyn Fn(&Progress) + Sync)>) {
        self.job.progress = progress;
    }

    /// Makes the engine. Where the choice was left to the program, a GPU that cannot be used gives way to the CPU.
    ///
    /// # Errors
    ///
    /// An engine that cannot be used, and no other may take its place.
    pub fn open(&mut self) -> Result<Box<dyn Backend>, BackendError> {
        match self.engine.make(&self.plan) {
            Err(error) if self.job.request.is_open() && !self.is_settled => {
                self.warn(&format!("{error}; taking the CPU"));
                self.engine = self.engine.on_the_cpu();
                self.method.engine = self.engine.kind();
                self.engine.make(&self.plan)
            }
            result => result,
        }
    }

    /// Runs the sweep; its rows go to the sink. It takes every thread of rayon's global pool. So call it from a thread outside that
    /// pool, not from a parallel iterator: threads of the pool that wait for sweeps cannot work on them.
    ///
    /// # Errors
    ///
    /// An engine that cannot be used, or a sink that cannot be written.
    pub fn run(mut self, sink: &mut dyn RowSink) -> Result<Summary, SweepError> {
        let mut backend = self.open()?;
        match self.run_on(backend.as_mut(), sink) {
            Err(error) => self.settled_meanwhile(error, sink)?.run(sink),
            summary => summary,
        }
    }

    /// The sweep by the method of another worker, where that worker has begun the run since this one was prepared.
    ///
    /// # Errors
    ///
    /// The error that ended the run, where that is not why; or as [`SweepJob::prepare`].
    pub fn settled_meanwhile(&self, error: SweepError, sink: &dyn RowSink) -> Result<PreparedSweep<'a>, SweepError> {
        let is_late = matches!(error, SweepError::Results(ResultsError::Mismatch { .. })) && !self.is_settled;
        match sink.method()? {
            Some(method) if is_late && method != self.method => {
                self.job.clone().prepare_as(method, self.asked_tolerance)
            }
            _ => Err(error),
        }
    }

    /// The same on the engine that [`PreparedSweep::open`] made.
    ///
    /// # Errors
    ///
    /// As [`PreparedSweep::run`].
    pub fn run_on(&self, backend: &mut dyn Backend, sink: &mut dyn RowSink) -> Result<Summary, SweepError> {
        let job = &self.job;
        let trusted = |plan: &Plan| Ok(witness(plan));
        let on_the_cpu = self.engine.on_the_cpu();
        let engine = &self.engine;
        let settle = |plan: &Plan| engine.settle(plan);
        let (search, search_on_the_cpu) = (|plan: &Plan| engine.make(plan), |plan: &Plan| on_the_cpu.make(plan));
        let mut options = RunOptions::new();
        options.shard = job.shard;
        options.method = Some(self.method);
        options.limit = job.limit;
        options.chunk = job.part_size.unwrap_or(job.spec.chunk());
        options.interrupt = job.interrupt;
        options.drain = job.drain;
        options.mixed = job.mixed.then_some(self.asked_tolerance);
        options.progress = job.progress;
        options.rows_written = job.rows_written;
        options.settle = engine.settles(job.spec.sample_count).then_some(&settle);
        // The reference has followed its paths twice: no other engine overrules it.
        let is_reference = engine.kind() == BackendKind::Reference;
        options.answer = self.plan.options.base_force.then_some(&answer_on_finer_steps);
        options.finest_answer = self.plan.options.base_force.then_some(&answer_on_finest_steps);
        options.refiners = if is_reference { Vec::new() } else { vec![&second_attempt, &trusted] };
        options.finer = (!is_reference).then_some(&finer_attempt);
        let all = job.path_check == Some(PathCheckOptions::All);
        let follower = if all { engine } else { &on_the_cpu };
        let second_path = |plan: &Plan| follower.make(&for_second_path(plan));
        options.second_path =
            job.path_check.filter(|_| !is_reference).map(|rows| (&second_path as BackendFactory, rows));
        options.search = Some(branch_tools(&search));
        options.trusted = job.spot_check.is_some().then_some(&trusted as BackendFactory);
        options.spot_check = job.spot_check.unwrap_or_default();
        options.max_failures = job.max_failures;
        options.pilot = self.pilot.clone();
        let fallback = Fallback {
            engine: &search_on_the_cpu,
            search: Some(branch_tools(&search_on_the_cpu)),
            tell: &|error| self.warn(&format!("{error}; going on with the CPU in the same precision")),
        };
        run_with_fallback(&job.spec, backend, &options, &fallback, sink)
    }

    fn warn(&self, text: &str) {
        if let Some(warn) = self.job.warn {
            warn(text);
        }
    }
}

/// A request with what the sweep file says, where the request says nothing.
fn with_precision(request: EngineRequest, choice: PrecisionChoice) -> EngineRequest {
    match choice {
        _ if request.asked_precision().is_some() => request,
        PrecisionChoice::Usual | PrecisionChoice::Auto => request,
        PrecisionChoice::Given(precision) => request.precision(Some(precision)),
    }
}

/// The engine of a sweep that tells how the load of a fold follows parameters: the CPU in f64 alone follows a rod through its fold
/// so exactly.
fn fold_engine(request: &EngineRequest, branch: BranchChoice) -> Result<Engine, BackendError> {
    let what = "derivatives of `fold.load`".to_owned();
    let refuse = |backend, remedy: &str| Err(BackendError::Unsupported { backend, what, remedy: remedy.into() });
    let leave_out = "; or leave out `fold.load` or the derivatives";
    match (request.asked_backend(), request.asked_precision()) {
        _ if branch == BranchChoice::All => {
            refuse(BackendKind::Cpu, &format!("of every equilibrium; take `branch = \"from_rest\"`{leave_out}"))
        }
        (Some(backend @ (BackendKind::Gpu | BackendKind::Reference)), _) => {
            refuse(backend, &format!("take `--backend cpu`{leave_out}"))
        }
        (_, Some(precision @ Precision::F32)) => {
            refuse(BackendKind::Cpu, &format!("in {precision}; take `--precision f64`{leave_out}"))
        }
        _ => Ok(Engine::new(BackendKind::Cpu, Precision::F64, "derivatives of fold loads are for the CPU in f64")),
    }
}

/// What finds every equilibrium: searches on an engine, answers in f64 on the CPU, energies by the reference.
pub fn branch_tools(engine: BackendFactory<'_>) -> BranchTools<'_> {
    BranchTools { engine, finisher: &second_attempt, energy: &|rod, base| energy(rod, base) }
}
