//! Errors and times of every method over all configurations.
//!
//! Methods take turns, so that whatever else the machine does meets all of them.

use super::cases::{CURRENT, Case, Cases, batch, jacobian, moved};
use super::continued::Continued;
use super::methods::{Baseline, baselines, engine};
use super::rows::{Errors, Row, Spread, Stopwatch};
use super::settings::{BATCH, TOGETHER, TOLERANCE};
use crate::baseline::{control_step, from_rest, solve};
use crate::error::BenchError;
use crate::random::Random;
use rodsweep::backend::Backend;
use rodsweep::cpu::{Cpu, InstructionSet};

/// A baseline with what it starts from.
struct Contender<'a> {
    baseline: &'a Baseline,
    errors: Errors,
    samples: usize,
    /// Unknowns at the configuration and at the one near by; `None` where it is not to be timed.
    starts: Vec<Option<[Vec<f64>; 2]>>,
    watches: [Stopwatch; 4],
}

impl<'a> Contender<'a> {
    fn new(baseline: &'a Baseline, cases: &Cases) -> Contender<'a> {
        let mut errors = Errors::default();
        let mut samples = 0;
        let mut start = |(index, case): (usize, &Case)| {
            if index % baseline.every != 0 {
                return None;
            }
            samples += 1;
            let method = &*baseline.method;
            let here = from_rest(method, &case.rod).ok();
            let found = here.as_ref().and_then(|here| method.jacobian(&case.rod, here, &cases.inputs));
            let near = from_rest(method, &case.near).ok();
            match (here, near, found) {
                (Some(here), Some(near), Some(found)) => {
                    errors.add(cases.errors(case, &found));
                    Some([here, near])
                }
                _ => {
                    errors.failed += 1;
                    None
                }
            }
        };
        let starts = cases.list.iter().enumerate().map(&mut start).collect();
        let watches = std::array::from_fn(|_| Stopwatch::new(cases.list.len()));
        Contender { baseline, errors, samples, starts, watches }
    }

    fn time(&mut self, index: usize, cases: &Cases) {
        let Some([here, near]) = &self.starts[index] else { return };
        let (case, method) = (&cases.list[index], &*self.baseline.method);
        let [jacobian, warm, cold, control] = &mut self.watches;
        jacobian.time(index, || method.jacobian(&case.rod, here, &cases.inputs));
        warm.time(index, || method.jacobian(&case.rod, &solve(method, &case.rod, near)?, &cases.inputs));
        cold.time(index, || method.jacobian(&case.rod, &from_rest(method, &case.rod).ok()?, &cases.inputs));
        control.time(index, || control_step(method, &case.rod, here, &cases.inputs, case.reach));
    }

    fn row(mut self) -> Row {
        let [jacobian, control] = self.baseline.published;
        Row {
            method: self.baseline.name.clone(),
            tolerance: self.baseline.tolerance,
            resolution: self.baseline.resolution.clone(),
            samples: self.samples,
            other_branch: self.errors.other_branch,
            failed: self.errors.failed,
            errors: self.errors.summary(),
            times: self.watches.map(Stopwatch::spread),
            published: [jacobian, None, None, control],
        }
    }
}

/// The engine, one configuration a call: from rest every time.
fn time_single(engine: &mut Cpu, cases: &Cases, index: usize, watches: &mut [Stopwatch; 2]) {
    let case = &cases.list[index];
    let inputs = batch(&cases.plan, std::slice::from_ref(&case.values));
    watches[0].time(index, || engine.solve(&inputs).ok());
    watches[1].time(index, || {
        let solutions = engine.solve(&inputs).ok()?;
        let next = moved(cases, &case.values, case.reach, &solutions, 0);
        Some(batch(&cases.plan, &[next]))
    });
}

/// The engine over many configurations at once, seconds for each.
fn time_batch(engine: &mut Cpu, cases: &Cases, repeats: usize) -> [Option<Spread>; 2] {
    let mut random = Random(cases.random);
    let currents = cases.plan.axes.len();
    let rows: Vec<Vec<f64>> =
        (0..BATCH).map(|_| (0..currents).map(|_| random.within(-CURRENT, CURRENT)).collect()).collect();
    let inputs = batch(&cases.plan, &rows);
    let mut watches = [Stopwatch::new(repeats), Stopwatch::new(repeats)];
    for repeat in 0..repeats {
        watches[0].time(repeat, || engine.solve(&inputs).ok());
        watches[1].time(repeat, || {
            let solutions = engine.solve(&inputs).ok()?;
            let reach = cases.list[0].reach;
            let next: Vec<Vec<f64>> =
                rows.iter().enumerate().map(|(at, values)| moved(cases, values, reach, &solutions, at)).collect();
            Some(batch(&cases.plan, &next))
        });
    }
    let each = |Spread { p5, median, p95 }: Spread| {
        let [p5, median, p95] = [p5, median, p95].map(|seconds| seconds / BATCH as f64);
        Spread { p5, median, p95 }
    };
    watches.map(|watch| watch.spread().map(each))
}

/// Every method's row, baselines first.
pub fn measure(cases: &Cases, repeats: usize) -> Result<Vec<Row>, BenchError> {
    let baselines = baselines(cases);
    let mut engine = engine(cases)?;
    let mut contenders: Vec<Contender> = baselines.iter().map(|baseline| Contender::new(baseline, cases)).collect();
    let rows: Vec<Vec<f64>> = cases.list.iter().map(|case| case.values.clone()).collect();
    let solutions = engine.solve(&batch(&cases.plan, &rows))?;
    let mut errors = Errors::default();
    for (sample, case) in cases.list.iter().enumerate() {
        if solutions.status(sample).is_success() {
            errors.add(cases.errors(case, &jacobian(&solutions, sample, cases.inputs.len())));
        } else {
            errors.failed += 1;
        }
    }
    let options = engine.plan().options;
    let mut continued = [
        Continued::new(cases, options, 1, InstructionSet::for_one())?,
        Continued::new(cases, options, TOGETHER, InstructionSet::available()[0])?,
    ];
    let mut single = [Stopwatch::new(cases.list.len()), Stopwatch::new(cases.list.len())];
    for _ in 0..repeats {
        for index in 0..cases.list.len() {
            contenders.iter_mut().for_each(|contender| contender.time(index, cases));
            time_single(&mut engine, cases, index, &mut single);
            continued.iter_mut().for_each(|continued| continued.time(index));
        }
    }
    let batched = time_batch(&mut engine, cases, repeats);
    let mut rows: Vec<Row> = contenders.into_iter().map(Contender::row).collect();
    let summary = errors.summary();
    for (what, [cold, control]) in [("one a call", single.map(Stopwatch::spread)), ("batches of 4096", batched)] {
        rows.push(Row {
            method: format!("this program, {what}"),
            tolerance: TOLERANCE,
            resolution: format!("{}, {} steps", engine.plan().options.stepper.name(), engine.plan().options.steps),
            samples: cases.list.len(),
            other_branch: errors.other_branch,
            failed: errors.failed,
            errors: summary,
            times: [None, None, cold, control],
            published: [None; 4],
        });
    }
    for continued in continued {
        rows.push(continued.row()?);
    }
    Ok(rows)
}
