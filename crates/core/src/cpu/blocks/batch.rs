//! A batch: its blocks side by side on all threads, then, packed together, those of its samples that another way is for.

use super::alike::sort_alike;
use super::kernels::Job;
use super::scratch::{Lent, Scratch};
use crate::backend::Precision;
use crate::clock::Busy;
use crate::cpu::ladder::{Course, Rung};
use crate::cpu::rod::program::Program;
use crate::cpu::simd::lane::WIDEST;
use crate::cpu::{BlockScalar, Cpu};
use crate::model::tolerances::{are_two_equilibria, growth_limit, limp_growth};
use crate::model::{BLOCK, Batch, ContactColumn, Entry, Quantity, Solutions, Status};
use rayon::prelude::*;
use std::time::Instant;

/// A path that ends on a smaller share of the load has not told why.
const LEAST_LOAD: f64 = 1.0 / 16.0;

impl Cpu {
    /// Writes the rows of a batch; one of no more than a block stays on the caller's thread, but for rods beside a wall.
    pub(in crate::cpu) fn fill<S: BlockScalar>(&self, batch: &Batch, solutions: &mut Solutions) {
        let rungs = self.course().rungs();
        let scales = self.output_scales();
        match &self.free {
            Some(free) => {
                free.fill::<S>(batch, solutions);
                self.climb::<S>(rungs, self.beside_wall(batch, solutions), batch, solutions, &scales);
            }
            None => {
                let left = self.first_rung::<S>(rungs[0], batch, solutions, &scales);
                self.climb::<S>(&rungs[1..], left, batch, solutions, &scales);
            }
        }
    }

    fn course(&self) -> Course {
        let Program { field, searches, anchors, bold, wall, .. } = &self.program;
        Course {
            varying: field.is_some(),
            searches: *searches,
            by_nodes: self.by_nodes,
            anchors: anchors.is_some(),
            bold: *bold,
            wall: wall.as_ref().filter(|_| self.free.is_some()).map(|wall| wall.kind),
        }
    }

