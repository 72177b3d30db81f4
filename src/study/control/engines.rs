//! The engines of a controller: from rest, and from given base moments at the resolutions that it may need.

use super::inputs::Inputs;
use super::task::Task;
use crate::backend::{Backend, BackendError, Precision};
use crate::engines::{cpu_f64, witness};
use crate::model::{Batch, OneSample, Plan, PlanOptions, Quantity, Solutions, Stepper, Vector};
use crate::study::MakeEngine;
use std::sync::Arc;

/// Resolutions that are tried, and the inputs they are tried at.
pub(super) const STEPS: [usize; 11] = [2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64];
const FEWEST_RK4: usize = 16;
const PROBES: usize = 64;
/// Near a fold the coarse grid on which a search begins may end too far from the fine one; that of so many steps does not.
const CAREFUL_STEPS: usize = 16;
/// Tried before DOP853, on the fewest steps: it has three quarters of the stages, and does for rods that bend little.
const QUICK: Stepper = Stepper::Tp7;
/// Error of the integration over the tolerance of the tip.
pub(super) const SHARE: f64 = 0.5;

/// Where errors grow by more powers of e at some of the probes, what the searches leave in doubt is solved from rest again, on
/// so many steps at least: single shooting on few steps loses such rods.
const GROWN: f64 = 4.0;
const GROWN_STEPS: usize = 64;
/// A tip whose error is estimated above this share of the rod's length is none.
pub(super) const LOST: f64 = 1e-3;

/// Looks for equilibria near given base moments.
struct Search {
    plan: Plan,
    engine: Box<dyn Backend>,
    single: Option<Single>,
}

/// The same for one at a time.
struct Single {
    sample: OneSample,
    engine: Box<dyn Backend>,
}

/// The engines of one controller.
pub(super) struct Engines {
    task: Arc<Task>,
    /// From rest; its axes are the inputs, its derivatives by them.
    pub plan: Plan,
    rest: Box<dyn Backend>,
    /// From rest on more steps, for rods on which errors grow.
    careful: Option<(Plan, Box<dyn Backend>)>,
    pub precision: Precision,
    /// At growing resolutions, the last that of the plan or one of more steps.
    searches: Vec<Search>,
    /// The one in use.
    pub resolution: usize,
}

