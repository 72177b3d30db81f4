//! Spot check: a fixed choice of samples is solved again by a trusted backend and the differences are reported.
//!
//! Samples are solved again beside the run, some at a time as their rows come by; they are compared when it has ended.

use super::columns::ColumnScales;
use super::error::SweepError;
use super::samples::Samples;
use super::stages::StageTime;
use super::tally::InputNames;
use crate::backend::{Backend, BackendFactory};
use crate::model::{Batch, Plan, Quantity, Scene, Solutions, Status};
use crate::model::{rotation_angle, rotation_matrix};
use crate::results::verdict::ELSEWHERE;
use crate::results::{Doubt, DoubtKind, ErrorDistribution, SpotCheck};
use crate::spec::{Sampler, Selection};
use crate::table::Table;
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

    /// How many of a sweep's samples are checked.
    pub fn samples_of(self, sample_count: u64) -> u64 {
        let wanted = (sample_count as f64 * self.share).ceil() as u64;
        wanted.max(self.least).min(self.most.max(self.least)).min(sample_count)
    }
}

/// An error that is so many times the tolerance, and the row's own estimate, is no matter of resolution or round-off.
const WRONG: f64 = 10.0;

/// An estimate is right that is at least the error, to this factor.
const BOUND: f64 = 1.05;
/// Errors of this size are those of the reference, or of round-off; of rows in single precision the second.
const ROUND_OFF: [f64; 2] = [1e-9, 1e-6];
/// The same of derivatives, over their size.
const DERIVATIVE_ROUND_OFF: f64 = 1e-6;

