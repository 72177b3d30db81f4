//! Gauss's elimination with row pivoting in a band: the almost block diagonal system of multiple shooting.

/// Entries below and above the diagonal that a row may have.
const BELOW: usize = 8;
const ABOVE: usize = 3;
/// Entries of a column, with those that exchanges of rows bring in above the band.
const HEIGHT: usize = 2 * BELOW + ABOVE + 1;

/// A square matrix with few diagonals, by columns; after `factor` its two factors.
#[derive(Clone, Debug)]
pub(super) struct Band {
    size: usize,
    columns: Vec<[f64; HEIGHT]>,
}

/// A band matrix taken apart: L has ones on its diagonal, rows were exchanged on the way.
#[derive(Clone, Debug)]
pub(super) struct Factored {
    band: Band,
    /// Row that took the place of row k.
    pivots: Vec<usize>,
}

impl Band {
    pub(super) fn new(size: usize) -> Self {
        Self { size, columns: vec![[0.0; HEIGHT]; size] }
    }

    fn at(&self, row: usize, column: usize) -> f64 {
        self.columns[column][BELOW + ABOVE + row - column]
    }

    fn at_mut(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.columns[column][BELOW + ABOVE + row - column]
    }

    /// Sets an entry within the band.
    pub(super) fn set(&mut self, row: usize, column: usize, value: f64) {
        debug_assert!(row <= column + BELOW && column <= row + ABOVE);
        *self.at_mut(row, column) = value;
    }

    /// Elimination; `None` for a singular matrix, or one that is not finite.
    pub(super) fn factor(mut self) -> Option<Factored> {
        let mut pivots = Vec::with_capacity(self.size);
        let mut last = 0;
        for k in 0..self.size {
            let lowest = (k + BELOW).min(self.size - 1);
            let pivot = (k..=lowest).max_by(|a, b| self.at(*a, k).abs().total_cmp(&self.at(*b, k).abs()))?;
            let value = self.at(pivot, k);
            if value == 0.0 || !value.is_finite() {
                return None;
            }
            last = last.max((pivot + ABOVE).min(self.size - 1));
            if pivot != k {
                for column in k..=last {
                    let (a, b) = (self.at(k, column), self.at(pivot, column));
                    *self.at_mut(k, column) = b;
                    *self.at_mut(pivot, column) = a;
                }
            }
            pivots.push(pivot);
            for row in k + 1..=lowest {
                *self.at_mut(row, k) /= value;
            }
            for column in k + 1..=last {
                let factor = self.at(k, column);
                if factor != 0.0 {
                    for row in k + 1..=lowest {
                        *self.at_mut(row, column) -= self.at(row, k) * factor;
                    }
                }
            }
        }
        Some(Factored { band: self, pivots })
    }
}

impl Factored {
    /// Sign of the determinant, and the logarithm of its size.
    pub(super) fn determinant(&self) -> (f64, f64) {
        let diagonal = || (0..self.band.size).map(|k| self.band.at(k, k));
        let exchanges = self.pivots.iter().enumerate().filter(|(k, pivot)| k != *pivot).count();
        let negative = diagonal().filter(|x| *x < 0.0).count() + exchanges;
        let sign = if negative % 2 == 0 { 1.0 } else { -1.0 };
        (sign, diagonal().map(|x| x.abs().ln()).sum())
    }

    /// A^-1 b, in place.
    pub(super) fn solve(&self, b: &mut [f64]) {
        let (band, size) = (&self.band, self.band.size);
        for k in 0..size {
            b.swap(k, self.pivots[k]);
            for row in k + 1..=(k + BELOW).min(size - 1) {
                b[row] -= band.at(row, k) * b[k];
            }
        }
        for k in (0..size).rev() {
            b[k] /= band.at(k, k);
            for row in k.saturating_sub(BELOW + ABOVE)..k {
                b[row] -= band.at(row, k) * b[k];
            }
        }
    }

    /// A^-T b, in place.
    pub(super) fn solve_transposed(&self, b: &mut [f64]) {
        let (band, size) = (&self.band, self.band.size);
        for k in 0..size {
            for row in k.saturating_sub(BELOW + ABOVE)..k {
                b[k] -= band.at(row, k) * b[row];
            }
            b[k] /= band.at(k, k);
        }
        for k in (0..size).rev() {
            for row in k + 1..=(k + BELOW).min(size - 1) {
                b[k] -= band.at(row, k) * b[row];
            }
            b.swap(k, self.pivots[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// Numbers without a pattern in [-1, 1).
    fn numbers(count: usize) -> Vec<f64> {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        (0..count).map(|_| next()).collect()
    }

    /// A diagonal that is next to nothing asks for exchanges of rows.
    #[test]
    fn solves_as_a_full_matrix_does() {
        const SIZE: usize = 45;
        let entries = numbers(SIZE * SIZE);
        let mut band = Band::new(SIZE);
        let mut full = DMatrix::zeros(SIZE, SIZE);
        for row in 0..SIZE {
            for column in row.saturating_sub(BELOW)..=(row + ABOVE).min(SIZE - 1) {
                let value = entries[row * SIZE + column] * if row == column { 1e-9 } else { 1.0 };
                band.set(row, column, value);
                full[(row, column)] = value;
            }
        }
        let factored = band.factor().expect("regular");
        let (sign, size) = factored.determinant();
        assert!((sign * size.exp() / full.determinant() - 1.0).abs() <= 1e-9);
        let x = DVector::from_vec(numbers(SIZE));
        for (matrix, transposed) in [(full.clone(), false), (full.transpose(), true)] {
            let mut b: Vec<f64> = (matrix * &x).iter().copied().collect();
            if transposed {
                factored.solve_transposed(&mut b)
            } else {
                factored.solve(&mut b)
            }
            let error = b.iter().zip(x.iter()).map(|(b, x)| (b - x).abs()).fold(0.0, f64::max);
            assert!(error <= 1e-10, "{error:e}");
        }
    }

    #[test]
    fn a_singular_matrix_has_no_factors() {
        assert!(Band::new(3).factor().is_none());
    }
}
