//! Spot check: a fixed choice of samples is solved again by a trusted backend and the differences are reported.
//!
//! Samples are solved again beside the run, some at a time as their rows come by; they are compared when it has ended.

use super::columns::ColumnScales;
use super::error::SweepError;
use super::samples::Samples;
use super::stages::StageTime;
use crate::backend::{Backend, BackendFactory};
use crate::model::rotation_angle;
use crate::model::{Batch, Plan, Quantity, Scene, Solutions};
use crate::results::{ErrorDistribution, SpotCheck};
use crate::spec::{Sampler, Selection};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

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

/// Of rods that take the reference 20 ms to 2 s a sample, or 1 to 6 ms in a field that varies. Others take it at most 1 ms.
const LEAST_OF_SLOW: u64 = 64;

impl Default for SpotCheckOptions {
    fn default() -> Self {
        Self { share: 1e-3, least: 256, most: 1024 }
    }
}

impl SpotCheckOptions {
    /// As many as suit a scene: at least 256, or 64 where its rod is too limp or too taut for single passes, or its field
    /// varies in space.
    pub fn of(scene: &Scene) -> SpotCheckOptions {
        let rod = scene.rod();
        let usual = SpotCheckOptions::default();
        let least = if rod.field.is_some() || rod.is_too_limp() { LEAST_OF_SLOW } else { usual.least };
        SpotCheckOptions { least, ..usual }
    }
}

/// An error that is so many times the tolerance, and the row's own estimate, is no matter of resolution or round-off.
const WRONG: f64 = 10.0;

/// Samples that are solved again at a time: few, since the engine waits for them.
const GROUP: usize = 32;

/// Some of the chosen samples: their solution columns, sample after sample.
#[derive(Default)]
struct Group {
    indices: Vec<u64>,
    rows: Vec<f64>,
}

/// What finds the chosen samples of a run, and what solves them again.
pub(crate) fn spot_check<'a>(
    sample_count: u64,
    options: SpotCheckOptions,
    single: Vec<usize>,
    trusted: BackendFactory<'a>,
    time: &'a StageTime,
) -> (SpotSamples, SpotChecker<'a>) {
    let wanted = (sample_count as f64 * options.share).ceil() as u64;
    let wanted = wanted.max(options.least).min(options.most.max(options.least)).min(sample_count);
    let selection = Selection::new(sample_count, wanted, 0x5b07);
    let (check, groups) = channel();
    let checker = SpotChecker { trusted, groups, checked: Vec::new(), time };
    (SpotSamples { selection, group: Group::default(), single, check }, checker)
}

/// Finds the chosen samples among those of a run, and hands them on.
pub(crate) struct SpotSamples {
    selection: Selection,
    group: Group,
    /// Columns that are written in single precision, and therefore checked so.
    single: Vec<usize>,
    check: Sender<Group>,
}

impl SpotSamples {
    /// Samples that are checked.
    pub fn selection(&self) -> Selection {
        self.selection
    }

    /// Takes the chosen ones of some samples.
    pub fn offer(&mut self, samples: &Samples<'_>, solutions: &Solutions) {
        for at in samples.chosen(self.selection) {
            self.take(samples.index(at), solutions, at);
        }
    }

    fn take(&mut self, index: u64, solutions: &Solutions, at: usize) {
        let Group { indices, rows } = &mut self.group;
        indices.push(index);
        let first = rows.len();
        rows.extend((0..solutions.values.column_count()).map(|column| solutions.values.get(at, column)));
        for column in &self.single {
            let value = &mut rows[first + column];
            *value = f64::from(*value as f32);
        }
        if indices.len() == GROUP {
            self.hand_on();
        }
    }

    fn hand_on(&mut self) {
        // A check that has failed takes no more, and says so in the end.
        let _ = self.check.send(std::mem::take(&mut self.group));
    }

    /// All rows have come by.
    pub fn finish(mut self) {
        self.hand_on();
    }
}

/// Solves chosen samples again.
pub(crate) struct SpotChecker<'a> {
    trusted: BackendFactory<'a>,
    groups: Receiver<Group>,
    /// Index, the run's row, the row that is believed.
    checked: Vec<(u64, Vec<f64>, Vec<f64>)>,
    time: &'a StageTime,
}

impl SpotChecker<'_> {
    /// Solves groups until the run has ended, or is given up.
    pub fn solve(mut self, plan: &Plan, sampler: &Sampler, is_given_up: &AtomicBool) -> Result<Self, SweepError> {
        let mut backend: Option<Box<dyn Backend>> = None;
        for group in self.groups.iter().filter(|group| !group.indices.is_empty()) {
            if is_given_up.load(Ordering::Relaxed) {
                break;
            }
            let _checking = self.time.enter();
            let made = match backend.take() {
                Some(made) => made,
                None => (self.trusted)(plan)?,
            };
            let truth = backend.insert(made).solve(&batch_of(plan, sampler, &group.indices))?;
            let width = group.rows.len() / group.indices.len();
            for ((at, index), row) in group.indices.iter().enumerate().zip(group.rows.chunks(width)) {
                let truth = (0..truth.values.column_count()).map(|column| truth.values.get(at, column));
                self.checked.push((*index, row.to_vec(), truth.collect()));
            }
        }
        Ok(self)
    }

    /// Compares.
    pub fn compare(mut self, plan: &Plan, sampler: &Sampler) -> SpotCheck {
        let _checking = self.time.enter();
        // Chunks may come in any order.
        self.checked.sort_unstable_by_key(|(index, ..)| *index);
        self.differences(plan, sampler)
    }

    fn differences(&self, plan: &Plan, sampler: &Sampler) -> SpotCheck {
        let indices: Vec<u64> = self.checked.iter().map(|(index, ..)| *index).collect();
        let mut check = SpotCheck { checked: indices.len() as u64, ..SpotCheck::default() };
        if indices.is_empty() {
            return check;
        }
        let batch = batch_of(plan, sampler, &indices);
        let (mut ours, mut truth) = (Solutions::new(plan, indices.len()), Solutions::new(plan, indices.len()));
        for (at, (_, our_row, true_row)) in self.checked.iter().enumerate() {
            for (to, row) in [(&mut ours, our_row), (&mut truth, true_row)] {
                row.iter().enumerate().for_each(|(column, value)| to.values.set(at, column, *value));
            }
        }
        let scales = ColumnScales::of(plan, &truth);
        let (mut position, mut rotation, mut derivative) = (Vec::new(), Vec::new(), Vec::new());
        let (mut worst, mut worst_derivative) = (-1.0, -1.0);
        for (at, index) in indices.iter().enumerate() {
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
            check.derivatives_beyond += u64::from(largest > ours.get(at, Quantity::DerivativeError));
            derivative.push(largest);
        }
        check.position = distribution(position);
        check.rotation = distribution(rotation);
        check.derivative = distribution(derivative);
        check.only_run_values =
            check.only_run_sample.map(|index| named_values(plan, sampler, index)).unwrap_or_default();
        check.worst_values = check.worst_sample.map(|index| named_values(plan, sampler, index)).unwrap_or_default();
        check
    }
}

fn batch_of(plan: &Plan, sampler: &Sampler, indices: &[u64]) -> Batch {
    plan.batch(indices.len(), |at, row| {
        if let Some(index) = indices.get(at) {
            sampler.values(*index, row);
        }
    })
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
