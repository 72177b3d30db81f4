//! An adaptive integrator of order twelve: Gragg's midpoint rule, extrapolated (Bulirsch and Stoer).
//!
//! It shares no coefficient with the engines' Runge-Kutta methods.

/// Midpoint results combined in one step, with 2, 4, ... substeps.
const ROWS: usize = 6;
/// On the way to an equilibrium so many do where they are good enough.
const LEAST_ROWS: usize = 4;
/// Steps shorter than this share of the rod mean that the solution has run away.
const SMALLEST_STEP: f64 = 1e-9;

/// The right-hand side of an autonomous-by-arc-length system, and how its errors are measured.
pub(super) trait Field {
    /// dy/ds at arc length s.
    fn slope(&self, s: f64, y: &[f64], dy: &mut [f64]);
    /// Largest error over the size it may have relative to; `y` gives the sizes.
    fn measure(&self, y: &[f64], error: &[f64]) -> f64;
}

/// The solution cannot be continued.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RunAway;

/// Integrator with its step size and scratch space.
#[derive(Clone, Debug)]
pub(super) struct Extrapolation {
    tolerance: f64,
    /// Midpoint results of a step, at least; more only as long as it is not good enough.
    least_rows: usize,
    /// Step to try next.
    step: f64,
    /// Estimated errors of the steps so far, summed up.
    spent: f64,
    slope0: Vec<f64>,
    slope: Vec<f64>,
    point: Vec<f64>,
    older: Vec<f64>,
    newer: Vec<f64>,
    table: [Vec<f64>; ROWS],
    error: Vec<f64>,
}

impl Extrapolation {
    /// `tolerance` is the error allowed in one step.
    pub(super) fn new(tolerance: f64) -> Self {
        let (slope0, slope, point, older, newer, error) = Default::default();
        let table = Default::default();
        Self { tolerance, least_rows: ROWS, step: 0.25, spent: 0.0, slope0, slope, point, older, newer, table, error }
    }

    /// For paths, of which only the end must be sharp: a step takes no more than its tolerance asks for.
    pub(super) fn on_the_way(tolerance: f64) -> Self {
        Self { least_rows: LEAST_ROWS, ..Self::new(tolerance) }
    }

    /// Allows no larger error in one step than this.
    pub(super) fn tighten(&mut self, tolerance: f64) {
        self.tolerance = self.tolerance.min(tolerance);
    }

    /// Estimated errors of all steps since the last call, summed up.
    pub(super) fn take_spent(&mut self) -> f64 {
        std::mem::take(&mut self.spent)
    }

    /// Integrates y from s = start to s = end.
    pub(super) fn advance(&mut self, field: &impl Field, start: f64, end: f64, y: &mut [f64]) -> Result<(), RunAway> {
        for buffer in [&mut self.slope0, &mut self.slope, &mut self.point, &mut self.older, &mut self.newer] {
            buffer.resize(y.len(), 0.0);
        }
        self.error.resize(y.len(), 0.0);
        self.table.iter_mut().for_each(|row| row.resize(y.len(), 0.0));
        let mut s = start;
        while s < end {
            let rest = end - s;
            // Equal steps rather than long ones and a tiny one.
            let steps = (rest / self.step).ceil();
            let (h, is_last) = (rest / steps, steps == 1.0);
            let (error, order) = self.try_step(field, s, h, y);
            // No error at all allows the largest growth, an undefined one the smallest.
            let growth = 0.9 * (self.tolerance / error).powf(1.0 / order);
            let proposal = h * if growth.is_nan() { 0.1 } else { growth.clamp(0.1, 3.0) };
            if error <= self.tolerance {
                y.iter_mut().zip(&self.table[0]).for_each(|(y, increment)| *y += increment);
                s = if is_last { end } else { s + h };
                self.spent += error;
                // A step cut short says nothing against longer ones.
                self.step = if h < self.step { self.step.max(proposal) } else { proposal };
            } else {
                self.step = proposal;
                if self.step.is_nan() || self.step < SMALLEST_STEP {
                    return Err(RunAway);
                }
            }
        }
        Ok(())
    }

    /// Leaves the increment over one step in `table[0]` and returns its estimated error, and of which order that is.
    fn try_step(&mut self, field: &impl Field, s: f64, h: f64, y: &[f64]) -> (f64, f64) {
        field.slope(s, y, &mut self.slope0);
        let mut estimate = (f64::NAN, 1.0);
        for row in 0..ROWS {
            self.midpoint(field, s, h, 2 * (row + 1), y);
            std::mem::swap(&mut self.table[row], &mut self.newer);
            // Aitken and Neville, in powers of the squared substep; the newest row climbs from column to column.
            for coarser in (0..row).rev() {
                let ratio = ((row + 1) as f64 / (coarser + 1) as f64).powi(2);
                let (low, high) = self.table.split_at_mut(coarser + 1);
                for ((coarse, fine), error) in low[coarser].iter_mut().zip(&high[0]).zip(&mut self.error) {
                    let better = fine + (fine - *coarse) / (ratio - 1.0);
                    *error = better - fine;
                    *coarse = better;
                }
            }
            if row + 1 >= self.least_rows {
                estimate = (field.measure(y, &self.error), (2 * row + 1) as f64);
                if estimate.0 <= self.tolerance {
                    break;
                }
            }
        }
        estimate
    }

    /// Gragg's midpoint rule: the increment over h in `newer`.
    fn midpoint(&mut self, field: &impl Field, s: f64, h: f64, substeps: usize, y: &[f64]) {
        let step = h / substeps as f64;
        self.older.fill(0.0);
        for (newer, slope) in self.newer.iter_mut().zip(&self.slope0) {
            *newer = step * slope;
        }
        for k in 1..substeps {
            for ((point, y), newer) in self.point.iter_mut().zip(y).zip(&self.newer) {
                *point = y + newer;
            }
            field.slope(s + k as f64 * step, &self.point, &mut self.slope);
            for (older, slope) in self.older.iter_mut().zip(&self.slope) {
                *older += 2.0 * step * slope;
            }
            std::mem::swap(&mut self.older, &mut self.newer);
        }
    }
}
