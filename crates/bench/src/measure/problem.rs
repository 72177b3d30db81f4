//! Samples of a bench file with the reference's answers, and the errors of an engine against them.

use crate::bench_file::{BenchSpec, Work};
use crate::error::BenchError;
use crate::random::Random;
use crate::record::{Errors, NONE, Record};
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{
    Batch, Parameter, Plan, PlanOptions, Quantity, Solutions, Start, Stepper, Vector, rotation_angle,
};
use rodsweep::reference::Reference;
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::with_anchors;

/// A warm start lies so far off along every axis, as a share of its range: the next point of a grid of 61.
pub const NEAR: f64 = 1.0 / 60.0;
/// Tips further than this from the reference's, over the length, lie on another branch.
const OTHER_BRANCH: f64 = 0.02;
/// A column is measured against its own size, or this share of its largest over the samples.
pub const SMALL_COLUMN: f64 = 1e-3;
/// Steps of the engine that finds base moments.
const FINE: usize = 48;
/// Samples of the sweep whose anchors are taken.
const MANY: u64 = 1 << 20;

/// Samples that have an answer.
pub struct Problem<'a> {
    pub spec: &'a BenchSpec,
    /// Values of the axes, those with an answer first.
    pub rows: Vec<Vec<f64>>,
    /// Values near by.
    pub near: Vec<Vec<f64>>,
    /// Base moments of the equilibria there and near by (N·m).
    starts: Vec<[Vector; 2]>,
    /// Answers by all derivatives of `wrt`.
    truth: Solutions,
    wrt: Vec<Parameter>,
    lengths: Vec<f64>,
    /// Of each derivative: its largest norm over the samples, and the parameter's natural change.
    sizes: Vec<[f64; 2]>,
    /// Samples without an answer from rest, or near which there is none.
    pub left_out: usize,
}

/// What one engine made of all samples.
pub struct Judged {
    tips: Vec<f64>,
    columns: Vec<f64>,
    norms: Vec<f64>,
    pub failed: usize,
    pub elsewhere: usize,
    /// Error estimate and true error, of position over length or of rotation, of each success on the right branch.
    pub estimates: Vec<[f64; 2]>,
    passes: f64,
}

/// Values of a plan's axes by sample.
pub fn batch_of(plan: &Plan, count: usize, rows: &[Vec<f64>]) -> Batch {
    plan.batch(count, |sample, row| {
        if let Some(values) = rows.get(sample % rows.len().max(1)) {
            row.copy_from_slice(values);
        }
    })
}

/// The same for another plan, one sample more or less known.
fn plan(spec: &BenchSpec, wrt: &[Parameter], options: PlanOptions) -> Result<Plan, BenchError> {
    let options = PlanOptions { base_moment_rows: false, ..options };
    Ok(Plan::new(&spec.sweep.scene, &spec.sweep.axis_parameters(), wrt, options)?)
}

