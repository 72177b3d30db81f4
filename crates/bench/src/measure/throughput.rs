//! Batches of every size on every engine, and threads.

use super::clock::{Clock, Effort};
use super::engines::Engine;
use super::problem::Problem;
use super::session::{Session, pool};
use crate::bench_file::Work;
use crate::error::BenchError;
use crate::record::Record;
use rodsweep::backend::{BackendError, Precision};
use rodsweep::model::{Plan, PlanOptions, Stepper};

/// Tips to 1e-6 or better, on the scenes that are measured.
const STEPS: usize = 3;

fn options(precision: Precision, engine: &Engine) -> PlanOptions {
    let stepper = if precision == Precision::F32 { Stepper::Tp6 } else { Stepper::Tp7 };
    PlanOptions { stepper, steps: STEPS, tolerance: engine.finest().max(1e-6), ..PlanOptions::default() }
}

/// All threads of the machine, time on the wall.
pub fn batches(problem: &Problem, session: &mut Session) -> Result<(), BenchError> {
    let most = if session.quick { 4096 } else { 65_536 };
    for engine in session.engines.clone() {
        let takes_too_long = engine.is_software() && session.quick;
        if !(engine.is_gpu() || engine.is_best()) || takes_too_long {
            continue;
        }
        let most = match (engine.is_gpu(), engine.is_software()) {
            (true, false) => 16 * most,
            (true, true) => most.min(4096),
            _ => most,
        };
        let plan = problem.plan(Work::Cold, options(engine.precision, &engine))?;
        let mut backend = match engine.make(&plan) {
            Ok(backend) => backend,
            Err(error) => {
                session.note(format!("{} {}: {error}", engine.name(), engine.precision));
                continue;
            }
        };
        let mut size = 1;
        while size <= most {
            let batch = problem.batch(Work::Cold, size)?;
            if let Err(error) = backend.solve(&batch) {
                session.note(format!("{} {}, batch of {size}: {error}", engine.name(), engine.precision));
                break;
            }
            let timing = Clock::Wall.time(session.effort, || backend.solve(&batch));
            session.records.push(record("batch", size, timing, size, &engine, &plan));
            size *= 4;
        }
    }
    Ok(())
}

fn record(
    part: &str,
    size: usize,
    timing: super::clock::Timing,
    samples: usize,
    engine: &Engine,
    plan: &Plan,
) -> Record {
    Record {
        work: "cold".into(),
        engine: engine.name().into(),
        precision: engine.precision.to_string(),
        method: plan.options.stepper.name().into(),
        size: size as f64,
        samples: samples as f64,
        seconds: timing.median / samples as f64,
        least: timing.least / samples as f64,
        spread: timing.spread(),
        ..Record::new(part, "")
    }
}

/// One batch on 1, 2, ... threads, up to those of the machine.
pub fn threads(problem: &Problem, session: &mut Session) -> Result<(), BenchError> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let samples = if session.quick { 4096 } else { 32_768 };
    let batch = problem.batch(Work::Cold, samples)?;
    let mut counts: Vec<usize> = std::iter::successors(Some(1), |n| Some(2 * n)).take_while(|n| *n < cores).collect();
    counts.push(cores);
    for precision in [Precision::F64, Precision::F32] {
        let engine = Engine::best(precision);
        let plan = problem.plan(Work::Cold, options(precision, &engine))?;
        for threads in &counts {
            let timing = pool(*threads)?.install(|| -> Result<_, BackendError> {
                let mut backend = engine.make(&plan)?;
                backend.solve(&batch)?;
                let effort = Effort { seconds: 0.5, ..session.effort };
                Ok(Clock::Wall.time(effort, || backend.solve(&batch)))
            })?;
            session.records.push(record("threads", *threads, timing, samples, &engine, &plan));
        }
    }
    Ok(())
}
