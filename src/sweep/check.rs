//! Spot check: a fixed choice of samples is solved again by a trusted backend and the differences are reported.

use super::columns::ColumnScales;
use super::error::SweepError;
use crate::backend::BackendFactory;
use crate::model::rotation_angle;
use crate::model::{Plan, Quantity, Solutions};
use crate::results::{ErrorDistribution, SpotCheck};
use crate::spec::Sampler;
use crate::spec::Selection;

/// How many samples are checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotCheckOptions {
    /// Share of all samples.
    pub share: f64,
    /// At least so many, or all that there are.
    pub least: u64,
    /// At most so many.
    pub most: u64,
}

impl Default for SpotCheckOptions {
    fn default() -> Self {
        Self { share: 1e-3, least: 64, most: 1024 }
    }
}

/// An error that is so many times the tolerance, and the row's own estimate, is no matter of resolution or round-off.
const WRONG: f64 = 10.0;

/// Samples of a run set aside for the check.
pub(crate) struct SpotSamples {
    selection: Selection,
    indices: Vec<u64>,
    /// Solution columns, sample after sample.
    rows: Vec<f64>,
    /// Columns that are written in single precision, and therefore checked so.
    single: Vec<usize>,
}

impl SpotSamples {
    pub fn new(sample_count: u64, options: SpotCheckOptions, single: Vec<usize>) -> SpotSamples {
        let wanted = (sample_count as f64 * options.share).ceil() as u64;
        let wanted = wanted.max(options.least).min(options.most.max(options.least)).min(sample_count);
        let selection = Selection::new(sample_count, wanted, 0x5b07);
        SpotSamples { selection, indices: Vec::new(), rows: Vec::new(), single }
    }

    /// Samples that are checked.
    pub fn selection(&self) -> Selection {
        self.selection
    }

    pub fn offer(&mut self, index: u64, solutions: &Solutions, at: usize) {
        if self.selection.contains(index) {
            self.indices.push(index);
            let first = self.rows.len();
            self.rows.extend((0..solutions.values.column_count()).map(|column| solutions.values.get(at, column)));
            for column in &self.single {
                let value = &mut self.rows[first + column];
                *value = f64::from(*value as f32);
            }
        }
    }

    /// Solves the chosen samples again and compares.
    pub fn compare(self, plan: &Plan, sampler: &Sampler, trusted: BackendFactory) -> Result<SpotCheck, SweepError> {
        let mut check = SpotCheck { checked: self.indices.len() as u64, ..SpotCheck::default() };
        if self.indices.is_empty() {
            return Ok(check);
        }
        let mut backend = trusted(plan)?;
        let batch = plan.batch(self.indices.len(), |at, row| {
            if let Some(index) = self.indices.get(at) {
                sampler.values(*index, row);
            }
        });
        let truth = backend.solve(&batch)?;
        let mut ours = Solutions::new(plan, self.indices.len());
        let width = ours.values.column_count();
        for (at, value) in self.rows.iter().enumerate() {
            ours.values.set(at / width, at % width, *value);
        }
        let scales = ColumnScales::of(plan, &truth);
        let (mut position, mut rotation, mut derivative) = (Vec::new(), Vec::new(), Vec::new());
        let (mut worst, mut worst_derivative) = (-1.0, -1.0);
        for (at, index) in self.indices.iter().enumerate() {
            match (ours.status(at).is_success(), truth.status(at).is_success()) {
                (true, false) => {
                    check.only_run += 1;
                    check.only_run_sample.get_or_insert(*index);
                }
                (false, true) => check.only_trusted += 1,
                _ => {}
            }
            if !(ours.status(at).is_converged() && truth.status(at).is_converged()) {
                continue;
            }
            check.compared += 1;
            let length = plan.sample_rod(&batch, at).total_length();
            let (p, q) = (ours.vector(at, Quantity::TipPosition), truth.vector(at, Quantity::TipPosition));
            let dp = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / length;
            let angle = rotation_angle(&ours.tip_rotation(at), &truth.tip_rotation(at));
            position.push(dp);
            rotation.push(angle);
            let allowed = WRONG * plan.options.tolerance.max(ours.get(at, Quantity::ErrorEstimate));
            let succeeded = ours.status(at).is_success() && truth.status(at).is_success();
            check.wrong += u64::from(succeeded && !(dp <= allowed && angle <= allowed));
            if dp.max(angle) > worst {
                worst = dp.max(angle);
                check.worst_sample = Some(*index);
            }
            let (largest, column) = scales.worst_error((&ours, &truth), at, length);
            if largest > worst_derivative {
                worst_derivative = largest;
                check.worst_derivative = plan.derivatives.get(column).map(|derivative| derivative.name.clone());
            }
            derivative.push(largest);
        }
        check.position = distribution(position);
        check.rotation = distribution(rotation);
        check.derivative = distribution(derivative);
        check.only_run_values =
            check.only_run_sample.map(|index| named_values(plan, sampler, index)).unwrap_or_default();
        check.worst_values = check.worst_sample.map(|index| named_values(plan, sampler, index)).unwrap_or_default();
        Ok(check)
    }
}

/// A sample's swept parameters by name.
pub(crate) fn named_values(plan: &Plan, sampler: &Sampler, index: u64) -> Vec<(String, f64)> {
    let mut row = vec![0.0; sampler.value_count()];
    sampler.values(index, &mut row);
    let named = |(axis, value): (&Vec<_>, f64)| {
        axis.iter()
            .map(move |parameter: &crate::model::Parameter| (parameter.name(&plan.scene), value))
            .collect::<Vec<_>>()
    };
    plan.axes.iter().zip(row).flat_map(named).collect()
}

pub(crate) fn distribution(mut errors: Vec<f64>) -> ErrorDistribution {
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| match errors.len() {
        0 => 0.0,
        count => errors[((count - 1) as f64 * share).ceil() as usize],
    };
    ErrorDistribution { median: at(0.5), p95: at(0.95), max: at(1.0) }
}
