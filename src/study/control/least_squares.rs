//! Damped least squares for a few scaled inputs and at most six residuals.

use super::inputs::{Inputs, MOST_INPUTS};

/// Rows of a residual: position, tangent.
pub(super) const ROWS: usize = 6;
/// Damping over the mean eigenvalue of J Jᵀ that keeps the direction in which a rod of constant length cannot move from
/// being taken for one in which it can.
pub(super) const LEAST_DAMPING: f64 = 1e-6;

/// Derivatives of a residual's rows by the scaled inputs (m).
pub(super) type Columns = [[f64; ROWS]; MOST_INPUTS];

/// J Jᵀ of the inputs that are free to move.
pub(super) struct NormalEquations<'a> {
    columns: &'a Columns,
    free: [bool; MOST_INPUTS],
    square: [[f64; ROWS]; ROWS],
    mean: f64,
}

impl<'a> NormalEquations<'a> {
    pub(crate) fn new(columns: &'a Columns, free: &[bool; MOST_INPUTS]) -> Self {
        let mut square = [[0.0; ROWS]; ROWS];
        for (column, _) in columns.iter().zip(free).filter(|(_, free)| **free) {
            for (row, to) in square.iter_mut().enumerate() {
                (0..ROWS).for_each(|other| to[other] += column[row] * column[other]);
            }
        }
        let mean = (0..ROWS).map(|row| square[row][row]).sum::<f64>() / ROWS as f64;
        Self { columns, free: *free, square, mean }
    }

    /// Jᵀ (J Jᵀ + damping · mean I)⁻¹ e: (34), (35).
    pub(crate) fn step(&self, damping: f64, e: &[f64; ROWS]) -> Inputs {
        let mut damped = self.square;
        (0..ROWS).for_each(|row| damped[row][row] += damping * self.mean + f64::MIN_POSITIVE);
        let y = solve_symmetric(damped, *e);
        std::array::from_fn(|k| if self.free[k] { dot(&self.columns[k], &y) } else { 0.0 })
    }

    /// What of a change of the free inputs the tip does not notice: twice, for what the damping lets through.
    pub(crate) fn unnoticed(&self, mut change: Inputs) -> Inputs {
        for _ in 0..2 {
            let mut moved = [0.0; ROWS];
            for (column, dz) in self.columns.iter().zip(&change) {
                (0..ROWS).for_each(|row| moved[row] += column[row] * dz);
            }
            let noticed = self.step(LEAST_DAMPING, &moved);
            (0..MOST_INPUTS).for_each(|k| change[k] -= noticed[k]);
        }
        change
    }
}

pub(super) fn norm2(v: &(impl AsRef<[f64]> + ?Sized)) -> f64 {
    v.as_ref().iter().map(|x| x * x).sum()
}

pub(super) fn dot(a: &[f64; ROWS], b: &[f64; ROWS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Cholesky's method for a positive definite matrix.
fn solve_symmetric(mut a: [[f64; ROWS]; ROWS], mut b: [f64; ROWS]) -> [f64; ROWS] {
    for j in 0..ROWS {
        for k in 0..j {
            for i in j..ROWS {
                a[i][j] -= a[i][k] * a[j][k];
            }
        }
        let pivot = a[j][j].max(f64::MIN_POSITIVE).sqrt();
        (j..ROWS).for_each(|i| a[i][j] /= pivot);
        a[j][j] = pivot;
    }
    for i in 0..ROWS {
        (0..i).for_each(|k| b[i] -= a[i][k] * b[k]);
        b[i] /= a[i][i];
    }
    for i in (0..ROWS).rev() {
        (i + 1..ROWS).for_each(|k| b[i] -= a[k][i] * b[k]);
        b[i] /= a[i][i];
    }
    b
}
