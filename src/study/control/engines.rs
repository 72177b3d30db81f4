//! The engines of a controller: from rest, and from given base moments at the resolutions that it may need.

use super::inputs::Inputs;
use super::task::Task;
use crate::backend::{Backend, BackendError, Precision};
use crate::model::{Batch, Plan, PlanOptions, Quantity, Solutions, Stepper, Vector};
use crate::study::MakeEngine;
use std::sync::Arc;

/// Resolutions that are tried, and the inputs they are tried at.
pub(super) const STEPS: [usize; 11] = [2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64];
const FEWEST_RK4: usize = 16;
const PROBES: usize = 64;
/// Near a fold the coarse grid on which a search begins may end too far from the fine one; that of so many steps does not.
const CAREFUL_STEPS: usize = 16;
/// Error of the integration over the tolerance of the tip.
pub(super) const SHARE: f64 = 0.5;

/// Looks for equilibria near given base moments.
struct Search {
    plan: Plan,
    engine: Box<dyn Backend>,
    /// For one at a time.
    single: Option<Box<dyn Backend>>,
}

/// The engines of one controller.
pub(super) struct Engines {
    task: Arc<Task>,
    /// From rest; its axes are the inputs, its derivatives by them.
    pub plan: Plan,
    rest: Box<dyn Backend>,
    pub precision: Precision,
    /// At growing resolutions, the last that of the plan or one of more steps.
    searches: Vec<Search>,
    /// The one in use.
    pub resolution: usize,
}

impl Engines {
    /// For a plan and its engine, with as many steps as the tolerance takes.
    pub(crate) fn refined(
        task: Arc<Task>,
        plan: Plan,
        rest: Box<dyn Backend>,
        make: &mut MakeEngine,
    ) -> Result<Engines, BackendError> {
        let precision = rest.info().precision;
        let mut engines = Engines { task, plan, rest, precision, searches: Vec::new(), resolution: 0 };
        engines.refine(make)?;
        Ok(engines)
    }

    /// That in use, for a person.
    pub(crate) fn name(&self) -> String {
        self.searches[self.resolution].engine.info().to_string()
    }

    /// The highest resolution.
    pub(crate) fn finest(&self) -> usize {
        self.searches.len() - 1
    }

    /// More steps, until those of the probes that are solved have small errors, or more steps do not help.
    fn refine(&mut self, make: &mut MakeEngine) -> Result<(), BackendError> {
        let tolerance = self.fine_enough();
        let probes: Vec<Inputs> = (0..PROBES).map(|k| self.task.lattice(k)).collect();
        let mut least = f64::INFINITY;
        for steps in self.resolutions() {
            let plan = self.plan.with_options(PlanOptions { steps, ..self.plan.options });
            let before = std::mem::replace(&mut self.plan, plan);
            let engine = std::mem::replace(&mut self.rest, make(&self.plan)?);
            let solutions = self.solve_from_rest(&probes)?;
            let solved = (0..PROBES).filter(|row| solutions.status(*row).is_success());
            let error = solved.map(|row| solutions.get(row, Quantity::ErrorEstimate)).fold(0.0, f64::max);
            if error > 0.5 * least && self.precision == Precision::F32 {
                (self.plan, self.rest) = (before, engine);
                break;
            }
            least = error;
            if error <= tolerance {
                break;
            }
        }
        self.searches = vec![self.search(self.plan.options.steps, make, None)?];
        Ok(())
    }

    /// Steps that are tried.
    fn resolutions(&self) -> impl Iterator<Item = usize> + use<> {
        let fewest = if self.plan.options.stepper == Stepper::Rk4 { FEWEST_RK4 } else { 0 };
        STEPS.into_iter().filter(move |steps| *steps >= fewest)
    }

    /// One for single searches, ones of fewer steps, and where points may be missed one of more.
    pub(crate) fn add_for_trajectories(
        &mut self,
        many: &mut MakeEngine,
        single: &mut MakeEngine,
    ) -> Result<(), BackendError> {
        let most = self.plan.options.steps;
        self.searches.clear();
        for steps in self.resolutions().filter(|steps| *steps <= most).chain(self.careful_steps()) {
            self.searches.push(self.search(steps, many, Some(single))?);
        }
        self.resolution = self.searches.iter().position(|search| search.plan.options.steps == most).unwrap_or(0);
        Ok(())
    }

    /// One of more steps, for targets that are missed by little.
    pub(crate) fn add_for_targets(&mut self, make: &mut MakeEngine) -> Result<(), BackendError> {
        if let Some(steps) = self.careful_steps() {
            self.searches.push(self.search(steps, make, None)?);
        }
        Ok(())
    }

    fn careful_steps(&self) -> Option<usize> {
        Some(CAREFUL_STEPS).filter(|steps| *steps > self.plan.options.steps)
    }

    fn search(
        &self,
        steps: usize,
        make: &mut MakeEngine,
        single: Option<&mut MakeEngine>,
    ) -> Result<Search, BackendError> {
        let plan = self.plan.with_options(PlanOptions { steps, ..self.plan.options }).with_lone_starts();
        let single = single.map(|make| make(&plan)).transpose()?;
        Ok(Search { engine: make(&plan)?, single, plan })
    }

    /// Error of the integration that is small beside the tolerance, over the rod's length.
    pub(crate) fn fine_enough(&self) -> f64 {
        SHARE * self.task.options.tolerance / self.task.length
    }

    /// Equilibria from rest.
    pub(crate) fn solve_from_rest(&mut self, rows: &[Inputs]) -> Result<Solutions, BackendError> {
        let mut all = Solutions::new(&self.plan, rows.len());
        let size = self.rest.batch_size();
        let task = &self.task;
        for (chunk, rows) in rows.chunks(size).enumerate() {
            let values = |i: usize, row: &mut [f64]| (0..row.len()).for_each(|k| row[k] = task.value(k, rows[i][k]));
            let batch = self.plan.batch(rows.len(), values);
            copy_rows(&mut all, chunk * size, &self.rest.solve(&batch)?);
        }
        Ok(all)
    }

    /// Equilibria near given base moments.
    pub(crate) fn continued(&mut self, rows: &[(Inputs, Vector)], found: &mut Solutions) -> Result<(), BackendError> {
        let Search { plan, engine, single } = &mut self.searches[self.resolution];
        let engine = single.as_mut().filter(|_| rows.len() == 1).unwrap_or(engine);
        let size = engine.batch_size();
        if rows.len() <= size {
            return engine.solve_into(&search_batch(&self.task, plan, rows), found);
        }
        *found = Solutions::new(plan, rows.len());
        for (chunk, rows) in rows.chunks(size).enumerate() {
            copy_rows(found, chunk * size, &engine.solve(&search_batch(&self.task, plan, rows))?);
        }
        Ok(())
    }
}

fn search_batch(task: &Task, plan: &Plan, rows: &[(Inputs, Vector)]) -> Batch {
    let values = |i: usize, row: &mut [f64]| (0..row.len()).for_each(|k| row[k] = task.value(k, rows[i].0[k]));
    let mut batch = plan.batch(rows.len(), values);
    rows.iter().enumerate().for_each(|(i, (_, m0))| plan.set_lone_start(&mut batch, i, *m0));
    batch
}

fn copy_rows(to: &mut Solutions, first: usize, from: &Solutions) {
    (0..from.sample_count()).for_each(|row| to.copy_row(first + row, from, row));
}
