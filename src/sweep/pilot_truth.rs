//! The truth that a pilot measures errors against: answers on grids that are refined until two of them agree.

use super::columns::ColumnScales;
use crate::backend::{BackendError, BackendFactory};
use crate::model::{Batch, Blocks, Plan, PlanOptions, Quantity, Solutions, Stepper, rotation_angle};

/// Steps and refinements of the truth that errors are measured against. It ends where two of them agree.
const TRUTH_STEPS: usize = 8;
const TRUTH_REFINEMENTS: [usize; 5] = [1, 2, 4, 8, 16];
/// They agree where tips differ by less than this share of the tolerance, and columns by less than this share of theirs.
const AGREEMENT: f64 = 0.02;
/// Tips are never asked to agree better, nor is a smaller error measured.
pub const ROUND_OFF: f64 = 1e-12;
/// The truth takes at least so many times the steps of what is measured against it.
const TRUTH_LEAD: usize = 2;
/// What is asked of it at least.
const TRUTH_TOLERANCE: f64 = 1e-12;

/// Answers on grids that are refined until two of them agree.
pub struct Truth<'a> {
    plan: &'a Plan,
    pub batch: &'a Batch,
    pub factory: BackendFactory<'a>,
    /// Of each sample the answer on its finest grid.
    pub solutions: Solutions,
    /// Of each sample: how far its last two answers are apart, by their tips and by their columns.
    pub doubt: Vec<(f64, f64)>,
    /// Grids so far.
    grids: usize,
}

impl<'a> Truth<'a> {
    pub fn new(plan: &'a Plan, batch: &'a Batch, factory: BackendFactory<'a>) -> Truth<'a> {
        let count = batch.sample_count();
        let (solutions, doubt) = (Solutions::new(plan, count), vec![(0.0, 0.0); count]);
        Truth { plan, batch, factory, solutions, doubt, grids: 0 }
    }

    /// Refines until the truth is ahead of so many steps and two grids agree, or there is no finer one. Where it is ahead, only
    /// samples on which two grids do not agree yet are solved on a finer one.
    pub fn lead(&mut self, steps: usize) -> Result<(), BackendError> {
        while let Some(refinement) = TRUTH_REFINEMENTS.get(self.grids) {
            let is_ahead = self.grids > 1 && TRUTH_STEPS * TRUTH_REFINEMENTS[self.grids - 1] >= TRUTH_LEAD * steps;
            if is_ahead && self.agrees() {
                break;
            }
            let is_partial = is_ahead && self.has_arrived();
            let (plan, usual) = (self.plan, self.plan.options);
            let tolerance = usual.tolerance.min(TRUTH_TOLERANCE);
            let (stepper, steps, refinement) = (Stepper::Dop853, TRUTH_STEPS, *refinement);
            let options = PlanOptions { stepper, steps, refinement, tolerance, ..usual };
            let left: Vec<usize> = (0..self.doubt.len()).filter(|at| !(is_partial && self.is_sure(*at))).collect();
            let finer = (self.factory)(&plan.with_options(options))?.solve(&gathered(self.batch, &left))?;
            if self.grids == 0 {
                self.solutions = finer;
            } else {
                let coarser = self.solutions.clone();
                left.iter().enumerate().for_each(|(from, to)| self.solutions.copy_row(*to, &finer, from));
                let scales = ColumnScales::of_each(plan, &self.solutions);
                for at in left {
                    self.doubt[at] = apart(plan, self.batch, &scales, (&coarser, &self.solutions), at);
                }
            }
            self.grids += 1;
        }
        Ok(())
    }

    fn is_sure(&self, at: usize) -> bool {
        let PlanOptions { tolerance, derivative_tolerance, .. } = self.plan.options;
        let (tip, columns) = self.doubt[at];
        tip <= (AGREEMENT * tolerance).max(ROUND_OFF) && columns <= AGREEMENT * derivative_tolerance
    }

    fn agrees(&self) -> bool {
        // Grids on which no sample arrives agree on nothing.
        self.has_arrived() && (0..self.doubt.len()).all(|at| self.is_sure(at))
    }

    fn has_arrived(&self) -> bool {
        (0..self.doubt.len()).any(|at| self.solutions.status(at).is_success())
    }
}

/// Some samples of a batch.
fn gathered(batch: &Batch, some: &[usize]) -> Batch {
    let column_count = batch.inputs.column_count();
    let mut inputs = Blocks::new(column_count, some.len());
    for (to, from) in some.iter().enumerate() {
        (0..column_count).for_each(|column| inputs.set(to, column, batch.inputs.get(*from, column)));
    }
    Batch { inputs, bad: some.iter().map(|at| batch.bad[*at]).collect() }
}

/// How far two answers to a sample are apart: by the tip, over the rod's length or in radians, and by the worst column over its
/// norm. Nothing where both failed, infinitely where one has.
pub fn apart(plan: &Plan, batch: &Batch, scales: &ColumnScales, (a, b): (&Solutions, &Solutions), at: usize) -> (f64, f64) {
    match (a.status(at).is_success(), b.status(at).is_success()) {
        (true, true) => {}
        (false, false) => return (0.0, 0.0),
        _ => return (f64::INFINITY, f64::INFINITY),
    }
    let length = plan.sample_rod(batch, at).total_length();
    let (p, q) = (a.vector(at, Quantity::TipPosition), b.vector(at, Quantity::TipPosition));
    let dp = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / length;
    let tip = dp.max(rotation_angle(&a.tip_rotation(at), &b.tip_rotation(at)));
    (tip, scales.worst_error((a, b), at, length).0)
}
