//! One pass over the rod from the equilibrium's own base moment, with the columns by that moment: what a step of Newton's
//! method takes, and nothing around it.

use super::clock::Clock;
use super::engines::{Engine, Place};
use super::problem::{Judged, Problem};
use super::session::Session;
use crate::bench_file::Work;
use crate::error::BenchError;
use crate::record::Record;
use rodsweep::backend::{BackendError, BackendKind};
use rodsweep::lanes::Lanes;
use rodsweep::model::{PassColumn, PassEnd, PassEnds, PlanOptions};

/// One number of steps: the tip's error that 95 % stay below.
pub fn point(
    problem: &Problem,
    engine: Engine,
    options: PlanOptions,
    session: &mut Session,
) -> Result<f64, BenchError> {
    let Place::Cpu(set) = engine.place else {
        let (what, remedy) = ("a lone pass".into(), "measure it on the CPU".into());
        return Err(BackendError::Unsupported { backend: BackendKind::Gpu, what, remedy }.into());
    };
    let truth = problem.passes()?;
    let plan = problem.plan(Work::Pass, options)?;
    let count = problem.rows.len();
    let batch = problem.batch(Work::Pass, count)?;
    let lanes = Lanes::with_instruction_set(&plan, engine.precision, set)?;
    let mut ends = PassEnds::new(count);
    lanes.pass(&batch, &mut ends)?;
    let effort = session.effort;
    let timing = session.one_thread.install(|| Clock::Processor.time(effort, || lanes.pass(&batch, &mut ends)));
    let mut judged = Judged::default();
    for (sample, truth) in truth.iter().enumerate() {
        judge(&ends.end(sample), truth, problem.length(sample), &mut judged);
    }
    let mut record = Record {
        operations: lanes.count_operations(&batch, 0).alone.total() as f64,
        passes: 1.0,
        ..engine.record(problem.spec.name.as_str(), Work::Pass, options, (timing, count))
    };
    judged.write(&mut record);
    session.records.push(record);
    Ok(judged.p95())
}

/// Errors of a pass against the reference's from the same base moment: of the tip over the length, of the worst column
/// (dp/L and w) and of all three together, relative.
fn judge(found: &PassEnd, truth: &PassEnd, length: f64, judged: &mut Judged) {
    let numbers = |PassColumn { w, dp, .. }: &PassColumn| {
        let [x, y, z] = dp.map(|x| x / length);
        [x, y, z, w[0], w[1], w[2]]
    };
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let (mut worst, mut squares, mut whole) = (0.0f64, 0.0, 0.0);
    for (found, truth) in found.columns.iter().zip(&truth.columns) {
        let (found, truth) = (numbers(found), numbers(truth));
        let apart = norm(&std::array::from_fn::<f64, 6, _>(|k| found[k] - truth[k]));
        worst = worst.max(apart / norm(&truth));
        squares += apart * apart;
        whole += norm(&truth).powi(2);
    }
    let apart = norm(&std::array::from_fn::<f64, 3, _>(|k| found.position[k] - truth.position[k]));
    if apart.is_finite() {
        judged.add(apart / length, worst, (squares / whole).sqrt());
    } else {
        judged.failed += 1;
    }
}