    /// Solves all samples of a batch by the first rung, and returns those that are left.
    fn first_rung<S: BlockScalar>(
        &self,
        rung: Rung,
        batch: &Batch,
        solutions: &mut Solutions,
        scales: &[f64],
    ) -> Vec<usize> {
        let pool = S::pool(&self.pools);
        let count = batch.sample_count();
        let block_len = solutions.values.block_len();
        let busy = Busy::here();
        let first = |lent: &mut Lent<'_, S>, (block, out): (usize, &mut [f64])| {
            let _busy = busy.enter();
            let samples: Vec<usize> = (block * BLOCK..count.min((block + 1) * BLOCK)).collect();
            let mut left = self.solve_samples((batch, None), &samples, rung, scales, &mut lent.scratch, out);
            if self.leaves_some_starts {
                let (limp, others): (Vec<_>, _) = samples.into_iter().partition(|at| self.leaves_start(batch, *at));
                left.retain(|at| others.contains(at));
                left.extend(limp);
            }
            left
        };
        let blocks = solutions.values.data_mut();
        match count <= BLOCK {
            true => {
                let mut own = pool.lend();
                blocks.chunks_mut(block_len).enumerate().flat_map(|block| first(&mut own, block)).collect()
            }
            false => {
                let blocks = blocks.par_chunks_mut(block_len).enumerate();
                blocks.map_init(|| pool.lend(), first).flatten_iter().collect()
            }
        }
    }

    /// Leads the samples that are left up the rungs, and writes their rows.
    fn climb<S: BlockScalar>(
        &self,
        rungs: &[Rung],
        mut left: Vec<usize>,
        batch: &Batch,
        solutions: &mut Solutions,
        scales: &[f64],
    ) {
        let (pool, busy) = (S::pool(&self.pools), Busy::here());
        let (count, block_len) = (batch.sample_count(), solutions.values.block_len());
        for rung in rungs {
            let mut others = Vec::new();
            match rung {
                Rung::LimpShooting => {
                    let is_limp = |at: &usize| self.is_limp(batch, *at) || self.leaves_start(batch, *at);
                    (left, others) = left.into_iter().partition(is_limp);
                }
                // A single pass that may lose its digits sees no turn.
                Rung::Curve => (left, others) = left.into_iter().partition(|at| !self.is_grown(batch, *at)),
                // In single precision it does not tell there where the load turns.
                Rung::FieldCurve | Rung::FieldFineCurve if self.precision == Precision::F32 => {
                    std::mem::swap(&mut left, &mut others)
                }
                // Guarded steps on the coarse grid hardly solve a rod that the curve on the fine grid has left: 4 of 270 guidewires.
                Rung::FieldGuardedSteps
                    if self.precision == Precision::F64 && rungs.contains(&Rung::FieldFineCurve) =>
                {
                    std::mem::swap(&mut left, &mut others)
                }
                Rung::FreeTip | Rung::ComingWall | Rung::FieldCurve | Rung::GuardedWall if self.free.is_some() => {
                    (left, others) = left.into_iter().partition(|at| solutions.status(*at).is_success());
                }
                Rung::MultipleShooting => left.retain(|sample| self.may_be_grown(batch, solutions, *sample)),
                _ => {}
            }
            sort_alike(&batch.inputs, &mut left);
            if *rung == Rung::ComingWall {
                self.sort_by_way(solutions, &mut left);
            }
            let rows = (batch, Some(&*solutions));
            let again = |lent: &mut Lent<'_, S>, samples: &[usize]| {
                let _busy = busy.enter();
                let mut out = vec![0.0; block_len];
                let left = self.solve_samples(rows, samples, *rung, scales, &mut lent.scratch, &mut out);
                (out, left)
            };
            let mut size = BLOCK;
            // Beside a wall a register takes milliseconds: a block is shared among threads.
            let solved: Vec<(Vec<f64>, Vec<usize>)> = match count <= BLOCK && self.free.is_none() {
                true => left.chunks(size).map(|samples| again(&mut pool.lend(), samples)).collect(),
                false => {
                    let threads = rayon::current_num_threads();
                    size = left.len().div_ceil(threads).next_multiple_of(WIDEST).clamp(WIDEST, BLOCK);
                    left.par_chunks(size).map_init(|| pool.lend(), again).collect()
                }
            };
            for (samples, (rows, unsolved)) in left.chunks(size).zip(&solved) {
                let mut is_taken = |(at, sample): &(usize, &usize)| match rung {
                    Rung::MultipleShooting => self.takes(solutions, **sample, |column| rows[column * BLOCK + at]),
                    // The free rod is where the next rung begins.
                    Rung::ComingWall | Rung::FieldCurve if self.free.is_some() => !unsolved.contains(*sample),
                    _ => true,
                };
                let taken: Vec<(usize, &usize)> = samples.iter().enumerate().filter(|row| is_taken(row)).collect();
                let mut first = 0;
                if *rung == Rung::FreeTip {
                    first = self.program.contact.unwrap_or(0);
                    self.mark_through_wall(solutions, samples, rows);
                }
                for (column, values) in rows.chunks(BLOCK).enumerate().skip(first) {
                    taken.iter().for_each(|(at, sample)| solutions.values.set(**sample, column, values[*at]));
                }
            }
            let unsolved = solved.into_iter().flat_map(|(_, left)| left);
            left = unsolved.filter(|at| !self.leaves_start(batch, *at)).chain(others).collect();
        }
        // A sample that is left has the row of its free rod, or none.
        if self.program.bold {
            let is_open = |at: &usize| self.free.is_none() || solutions.status(*at).is_success();
            let open: Vec<usize> = left.into_iter().filter(is_open).collect();
            open.into_iter().for_each(|at| solutions.set_status(at, Status::Pending));
        }
    }

    /// Whether a sample starts from rest though a base moment is given, and by nodes, which leave it no other way.
    fn leaves_start(&self, batch: &Batch, sample: usize) -> bool {
        self.leaves_some_starts && self.plan.sample_rod(batch, sample).is_too_limp()
    }

    /// Whether errors of a single pass grow beyond all digits.
    fn is_limp(&self, batch: &Batch, sample: usize) -> bool {
        self.plan.sample_rod(batch, sample).growth() > limp_growth(self.precision.epsilon())
    }

    /// Whether errors of a single pass grow so much that what it says of a path that ends may mean little.
    fn is_grown(&self, batch: &Batch, sample: usize) -> bool {
        self.plan.sample_rod(batch, sample).growth() > growth_limit(self.precision.epsilon())
    }

    /// Whether a sample that a single pass does not solve, or whose columns it does not tell, may be one of much growth.
    fn may_be_grown(&self, batch: &Batch, solutions: &Solutions, sample: usize) -> bool {
        // Of no other status is anything claimed that nodes might take back.
        if !matches!(solutions.status(sample), Status::Fold | Status::Unstable) {
            return true;
        }
        // A path that hardly set out tells nothing: half the growth will do.
        let share = if solutions.get(sample, Quantity::LoadFraction) > LEAST_LOAD { 1.0 } else { 2.0 };
        self.plan.sample_rod(batch, sample).growth() * share > growth_limit(self.precision.epsilon())
    }

    /// Whether the row of a sample is replaced by one that nodes have found. One without an equilibrium only takes back a
    /// fold that is none.
    fn takes(&self, solutions: &mut Solutions, sample: usize, found: impl Fn(usize) -> f64) -> bool {
        let is = |status: Status| found(Quantity::Status.column()) == f64::from(status.code());
        let before = solutions.status(sample);
        if is(Status::Ramped) {
            let apart = |k: usize| (found(k) - solutions.values.get(sample, k)).powi(2);
            let apart = (0..3).map(apart).sum::<f64>().sqrt() / self.plan.scene.total_length();
            let estimate = solutions.get(sample, Quantity::ErrorEstimate);
            if before == Status::Pending && are_two_equilibria(apart, estimate) {
                solutions.set_status(sample, Status::NotConverged);
                return false;
            }
            return true;
        }
        if before == Status::Pending || before == Status::Fold && !is(Status::Fold) {
            solutions.set_status(sample, Status::NotConverged);
        }
        false
    }

    /// Factors that turn the kernel's columns into SI.
    fn output_scales(&self) -> Vec<f64> {
        let units = &self.plan.units;
        let mut scales = vec![1.0; Quantity::COUNT];
        scales[..3].fill(units.length);
        scales[Quantity::BaseMoment.column()..][..3].fill(units.moment());
        let of_row = |row: usize| match row % self.plan.rows() {
            row if self.plan.base_force_row().is_some_and(|first| first <= row) => units.force,
            row => [units.length, 1.0, units.moment(), units.curvature()][row / 3],
        };
        scales.extend((0..self.plan.rows() * self.plan.derivatives.len()).map(of_row));
        let last = self.plan.contact_column().unwrap_or(self.plan.output_count());
        let count = self.plan.fold_column().unwrap_or(last);
        scales.resize(self.plan.base_force_column().unwrap_or(count), units.curvature());
        scales.resize(count, units.force);
        scales.resize(self.plan.contact_column().unwrap_or(self.plan.output_count()), 1.0);
        if let Some(first) = self.plan.contact_column() {
            scales.resize(self.plan.output_count(), units.force);
            let mut set = |column: ContactColumn, count: usize, unit: f64| {
                scales[first + column as usize..][..count].fill(unit);
            };
            set(ContactColumn::Touching, 1, 1.0);
            set(ContactColumn::Gap, 1, units.length);
            set(ContactColumn::Normal, 3, 1.0);
            set(ContactColumn::BodyGap, 1, units.length);
            set(ContactColumn::Friction, 1, 1.0);
        }
        scales
    }

    /// Solves at most a block of samples in one way; their rows go to `out`, column by column. Returns those that are left
    /// to the next.
    pub(in crate::cpu) fn solve_samples<S: BlockScalar>(
        &self,
        (batch, rows): (&Batch, Option<&Solutions>),
        samples: &[usize],
        rung: Rung,
        scales: &[f64],
        scratch: &mut Scratch<S>,
        out: &mut [f64],
    ) -> Vec<usize> {
        let begin = Instant::now();
        let Scratch { inputs, bad, free, order, values, memory } = scratch;
        inputs.resize(BLOCK * self.plan.input_count, S::default());
        values.resize(out.len(), S::default());
        bad.clear();
        bad.extend(samples.iter().map(|sample| batch.bad[*sample]));
        for (entry, unit) in self.plan.entries.iter().zip(&self.units) {
            if let Entry::Varying(column) = *entry {
                let to = &mut inputs[column * BLOCK..][..BLOCK];
                for (to, sample) in to.iter_mut().zip(samples) {
                    *to = S::from_f64(batch.inputs.get(*sample, column) / unit);
                }
                // Lanes without a sample do as the last one does, and take no time of their own.
                let last = to[samples.len() - 1];
                to[samples.len()..].iter_mut().take(WIDEST).for_each(|to| *to = last);
            }
        }
        free.clear();
        let from_free = matches!(rung, Rung::FreeTip | Rung::ComingWall | Rung::FieldCurve | Rung::GuardedWall);
        if let (Some(_), true, Some(rows)) = (&self.free, from_free, rows) {
            self.take_free_rods((batch, rows), samples, free);
        }
        let mut left = Vec::new();
        let job = Job { program: &self.program, inputs, bad, rung, free, order, left: &mut left, values, memory };
        S::run(self.arch, job);
        // A place in a block is a byte, which needs no check.
        let places: Vec<u8> = order.iter().map(|place| *place as u8).collect();
        let columns = out.as_chunks_mut::<BLOCK>().0.iter_mut().zip(values.chunks_exact(BLOCK));
        for ((to, from), scale) in columns.zip(scales) {
            for (value, place) in from.iter().zip(&places) {
                to[usize::from(*place)] = value.to_f64() * scale;
            }
        }
        self.plan.raise_error_estimates(out);
        self.plan.add_base_positions(batch, samples.iter().copied(), out);
        if let Some(noise) = &self.column_noise {
            noise.add(out);
        }
        left.iter_mut().for_each(|place| *place = samples[*place]);
        self.rungs[rung as usize].add(samples.len(), left.len(), begin.elapsed());
        left
    }
}
