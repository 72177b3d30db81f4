//! Rows that miss the tolerance or fail, counted as they come by: how many, where, the worst.

use crate::model::{Plan, Status};
use crate::results::{Doubt, DoubtKind};
use crate::spec::Sampler;
use crate::table::Table;

/// Names and units of a sample's swept parameters, and which value of the sample each is.
pub(crate) struct InputNames {
    names: Vec<(String, &'static str)>,
    axes: Vec<usize>,
}

impl InputNames {
    /// Those of a plan.
    pub fn of(plan: &Plan) -> InputNames {
        let driven = plan.axes.iter().enumerate().flat_map(|(axis, all)| all.iter().map(move |one| (axis, one)));
        let (axes, names) = driven.map(|(axis, one)| (axis, (one.name(&plan.scene), one.unit()))).unzip();
        InputNames { names, axes }
    }

    /// A doubt takes in a sample.
    pub fn add(&self, doubt: &mut Doubt, sampler: &Sampler, (sample, status, far): (u64, Status, f64)) {
        let mut row = vec![0.0; sampler.value_count()];
        sampler.values(sample, &mut row);
        let values: Vec<f64> = self.axes.iter().map(|axis| row[*axis]).collect();
        doubt.add(sample, status, far, &self.names, &values);
    }
}

/// Samples of one kind.
struct Kind {
    counts: [u64; Status::ALL.len()],
    low: Vec<f64>,
    high: Vec<f64>,
    far: f64,
    worst: Option<(u64, Status)>,
}

impl Kind {
    fn new(width: usize) -> Kind {
        let (low, high) = (vec![f64::INFINITY; width], vec![f64::NEG_INFINITY; width]);
        Kind { counts: [0; Status::ALL.len()], low, high, far: 0.0, worst: None }
    }

    fn add(&mut self, sample: u64, status: Status, far: f64, row: &[f64]) {
        self.counts[status.code() as usize] += 1;
        for ((low, high), x) in self.low.iter_mut().zip(&mut self.high).zip(row) {
            (*low, *high) = (low.min(*x), high.max(*x));
        }
        // An estimate that is none misses every tolerance.
        let far = if far.is_nan() { f64::INFINITY } else { far };
        if self.worst.is_none() || far > self.far {
            (self.far, self.worst) = (far, Some((sample, status)));
        }
    }

    fn doubt(&self, kind: DoubtKind, of: u64, names: &InputNames, sampler: &Sampler) -> Option<Doubt> {
        let (sample, status) = self.worst?;
        let mut doubt = Doubt::new(kind);
        names.add(&mut doubt, sampler, (sample, status, self.far));
        for (range, axis) in doubt.inputs.iter_mut().zip(&names.axes) {
            (range.from, range.to) = (self.low[*axis], self.high[*axis]);
        }
        doubt.samples = self.counts.iter().sum();
        doubt.of = of;
        let counted = Status::ALL.into_iter().filter(|status| self.counts[status.code() as usize] > 0);
        doubt.statuses =
            counted.map(|status| (status.name().to_owned(), self.counts[status.code() as usize])).collect();
        Some(doubt)
    }
}

/// Samples of a run that miss the tolerance, and those that failed.
pub(crate) struct Tally<'a> {
    sampler: &'a Sampler,
    row: Vec<f64>,
    missed: Kind,
    failed: Kind,
    tolerance: f64,
    /// Where every equilibrium is asked for, an unstable one is no failure.
    every_branch: bool,
}

impl<'a> Tally<'a> {
    pub fn new(sampler: &'a Sampler, tolerance: f64, every_branch: bool) -> Tally<'a> {
        let width = sampler.value_count();
        let (missed, failed) = (Kind::new(width), Kind::new(width));
        Tally { sampler, row: vec![0.0; width], missed, failed, tolerance, every_branch }
    }

    /// Whether a row is of interest here.
    pub fn concerns(&self, status: Status, estimate: f64) -> bool {
        !self.succeeds(status) || estimate.is_nan() || estimate > self.tolerance
    }

    fn succeeds(&self, status: Status) -> bool {
        status.is_success() || self.every_branch && status.is_converged()
    }

    /// Takes in a row that is of interest.
    pub fn add(&mut self, sample: u64, status: Status, estimate: f64) {
        self.sampler.values(sample, &mut self.row);
        if self.succeeds(status) {
            self.missed.add(sample, status, estimate / self.tolerance, &self.row);
        } else {
            self.failed.add(sample, status, 0.0, &self.row);
        }
    }

    /// Takes in the rows of a part that was there.
    pub fn add_table(&mut self, rows: &Table) {
        let estimates = rows.column("error_estimate").map(|column| &column.values);
        for (at, (sample, status)) in rows.samples().iter().zip(rows.statuses()).enumerate() {
            let estimate = estimates.map_or(0.0, |values| values.number(at));
            if self.concerns(*status, estimate) {
                self.add(*sample, *status, estimate);
            }
        }
    }

    /// What was seen among so many samples: those that miss the tolerance, those that failed.
    pub fn doubts(&self, plan: &Plan, of: u64) -> [Option<Doubt>; 2] {
        let names = InputNames::of(plan);
        let kinds = [(&self.missed, DoubtKind::ToleranceMissed), (&self.failed, DoubtKind::TooManyFailures)];
        kinds.map(|(seen, kind)| seen.doubt(kind, of, &names, self.sampler))
    }
}
