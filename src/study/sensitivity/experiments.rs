//! Which measurements tell parameters best: Fisher information, D-optimal choice, observability.
//!
//! A measurement is a matrix: what it sees, over its noise, by the scaled parameters. F = Σ JᵀJ over measurements.

use nalgebra::DMatrix;

/// What the determinant of a choice that does not yet determine everything begins with.
const PRIOR: f64 = 1e-9;
/// An exchange has to gain at least this.
const GAIN: f64 = 1e-9;
/// Rounds of exchanges.
const ROUNDS: usize = 100;

/// A choice of measurements.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Choice {
    /// Indices of the candidates, ascending.
    pub rows: Vec<usize>,
    /// Logarithm of the determinant of the Fisher information.
    pub log_determinant: f64,
}

/// Measurements that could be made: each some numbers over their noise, by the scaled parameters.
///
/// ```
/// use rodsweep::study::sensitivity::Measurements;
///
/// let mut candidates = Measurements::new(2);
/// for row in [[1.0, 0.0], [0.9, 0.1], [0.0, 1.0]] {
///     candidates.push(&row);
/// }
/// assert_eq!(candidates.choose(&[0, 1, 2], 2).unwrap().rows, [0, 2]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Measurements {
    parameters: usize,
    matrices: Vec<DMatrix<f64>>,
}

impl Measurements {
    /// None yet, of so many parameters.
    pub fn new(parameters: usize) -> Measurements {
        Measurements { parameters, matrices: Vec::new() }
    }

    /// Adds a measurement: for each of its numbers the slopes by every parameter, over the noise.
    pub fn push(&mut self, slopes: &[f64]) {
        let numbers = slopes.len() / self.parameters.max(1);
        self.matrices.push(DMatrix::from_row_slice(numbers, self.parameters, &slopes[..numbers * self.parameters]));
    }

    /// Fisher information of some of them, row by row.
    pub fn information(&self, rows: &[usize]) -> Vec<Vec<f64>> {
        let matrix = fisher(&self.matrices, rows);
        matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
    }

    /// Logarithm of its determinant; minus infinity where they do not determine every parameter.
    pub fn log_determinant(&self, rows: &[usize]) -> f64 {
        log_determinant(&fisher(&self.matrices, rows))
    }

    /// Observability indices of some of them.
    pub fn observability(&self, rows: &[usize]) -> Observability {
        let numbers = rows.iter().map(|row| self.matrices[*row].nrows()).sum();
        Observability::new(&fisher(&self.matrices, rows), numbers)
    }

    /// The D-optimal `count` of the allowed ones: chosen greedily, then exchanged one for another until nothing gains.
    /// `None` where so many are not allowed, or none are asked for.
    pub fn choose(&self, allowed: &[usize], count: usize) -> Option<Choice> {
        choose(&self.matrices, allowed, count)
    }
}

/// Observability indices of a design (Nahvi and Hollerbach 1996), of the singular values s_1 ≥ .. ≥ s_p of all
/// measurements together, m numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Observability {
    /// (s_1 ⋯ s_p)^(1/p) / √m: the volume of what is seen.
    pub volume: f64,
    /// s_p / s_1: the inverse condition number.
    pub roundness: f64,
    /// s_p: the weakest direction.
    pub weakest: f64,
    /// s_p² / s_1: the noise amplification.
    pub amplification: f64,
}

/// Σ JᵀJ of the chosen measurements.
pub(super) fn fisher(candidates: &[DMatrix<f64>], rows: &[usize]) -> DMatrix<f64> {
    let parameters = candidates.first().map_or(0, DMatrix::ncols);
    rows.iter()
        .fold(DMatrix::zeros(parameters, parameters), |sum, row| sum + candidates[*row].transpose() * &candidates[*row])
}

/// Logarithm of the determinant; minus infinity where it is not positive.
pub(super) fn log_determinant(information: &DMatrix<f64>) -> f64 {
    match information.clone().cholesky() {
        Some(cholesky) => 2.0 * cholesky.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>(),
        None => f64::NEG_INFINITY,
    }
}

