//! The overlapping stages of a run: build batches, solve, finish rows, write. Each queue holds one item.

use super::branches::{BranchSearch, Branches};
use super::check::Kept;
use super::columns::{BranchCells, Layout, SolvedRow, Table};
use super::directory::RunRecord;
use super::error::SweepError;
use super::reduce::Reduction;
use super::refine::Refiners;
use super::run::{Progress, RunOptions, Timings};
use super::sampling::Sampler;
use super::spec::{Format, SweepSpec};
use crate::backend::{Backend, Returned};
use crate::model::{Batch, Plan, Quantity, Solutions};
use rayon::prelude::*;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// Consecutive samples of one chunk within a batch.
#[derive(Clone, Copy)]
pub(super) struct Piece {
    chunk: u64,
    start: u64,
    len: u64,
    is_last: bool,
}

struct Job {
    pieces: Vec<Piece>,
    batch: Batch,
}

/// Shares chunks out over batches: a batch holds several chunks or a piece of one.
pub(super) fn pieces(record: &RunRecord, chunks: &[u64], batch_size: u64) -> Vec<Vec<Piece>> {
    let mut jobs: Vec<Vec<Piece>> = Vec::new();
    let mut room = 0;
    for chunk in chunks {
        let (mut start, mut left) = record.chunk_range(*chunk);
        while left > 0 {
            if room == 0 {
                jobs.push(Vec::new());
                room = batch_size;
            }
            let len = left.min(room);
            let piece = Piece { chunk: *chunk, start, len, is_last: len == left };
            if let Some(job) = jobs.last_mut() {
                job.push(piece);
            }
            (start, left, room) = (start + len, left - len, room - len);
        }
    }
    jobs
}

/// Sample at a place of a batch.
fn index_at(pieces: &[Piece], at: usize) -> Option<u64> {
    let mut at = at as u64;
    for piece in pieces {
        if at < piece.len {
            return Some(piece.start + at);
        }
        at -= piece.len;
    }
    None
}

/// Runs the four stages; returns the busy seconds of building, solving and writing.
pub(super) fn pipeline(
    jobs: Vec<Vec<Piece>>,
    backend: &mut dyn Backend,
    finisher: &mut Finisher,
    write: impl Fn(u64, Table) -> Result<(), SweepError> + Send,
) -> Result<(f64, f64, f64), SweepError> {
    let (plan, sampler, options) = (finisher.plan, finisher.sampler, finisher.options);
    std::thread::scope(|scope| {
        let (built, to_solve) = sync_channel::<Job>(1);
        let (solved, to_finish) = sync_channel::<(Job, Solutions)>(1);
        let (finished, to_write) = sync_channel::<(u64, Table)>(1);
        let builder = scope.spawn(move || {
            let mut busy = Duration::ZERO;
            for pieces in jobs {
                let begin = Instant::now();
                let count = pieces.iter().map(|piece| piece.len).sum::<u64>() as usize;
                let batch = plan.batch(count, |at, row| {
                    if let Some(index) = index_at(&pieces, at) {
                        sampler.values(index, row);
                    }
                });
                busy += begin.elapsed();
                if options.is_interrupted() || built.send(Job { pieces, batch }).is_err() {
                    break;
                }
            }
            busy.as_secs_f64()
        });
        let finishing = scope.spawn(move || finisher.finish_all(to_finish, finished));
        let writer = scope.spawn(move || -> Result<f64, SweepError> {
            let mut busy = Duration::ZERO;
            for (chunk, table) in to_write {
                let begin = Instant::now();
                write(chunk, table)?;
                busy += begin.elapsed();
            }
            Ok(busy.as_secs_f64())
        });
        let solving = solve_all(backend, options, to_solve, solved);
        // A stage that fails drops its queue, which ends the others; the error nearest the disk is the cause.
        let build = builder.join().unwrap_or(0.0);
        let finishing = join(finishing.join());
        let write = join(writer.join())?;
        finishing?;
        Ok((build, solving?, write))
    })
}

