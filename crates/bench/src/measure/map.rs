//! The workspace map with its files, as `run` solves it: busy time by stage, and what its checks cost.

use super::clock::Clock;
use super::engines::Engine;
use super::problem::batch_of;
use super::session::Session;
use crate::error::BenchError;
use crate::record::Record;
use rodsweep::backend::{Backend, BackendError, BackendKind, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::engines::{self, F32_TOLERANCE, cpu_f64, second_attempt, witness};
use rodsweep::model::{Plan, PlanOptions, Quantity};
use rodsweep::shipped::{P6, WORKSPACE};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::{self, ResultDirectory, RunOptions, Summary};
use std::path::Path;

/// Samples of the map where it is to be quick.
const QUICK: u64 = 20_000;
/// Samples of the map whose operations are counted.
const COUNTED: usize = 512;
/// Runs of the map with all checks, and without one and the other.
const ROUNDS: usize = 5;

struct Map {
    spec: SweepSpec,
    plan: Plan,
    engine: Engine,
    limit: Option<u64>,
}

/// What a run does beside solving.
#[derive(Clone, Copy)]
struct Checks {
    second_attempts: bool,
    spot_check: bool,
}

impl Map {
    /// With the method and the steps that `run` would take.
    fn new(precision: Precision, session: &Session) -> Result<Map, BenchError> {
        let (name, text) = WORKSPACE;
        let spec = SweepSpec::parse_with(Path::new(name), text, &[("scenes/p6.toml", P6.1)])?;
        let tolerance = if precision == Precision::F32 { F32_TOLERANCE } else { spec.tolerance };
        let spec = SweepSpec { tolerance, ..spec };
        let steppers = engines::Engine::new(BackendKind::Cpu, precision, "").steppers();
        let plan = spec.plan(PlanOptions { stepper: steppers[0], ..PlanOptions::default() })?;
        let pilot = sweep::choose_method(&plan, &spec.sampler(), &steppers[1..], &cpu_f64)?;
        let plan = plan.with_options(pilot.options(&plan));
        Ok(Map { spec, plan, engine: Engine::best(precision), limit: session.quick.then_some(QUICK) })
    }

    /// One run, whose files are thrown away.
    fn run(&self, checks: Checks) -> Result<Summary, BenchError> {
        let out = std::env::temp_dir().join(format!("rodsweep-bench-{}", std::process::id()));
        let trusted = |plan: &Plan| -> Result<Box<dyn Backend>, BackendError> { Ok(witness(plan)) };
        let mut run = RunOptions::new();
        run.limit = self.limit;
        if checks.second_attempts {
            run.refiners = vec![&second_attempt, &trusted];
        }
        run.trusted = checks.spot_check.then_some(&trusted);
        let mut backend = self.engine.make(&self.plan)?;
        let mut files = ResultDirectory::new(&out);
        let summary = sweep::run(&self.spec, backend.as_mut(), &run, &mut files);
        let _ = std::fs::remove_dir_all(&out);
        Ok(summary?)
    }

    fn record(&self, part: &str, case: &str, samples: f64) -> Record {
        Record {
            work: "map".into(),
            engine: self.engine.name().into(),
            precision: self.engine.precision.to_string(),
            method: self.plan.options.stepper.name().into(),
            size: self.plan.options.steps as f64,
            samples,
            ..Record::new(part, case)
        }
    }
}

/// Busy time by stage.
pub fn stages(session: &mut Session) -> Result<(), BenchError> {
    for precision in [Precision::F64, Precision::F32] {
        let map = Map::new(precision, session)?;
        let summary = map.run(Checks { second_attempts: true, spot_check: false })?;
        let busy = summary.timings;
        for (stage, seconds) in [
            ("build inputs", busy.build),
            ("solve", busy.solve),
            ("second attempts", busy.refine),
            ("make rows", busy.rows),
            ("write Parquet", busy.write),
            ("from start to end", busy.total),
        ] {
            let record = map.record("stages", stage, summary.solved as f64);
            session.records.push(Record { failed: summary.failed() as f64, seconds, ..record });
        }
    }
    Ok(())
}

/// What checks cost: those of a run by processor time with and without them, those of a sample by operations, since no
/// setting leaves them out.
pub fn trust(session: &mut Session) -> Result<(), BenchError> {
    let map = Map::new(Precision::F64, session)?;
    let all = Checks { second_attempts: true, spot_check: true };
    map.run(all)?;
    let (mut whole, mut attempts, mut checks) = (Vec::new(), Vec::new(), Vec::new());
    let mut counts = [0.0; 3];
    for _ in 0..if session.quick { 1 } else { ROUNDS } {
        let timed = |checks: Checks| -> Result<(Summary, f64), BenchError> {
            let (summary, seconds) = Clock::Processors.once(|| map.run(checks));
            let summary = summary?;
            let a_sample = seconds / summary.solved.max(1) as f64;
            Ok((summary, a_sample))
        };
        let (summary, with_all) = timed(all)?;
        let (_, without_attempts) = timed(Checks { second_attempts: false, ..all })?;
        let (_, without_check) = timed(Checks { spot_check: false, ..all })?;
        whole.push(with_all);
        attempts.push(with_all - without_attempts);
        checks.push(with_all - without_check);
        let checked = summary.spot_check.map_or(0, |check| check.checked);
        counts = [summary.solved as f64, summary.attempts as f64, checked as f64];
    }
    for ((case, seconds), samples) in
        [("the map", whole), ("second attempts", attempts), ("spot check", checks)].into_iter().zip(counts)
    {
        session.records.push(Record { seconds: median(seconds), ..map.record("trust", case, samples) });
    }
    operations(&map, session)
}

/// The middle one.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Of a sample of the map: what error estimate and stability index add.
fn operations(map: &Map, session: &mut Session) -> Result<(), BenchError> {
    let sampler = map.spec.sampler();
    let mut rows = vec![vec![0.0; sampler.value_count()]; COUNTED];
    let every = map.spec.sample_count / COUNTED as u64;
    rows.iter_mut().enumerate().for_each(|(index, row)| sampler.values(index as u64 * every, row));
    let batch = batch_of(&map.plan, COUNTED, &rows);
    let mut lanes = Cpu::new(&map.plan, Precision::F64)?;
    let solved = lanes.solve(&batch)?;
    let passes = (0..COUNTED).map(|at| solved.get(at, Quantity::Iterations)).sum::<f64>() / COUNTED as f64;
    let counted = lanes.count_operations(&batch, 0);
    for (case, operations) in [
        ("a sample", counted.of_sample(passes)),
        // Its pass is a chord step, too.
        ("error estimate", counted.check.total() as f64 - counted.chord.total() as f64),
        ("stability index", counted.stability.total() as f64),
    ] {
        let record = map.record("trust", case, COUNTED as f64);
        session.records.push(Record { operations, passes, ..record });
    }
    Ok(())
}