/// Chooses `count` of the allowed candidates so that the determinant of the Fisher information is large: greedily, then
/// by exchanges of one for another until none gains (Fedorov 1972).
pub(super) fn choose(candidates: &[DMatrix<f64>], allowed: &[usize], count: usize) -> Option<Choice> {
    let parameters = candidates.first()?.ncols();
    if count == 0 || count > allowed.len() {
        return None;
    }
    // Scaled by what everything together tells, so that the beginning is no matter of units.
    let scale = fisher(candidates, allowed).diagonal().map(|x| PRIOR * x.max(f64::MIN_POSITIVE));
    let mut information = DMatrix::from_diagonal(&scale);
    let mut rows: Vec<usize> = Vec::new();
    for _ in 0..count {
        let inverse = information.clone().cholesky()?.inverse();
        let gain = |row: &usize| log_gain(&candidates[*row], &inverse);
        let free = allowed.iter().filter(|row| !rows.contains(row));
        let best = free
            .copied()
            .map(|row| (row, gain(&row)))
            .reduce(|best, next| if next.1 > best.1 { next } else { best })?;
        information += candidates[best.0].transpose() * &candidates[best.0];
        rows.push(best.0);
    }
    exchange(candidates, allowed, &mut rows, &DMatrix::from_diagonal(&scale));
    rows.sort_unstable();
    let determinant = if count * candidates[0].nrows() < parameters {
        f64::NEG_INFINITY
    } else {
        log_determinant(&fisher(candidates, &rows))
    };
    Some(Choice { rows, log_determinant: determinant })
}

/// log det(I + J M⁻¹ Jᵀ): what a measurement adds to the logarithm of the determinant of M.
fn log_gain(candidate: &DMatrix<f64>, inverse: &DMatrix<f64>) -> f64 {
    let count = candidate.nrows();
    log_determinant(&(DMatrix::identity(count, count) + candidate * inverse * candidate.transpose()))
}

fn exchange(candidates: &[DMatrix<f64>], allowed: &[usize], rows: &mut [usize], prior: &DMatrix<f64>) {
    let mut value = log_determinant(&(fisher(candidates, rows) + prior));
    for _ in 0..ROUNDS {
        let mut has_gained = false;
        for place in 0..rows.len() {
            let others: Vec<usize> =
                rows.iter().enumerate().filter(|(k, _)| *k != place).map(|(_, row)| *row).collect();
            let without = fisher(candidates, &others) + prior;
            let Some(cholesky) = without.clone().cholesky() else { continue };
            let (inverse, base) = (cholesky.inverse(), log_determinant(&without));
            let free = allowed.iter().filter(|row| !others.contains(row));
            let gains = free.map(|row| (*row, base + log_gain(&candidates[*row], &inverse)));
            let Some((row, found)) = gains.reduce(|best, next| if next.1 > best.1 { next } else { best }) else {
                continue;
            };
            if found > value + GAIN {
                (rows[place], value, has_gained) = (row, found, true);
            }
        }
        if !has_gained {
            return;
        }
    }
}

impl Observability {
    /// Of Fisher information and the numbers that were measured.
    pub(super) fn new(information: &DMatrix<f64>, numbers: usize) -> Observability {
        let mut squares: Vec<f64> = information.clone().symmetric_eigenvalues().iter().map(|x| x.max(0.0)).collect();
        squares.sort_by(|a, b| b.total_cmp(a));
        let singular: Vec<f64> = squares.iter().map(|x| x.sqrt()).collect();
        let (largest, least) = (singular.first().copied().unwrap_or(0.0), singular.last().copied().unwrap_or(0.0));
        let logarithms: f64 = singular.iter().map(|x| x.ln()).sum();
        Observability {
            volume: (logarithms / singular.len() as f64).exp() / (numbers as f64).sqrt(),
            roundness: least / largest,
            weakest: least,
            amplification: least * least / largest,
        }
    }
}
