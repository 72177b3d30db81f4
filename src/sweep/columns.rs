//! How far two sets of derivatives are apart, each column (dp/L, w) against its own size.

use crate::model::{Derivative, Plan, SMALL_COLUMN, Solutions, natural_size};

/// Sizes that errors of columns are measured by.
pub(crate) struct ColumnScales {
    typical: Vec<f64>,
    natural: Vec<f64>,
    /// A column smaller than this share of its natural size is measured against that.
    small: f64,
}

impl ColumnScales {
    /// Those of solutions that are believed.
    pub fn of(plan: &Plan, truth: &Solutions) -> ColumnScales {
        let natural = |d: &Derivative| natural_size(&plan.scene, d.parameter, &plan.units);
        let natural = plan.derivatives.iter().map(natural).collect();
        ColumnScales { typical: typical_norms(plan, truth), natural, small: SMALL_COLUMN }
    }

    /// Each column against its own size even where that is little, which f64 resolves.
    pub fn of_each(plan: &Plan, truth: &Solutions) -> ColumnScales {
        ColumnScales { small: LEAST_COLUMN, ..ColumnScales::of(plan, truth) }
    }

    /// Largest error of a column of a sample over its norm, at least 1 % of the column's typical norm; and which it is.
    pub fn worst_error(&self, (ours, truth): (&Solutions, &Solutions), at: usize, length: f64) -> (f64, usize) {
        let error = |column: usize| {
            let found = column_of(ours, at, column, length);
            let expected = column_of(truth, at, column, length);
            let difference = norm(&std::array::from_fn(|k| found[k] - expected[k]));
            let scale = norm(&expected).max(0.01 * self.typical[column]).max(self.small * self.natural[column]);
            if scale > 0.0 { difference / scale } else { difference }
        };
        let errors = (0..self.typical.len()).map(|column| (error(column), column));
        errors.fold((0.0, 0), |worst, error| if error.0 > worst.0 { error } else { worst })
    }
}

/// A column smaller than this share of its natural size is round-off.
const LEAST_COLUMN: f64 = 1e-6;

/// One derivative: (dp / L, w).
fn column_of(solutions: &Solutions, at: usize, column: usize, length: f64) -> [f64; 6] {
    std::array::from_fn(|row| solutions.derivative(at, column, row) / if row < 3 { length } else { 1.0 })
}

fn norm(column: &[f64; 6]) -> f64 {
    column.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Root mean square norm of each derivative over the converged samples.
fn typical_norms(plan: &Plan, truth: &Solutions) -> Vec<f64> {
    let length = plan.units.length;
    let converged: Vec<usize> = (0..truth.sample_count()).filter(|at| truth.status(*at).is_converged()).collect();
    let mean = |column: usize| {
        let squares: f64 = converged.iter().map(|at| norm(&column_of(truth, *at, column, length)).powi(2)).sum();
        (squares / converged.len().max(1) as f64).sqrt()
    };
    (0..plan.derivatives.len()).map(mean).collect()
}
