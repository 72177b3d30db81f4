//! `rodsweep verify`: every engine of this machine against the reference, in a chain whose links each isolate one
//! cause: reference and cpu f64 (algebra), cpu f64 and cpu f32 (precision), cpu f32 and gpu (hardware).

mod any_scene;
mod cases;
mod compare;
pub mod hard;
pub mod random;
mod search;
mod show;
mod verdicts;

use super::args::VerifyArguments;
use super::engine::Engine;
use super::{CommandError, Exit, print, say};
use cases::Case;
use compare::{Differences, Largest, Limits};
use rodsweep::backend::{BackendError, BackendInfo, BackendKind, Precision};
use rodsweep::model::{PlanOptions, Solutions, Stepper};
use rodsweep::sweep::write_scene;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Limits of an f64 engine: its steps and round-off leave less.
const F64: Limits = Limits { pose: 1e-9, moment: 1e-9, derivative: 1e-9, small_column: 1e-3 };
/// Limits of an f32 engine: round-off of 6e-8 over some hundred stages. Small columns are measured against their
/// natural size, for f32 has no digits left for what almost cancels.
const F32: Limits = Limits { pose: 2e-5, moment: 2e-5, derivative: 2e-5, small_column: 1.0 };

/// An engine with its resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Setup {
    kind: BackendKind,
    precision: Precision,
    stepper: Stepper,
    steps: usize,
}

impl Setup {
    const REFERENCE: Setup =
        Setup { kind: BackendKind::Reference, precision: Precision::F64, stepper: Stepper::Dop853, steps: 1 };
    /// So fine that its steps do not show.
    const FINE: Setup =
        Setup { kind: BackendKind::Cpu, precision: Precision::F64, stepper: Stepper::Dop853, steps: 32 };

    /// An f32 engine as `run` takes it, at steps that do not show in f32.
    fn single(kind: BackendKind) -> Setup {
        let stepper = engine(kind, Precision::F32).steppers()[0];
        let steps = match stepper {
            Stepper::Rk4 => 64,
            Stepper::Tp6 | Stepper::Tp7 | Stepper::Dop853 => 8,
        };
        Setup { kind, precision: Precision::F32, stepper, steps }
    }

    fn options(&self) -> PlanOptions {
        let tolerance = match self.precision {
            Precision::F64 => 1e-12,
            Precision::F32 => 1e-6,
        };
        PlanOptions { tolerance, stepper: self.stepper, steps: self.steps, ..PlanOptions::default() }
    }

    fn name(&self) -> String {
        match self.kind {
            BackendKind::Reference => "reference".into(),
            kind => format!("{kind} {}", self.precision),
        }
    }

    fn method(&self) -> String {
        match self.kind {
            BackendKind::Reference => "adaptive".into(),
            _ => format!("{}, {} steps", self.stepper.name(), self.steps),
        }
    }
}

/// What an engine made of all cases.
struct Run {
    setup: Setup,
    info: Option<BackendInfo>,
    /// Of each case; `None` where the engine could not take it.
    solutions: Vec<Option<Solutions>>,
    skipped: Option<String>,
    failed: Option<String>,
    seconds: f64,
}

/// A line of the table: an engine, and what it is compared with.
struct Link {
    run: usize,
    against: Option<usize>,
    /// What a difference would come from.
    cause: &'static str,
}

/// A link, measured.
struct Row {
    link: Link,
    limits: Limits,
    differences: Differences,
    case_count: usize,
    sample_count: usize,
    converged: usize,
    replay: Option<PathBuf>,
}

pub fn verify(arguments: &VerifyArguments) -> Result<Exit, CommandError> {
    if arguments.hard {
        return hard::verify_hard(arguments);
    }
    if let Some(count) = arguments.random {
        return search::verify_random(arguments, count);
    }
    let cases = cases::cases(arguments.samples, arguments.seed)?;
    let (cpu, gpu) = (Setup::single(BackendKind::Cpu), Setup::single(BackendKind::Gpu));
    let setups = [
        Setup::REFERENCE,
        Setup::FINE,
        Setup { precision: Precision::F64, ..cpu },
        cpu,
        Setup { kind: BackendKind::Cpu, ..gpu },
        gpu,
    ];
    let runs: Vec<Run> = setups.into_iter().map(|setup| run(setup, &cases)).collect();
    let link = |run, against, cause| Link { run, against, cause };
    let links = [
        link(0, None, "the truth"),
        link(1, Some(0), "algebra"),
        link(3, Some(2), "precision"),
        link(5, Some(4), "hardware"),
        link(3, Some(0), "all of it"),
        link(5, Some(0), "all of it"),
    ];
    let mut rows: Vec<Row> = links.into_iter().map(|link| measure(link, &runs, &cases)).collect();
    for row in &mut rows {
        write_replay(row, &runs, &cases, &arguments.out)?;
    }
    let text = if arguments.json {
        show::json_text(&rows, &runs, &cases, arguments)
    } else {
        show::describe(&rows, &runs, &cases)
    };
    print(&text)?;
    let required = std::env::var("RODSWEEP_GPU").is_ok_and(|value| value == "require");
    let skipped = runs.iter().any(|run| run.skipped.is_some());
    if required && skipped {
        say("error: an engine was skipped, and RODSWEEP_GPU=require asks for all; install a driver or unset it");
    }
    let good = rows.iter().all(|row| row.is_within(&runs)) && !(required && skipped);
    Ok(if good { Exit::Done } else { Exit::Failed })
}