/// Status of a sample whose branch the reference could not tell.
const UNDECIDED: &str = "doubtful";

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
    let selection = Selection::new(sample_count, options.samples_of(sample_count), 0x5b07);
    let (check, groups) = channel();
    let is_single = !single.is_empty();
    let checker = SpotChecker { trusted, groups, checked: Vec::new(), is_single, time };
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

    /// Takes the chosen rows of a part that was there: as far as it tells tips, and without derivatives.
    pub fn offer_table(&mut self, rows: &Table, width: usize) {
        let Some(position) = rows.vector_columns("tip.position") else { return };
        let rotation = rows.vector_columns("tip.rotation");
        let from_rest = rows.column("from_rest").map(|column| &column.values);
        let estimate = rows.column("error_estimate").map(|column| &column.values);
        for (at, (sample, status)) in rows.samples().iter().zip(rows.statuses()).enumerate() {
            let is_other = from_rest.is_some_and(|flags| flags.number(at) != 1.0);
            if is_other || !self.selection.contains(*sample) {
                continue;
            }
            let mut row = vec![f64::NAN; width];
            let mut put = |quantity: Quantity, values: &[f64]| {
                let first = quantity.column();
                row[first..first + values.len()].copy_from_slice(values);
            };
            put(Quantity::TipPosition, &position.map(|column| column.number(at)));
            if let Some(vector) = rotation {
                let matrix = rotation_matrix(vector.map(|column| column.number(at)));
                put(Quantity::TipD1, &matrix.map(|line| line[0]));
                put(Quantity::TipTangent, &matrix.map(|line| line[2]));
            }
            put(Quantity::ErrorEstimate, &[estimate.map_or(f64::NAN, |values| values.number(at))]);
            put(Quantity::Status, &[f64::from(status.code())]);
            self.group.indices.push(*sample);
            self.group.rows.extend(row);
            if self.group.indices.len() == GROUP {
                self.hand_on();
            }
        }
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
    /// Whether rows are written in single precision.
    is_single: bool,
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

    /// Compares; what speaks against the rows beside the differences.
    pub fn compare(mut self, plan: &Plan, sampler: &Sampler) -> (SpotCheck, Vec<Doubt>) {
        let _checking = self.time.enter();
        // Chunks may come in any order.
        self.checked.sort_unstable_by_key(|(index, ..)| *index);
        self.differences(plan, sampler)
    }

    fn differences(&self, plan: &Plan, sampler: &Sampler) -> (SpotCheck, Vec<Doubt>) {
        let indices: Vec<u64> = self.checked.iter().map(|(index, ..)| *index).collect();
        let mut check = SpotCheck { checked: indices.len() as u64, ..SpotCheck::default() };
        if indices.is_empty() {
            return (check, Vec::new());
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
        let mut doubts = Doubts::new(plan, sampler, check.checked);
        for (at, index) in indices.iter().enumerate() {
            let status = ours.status(at);
            // A reference that cannot decide says nothing against a row.
            let is_decided = truth.status(at).name() != UNDECIDED;
            match (status.is_success(), truth.status(at).is_success()) {
                (true, false) if is_decided => {
                    check.only_run += 1;
                    check.only_run_sample.get_or_insert(*index);
                    doubts.add(DoubtKind::RowsPastFold, (*index, status, 0.0));
                }
                (false, true) => {
                    check.only_trusted += 1;
                    doubts.add(DoubtKind::FalseFailures, (*index, status, 0.0));
                }
                _ => {}
            }
            if !(status.is_converged() && truth.status(at).is_converged()) {
                continue;
            }
            check.compared += 1;
            let length = plan.sample_rod(&batch, at).total_length();
            let (p, q) = (ours.vector(at, Quantity::TipPosition), truth.vector(at, Quantity::TipPosition));
            let dp = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / length;
            let angle = rotation_angle(&ours.tip_rotation(at), &truth.tip_rotation(at));
            position.push(dp);
            // A part that was there may not tell it.
            rotation.extend((!angle.is_nan()).then_some(angle));
            // NaN says nothing of the other.
            let far = dp.max(angle);
            let estimate = ours.get(at, Quantity::ErrorEstimate);
            let is_known = !estimate.is_nan();
            let allowed = WRONG * plan.options.tolerance.max(estimate);
            let allowed = if is_known { allowed } else { allowed.max(ELSEWHERE) };
            let succeeded = status.is_success() && truth.status(at).is_success();
            let is_wrong = succeeded && (far.is_nan() || far > allowed);
            check.wrong += u64::from(is_wrong);
            let own = truth.get(at, Quantity::ErrorEstimate).max(0.0);
            let floor = ROUND_OFF[usize::from(self.is_single)] + own;
            if is_wrong && (far.is_nan() || far > ELSEWHERE) {
                doubts.add(DoubtKind::RowsElsewhere, (*index, status, far));
            } else if is_wrong || succeeded && is_known && far > BOUND * estimate + floor {
                doubts.add(DoubtKind::EstimatesBelowError, (*index, status, far / estimate));
            }
            if far > worst {
                worst = far;
                check.worst_sample = Some(*index);
            }
            let (largest, column) = scales.worst_error((&ours, &truth), at, length);
            if largest > worst_derivative {
                worst_derivative = largest;
                check.worst_derivative = plan.derivatives.get(column).map(|derivative| derivative.name.clone());
            }
            let estimate = ours.get(at, Quantity::DerivativeError);
            let own = truth.get(at, Quantity::DerivativeError).max(0.0);
            let is_beyond = estimate < 1.0 && largest > BOUND * estimate + DERIVATIVE_ROUND_OFF + own;
            check.derivatives_beyond += u64::from(is_beyond);
            // On another equilibrium they are those of it.
            if is_beyond && succeeded && far <= allowed {
                doubts.add(DoubtKind::DerivativeEstimatesBelowError, (*index, status, largest / estimate));
            }
            let is_told = plan.derivatives.is_empty() || !ours.derivative(at, 0, 0).is_nan();
            derivative.extend(is_told.then_some(largest));
        }
        check.position = distribution(position);
        check.rotation = distribution(rotation);
        check.derivative = distribution(derivative);
        check.only_run_values =
            check.only_run_sample.map(|index| named_values(plan, sampler, index)).unwrap_or_default();
        check.worst_values = check.worst_sample.map(|index| named_values(plan, sampler, index)).unwrap_or_default();
        (check, doubts.found)
    }
}

/// What speaks against the rows that were checked.
pub(crate) struct Doubts<'a> {
    names: InputNames,
    sampler: &'a Sampler,
    checked: u64,
    pub found: Vec<Doubt>,
}

impl<'a> Doubts<'a> {
    pub fn new(plan: &Plan, sampler: &'a Sampler, checked: u64) -> Doubts<'a> {
        Doubts { names: InputNames::of(plan), sampler, checked, found: Vec::new() }
    }

    pub fn add(&mut self, kind: DoubtKind, seen: (u64, Status, f64)) {
        let at = self.found.iter().position(|doubt| doubt.kind == kind).unwrap_or_else(|| {
            self.found.push(Doubt { of: self.checked, ..Doubt::new(kind) });
            self.found.len() - 1
        });
        self.names.add(&mut self.found[at], self.sampler, seen);
        self.found[at].seen.insert(seen.0);
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