impl<'a> Problem<'a> {
    /// Draws the samples of a file, at most so many.
    pub fn new(spec: &'a BenchSpec, most: usize) -> Result<Problem<'a>, BenchError> {
        let mut wrt = spec.sweep.wrt.clone();
        wrt.extend(spec.tip.iter().filter(|parameter| !spec.sweep.wrt.contains(parameter)));
        let count = (spec.sweep.sample_count as usize).min(most).max(1);
        let (sampler, mut random) = (spec.sweep.sampler(), Random(spec.sweep.seed));
        let drawn = if count < spec.sweep.sample_count as usize { count } else { spec.timed.max(count) };
        let mut rows = vec![vec![0.0; sampler.value_count()]; drawn];
        let mut near = rows.clone();
        let mut values = vec![0.0; sampler.axis_count()];
        for (index, (row, near)) in rows.iter_mut().zip(&mut near).enumerate() {
            sampler.values(index as u64, row);
            sampler.axis_values(index as u64, &mut values);
            for (axis, value) in spec.sweep.axes.iter().zip(&mut values) {
                let law = &axis.distribution;
                let by = 2.0 * NEAR * law.half_range() * if random.unit() < 0.5 { -1.0 } else { 1.0 };
                let is_inside = |x: &f64| law.limits().is_none_or(|(a, b)| (a.min(b)..=a.max(b)).contains(x));
                *value = if is_inside(&(*value + by)) { *value + by } else { *value - by };
            }
            sampler.expand(&values, near);
        }
        let options = PlanOptions { tolerance: 1e-12, stepper: Stepper::Dop853, steps: FINE, ..PlanOptions::default() };
        let plan = plan(spec, &wrt, options)?;
        let truth = Reference::new(&plan).solve(&batch_of(&plan, count, &rows))?;
        let mut lanes = Cpu::new(&plan, Precision::F64)?;
        let here = lanes.solve(&batch_of(&plan, drawn, &rows))?;
        let there = lanes.solve(&batch_of(&plan, drawn, &near))?;
        let is_solved = |at: &usize| here.status(*at).is_success() && there.status(*at).is_success();
        let known: Vec<usize> =
            (0..count).filter(|at| truth.status(*at).is_success() && there.status(*at).is_success()).collect();
        let timed: Vec<usize> = known.iter().copied().chain((count..drawn).filter(is_solved)).collect();
        if known.is_empty() {
            return Err(BenchError::NoAnswers { file: spec.sweep.file.clone() });
        }
        let mut kept = Solutions::new(&plan, known.len());
        known.iter().enumerate().for_each(|(to, from)| kept.copy_row(to, &truth, *from));
        let of_known = |all: &[Vec<f64>]| -> Vec<Vec<f64>> { timed.iter().map(|at| all[*at].clone()).collect() };
        let (rows, near) = (of_known(&rows), of_known(&near));
        let lengths = rows.iter().take(known.len());
        let lengths = lengths.map(|row| plan.sample_scene(row).rod().total_length()).collect();
        let moments = |at: &usize| [&here, &there].map(|solutions| solutions.vector(*at, Quantity::BaseMoment));
        let starts = timed.iter().map(moments).collect();
        let left_out = count - known.len();
        let sizes = Vec::new();
        let mut problem = Problem { spec, rows, near, starts, truth: kept, wrt, lengths, sizes, left_out };
        problem.sizes = (0..problem.wrt.len()).map(|column| problem.size(&plan, column)).collect();
        Ok(problem)
    }

    /// Samples with an answer.
    pub fn len(&self) -> usize {
        self.truth.sample_count()
    }

    /// Largest norm of a column of the truth, and the change of its parameter that moves a number of the rod by one
    /// natural unit: what bends the mean rod by a radian, its length, its stiffness.
    fn size(&self, plan: &Plan, column: usize) -> [f64; 2] {
        let norm = |sample: usize| length(&self.column(&self.truth, sample, column));
        let largest = (0..self.len()).map(norm).fold(f64::MIN_POSITIVE, f64::max);
        let chain = self.wrt[column].chain(&plan.scene);
        let rates: Vec<f64> = chain.iter().map(|(slot, rate)| rate / slot.unit(&plan.units)).collect();
        [largest, 1.0 / length(&rates).max(f64::MIN_POSITIVE)]
    }

    /// dp/L and w.
    fn column(&self, solutions: &Solutions, sample: usize, column: usize) -> [f64; 6] {
        let scale = |row: usize| if row < 3 { self.lengths[sample] } else { 1.0 };
        std::array::from_fn(|row| solutions.derivative(sample, column, row) / scale(row))
    }

    pub fn wrt(&self, work: Work) -> &[Parameter] {
        match work {
            Work::Given | Work::Tip => &self.spec.tip,
            Work::Cold | Work::Sweep | Work::Warm => &self.spec.sweep.wrt,
        }
    }

    /// The plan of a kind of work.
    pub fn plan(&self, work: Work, options: PlanOptions) -> Result<Plan, BenchError> {
        let plan = plan(self.spec, self.wrt(work), options)?;
        Ok(match work {
            Work::Given | Work::Warm => plan.with_starts(),
            Work::Tip | Work::Cold => plan,
            Work::Sweep => {
                let many = SweepSpec { sample_count: MANY, ..self.spec.sweep.clone() };
                with_anchors(&many, plan)?
            }
        })
    }

    /// So many samples, those that are timed over and over.
    pub fn batch(&self, work: Work, count: usize) -> Result<Batch, BenchError> {
        let starts_itself = matches!(work, Work::Tip | Work::Cold | Work::Sweep);
        let plan = match starts_itself {
            true => self.plan(work, PlanOptions::default())?,
            false => plan(self.spec, self.wrt(work), PlanOptions::default())?,
        };
        let batch = batch_of(&plan, count, &self.rows);
        let m0 = |sample: usize| match work {
            Work::Given => self.starts[sample][0],
            Work::Tip | Work::Cold | Work::Sweep | Work::Warm => self.starts[sample][1],
        };
        if starts_itself {
            return Ok(batch);
        }
        let start = |sample| Start { sample, m0: m0(sample % self.rows.len()), n0: None, known: &[] };
        Ok(plan.start_batch(&batch, &(0..count).map(start).collect::<Vec<_>>()))
    }

    /// Judges the first answers of a batch, one for each sample.
    pub fn judge(&self, work: Work, found: &Solutions) -> Judged {
        let mut judged = Judged::default();
        for sample in 0..self.len() {
            judged.passes += found.get(sample, Quantity::Iterations) / self.len() as f64;
            if !found.status(sample).is_success() {
                judged.failed += 1;
                continue;
            }
            let columns: Vec<[f64; 6]> =
                (0..self.wrt(work).len()).map(|column| self.column(found, sample, column)).collect();
            let tip = found.vector(sample, Quantity::TipPosition);
            if let Some(tip) = self.add(work, sample, tip, &columns, &mut judged) {
                let turn = rotation_angle(&found.tip_rotation(sample), &self.truth.tip_rotation(sample));
                judged.estimates.push([found.get(sample, Quantity::ErrorEstimate), tip.max(turn)]);
            }
        }
        judged
    }

    /// Adds the errors of one sample, columns as dp/L and w; the tip's, if it is on the right branch.
    pub fn add(&self, work: Work, sample: usize, tip: Vector, columns: &[[f64; 6]], to: &mut Judged) -> Option<f64> {
        let truth = self.truth.vector(sample, Quantity::TipPosition);
        let apart: [f64; 3] = std::array::from_fn(|k| tip[k] - truth[k]);
        let error = length(&apart) / self.lengths[sample];
        // Also true for NaN.
        if !error.is_finite() || error > OTHER_BRANCH {
            to.elsewhere += 1;
            return None;
        }
        let (mut worst, mut squares, mut whole) = (0.0f64, 0.0, 0.0);
        for (column, parameter) in columns.iter().zip(self.wrt(work)) {
            let of = self.wrt.iter().position(|other| other == parameter).unwrap_or(0);
            let true_column = self.column(&self.truth, sample, of);
            let [largest, natural] = self.sizes[of];
            let apart = length(&std::array::from_fn::<f64, 6, _>(|row| column[row] - true_column[row]));
            let size = length(&true_column);
            worst = worst.max(apart / size.max(SMALL_COLUMN * largest));
            squares += (apart * natural).powi(2);
            whole += (size * natural).powi(2);
        }
        to.add(error, worst, (squares / whole).sqrt());
        Some(error)
    }

    /// Mean angle between tip and base (rad).
    pub fn bend(&self) -> f64 {
        let base = self.spec.sweep.scene.rod().base_rotation.map(|row| row[2]);
        let angle = |sample: usize| {
            let tangent = self.truth.vector(sample, Quantity::TipTangent);
            (0..3).map(|k| tangent[k] * base[k]).sum::<f64>().clamp(-1.0, 1.0).acos()
        };
        (0..self.len()).map(angle).sum::<f64>() / self.len() as f64
    }

    /// Lengths of the rods (m).
    pub fn length(&self, sample: usize) -> f64 {
        self.lengths[sample]
    }
}

impl Default for Judged {
    fn default() -> Self {
        let (tips, columns, norms, estimates) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Judged { tips, columns, norms, failed: 0, elsewhere: 0, estimates, passes: 0.0 }
    }
}

impl Judged {
    /// The errors of one sample: of the tip, of the worst column and of the norm of all.
    pub fn add(&mut self, tip: f64, column: f64, norm: f64) {
        self.tips.push(tip);
        self.columns.push(column);
        self.norms.push(norm);
    }