pub fn engine(kind: BackendKind, precision: Precision) -> Engine {
    Engine { kind, precision, reason: String::new() }
}

/// Solves every case; an engine that cannot be had is noted, not an error.
fn run(setup: Setup, cases: &[Case]) -> Run {
    let mut run = Run { setup, info: None, solutions: Vec::new(), skipped: None, failed: None, seconds: 0.0 };
    for case in cases {
        let missing = run.failed.is_some() || run.skipped.is_some() && run.info.is_none();
        let solved = if missing { None } else { solve(&mut run, case) };
        run.solutions.push(solved);
    }
    run
}

fn solve(run: &mut Run, case: &Case) -> Option<Solutions> {
    if run.setup.kind == BackendKind::Gpu {
        // Compiling may take a while on a software adapter.
        say(&format!("{}: {}, {} samples", run.setup.name(), case.name, case.sample_count()));
    }
    let plan = case.plan.with_options(run.setup.options());
    let solved = engine(run.setup.kind, run.setup.precision).make(&plan).and_then(|mut backend| {
        run.info.get_or_insert_with(|| backend.info());
        let start = Instant::now();
        let solutions = backend.solve(&case.batch)?;
        run.seconds += start.elapsed().as_secs_f64();
        Ok(solutions)
    });
    match solved {
        Ok(solutions) => Some(solutions),
        Err(BackendError::DeviceFailed { reason } | BackendError::OutOfMemory { reason }) => {
            run.failed = Some(format!("{}: {reason}", case.name));
            None
        }
        Err(error @ (BackendError::NoDevice { .. } | BackendError::Unsupported { .. })) => {
            run.skipped.get_or_insert(error.to_string());
            None
        }
    }
}

fn measure(link: Link, runs: &[Run], cases: &[Case]) -> Row {
    let run = &runs[link.run];
    let limits = match run.setup.precision {
        Precision::F64 => F64,
        Precision::F32 => F32,
    };
    let mut row = Row {
        limits,
        differences: Differences::default(),
        case_count: 0,
        sample_count: 0,
        converged: 0,
        replay: None,
        link,
    };
    for (index, (case, found)) in cases.iter().zip(&run.solutions).enumerate() {
        let Some(found) = found else { continue };
        row.case_count += 1;
        row.sample_count += case.sample_count();
        row.converged += (0..case.sample_count()).filter(|sample| found.status(*sample).is_success()).count();
        if let Some(expected) = row.link.against.and_then(|against| runs[against].solutions[index].as_ref()) {
            row.differences.add(index, case, found, expected, &limits);
        }
    }
    row
}

impl Row {
    fn is_within(&self, runs: &[Run]) -> bool {
        runs[self.link.run].failed.is_none() && self.differences.offender(&self.limits).is_none()
    }

    fn verdict(&self, runs: &[Run]) -> &'static str {
        let run = &runs[self.link.run];
        match (&run.failed, &run.skipped, self.sample_count, self.link.against) {
            (Some(_), ..) => "FAILED",
            (_, Some(_), 0, _) => "skipped",
            (.., None) => "",
            _ if self.is_within(runs) => "ok",
            _ => "BEYOND",
        }
    }

    fn worst_parameter(&self, cases: &[Case]) -> Option<String> {
        let Largest { case, column, error, .. } = self.differences.derivative;
        let derivative = cases[case].plan.derivatives.get(column).filter(|_| error > 0.0);
        derivative.map(|derivative| derivative.name.clone())
    }

    fn seconds_per_sample(&self, runs: &[Run]) -> Option<f64> {
        (self.sample_count > 0).then(|| runs[self.link.run].seconds / self.sample_count as f64)
    }
}

/// Writes the worst sample of a row beyond its limit as a scene that `solve` reads.
fn write_replay(row: &mut Row, runs: &[Run], cases: &[Case], out: &Path) -> Result<(), CommandError> {
    let (Some(against), Some((case, sample))) = (row.link.against, row.differences.offender(&row.limits)) else {
        return Ok(());
    };
    let name = format!("verify-{}-against-{}.toml", runs[row.link.run].setup.name(), runs[against].setup.name());
    let path = out.join(name.replace(' ', "-"));
    let written =
        std::fs::create_dir_all(out).and_then(|()| std::fs::write(&path, write_scene(&cases[case].scene(sample))));
    written.map_err(|error| CommandError::Usage(format!("cannot write {}: {error}; choose --out", path.display())))?;
    row.replay = Some(path);
    Ok(())
}