/// The error estimate of a row (over the rod's length, or rad); infinite where it is no success.
pub(super) fn estimate(solutions: &Solutions, row: usize) -> f64 {
    if solutions.status(row).is_success() { solutions.get(row, Quantity::ErrorEstimate) } else { f64::INFINITY }
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
        let mut engines = Engines { task, plan, rest, careful: None, precision, searches: Vec::new(), resolution: 0 };
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
        self.searches = vec![self.search(self.plan.options, make, None)?];
        let batch = self.plan.batch(PROBES, |i, row| values(&self.task, &probes[i], row));
        if (0..PROBES).any(|i| self.plan.sample_rod(&batch, i).growth() > GROWN) {
            let steps = self.plan.options.steps.max(GROWN_STEPS);
            let plan = self.plan.with_options(PlanOptions { steps, ..self.plan.options });
            let engine = cpu_f64(&plan)?;
            self.careful = Some((plan, engine));
        }
        Ok(())
    }

    /// Solves rows in doubt again, from rest on more steps; those that are then solved are taken.
    fn solve_doubtful(&mut self, rows: &[Inputs], all: &mut Solutions, most: f64) -> Result<(), BackendError> {
        let Some((plan, engine)) = &mut self.careful else { return Ok(()) };
        // Also doubtful where the estimate is NaN.
        let is_good = |row: &usize| estimate(all, *row) <= most;
        let doubtful: Vec<usize> = (0..rows.len()).filter(|row| !is_good(row)).collect();
        for doubtful in doubtful.chunks(engine.batch_size()) {
            let batch = plan.batch(doubtful.len(), |i, row| values(&self.task, &rows[doubtful[i]], row));
            let found = engine.solve(&batch)?;
            for (i, row) in doubtful.iter().enumerate() {
                if estimate(&found, i) < estimate(all, *row) {
                    all.copy_row(*row, &found, i);
                }
            }
        }
        Ok(())
    }

    /// The equilibrium from rest as the reference finds it.
    pub(crate) fn by_the_reference(&self, row: &Inputs) -> Result<Solutions, BackendError> {
        let task = &*self.task;
        witness(&self.plan).solve(&self.plan.batch(1, |_, to| values(task, row, to)))
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
        let own = self.plan.options;
        let quick = PlanOptions { stepper: QUICK, steps: STEPS[0], ..own };
        let quick = Some(quick).filter(|_| own.stepper == Stepper::Dop853);
        let of_steps = self.resolutions().filter(|steps| *steps <= own.steps).chain(self.careful_steps());
        let all: Vec<_> = quick.into_iter().chain(of_steps.map(|steps| PlanOptions { steps, ..own })).collect();
        self.resolution = all.iter().position(|options| *options == own).unwrap_or(0);
        self.searches.clear();
        for options in all {
            self.searches.push(self.search(options, many, Some(single))?);
        }
        Ok(())
    }

    /// One of more steps, for targets that are missed by little.
    pub(crate) fn add_for_targets(&mut self, make: &mut MakeEngine) -> Result<(), BackendError> {
        if let Some(steps) = self.careful_steps() {
            self.searches.push(self.search(PlanOptions { steps, ..self.plan.options }, make, None)?);
        }
        Ok(())
    }

    fn careful_steps(&self) -> Option<usize> {
        Some(CAREFUL_STEPS).filter(|steps| *steps > self.plan.options.steps)
    }

    fn search(
        &self,
        options: PlanOptions,
        make: &mut MakeEngine,
        single: Option<&mut MakeEngine>,
    ) -> Result<Search, BackendError> {
        let plan = self.plan.with_options(options).with_lone_starts();
        let single = match single {
            Some(make) => Some(Single { sample: plan.one_sample(), engine: make(&plan)? }),
            None => None,
        };
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
        for (chunk, rows) in rows.chunks(size).enumerate() {
            let batch = self.plan.batch(rows.len(), |i, row| values(&self.task, &rows[i], row));
            copy_rows(&mut all, chunk * size, &self.rest.solve(&batch)?);
        }
        let most = self.fine_enough();
        self.solve_doubtful(rows, &mut all, most)?;
        Ok(all)
    }

    /// Equilibria near given base moments; of rods on which errors grow, those from rest where the search is lost.
    pub(crate) fn continued(&mut self, rows: &[(Inputs, Vector)], found: &mut Solutions) -> Result<(), BackendError> {
        self.search_near(rows, found)?;
        if self.careful.is_some() {
            let inputs: Vec<Inputs> = rows.iter().map(|(z, _)| *z).collect();
            self.solve_doubtful(&inputs, found, self.fine_enough())?;
        }
        Ok(())
    }

    fn search_near(&mut self, rows: &[(Inputs, Vector)], found: &mut Solutions) -> Result<(), BackendError> {
        let Search { plan, engine, single } = &mut self.searches[self.resolution];
        if let (Some(Single { sample, engine }), [(z, m0)]) = (single, rows) {
            sample.set(|row| values(&self.task, z, row));
            sample.start_at(*m0);
            return engine.solve_into(sample.batch(), found);
        }
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

/// Values of scaled inputs.
fn values(task: &Task, z: &Inputs, row: &mut [f64]) {
    row.iter_mut().enumerate().for_each(|(k, value)| *value = task.value(k, z[k]));
}

fn search_batch(task: &Task, plan: &Plan, rows: &[(Inputs, Vector)]) -> Batch {
    let mut batch = plan.batch(rows.len(), |i, row| values(task, &rows[i].0, row));
    rows.iter().enumerate().for_each(|(i, (_, m0))| plan.set_lone_start(&mut batch, i, *m0));
    batch
}

fn copy_rows(to: &mut Solutions, first: usize, from: &Solutions) {
    (0..from.sample_count()).for_each(|row| to.copy_row(first + row, from, row));
}
