//! `rodsweep run`: a sweep file to a result directory, a summary and figures.

use super::engine_args::EngineArguments;
use super::progress::Meter;
use super::run_summary::print_summary;
use super::{CommandError, Exit, force, say, signals, verdict};
use clap::Args;
use rodsweep::draw::count;
use rodsweep::figures::{Drawn, RunFigures};
use rodsweep::model::{Plan, PlanOptions, Quantity};
use rodsweep::results::{AnchorAccount, Reduction, Results, SILENCE};
use rodsweep::spec::{AxisSpec, BranchChoice, Distribution, Format, Method, Shard, SweepSpec};
use rodsweep::study::workspace::with_measured_dimension;
use rodsweep::sweep::{PathCheckOptions, PreparedSweep, Progress, ResultDirectory, SweepJob};

use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

#[derive(Debug, Args)]
pub struct RunArguments {
    /// Sweep file (TOML)
    pub sweep: PathBuf,
    /// Result directory [default: results/NAME-OF-THE-SWEEP]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub engine: EngineArguments,
    /// Solve part K of N only; `merge` puts the parts together
    #[arg(long, value_name = "K/N", default_value = "1/1")]
    pub shard: String,
    /// Go on with what the result directory holds
    #[arg(long)]
    pub resume: bool,
    /// Replace what an earlier run has left in the result directory; a file of somebody else stops it
    #[arg(long, conflicts_with_all = ["resume", "join", "dry_run"])]
    pub force: bool,
    #[command(flatten)]
    pub share: ShareArguments,
    /// Solve by the method (engine, precision, stepper, steps) of another result directory, such as another shard's
    #[arg(long, value_name = "DIR")]
    pub method_of: Option<PathBuf>,
    /// Follow the path from rest of every row a second time, by other steps; where two paths end apart the reference decides. Takes up to
    /// twice the time
    #[arg(long)]
    pub certain: bool,
    /// Say what would be done, and do nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Solve the first N samples only
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub limit: Option<u64>,
    /// Samples in a part [default: 65536, or 2048 where every equilibrium is wanted]; all shards and workers take the same
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub part_size: Option<u64>,
    /// No progress and no summary
    #[arg(long)]
    pub quiet: bool,
    /// Tell more: times of stages, processor seconds, anchors
    #[arg(long, conflicts_with = "quiet")]
    pub verbose: bool,
    /// Exit with 3 if more samples than this fail [default: as the sweep's allow_failures says]
    #[arg(long, value_name = "N")]
    pub max_failures: Option<u64>,
    /// Exit with 0 although rows are not to be trusted; what comes of them says so
    #[arg(long)]
    pub accept_distrusted: bool,
    /// Draw no figures
    #[arg(long)]
    pub no_figures: bool,
    /// Column that colours the tip cloud, for example stability.margin or coil.current.z
    #[arg(long, value_name = "COLUMN")]
    pub colour: Option<String>,
}

#[derive(Debug, Args)]
pub struct ShareArguments {
    /// Share the run with every other worker that joins it, on whatever machine: each claims chunks, those of dead
    /// workers are taken over, and all end together
    #[arg(long, conflicts_with = "shard")]
    pub join: bool,
    /// Seconds without a sign after which a worker is taken for dead; the first worker settles it [default: 60]
    #[arg(long, value_name = "SECONDS", requires = "join", value_parser = clap::value_parser!(u64).range(1..=86400))]
    pub silence: Option<u64>,
    /// Workers may solve the run by different methods (engine, precision, steps); each part says by which
    #[arg(long)]
    pub mixed_methods: bool,
}

impl ShareArguments {
    /// When a worker is taken for dead.
    pub fn silence(&self) -> Duration {
        self.silence.map_or(SILENCE, Duration::from_secs)
    }
}

