//! `rodsweep run`: a sweep file to a result directory, a summary and figures.

use super::args::{RunArguments, SensitivityArguments};
use super::progress::{Meter, duration};
use super::{CommandError, Exit, force, say, signals, verdict};
use rodsweep::figures::RunFigures;
use rodsweep::input::scene_notes;
use rodsweep::model::{Plan, PlanOptions, Quantity, Status};
use rodsweep::report::{count, engineering};
use rodsweep::results::{
    AnchorAccount, BranchCounts, ErrorDistribution, PathCheck, Reduction, Results, SampleOrigin, Timings,
};
use rodsweep::spec::{AxisSpec, BranchChoice, Distribution, Format, Method, Shard, SweepSpec};
use rodsweep::study::workspace::with_measured_dimension;
use rodsweep::sweep::{PathCheckOptions, PreparedSweep, Progress, ResultDirectory, Summary, SweepJob};

use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

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
    for note in spec.notes.iter().chain(&scene_notes(&spec.scene)) {
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
        files.left_out.iter().for_each(|note| tell(&format!("note: {note}")));
        for path in files {
            tell(&format!("figure: {}", path.display()));
        }
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

/// Runs the sweep of a study into a directory, or goes on with it there; the exit where that ends the command.
pub fn run_for_study(
    spec: SweepSpec,
    arguments: &SensitivityArguments,
    out: &Path,
) -> Result<Option<Exit>, CommandError> {
    let quiet = arguments.quiet;
    let tell = |line: &str| {
        if !quiet {
            say(line);
        }
    };
    for note in spec.notes.iter().chain(&scene_notes(&spec.scene)) {
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

/// Whether a directory holds the run of a sweep; its tolerance is then the one that its engine was held to.
fn holds(spec: &SweepSpec, out: &Path) -> bool {
    let Ok(results) = Results::open(out) else { return false };
    let there = SweepSpec { tolerance: spec.tolerance, ..results.spec().clone() };
    there.to_toml() == spec.to_toml() && there.table == spec.table
}

/// Draws the figures of a result directory again.
pub fn draw(directory: &Path, colour: Option<&str>, accept_distrusted: bool) -> Result<Exit, CommandError> {
    let results = Results::open(directory)?;
    if let Some(exit) = verdict::of_results(&results, accept_distrusted)? {
        return Ok(exit);
    }
    let drawn = RunFigures::new().colour(colour).drawn(&results, directory)?;
    drawn.left_out.iter().for_each(|note| say(&format!("note: {note}")));
    for path in drawn {
        say(&format!("figure: {}", path.display()));
    }
    Ok(Exit::Done)
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
        (terms.varying_field, "a field that varies in space"),
        (terms.force || terms.varying_field, "internal force"),
        (terms.load, "distributed load"),
        (terms.tip_moment, "tip moment"),
        (!plan.scene.rigid_force_arm, "no force arm over rigid segments"),
    ];
    words.iter().filter(|(used, _)| *used).map(|(_, word)| *word).collect::<Vec<_>>().join(", ")
}

fn named_stages(of: &Timings) -> String {
    let search = if of.search > 0.0 { format!(", search {:.2}", of.search) } else { String::new() };
    format!(
        "build {:.2}, solve {:.2}, solve again {:.2}{search}, rows {:.2}, write {:.2}, check {:.2}",
        of.build, of.solve, of.refine, of.rows, of.write, of.check
    )
}

fn print_summary(spec: &SweepSpec, summary: &Summary, out: &Path, is_verbose: bool) {
    let time = duration(Duration::from_secs_f64(summary.timings.total));
    let resumed = if summary.resumed > 0 { format!(", {} found done", count(summary.resumed)) } else { String::new() };
    say(&format!(
        "solved {} samples in {time} ({}/s) on {}{resumed}",
        count(summary.solved),
        count(summary.rate.round() as u64),
        summary.backend
    ));
    if is_verbose {
        say_stages(summary);
    }
    summary.notes.iter().for_each(|note| say(&format!("warning: {note}")));
    if let SampleOrigin::HostBecause(reason) = &summary.origin {
        say(&format!("note: samples were made on the host and uploaded: {reason}"));
    }
    say_statuses(summary);
    if let Some([low, high]) = summary.reduction.extents {
        let span = |axis: usize| format!("{:.2} to {:.2}", low[axis] * 1e3, high[axis] * 1e3);
        say(&format!("tip extents [mm]: x {}, y {}, z {}", span(0), span(1), span(2)));
    }
    say(&format!(
        "worst residual {} (plan units of moment), worst error estimate {}, {} rows above the tolerance {:.0e}",
        engineering(summary.worst_residual),
        engineering(summary.worst_error_estimate),
        count(summary.above_tolerance),
        spec.tolerance
    ));
    for path in &summary.quarantined {
        say(&format!("warning: a damaged part was put aside as {} and solved again", path.display()));
    }
    if let Some(check) = &summary.path_check {
        let PathCheck { followed, confirmed, elsewhere, past_fold, doubtful, .. } = check;
        let which = if check.all { "every row that is called solved" } else { "a fixed choice" };
        say(&format!(
            "second paths: {} rows ({which}) followed from rest by other steps: {elsewhere} were another equilibrium, {past_fold} beyond a \
             fold, {doubtful} doubtful, {confirmed} confirmed by the reference",
            count(*followed)
        ));
    }
    if let Some(check) = &summary.spot_check {
        let distribution = |d: &ErrorDistribution| [d.median, d.p95, d.max].map(engineering).join(" / ");
        say(&format!(
            "spot check: {} samples against the reference; median / 95 % / max error: position over length {}, rotation {} rad, derivative column {}",
            count(check.compared),
            distribution(&check.position),
            distribution(&check.rotation),
            distribution(&check.derivative)
        ));
    }
    say(&format!("results: {}", out.display()));
}

/// Times by stage; the manifest has them, too.
fn say_stages(summary: &Summary) {
    say(&format!("stages (busy seconds, overlapping): {}", named_stages(&summary.timings)));
    if let Some(processor) = &summary.processor {
        let stages = named_stages(processor);
        say(&format!("stages (processor seconds): {stages}, of {:.2} of the process", processor.total));
    }
    if !summary.engine_timings.is_empty() {
        let each: Vec<_> = summary.engine_timings.iter().map(|(name, s)| format!("{} {s:.2}", spaced(name))).collect();
        say(&format!("of these, the {}: {}", summary.backend.kind, each.join(", ")));
    }
}

/// `first dispatch` for `first_dispatch`
fn spaced(name: &str) -> String {
    name.replace('_', " ")
}

fn say_statuses(summary: &Summary) {
    let reduction = &summary.reduction;
    let words: Vec<String> = Status::ALL
        .into_iter()
        .filter(|status| summary.count(*status) > 0)
        .map(|status| format!("{} {}", count(summary.count(status)), status.name()))
        .collect();
    let words = words.join(", ");
    let share = 100.0 * (1.0 - summary.failed() as f64 / reduction.sample_count.max(1) as f64);
    let Some(BranchCounts { most, unbalanced, .. }) = reduction.branches else {
        return say(&format!("status: {words}; {share:.3} % usable"));
    };
    let rows = count(reduction.row_count());
    say(&format!("status of {rows} rows: {words}; {share:.3} % of the samples have an equilibrium"));
    let complete = match unbalanced {
        0 => "their signs add up in every sample".into(),
        some => format!("in {} samples their signs do not add up: some are missing", count(some)),
    };
    say(&format!("equilibria: at most {most} a sample; {complete}"));
}
