//! Answers on grids that are refined until they agree.

use crate::error::BenchError;
use rodsweep::backend::BackendError;
use rodsweep::engines::{cpu_f64, witness};
use rodsweep::model::{
    Batch, DerivativeScale, Plan, PlanOptions, Quantity, Solutions, Stepper, natural_size, rotation_angle,
};
use rodsweep::spec::SweepSpec;

/// Rows of a sweep that are looked at.
pub const ROWS: u64 = 16;
/// Tips further apart lie on different branches.
pub const OTHER_BRANCH: f64 = 1e-2;
/// Refinements of the truth.
const REFINEMENTS: [usize; 5] = [1, 2, 4, 8, 16];
/// Grids that are no further apart than this agree: by tips, and by columns.
const SHARP: f64 = 1e-11;
const SHARP_COLUMN: f64 = 1e-7;
/// Steps of its coarsest grid.
const STEPS: usize = 16;
/// In f64 columns smaller than this share of their natural size are measured against that; f32 resolves less.
pub const SMALL_IN_DOUBLE: f64 = 1e-5;

/// Rows of a sweep that are taken for right, and how sure that is.
pub struct Truth {
    pub plan: Plan,
    pub batch: Batch,
    pub solutions: Solutions,
    /// The distance of the last two grids, for each row: by the tip, and by each column.
    pub doubt: Vec<(f64, Vec<f64>)>,
}

impl Truth {
    pub fn of(spec: &SweepSpec) -> Result<Truth, BenchError> {
        let options = PlanOptions {
            tolerance: 1e-12,
            stepper: Stepper::Dop853,
            steps: STEPS,
            derivative_scale: DerivativeScale::BARE,
            ..PlanOptions::default()
        };
        let plan = Plan::new(
            &spec.scene,
            &spec.axis_parameters(),
            &spec.wrt,
            PlanOptions { base_moment_rows: false, ..options },
        )?;
        let sampler = spec.sampler();
        let batch = plan.batch(ROWS as usize, |at, row| sampler.values(at as u64, row));
        let mut truth = Truth { solutions: Solutions::new(&plan, ROWS as usize), plan, batch, doubt: Vec::new() };
        for refinement in REFINEMENTS {
            let options = PlanOptions { refinement, ..truth.plan.options };
            let finer = cpu_f64(&truth.plan.with_options(options))?.solve(&truth.batch)?;
            let coarser = std::mem::replace(&mut truth.solutions, finer);
            if refinement == REFINEMENTS[0] {
                continue;
            }
            truth.doubt = (0..ROWS as usize).map(|at| truth.apart(&coarser, at)).collect();
            let is_sure = |at: usize| {
                let (tip, columns) = &truth.doubt[at];
                !truth.solutions.status(at).is_success() || *tip < SHARP && columns.iter().all(|c| *c < SHARP_COLUMN)
            };
            if (0..ROWS as usize).all(is_sure) {
                break;
            }
        }
        Ok(truth)
    }

    /// Whether no row has an answer to compare with.
    pub fn is_unknown(&self) -> bool {
        (0..ROWS as usize).all(|at| !self.solutions.status(at).is_success())
    }

    /// How far another answer is from the truth: by the tip, and by each column.
    fn apart(&self, other: &Solutions, at: usize) -> (f64, Vec<f64>) {
        if !(other.status(at).is_success() && self.solutions.status(at).is_success()) {
            return (f64::INFINITY, vec![f64::INFINITY; self.plan.derivatives.len()]);
        }
        let length = self.plan.sample_rod(&self.batch, at).total_length();
        let (p, q) = (other.vector(at, Quantity::TipPosition), self.solutions.vector(at, Quantity::TipPosition));
        let tip = distance(&p, &q) / length;
        let tip = tip.max(rotation_angle(&other.tip_rotation(at), &self.solutions.tip_rotation(at)));
        let column =
            |index| self.column_error((at, index), (length, SMALL_IN_DOUBLE), |row| other.derivative(at, index, row));
        (tip, (0..self.plan.derivatives.len()).map(column).collect())
    }

    /// The error of a column (dp/L, w) over its norm, at least a `small` share of its natural size.
    pub fn column_error(
        &self,
        (at, index): (usize, usize),
        (length, small): (f64, f64),
        value: impl Fn(usize) -> f64,
    ) -> f64 {
        let unit = |row: usize| if row < 3 { length } else { 1.0 };
        let found: [f64; 6] = std::array::from_fn(|row| value(row) / unit(row));
        let right: [f64; 6] = std::array::from_fn(|row| self.solutions.derivative(at, index, row) / unit(row));
        let parameter = self.plan.derivatives[index].parameter;
        let natural = small * natural_size(&self.plan.scene, parameter, &self.plan.units);
        let size = right.iter().map(|x| x * x).sum::<f64>().sqrt().max(natural);
        let error = distance(&found, &right);
        if error == 0.0 { 0.0 } else { error / size }
    }

    /// Tips that are not those of the reference, of so many.
    pub fn witness(&self) -> Result<(u64, u64), BackendError> {
        let reference = witness(&self.plan).solve(&self.batch)?;
        let mut counts = (0, 0);
        for at in 0..ROWS as usize {
            if reference.status(at).is_success() && self.solutions.status(at).is_success() {
                let (tip, _) = self.apart(&reference, at);
                let allowed = reference.get(at, Quantity::ErrorEstimate) + self.doubt[at].0 + 1e-9;
                counts = (counts.0 + u64::from(tip > allowed && tip < OTHER_BRANCH), counts.1 + 1);
            }
        }
        Ok(counts)
    }
}

pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
