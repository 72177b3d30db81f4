//! Work against precision: every engine and stepper over growing numbers of steps.

use super::clock::{Clock, Effort};
use super::engines::Engine;
use super::problem::{Judged, Problem};
use super::session::Session;
use crate::bench_file::{BenchSpec, Sets, Work};
use crate::error::BenchError;
use crate::record::Record;
use rodsweep::backend::{BackendError, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{Plan, PlanOptions, Stepper};
use std::time::Instant;

/// Samples of a batch on a GPU that is none in software: it needs many to be busy.
const MANY: usize = 65_536;
/// Error estimates that are kept of each measurement, for the diagram.
const ESTIMATES: usize = 4;
/// More steps are not tried once so many in a row have not lowered the error by much.
const FLAT: usize = 2;
const GAIN: f64 = 0.7;

/// Measures one scene.
pub fn measure(problem: &Problem, session: &mut Session) -> Result<(), BenchError> {
    let spec = problem.spec;
    for work in spec.work.iter().copied() {
        for engine in session.engines.clone() {
            let wanted = match (spec.sets, engine.is_gpu(), engine.is_software()) {
                (_, true, true) => {
                    let is_whole = matches!(work, Work::Cold | Work::Sweep);
                    is_whole && software_steps(spec, engine, session.quick) > 0
                }
                (Sets::Best, false, _) => engine.is_best(),
                _ => true,
            };
            if !wanted {
                continue;
            }
            for stepper in spec.steppers.iter().copied() {
                let mut steps = spec.steps(stepper);
                if session.quick || engine.is_software() {
                    // Every second, the coarsest left out.
                    steps = steps.into_iter().skip(1).step_by(2).collect();
                }
                if engine.is_software() {
                    let suits = match engine.precision {
                        Precision::F32 => stepper == Stepper::Tp6,
                        Precision::F64 => stepper == Stepper::Dop853,
                    };
                    steps.truncate(if suits { software_steps(spec, engine, session.quick) } else { 0 });
                }
                curve(problem, work, engine, stepper, &steps, session)?;
            }
        }
    }
    Ok(())
}

/// How many numbers of steps are measured on a GPU in software: each is a kernel, which takes seconds to compile.
fn software_steps(spec: &BenchSpec, engine: Engine, quick: bool) -> usize {
    match (spec.software_gpu, engine.precision, quick) {
        (true, _, false) => 3,
        (true, _, true) => 1,
        (false, Precision::F32, false) => 2,
        (false, ..) => 0,
    }
}

/// One stepper on one engine.
fn curve(
    problem: &Problem,
    work: Work,
    engine: Engine,
    stepper: Stepper,
    steps: &[usize],
    session: &mut Session,
) -> Result<(), BenchError> {
    let (mut best, mut flat) = (f64::INFINITY, 0);
    for steps in steps {
        let options = PlanOptions { stepper, steps: *steps, ..PlanOptions::default() };
        let error = match point(problem, work, engine, options, session) {
            Ok(error) => error,
            Err(BenchError::Backend(
                error @ (BackendError::Unsupported { .. }
                | BackendError::DeviceFailed { .. }
                | BackendError::OutOfMemory { .. }),
            )) => {
                session.note(format!("{} {}, {}: {error}", engine.name(), engine.precision, problem.spec.name));
                break;
            }
            Err(error) => return Err(error),
        };
        flat = if error < GAIN * best { 0 } else { flat + 1 };
        best = best.min(error);
        if flat >= FLAT {
            break;
        }
    }
    Ok(())
}

/// One number of steps: the tip's error that 95 % stay below.
fn point(
    problem: &Problem,
    work: Work,
    engine: Engine,
    options: PlanOptions,
    session: &mut Session,
) -> Result<f64, BenchError> {
    // Who asks for no more than the steps give should not pay for more of Newton's steps.
    let finest = PlanOptions { tolerance: engine.finest(), ..options };
    let samples = problem.len();
    let tolerance = if engine.is_software() {
        1e-6
    } else {
        let scout = Engine::best(engine.precision);
        let solutions = scout.make(&problem.plan(work, finest)?)?.solve(&problem.batch(work, samples)?)?;
        let reached = problem.judge(work, &solutions).p95();
        if reached.is_finite() { reached.clamp(engine.finest(), 1e-3) } else { 1e-6 }
    };
    let plan = problem.plan(work, PlanOptions { tolerance, ..options })?;
    let count = match (engine.is_gpu(), engine.is_software()) {
        (false, _) => problem.rows.len(),
        (true, true) => samples,
        (true, false) => MANY,
    };
    let batch = problem.batch(work, count)?;
    let effort = session.effort;
    let run = || -> Result<_, BenchError> {
        let begin = Instant::now();
        let mut backend = engine.make(&plan)?;
        let mut solutions = backend.solve(&batch)?;
        let first = begin.elapsed().as_secs_f64();
        let clock = if engine.is_gpu() { Clock::Wall } else { Clock::Processor };
        let effort = if engine.is_software() { Effort { least: 3, most: 3, ..effort } } else { effort };
        let timing = clock.time(effort, || backend.solve_into(&batch, &mut solutions));
        Ok((solutions, timing, first))
    };
    let (solutions, timing, first) = if engine.is_gpu() { run() } else { session.one_thread.install(run) }?;
    let judged = problem.judge(work, &solutions);
    let mut record = Record {
        setup: (first - timing.median).max(0.0),
        operations: operations(&plan, &problem.batch(work, samples)?, engine, &solutions)?,
        ..engine.record(problem.spec.name.as_str(), work, options, (timing, count))
    };
    judged.write(&mut record);
    keep_estimates(&judged, &record, session);
    session.records.push(record);
    Ok(judged.p95())
}

/// Operations of the passes that a sample takes, on average: all but the last few follow the path.
fn operations(
    plan: &Plan,
    batch: &rodsweep::model::Batch,
    engine: Engine,
    solutions: &rodsweep::model::Solutions,
) -> Result<f64, BenchError> {
    use rodsweep::model::Quantity::Iterations;
    let passes = Cpu::new(plan, engine.precision)?.count_operations(batch, 0);
    let count = batch.sample_count();
    let mean = (0..count).map(|sample| solutions.get(sample, Iterations)).sum::<f64>() / count.max(1) as f64;
    Ok(passes.of_sample(mean))
}

/// A few estimates with their errors, evenly spread over the samples.
fn keep_estimates(judged: &Judged, of: &Record, session: &mut Session) {
    if of.work != Work::Cold.name() || of.engine != Engine::best(Precision::F64).name() {
        return;
    }
    let count = judged.estimates.len();
    for [estimate, error] in judged.estimates.iter().step_by((count / ESTIMATES).max(1)) {
        session.records.push(Record {
            engine: of.engine.clone(),
            precision: of.precision.clone(),
            method: of.method.clone(),
            size: of.size,
            tip: [*error; 3],
            estimate: *estimate,
            ..Record::new("estimate", of.case.as_str())
        });
    }
}