pub fn run(arguments: &RunArguments) -> Result<Exit, CommandError> {
    let tell = |line: &str| {
        if !arguments.quiet {
            say(line);
        }
    };
    let spec = with_measured_dimension(SweepSpec::read(&arguments.sweep)?)?;
    let shard = Shard::parse(&arguments.shard).map_err(|error| CommandError::Usage(format!("`--shard`: {error}")))?;
    let figures = RunFigures::new().colour(arguments.colour.as_deref());
    figures.check(&spec)?;
    let out = arguments.out.clone().unwrap_or_else(|| default_directory(&spec));
    let settled = match &arguments.method_of {
        Some(dir) => Results::open(dir)?.method(),
        None => None,
    };
    for note in &spec.notes {
        tell(&format!("note: {note}"));
    }
    let meter = OnceLock::new();
    let warn = |text: &str| {
        meter.get().into_iter().for_each(Meter::finish);
        say(&format!("warning: {text}"));
    };
    let job = SweepJob::new(spec).engine(arguments.engine.request()).method(settled).shard(shard);
    let interrupted = signals::listen();
    let share = &arguments.share;
    let job = job.limit(arguments.limit).interrupt(interrupted).warn(&warn);
    let job = job.drain(signals::listen_for_drain(share.join)).mixed_methods(share.mixed_methods);
    let job = job.part_size(arguments.part_size).max_failures(arguments.max_failures);
    let job = if arguments.certain { job.path_check(Some(PathCheckOptions::All)) } else { job };
    let drawn = Mutex::new(None);
    let draw = |spec: &SweepSpec, rows: &Reduction| {
        let files = figures.drawn_reduction(spec, rows, &out);
        drawn.lock().unwrap_or_else(PoisonError::into_inner).replace(files);
    };
    // A shard's figures show what the directory holds of all shards, and a worker's what it holds of all workers.
    let is_drawn = !arguments.no_figures && shard == Shard::WHOLE && !share.join;
    let job = job.rows_written(if is_drawn { Some(&draw) } else { None });
    let directory = ResultDirectory::new(&out).resume(arguments.resume);
    let mut directory = if share.join { directory.join(share.silence()) } else { directory };
    let mut sweep = job.prepare(&directory)?;
    tell_method(&sweep, &tell, arguments.verbose);
    if arguments.dry_run {
        describe(&sweep, arguments, &out);
        return Ok(Exit::Done);
    }
    if arguments.force {
        if shard != Shard::WHOLE {
            return Err(CommandError::Usage("`--force` replaces whole runs: leave it or `--shard` out".into()));
        }
        force::clear(&out)?;
    }
    let show = |progress: &Progress| meter.get().into_iter().for_each(|meter| meter.show(progress));
    let summary = loop {
        let mut backend = sweep.open()?;
        let meter = meter.get_or_init(|| Meter::new(&backend.info()));
        sweep.set_progress(if arguments.quiet { None } else { Some(&show) });
        let result = sweep.run_on(backend.as_mut(), &mut directory);
        meter.finish();
        match result {
            Ok(summary) => break summary,
            Err(error) => sweep = sweep.settled_meanwhile(error, &directory)?,
        }
        tell_method(&sweep, &tell, arguments.verbose);
    };
    let spec = sweep.spec();
    if !arguments.quiet {
        print_summary(spec, &summary, &out, arguments.verbose);
    }
    if summary.interrupted {
        let how = if share.join { "--join" } else { "--resume" };
        let what = if summary.drained { "stopped between two parts" } else { "interrupted" };
        say(&format!("{what}; go on with: rodsweep run {} --out {} {how}", spec.file.display(), out.display()));
        return Ok(if summary.drained { Exit::Unfinished } else { Exit::Interrupted });
    }
    if !arguments.no_figures && summary.finished_run {
        let drawn = drawn.lock().unwrap_or_else(PoisonError::into_inner).take();
        let files = match drawn {
            // Drawn before it was known what speaks against the rows, or not.
            Some(files) if summary.verdict.sound => files?,
            _ => figures.drawn(&Results::open(&out)?, &out)?,
        };
        tell_figures(files, &tell);
    }
    let all = if share.join && summary.finished_run { Results::open(&out)?.verdict()? } else { None };
    if all.is_some_and(|verdict| !verdict.sound) && summary.verdict.sound {
        // Doubts that other workers found.
        let exit = verdict::of_results(&Results::open(&out)?, arguments.accept_distrusted)?;
        return Ok(exit.unwrap_or(Exit::Done));
    }
    let solved = (sweep.method(), out.as_path());
    Ok(verdict::of_run(&summary, solved, arguments.max_failures, arguments.accept_distrusted))
}

