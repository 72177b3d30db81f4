//! What a GPU takes by its own clock, part by part: kernels and copies, and the host's share beside them.

use super::engines::Engine;
use super::problem::Problem;
use super::session::Session;
use crate::bench_file::Work;
use crate::error::BenchError;
use crate::record::Record;
use rodsweep::backend::{BackendError, Precision};
use rodsweep::model::{Batch, Plan, PlanOptions, Quantity, Start, Stepper};

/// Samples of a batch: enough for several full dispatches.
const SAMPLES: usize = 1 << 18;
const FEW: usize = 1 << 12;
/// Work that is the same for every batch.
const ONCE: [&str; 3] = ["open", "compile", "first_dispatch"];

pub fn measure(problem: &Problem, session: &mut Session) -> Result<(), BenchError> {
    for engine in session.engines.clone().into_iter().filter(Engine::is_gpu) {
        match on_engine(problem, engine, session) {
            Err(BenchError::Backend(error)) => {
                session.note(format!("{} {} by its own clock: {error}", engine.name(), engine.precision));
            }
            done => done?,
        }
    }
    Ok(())
}

fn on_engine(problem: &Problem, engine: Engine, session: &mut Session) -> Result<(), BenchError> {
    let methods = match engine.precision {
        Precision::F32 => [(Stepper::Tp6, 2), (Stepper::Tp6, 3), (Stepper::Rk4, 12)],
        Precision::F64 => [(Stepper::Tp7, 2), (Stepper::Tp7, 3), (Stepper::Tp6, 4)],
    };
    let few = engine.is_software() || session.quick;
    let samples = if few { FEW } else { SAMPLES };
    for (stepper, steps) in methods.into_iter().take(if few { 1 } else { methods.len() }) {
        let tolerance = engine.finest().max(1e-6);
        let options = PlanOptions { stepper, steps, tolerance, ..PlanOptions::default() };
        for work in [Work::Tip, Work::Cold, Work::Warm] {
            let (plan, batch) = (problem.plan(work, options)?, problem.batch(work, samples)?);
            point(work.name(), engine, &plan, &batch, session)?;
        }
        known(problem, engine, options, samples, session)?;
    }
    Ok(())
}

/// From the base moment that the engine itself has found, with the few derivatives: little more than an initial value
/// problem with three columns, and its check.
fn known(
    problem: &Problem,
    engine: Engine,
    options: PlanOptions,
    samples: usize,
    session: &mut Session,
) -> Result<(), BenchError> {
    let plan = problem.plan(Work::Tip, options)?;
    let batch = problem.batch(Work::Tip, samples)?;
    let solutions = engine.make(&plan)?.solve(&batch)?;
    let start = |sample| Start { sample, m0: solutions.vector(sample, Quantity::BaseMoment), n0: None, known: &[] };
    let batch = plan.start_batch(&batch, &(0..samples).map(start).collect::<Vec<_>>());
    point("known", engine, &plan.with_starts(), &batch, session)
}

/// Seconds a sample of each part of a batch, the median batch by its kernels; of the setup, seconds.
fn point(work: &str, engine: Engine, plan: &Plan, batch: &Batch, session: &mut Session) -> Result<(), BenchError> {
    let samples = batch.sample_count();
    let mut backend = engine.make(plan)?;
    // Until dispatches have grown to their full size.
    for _ in 0..session.effort.least {
        backend.solve(batch)?;
    }
    let mut batches = (0..session.effort.least)
        .map(|_| -> Result<Vec<(&str, f64)>, BackendError> {
            let before = backend.timings();
            backend.solve(batch)?;
            let spent = backend.timings().into_iter().zip(before);
            Ok(spent.map(|((name, after), (_, before))| (name, after - before)).collect())
        })
        .collect::<Result<Vec<_>, _>>()?;
    let kernel = |parts: &Vec<(&str, f64)>| parts.iter().find(|(name, _)| *name == "kernel").map_or(0.0, |part| part.1);
    batches.sort_by(|a, b| kernel(a).total_cmp(&kernel(b)));
    let of_batch = batches.swap_remove(batches.len() / 2);
    let setup = backend.timings();
    let parts = setup.into_iter().zip(of_batch).map(|((name, total), (_, spent))| match ONCE.contains(&name) {
        true => (name, 1, total),
        false => (name, samples, spent),
    });
    for (name, samples, seconds) in parts {
        session.records.push(Record {
            work: work.into(),
            engine: engine.name().into(),
            precision: engine.precision.to_string(),
            method: plan.options.stepper.name().into(),
            size: plan.options.steps as f64,
            samples: samples as f64,
            seconds: seconds / samples as f64,
            ..Record::new("device", name)
        });
    }
    Ok(())
}
