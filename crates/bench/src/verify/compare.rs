//! How far two engines are apart, over all samples of all cases, in measures that do not depend on units.

use super::cases::Case;
use rodsweep::model::{MOST_ROWS, Quantity, Solutions, natural_size, rotation_angle};

/// Converged tips further apart than this share of the length lie on different branches.
const OTHER_BRANCH: f64 = 1e-2;

/// The largest differences that a row may show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Tip position over rod length, and tip rotation (rad).
    pub pose: f64,
    /// Base moment over the larger of itself and the moment that bends the rod by one radian.
    pub moment: f64,
    /// Columns (dp/L, w) and d(base moment), over their own norm.
    pub derivative: f64,
    /// Columns smaller than this share of their natural size are measured against that share.
    pub small_column: f64,
}

/// A largest value and where it was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Largest {
    pub error: f64,
    pub case: usize,
    pub sample: usize,
    /// Index of the derivative.
    pub column: usize,
}

impl Largest {
    /// Takes a larger error; what is no number is larger than any.
    fn take(&mut self, error: f64, case: usize, sample: usize, column: usize) {
        let error = if error.is_nan() { f64::INFINITY } else { error };
        if error > self.error {
            *self = Largest { error, case, sample, column };
        }
    }
}

/// Differences of an engine from another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Differences {
    /// Both converged, to the same branch.
    pub compared: usize,
    pub position: Largest,
    pub rotation: Largest,
    pub moment: Largest,
    pub derivative: Largest,
    /// Converged by the other engine only.
    pub gave_up: usize,
    /// Converged where the other engine does not, or to another branch.
    pub other: usize,
    /// The first sample counted in `gave_up` or `other`.
    pub odd: Option<(usize, usize)>,
}

impl Differences {
    /// Adds the samples of a case.
    pub fn add(&mut self, index: usize, case: &Case, found: &Solutions, expected: &Solutions, limits: &Limits) {
        for sample in 0..case.sample_count() {
            match (found.status(sample).is_success(), expected.status(sample).is_success()) {
                (true, true) => self.add_sample((index, sample), case, found, expected, limits),
                (false, true) => self.gave_up += 1,
                // Two engines may word it differently why there is no answer.
                (true, false) => self.other += 1,
                (false, false) => continue,
            }
            if self.odd.is_none() && self.gave_up + self.other > 0 {
                self.odd = Some((index, sample));
            }
        }
    }

    fn add_sample(
        &mut self,
        (index, sample): (usize, usize),
        case: &Case,
        found: &Solutions,
        expected: &Solutions,
        limits: &Limits,
    ) {
        let length = case.plan.sample_rod(&case.batch, sample).total_length();
        let units = &case.plan.units;
        let vector = |solutions: &Solutions, quantity| solutions.vector(sample, quantity);
        let apart = |quantity| distance(&vector(found, quantity), &vector(expected, quantity));
        let position = apart(Quantity::TipPosition) / length;
        if position > OTHER_BRANCH {
            self.other += 1;
            return;
        }
        self.compared += 1;
        self.position.take(position, index, sample, 0);
        let rotation = rotation_angle(&found.tip_rotation(sample), &expected.tip_rotation(sample));
        self.rotation.take(rotation, index, sample, 0);
        let size = norm(&vector(expected, Quantity::BaseMoment)).max(units.moment());
        self.moment.take(apart(Quantity::BaseMoment) / size, index, sample, 0);
        if case.plan.derivatives.is_empty() {
            return;
        }
        let scene = case.scene(sample);
        for (column, derivative) in case.plan.derivatives.iter().enumerate() {
            let rows = |solutions: &Solutions| -> [f64; MOST_ROWS] {
                let unit = [length, 1.0, units.moment()];
                std::array::from_fn(|row| solutions.derivative(sample, column, row) / unit[row / 3])
            };
            let (found, expected) = (rows(found), rows(expected));
            let natural = limits.small_column * natural_size(&scene, derivative.parameter, units);
            for part in [0..6, 6..MOST_ROWS] {
                let (found, expected) = (&found[part.clone()], &expected[part]);
                let error = distance(found, expected);
                let size = norm(expected).max(natural);
                self.derivative.take(if error == 0.0 { 0.0 } else { error / size }, index, sample, column);
            }
        }
    }

    /// The sample to look at first where a limit is exceeded.
    pub fn offender(&self, limits: &Limits) -> Option<(usize, usize)> {
        let measures = [
            (&self.position, limits.pose),
            (&self.rotation, limits.pose),
            (&self.moment, limits.moment),
            (&self.derivative, limits.derivative),
        ];
        let worst = measures.into_iter().max_by(|(a, at), (b, bt)| (a.error / at).total_cmp(&(b.error / bt)));
        let exceeded = worst.filter(|(largest, limit)| largest.error > *limit);
        self.odd.or(exceeded.map(|(largest, _)| (largest.case, largest.sample)))
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