/// How a study wants the run that it needs to be done.
#[derive(Clone, Copy, Debug)]
pub struct StudyRun<'a> {
    pub engine: &'a EngineArguments,
    pub limit: Option<u64>,
    pub force: bool,
    pub quiet: bool,
    pub verbose: bool,
    pub accept_distrusted: bool,
}

/// Runs the sweep of a study into a directory, or goes on with it there; the exit where that ends the command.
pub fn run_for_study(spec: SweepSpec, arguments: StudyRun, out: &Path) -> Result<Option<Exit>, CommandError> {
    let quiet = arguments.quiet;
    let tell = |line: &str| {
        if !quiet {
            say(line);
        }
    };
    for note in &spec.notes {
        tell(&format!("note: {note}"));
    }
    let is_resumed = !arguments.force || holds(&spec, out);
    let warn = |text: &str| say(&format!("warning: {text}"));
    let job = SweepJob::new(spec).engine(arguments.engine.request()).limit(arguments.limit);
    let job = job.interrupt(signals::listen()).warn(&warn);
    let mut directory = ResultDirectory::new(out).resume(is_resumed);
    let mut sweep = job.prepare(&directory)?;
    tell_method(&sweep, &tell, arguments.verbose);
    if arguments.force && !is_resumed {
        force::clear(out)?;
    }
    let mut backend = sweep.open()?;
    let meter = Meter::new(&backend.info());
    let show = |progress: &Progress| meter.show(progress);
    sweep.set_progress(if quiet { None } else { Some(&show) });
    let result = sweep.run_on(backend.as_mut(), &mut directory);
    meter.finish();
    let summary = result?;
    if !quiet {
        print_summary(sweep.spec(), &summary, out, arguments.verbose);
    }
    if summary.interrupted {
        say("interrupted; the same command goes on");
        return Ok(Some(Exit::Interrupted));
    }
    let solved = (sweep.method(), out);
    let exit = verdict::of_run(&summary, solved, None, arguments.accept_distrusted);
    Ok((exit != Exit::Done).then_some(exit))
}

/// Names the figures of a run that were drawn, and says why others were not.
pub fn tell_figures(drawn: Drawn, tell: &dyn Fn(&str)) {
    drawn.left_out.iter().for_each(|note| tell(&format!("note: {note}")));
    for path in drawn {
        tell(&format!("figure: {}", path.display()));
    }
}

/// Whether a directory holds the run of a sweep; its tolerance is then the one that its engine was held to.
fn holds(spec: &SweepSpec, out: &Path) -> bool {
    let Ok(results) = Results::open(out) else { return false };
    let there = SweepSpec { tolerance: spec.tolerance, ..results.spec().clone() };
    there.to_toml() == spec.to_toml() && there.table == spec.table
}

