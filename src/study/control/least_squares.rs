//! Damped least squares for a few scaled inputs and at most seven residuals.

use super::inputs::{Inputs, MOST_INPUTS};

/// Rows of a residual: position, tangent, force of the wall.
pub(super) const ROWS: usize = 7;
/// Number of residuals of a pose without a force.
const POSE: usize = 6;
/// Damping over the mean eigenvalue of J Jᵀ that keeps the direction in which a rod of constant length cannot move from
/// being taken for one in which it can.
pub(super) const LEAST_DAMPING: f64 = 1e-6;

/// Derivatives of a residual's rows by the scaled inputs (m).
pub(super) type Columns = [[f64; ROWS]; MOST_INPUTS];

/// J Jᵀ of the inputs that are free to move.
pub(super) struct NormalEquations<'a> {
    columns: &'a Columns,
    free: [bool; MOST_INPUTS],
    /// Of the residual, as far as any input changes them.
    rows: usize,
    square: [[f64; ROWS]; ROWS],
    mean: f64,
}

impl<'a> NormalEquations<'a> {
    pub(crate) fn new(columns: &'a Columns, free: &[bool; MOST_INPUTS]) -> Self {
        let mut square = [[0.0; ROWS]; ROWS];
        let has = |from: usize| columns.iter().any(|column| column[from..].iter().any(|x| *x != 0.0));
        let rows = if has(POSE) {
            ROWS
        } else if has(3) {
            POSE
        } else {
            3
        };
        for (column, _) in columns.iter().zip(free).filter(|(column, free)| **free && **column != [0.0; ROWS]) {
            for (row, to) in square.iter_mut().enumerate().take(rows) {
                (0..rows).for_each(|other| to[other] += column[row] * column[other]);
            }
        }
        let mean = (0..ROWS).map(|row| square[row][row]).sum::<f64>() / POSE as f64;
        Self { columns, free: *free, rows, square, mean }
    }

    /// J Jᵀ + damping · mean I, factored.
    pub(crate) fn damped(&self, damping: f64) -> Damped<'_> {
        let mut factor = self.square;
        (0..self.rows).for_each(|row| factor[row][row] += damping * self.mean + f64::MIN_POSITIVE);
        factor_symmetric(&mut factor, self.rows);
        Damped { equations: self, factor }
    }
}

/// Normal equations with a damping.
pub(super) struct Damped<'a> {
    equations: &'a NormalEquations<'a>,
    factor: [[f64; ROWS]; ROWS],
}

impl Damped<'_> {
    /// Jᵀ (J Jᵀ + damping · mean I)⁻¹ e: (34), (35).
    pub(crate) fn step(&self, e: &[f64; ROWS]) -> Inputs {
        let NormalEquations { columns, free, rows, .. } = *self.equations;
        let y = solve_symmetric(&self.factor, rows, *e);
        std::array::from_fn(|k| if free[k] { dot(&columns[k], &y) } else { 0.0 })
    }

    /// What of a change of the free inputs the tip does not notice: twice, for what the damping lets through.
    pub(crate) fn unnoticed(&self, mut change: Inputs) -> Inputs {
        for _ in 0..2 {
            let mut moved = [0.0; ROWS];
            for (column, dz) in self.equations.columns.iter().zip(&change) {
                (0..ROWS).for_each(|row| moved[row] += column[row] * dz);
            }
            let noticed = self.step(&moved);
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

/// The factor of a positive definite matrix of so many rows, by Cholesky's method, in its lower half.
fn factor_symmetric(a: &mut [[f64; ROWS]; ROWS], rows: usize) {
    for j in 0..rows {
        for k in 0..j {
            for i in j..rows {
                a[i][j] -= a[i][k] * a[j][k];
            }
        }
        let pivot = a[j][j].max(f64::MIN_POSITIVE).sqrt();
        (j..rows).for_each(|i| a[i][j] /= pivot);
        a[j][j] = pivot;
    }
}

/// What a matrix of this factor takes to `b`; zero beyond its rows.
fn solve_symmetric(a: &[[f64; ROWS]; ROWS], rows: usize, mut b: [f64; ROWS]) -> [f64; ROWS] {
    b[rows..].fill(0.0);
    for i in 0..rows {
        (0..i).for_each(|k| b[i] -= a[i][k] * b[k]);
        b[i] /= a[i][i];
    }
    for i in (0..rows).rev() {
        (i + 1..rows).for_each(|k| b[i] -= a[k][i] * b[k]);
        b[i] /= a[i][i];
    }
    b
}