pub(super) fn join<T>(result: std::thread::Result<T>) -> T {
    result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

fn solve_all(
    backend: &mut dyn Backend,
    options: &RunOptions,
    jobs: Receiver<Job>,
    solved: SyncSender<(Job, Solutions)>,
) -> Result<f64, SweepError> {
    let mut busy = Duration::ZERO;
    for job in jobs {
        if options.is_interrupted() {
            break;
        }
        let begin = Instant::now();
        let solutions = backend.solve(&job.batch)?;
        busy += begin.elapsed();
        if solved.send((job, solutions)).is_err() {
            break;
        }
    }
    Ok(busy.as_secs_f64())
}

/// A batch and what came back.
#[derive(Clone, Copy)]
struct Solved<'a> {
    batch: &'a Batch,
    /// From rest.
    solutions: &'a Solutions,
    branches: Option<&'a Branches>,
}

impl<'a> Solved<'a> {
    /// The rows of a sample: its equilibria, where there is any and all are wanted, else the one from rest.
    fn rows(&self, plan: &'a Plan, sample: usize) -> impl Iterator<Item = SolvedRow<'a>> + use<'a> {
        let Solved { batch, solutions, branches } = *self;
        let found = branches.map(|branches| (branches, &branches.samples[sample]));
        let rows = match found {
            Some((_, of)) if !of.rows.is_empty() => of.rows.clone(),
            _ => sample..sample + 1,
        };
        let first = rows.start;
        rows.map(move |row| match found {
            Some((branches, of)) if !of.rows.is_empty() => {
                let found = branches.branches[row];
                let (energy, from_rest, balanced) = (found.energy, found.from_rest, of.balanced);
                let branch = BranchCells { number: row - first, energy, from_rest, balanced };
                SolvedRow { plan, batch, sample, solutions: &branches.solutions, row, branch }
            }
            _ => SolvedRow { plan, batch, sample, solutions, row, branch: BranchCells::default() },
        })
    }
}

/// Turns solutions into rows: second attempts, statistics, tables of whole chunks.
pub(super) struct Finisher<'a> {
    pub spec: &'a SweepSpec,
    pub plan: &'a Plan,
    pub layout: &'a Layout,
    pub sampler: &'a Sampler,
    pub options: &'a RunOptions<'a>,
    pub refiners: Refiners<'a>,
    pub search: Option<BranchSearch<'a>>,
    pub kept: Option<Kept>,
    pub reduction: Reduction,
    /// Rows of the chunk that is being filled.
    pub table: Table,
    /// Samples in `table`.
    pub in_table: u64,
    pub total: u64,
    pub resumed: u64,
    pub start: Instant,
    pub solved: u64,
    pub failed: u64,
    pub above_tolerance: u64,
    pub worst_residual: f64,
    pub worst_error_estimate: f64,
    pub timings: Timings,
}

