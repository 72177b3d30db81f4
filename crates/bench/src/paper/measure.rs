//! Errors and times of every method over all configurations.
//!
//! A time is that of the second of two calls (a slow call is made once), the median over the repeats of each
//! configuration; methods take turns, so that whatever else the machine does meets all of them.

use super::cases::{CURRENT, Case, Cases, jacobian};
use super::continued::Continued;
use super::methods::{Baseline, baselines, engine, p95};
use super::{BATCH, TOGETHER, TOLERANCE};
use crate::BenchError;
use crate::cli::verify::random::Random;
use rodsweep::backend::Backend;
use crate::baseline::{control_step, damped_least_squares, from_rest, solve};
use rodsweep::lanes::{InstructionSet, Lanes};
use rodsweep::model::{Batch, Plan, Solutions};
use std::hint::black_box;
use std::time::Instant;

/// Tips further than this from the reference's, over the length, lie on another branch.
const OTHER_BRANCH: f64 = 0.02;
/// A call that takes longer needs no other to warm up [s].
const SLOW: f64 = 2e-3;

/// What is timed.
pub const TIMED: [&str; 4] = ["jacobian", "warm", "cold", "control"];

/// Median of the configurations, and what 5 % and 95 % of them stay below [s].
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    pub p5: f64,
    pub median: f64,
    pub p95: f64,
}

/// One method.
pub struct Row {
    pub method: String,
    /// What 95 % of the tip errors are to stay below.
    pub tolerance: f64,
    pub resolution: String,
    /// Configurations that it was measured on.
    pub samples: usize,
    pub other_branch: usize,
    pub failed: usize,
    /// Of the tip and of the worst column: 95 %, largest; over those on the branch from rest.
    pub errors: [[f64; 2]; 2],
    /// As `TIMED`; `None` where a method has no such thing.
    pub times: [Option<Spread>; 4],
    /// Published times [s], as `TIMED`.
    pub published: [Option<f64>; 4],
}

/// Seconds of each repeat, by configuration.
pub struct Stopwatch {
    seconds: Vec<Vec<f64>>,
}

impl Stopwatch {
    pub fn new(cases: usize) -> Stopwatch {
        Stopwatch { seconds: vec![Vec::new(); cases] }
    }

    /// Times a call; one that returns `None` failed and does not count.
    pub fn time<T>(&mut self, case: usize, mut call: impl FnMut() -> Option<T>) {
        let mut once = || {
            let start = Instant::now();
            let done = black_box(call()).is_some();
            (start.elapsed().as_secs_f64(), done)
        };
        let (mut seconds, mut done) = once();
        if seconds < SLOW {
            (seconds, done) = once();
        }
        if done {
            self.seconds[case].push(seconds);
        }
    }

    pub fn spread(self) -> Option<Spread> {
        let median = |mut values: Vec<f64>| -> Option<f64> {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        };
        let mut of_cases: Vec<f64> = self.seconds.into_iter().filter_map(median).collect();
        of_cases.sort_by(f64::total_cmp);
        let at = |share: f64| of_cases.get((share * (of_cases.len().max(1) - 1) as f64).round() as usize).copied();
        Some(Spread { p5: at(0.05)?, median: at(0.5)?, p95: at(0.95)? })
    }
}

/// Errors gathered over configurations.
#[derive(Default)]
pub struct Errors {
    tips: Vec<f64>,
    columns: Vec<f64>,
    pub other_branch: usize,
    pub failed: usize,
}

impl Errors {
    pub fn add(&mut self, [tip, column]: [f64; 2]) {
        if tip > OTHER_BRANCH {
            self.other_branch += 1;
        } else {
            self.tips.push(tip);
            self.columns.push(column);
        }
    }

    pub fn summary(&mut self) -> [[f64; 2]; 2] {
        [&mut self.tips, &mut self.columns].map(|values| {
            let p95 = p95(values);
            [p95, values.last().copied().unwrap_or(f64::NAN)]
        })
    }
}

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

/// The inputs that a step of damped least squares leads to.
pub fn moved(cases: &Cases, values: &[f64], reach: [f64; 3], solutions: &Solutions, sample: usize) -> Vec<f64> {
    let found = jacobian(solutions, sample, cases.inputs.len());
    let moves = damped_least_squares(&found.columns, &cases.scales, cases.length, reach);
    values.iter().zip(&moves).map(|(value, by)| value + by).collect()
}

/// A batch of a plan whose axes are the currents.
pub fn batch(plan: &Plan, rows: &[Vec<f64>]) -> Batch {
    plan.batch(rows.len(), |sample, row| {
        if let Some(values) = rows.get(sample) {
            row.copy_from_slice(values);
        }
    })
}

/// The engine, one configuration a call: from rest every time.
fn time_single(engine: &mut Lanes, cases: &Cases, index: usize, watches: &mut [Stopwatch; 2]) {
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
fn time_batch(engine: &mut Lanes, cases: &Cases, repeats: usize) -> [Option<Spread>; 2] {
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