/// By what the sweep will be solved, and why.
fn tell_method(sweep: &PreparedSweep, tell: &dyn Fn(&str), is_verbose: bool) {
    let (engine, method) = (sweep.engine(), sweep.method());
    tell(&format!("engine: {} {} ({})", engine.kind(), engine.precision(), engine.reason()));
    let asked = sweep.asked_tolerance();
    if method.tolerance > asked {
        tell(&format!("note: tolerance {asked:.0e} is beyond f32; held to {:.0e}", method.tolerance));
    }
    let PlanOptions { stepper, steps, .. } = sweep.plan().options;
    tell(&match sweep.pilot() {
        Some(pilot) => format!("integration: {}", pilot.explain()),
        None => {
            let who = if sweep.is_settled() { "as the run was begun" } else { "as the sweep file says" };
            format!("integration: {}, {steps} steps, {who}", stepper.name())
        }
    });
    if let Some(anchors) = AnchorAccount::of(sweep.plan()).filter(|_| is_verbose) {
        tell(&format!("anchors: {}", anchors.explain()));
    }
}

/// `results/` and the name of the sweep file.
pub fn default_directory(spec: &SweepSpec) -> PathBuf {
    PathBuf::from("results").join(spec.file.file_stem().unwrap_or(spec.file.as_os_str()))
}

/// By which law an axis varies.
fn law(axis: &AxisSpec) -> String {
    let unit = if axis.scales { "times the scene's values" } else { axis.unit() };
    match &axis.distribution {
        Distribution::Uniform { from, to } => format!("{from} to {to} {unit}"),
        law => format!("{} {unit}", law.words()),
    }
}

fn describe(sweep: &PreparedSweep, arguments: &RunArguments, out: &Path) {
    let (spec, plan) = (sweep.spec(), sweep.plan());
    let samples = arguments.limit.unwrap_or(u64::MAX).min(spec.sample_count);
    let driven: usize = spec.axes.iter().map(|axis| axis.parameters.len()).sum();
    let columns = 1 + driven + Quantity::COUNT + plan.rows() * plan.derivatives.len();
    say(&format!("samples: {} by {}", count(samples), spec.method.name()));
    for axis in &spec.axes {
        let names: Vec<String> = axis.parameters.iter().map(|parameter| parameter.name(&spec.scene)).collect();
        match spec.method {
            Method::Table => say(&format!("  {}", names.join(", "))),
            _ => say(&format!("  {}: {}", names.join(", "), law(axis))),
        }
    }
    let names: Vec<&str> = plan.derivatives.iter().map(|derivative| derivative.name.as_str()).collect();
    say(&format!("derivatives by: {}", if names.is_empty() { "nothing".into() } else { names.join(", ") }));
    say(&format!("terms: {}", terms(plan)));
    match spec.format {
        Format::None => say(&format!("would write the reduced workspace to {}", out.display())),
        format => {
            let bytes = samples as f64 * columns as f64 * 8.0;
            let rows = match spec.branch {
                BranchChoice::FromRest => "rows",
                BranchChoice::All => "samples, a row for each equilibrium,",
            };
            let each = if spec.branch == BranchChoice::All { " where each has one" } else { "" };
            say(&format!(
                "would write {} {rows} as {} to {} (at most {:.1} MB{each})",
                count(samples),
                format.name(),
                out.display(),
                bytes / 1e6
            ));
        }
    }
}

/// The terms of the model that the kernels contain.
pub fn terms(plan: &Plan) -> String {
    let terms = plan.terms;
    let words = [
        (true, "bending and torsion"),
        (terms.anisotropic, "anisotropic bending"),
        (terms.taper, "stiffness along segments"),
        (terms.curvature_rise, "rest curvature along segments"),
        (terms.shear, "shear and stretch"),
        (terms.dipole, "dipoles in the field"),
        (terms.magnet, "flexible magnets"),
        (plan.scene.sources.varies(), "a field that varies in space"),
        (terms.force || terms.varying_field, "internal force"),
        (terms.load, "distributed load"),
        (terms.load_without_energy, "tip moment"),
        (!plan.scene.rigid_force_arm, "no force arm over rigid segments"),
        (terms.wall, "a wall that the tip may touch"),
    ];
    words.iter().filter(|(used, _)| *used).map(|(_, word)| *word).collect::<Vec<_>>().join(", ")
}
