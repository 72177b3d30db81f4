//! The CPU engine as control uses it: from a known equilibrium to the next, without the way from rest.

use super::cases::{Cases, batch, jacobian, moved};
use super::rows::{Errors, Row, Spread, Stopwatch};
use super::settings::TOLERANCE;
use crate::error::BenchError;
use rodsweep::backend::{Backend, BackendError, Precision};
use rodsweep::cpu::{Cpu, InstructionSet};
use rodsweep::model::{OneSample, Plan, PlanOptions, Quantity, Solutions, Vector};

/// Row of a derivative where that of the base moment begins.
const MOMENT_ROW: usize = 6;

/// So many configurations a call.
pub struct Continued<'a> {
    method: String,
    cases: &'a Cases,
    plan: Plan,
    sample: OneSample,
    engine: Cpu,
    at_once: usize,
    /// Of every configuration, and of those near by.
    here: Solutions,
    near: Solutions,
    found: Solutions,
    watches: [Stopwatch; 2],
}

impl<'a> Continued<'a> {
    pub fn new(
        cases: &'a Cases,
        options: PlanOptions,
        at_once: usize,
        set: InstructionSet,
    ) -> Result<Self, BackendError> {
        let from_rest = cases.plan.with_options(options);
        let mut engine = Cpu::new(&from_rest, Precision::F64)?;
        let mut solve = |values: &dyn Fn(usize) -> Vec<f64>| {
            let rows: Vec<Vec<f64>> = (0..cases.list.len()).map(values).collect();
            engine.solve(&batch(&from_rest, &rows))
        };
        let here = solve(&|k| cases.list[k].values.clone())?;
        let near = solve(&|k| cases.list[k].near_values.clone())?;
        let plan = from_rest.with_lone_starts();
        let method = match at_once {
            1 => "this program, continued, one a call".into(),
            count => format!("this program, continued, {count} a call"),
        };
        let at_once = at_once.min(cases.list.len());
        let watch = || Stopwatch::new(cases.list.len() / at_once);
        Ok(Self {
            method,
            cases,
            engine: Cpu::with_instruction_set(&plan, Precision::F64, set)?,
            sample: plan.one_sample(),
            plan,
            at_once,
            here,
            near,
            found: Solutions::default(),
            watches: [watch(), watch()],
        })
    }

    fn search(&mut self, rows: &[Vec<f64>], starts: &[Vector]) -> Option<()> {
        if let ([values], [m0]) = (rows, starts) {
            self.sample.set(|row| row.copy_from_slice(values));
            self.sample.start_at(*m0);
            return self.engine.solve_into(self.sample.batch(), &mut self.found).ok();
        }
        let mut batch = batch(&self.plan, rows);
        starts.iter().enumerate().for_each(|(row, m0)| self.plan.set_lone_start(&mut batch, row, *m0));
        self.engine.solve_into(&batch, &mut self.found).ok()
    }

    /// Equilibria and Jacobians of configurations from `first` on, from the base moments near by.
    fn warm(&mut self, first: usize, count: usize) -> Option<()> {
        let rows: Vec<Vec<f64>> =
            self.cases.list[first..first + count].iter().map(|case| case.values.clone()).collect();
        let starts: Vec<Vector> = (first..first + count).map(|at| self.near.vector(at, Quantity::BaseMoment)).collect();
        self.search(&rows, &starts)
    }

    /// One step of control for each: damped least squares, then equilibrium and Jacobian there.
    fn control(&mut self, first: usize, count: usize) -> Option<()> {
        let (mut rows, mut starts) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for at in first..first + count {
            let case = &self.cases.list[at];
            let next = moved(self.cases, &case.values, case.reach, &self.here, at);
            let mut m0 = self.here.vector(at, Quantity::BaseMoment);
            for (k, (to, from)) in next.iter().zip(&case.values).enumerate() {
                (0..3).for_each(|a| m0[a] += self.here.derivative(at, k, MOMENT_ROW + a) * (to - from));
            }
            rows.push(next);
            starts.push(m0);
        }
        self.search(&rows, &starts)
    }

    /// Times the call that configuration `index` is the first of.
    pub fn time(&mut self, index: usize) {
        let (group, count) = (index / self.at_once, self.at_once);
        if !index.is_multiple_of(count) || index + count > self.cases.list.len() {
            return;
        }
        let [mut warm, mut control] = std::mem::replace(&mut self.watches, [Stopwatch::new(0), Stopwatch::new(0)]);
        warm.time(group, || self.warm(index, count));
        control.time(group, || self.control(index, count));
        self.watches = [warm, control];
    }

    pub fn row(mut self) -> Result<Row, BenchError> {
        let mut errors = Errors::default();
        for (at, case) in self.cases.list.iter().enumerate() {
            match self.warm(at, 1) {
                Some(()) if self.found.status(0).is_success() => {
                    errors.add(self.cases.errors(case, &jacobian(&self.found, 0, self.cases.inputs.len())));
                }
                _ => errors.failed += 1,
            }
        }
        let options = self.plan.options;
        let count = self.at_once as f64;
        let each =
            |Spread { p5, median, p95 }: Spread| Spread { p5: p5 / count, median: median / count, p95: p95 / count };
        let [warm, control] = self.watches.map(|watch| watch.spread().map(each));
        Ok(Row {
            method: self.method,
            tolerance: TOLERANCE,
            resolution: format!("{}, {} steps", options.stepper.name(), options.steps),
            samples: self.cases.list.len(),
            other_branch: errors.other_branch,
            failed: errors.failed,
            errors: errors.summary(),
            times: [None, warm, None, control],
            published: [None; 4],
        })
    }
}