    /// Of the tip, 95 % of the samples.
    pub fn p95(&self) -> f64 {
        shares(&self.tips)[1]
    }

    /// Fills in what is known about the samples.
    pub fn write(&self, record: &mut Record) {
        record.samples = (self.tips.len() + self.failed + self.elsewhere) as f64;
        record.failed = self.failed as f64;
        record.elsewhere = self.elsewhere as f64;
        record.tip = shares(&self.tips);
        record.column = shares(&self.columns);
        record.norm = shares(&self.norms);
        if !self.estimates.is_empty() {
            record.passes = self.passes;
            record.estimate = shares(&self.estimates.iter().map(|[estimate, _]| *estimate).collect::<Vec<_>>())[0];
            record.bounded = self.estimates.iter().filter(|pair| is_bounded(**pair)).count() as f64;
        }
    }
}

/// Round-off of the reference, which no estimate knows of.
const REFERENCE: f64 = 5e-14;

/// Whether an error is within its estimate; false for NaN.
pub fn is_bounded([estimate, error]: [f64; 2]) -> bool {
    error <= estimate + REFERENCE
}

fn length(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Median, what 95 % are at or below, largest; nothing of nothing.
pub fn shares(values: &[f64]) -> Errors {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let Some(worst) = values.last().copied() else { return [NONE; 3] };
    let at = |share: f64| values[((share * values.len() as f64).ceil() as usize).clamp(1, values.len()) - 1];
    [at(0.5), at(0.95), worst]
}