impl Finisher<'_> {
    fn finish_all(
        &mut self,
        jobs: Receiver<(Job, Solutions)>,
        finished: SyncSender<(u64, Table)>,
    ) -> Result<(), SweepError> {
        for (job, mut solutions) in jobs {
            let begin = Instant::now();
            let index = |at: usize| index_at(&job.pieces, at).unwrap_or(0);
            self.refiners.refine(self.plan, self.sampler, &job.batch, &mut solutions, &index)?;
            let refined = Instant::now();
            let mut branches = None;
            if let Some(search) = &mut self.search {
                branches = search.find(&job.batch, &solutions, &|| self.options.is_interrupted())?;
                if branches.is_none() {
                    return Ok(());
                }
            }
            let searched = Instant::now();
            let solved = Solved { batch: &job.batch, solutions: &solutions, branches: branches.as_ref() };
            let mut at = 0;
            for piece in &job.pieces {
                let count = piece.len as usize;
                self.add_rows(&|row| piece.start + row as u64, count, &solved, at);
                at += count;
                if piece.is_last {
                    let table = std::mem::replace(&mut self.table, self.layout.empty().clone());
                    self.solved += std::mem::take(&mut self.in_table);
                    self.reduction.add(&table);
                    if self.spec.format != Format::None && finished.send((piece.chunk, table)).is_err() {
                        return Ok(());
                    }
                }
            }
            self.timings.refine += (refined - begin).as_secs_f64();
            self.timings.search += (searched - refined).as_secs_f64();
            self.timings.rows += searched.elapsed().as_secs_f64();
            self.report(false);
        }
        Ok(())
    }

    /// Takes in what came back of a range whose other samples were counted by the engine.
    pub fn finish_returned(&mut self, returned: Returned) -> Result<(), SweepError> {
        let begin = Instant::now();
        let Returned { indices, batch, mut solutions, counted } = returned;
        let index = |at: usize| indices.get(at).copied().unwrap_or(0);
        self.refiners.refine(self.plan, self.sampler, &batch, &mut solutions, &index)?;
        let refined = Instant::now();
        let solved = Solved { batch: &batch, solutions: &solutions, branches: None };
        self.add_rows(&index, indices.len(), &solved, 0);
        let table = std::mem::replace(&mut self.table, self.layout.empty().clone());
        self.solved += std::mem::take(&mut self.in_table) + counted.iter().sum::<u64>();
        self.reduction.add(&table);
        self.reduction.add_counted(counted);
        self.timings.refine += (refined - begin).as_secs_f64();
        self.timings.rows += refined.elapsed().as_secs_f64();
        self.report(false);
        Ok(())
    }

    /// Adds the rows of some samples of the sweep, which start at sample `at` of a batch.
    fn add_rows(&mut self, index: &(dyn Fn(usize) -> u64 + Sync), count: usize, solved: &Solved, at: usize) {
        const ROWS: usize = 4096;
        let (layout, sampler, plan) = (self.layout, self.sampler, self.plan);
        let rows_from = |first: usize| {
            let mut table = layout.empty().clone();
            let mut values = vec![0.0; sampler.axis_count()];
            for row in first..count.min(first + ROWS) {
                let index = index(row);
                sampler.values(index, &mut values);
                solved.rows(plan, at + row).for_each(|solved| layout.push(&mut table, index, &values, &solved));
            }
            table
        };
        let tables: Vec<Table> = (0..count.div_ceil(ROWS)).into_par_iter().map(|k| rows_from(k * ROWS)).collect();
        tables.iter().for_each(|table| self.table.append(table));
        self.in_table += count as u64;
        for row in 0..count {
            self.note(index(row), solved, at + row);
        }
    }

    /// Statistics of one sample.
    fn note(&mut self, index: u64, solved: &Solved, at: usize) {
        if let Some(kept) = &mut self.kept {
            kept.offer(index, solved.solutions, at);
        }
        for SolvedRow { solutions, row, .. } in solved.rows(self.plan, at) {
            let status = solutions.status(row);
            if status.is_converged() {
                self.worst_residual = self.worst_residual.max(solutions.get(row, Quantity::Residual));
            }
            if status.is_success() || status.is_converged() && solved.branches.is_some() {
                let estimate = solutions.get(row, Quantity::ErrorEstimate);
                self.worst_error_estimate = self.worst_error_estimate.max(estimate);
                self.above_tolerance += u64::from(estimate > self.spec.tolerance);
            } else {
                self.failed += 1;
            }
        }
    }

    pub fn report(&self, checking: bool) {
        let Some(progress) = self.options.progress else { return };
        let rows = self.solved + self.in_table;
        let rate = rows as f64 / self.start.elapsed().as_secs_f64().max(1e-9);
        let done = self.resumed + rows;
        let left = (rate > 0.0).then(|| Duration::from_secs_f64((self.total - done) as f64 / rate));
        progress(&Progress { done, total: self.total, failed: self.failed, rate, left, checking });
    }
}
