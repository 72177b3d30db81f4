//! The overlapping stages of a run: build batches, solve, finish rows, write. A queue holds one item at most.

use super::branches::{Branch, BranchSearch, Branches};
use super::check::SpotSamples;
use super::chunks::Piece;
use super::error::SweepError;
use super::options::{Progress, RunOptions};
use super::refine::Refiners;
use super::samples::Samples;
use super::second_path::SecondPaths;
use super::stages::StageTimes;
use super::tally::Tally;
use crate::backend::{Backend, Returned};
use crate::model::{Batch, Plan, Quantity, Solutions};
use crate::results::Reduction;
use crate::results::claims::ClaimState;
use crate::results::{BranchCells, Layout, Rows};
use crate::spec::CHUNK;
use crate::spec::Sampler;
use crate::spec::{Format, SweepSpec};
use crate::table::Table;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread::{Builder, Scope, ScopedJoinHandle};
use std::time::{Duration, Instant};

struct Job {
    pieces: Vec<Piece>,
    batch: Batch,
}

/// Starts a thread; a system that gives none ends the run.
pub(crate) fn spawn<'scope, T: Send + 'scope>(
    scope: &'scope Scope<'scope, '_>,
    work: impl FnOnce() -> T + Send + 'scope,
) -> Result<ScopedJoinHandle<'scope, T>, SweepError> {
    Builder::new().spawn_scoped(scope, work).map_err(|error| SweepError::Threads { reason: error.to_string() })
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

/// The samples of each piece of a batch.
fn pieces_of(pieces: &[Piece]) -> impl Iterator<Item = (Samples<'static>, &Piece)> {
    let mut at = 0;
    pieces.iter().map(move |piece| {
        let first = at;
        at += piece.len as usize;
        (Samples::Following { places: first..at, first: piece.start }, piece)
    })
}

/// Runs the four stages.
///
/// Solutions and tables go back to where they come from, since fresh memory takes longer to get than to fill.
pub(crate) fn pipeline(
    jobs: impl Iterator<Item = Result<Vec<Piece>, SweepError>> + Send,
    is_over: &AtomicBool,
    backend: &mut dyn Backend,
    finisher: &mut Finisher,
    mut write: impl FnMut(u64, &Table) -> Result<(), SweepError> + Send,
) -> Result<(), SweepError> {
    let (plan, sampler, options, times) = (finisher.plan, finisher.sampler, finisher.options, finisher.times);
    std::thread::scope(|scope| {
        let (built, to_solve) = sync_channel::<Job>(1);
        let (solved, to_finish) = sync_channel::<(Job, Solutions)>(1);
        // None waits: one table is filled while another is written.
        let (finished, to_write) = sync_channel::<(u64, Table)>(0);
        let (used_solutions, spare_solutions) = channel::<Solutions>();
        let (used_tables, spare_tables) = channel::<Table>();
        let builder = spawn(scope, move || {
            for pieces in jobs {
                let pieces = pieces?;
                let building = times.build.enter();
                let count = pieces.iter().map(|piece| piece.len).sum::<u64>() as usize;
                let batch = plan.batch(count, |at, row| {
                    if let Some(index) = index_at(&pieces, at) {
                        sampler.values(index, row);
                    }
                });
                drop(building);
                if options.is_interrupted() || built.send(Job { pieces, batch }).is_err() {
                    break;
                }
            }
            Ok::<_, SweepError>(())
        })?;
        let finishing =
            spawn(scope, move || finisher.finish_all(to_finish, &finished, &spare_tables, &used_solutions))?;
        let writer = spawn(scope, move || -> Result<(), SweepError> {
            let _over = SetOnDrop(is_over);
            for (chunk, table) in to_write {
                let writing = times.write.enter();
                write(chunk, &table)?;
                drop(writing);
                // The finisher may be done.
                let _ = used_tables.send(table);
            }
            Ok(())
        })?;
        let solving = {
            let _over = SetOnDrop(is_over);
            solve_all(backend, (options, times), to_solve, solved, &spare_solutions)
        };
        // A stage that fails drops its queue, which ends the others; the error nearest the disk is the cause.
        let building = join(builder.join());
        let finishing = join(finishing.join());
        join(writer.join())?;
        finishing?;
        solving?;
        building
    })
}

/// Tells the first stage, which may be waiting for other workers, that a later one has ended.
struct SetOnDrop<'a>(&'a AtomicBool);

impl Drop for SetOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

pub(crate) fn join<T>(result: std::thread::Result<T>) -> T {
    result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

fn solve_all(
    backend: &mut dyn Backend,
    (options, times): (&RunOptions, &StageTimes),
    jobs: Receiver<Job>,
    solved: SyncSender<(Job, Solutions)>,
    spare: &Receiver<Solutions>,
) -> Result<(), SweepError> {
    for job in jobs {
        if options.is_interrupted() {
            break;
        }
        let solving = times.solve.enter();
        let mut solutions = spare.try_recv().unwrap_or_default();
        backend.solve_into(&job.batch, &mut solutions)?;
        drop(solving);
        if solved.send((job, solutions)).is_err() {
            break;
        }
    }
    Ok(())
}

/// A batch and what came back.
#[derive(Clone, Copy)]
struct Solved<'a> {
    batch: &'a Batch,
    from_rest: &'a Solutions,
    /// The rows to be written: those from rest, or of every equilibrium.
    rows: &'a Solutions,
    branches: Option<&'a [BranchCells]>,
}

impl Solved<'_> {
    /// The rows of some samples.
    fn range(&self, samples: Range<usize>) -> Range<usize> {
        let Some(cells) = self.branches else { return samples };
        let first = |sample: usize| cells.partition_point(|cells| cells.sample < sample);
        first(samples.start)..first(samples.end)
    }

    /// The sample of a row, as a place of the batch.
    fn sample(&self, row: usize) -> usize {
        self.branches.map_or(row, |cells| cells[row].sample)
    }
}

/// The rows of every sample of a batch: its equilibria where there is any, else the one from rest.
fn rows_of(plan: &Plan, branches: &Branches, from_rest: &Solutions) -> (Solutions, Vec<BranchCells>) {
    let count = branches.samples.iter().map(|of| of.rows.len().max(1)).sum();
    let (mut rows, mut cells) = (Solutions::new(plan, count), Vec::with_capacity(count));
    for (sample, of) in branches.samples.iter().enumerate() {
        if of.rows.is_empty() {
            rows.copy_row(cells.len(), from_rest, sample);
            cells.push(BranchCells { sample, number: 0, energy: None, from_rest: false, balanced: false });
        }
        for (number, row) in of.rows.clone().enumerate() {
            rows.copy_row(cells.len(), &branches.solutions, row);
            let Branch { energy, from_rest, .. } = branches.branches[row];
            cells.push(BranchCells { sample, number, energy, from_rest, balanced: of.balanced });
        }
    }
    (rows, cells)
}

/// Turns solutions into rows: second attempts, statistics, tables of whole chunks.
pub(crate) struct Finisher<'a> {
    pub spec: &'a SweepSpec,
    pub plan: &'a Plan,
    pub layout: &'a Layout,
    pub sampler: &'a Sampler,
    pub options: &'a RunOptions<'a>,
    pub refiners: Refiners<'a>,
    pub second_paths: Option<SecondPaths<'a>>,
    pub search: Option<BranchSearch<'a>>,
    pub spot_samples: Option<SpotSamples>,
    pub reduction: Reduction,
    /// Rows of the chunk that is being filled.
    pub table: Table,
    /// Samples in `table`.
    pub in_table: u64,
    pub total: u64,
    pub resumed: u64,
    /// Where workers share the run: what the others have done.
    pub others: Option<Arc<ClaimState>>,
    pub start: Instant,
    pub solved: u64,
    pub failed: u64,
    pub above_tolerance: u64,
    pub worst_residual: f64,
    pub worst_error_estimate: f64,
    /// Rows that miss the tolerance, and those that failed.
    pub tally: Tally<'a>,
    pub times: &'a StageTimes,
}

impl Finisher<'_> {
    fn finish_all(
        &mut self,
        jobs: Receiver<(Job, Solutions)>,
        finished: &SyncSender<(u64, Table)>,
        spare: &Receiver<Table>,
        used: &Sender<Solutions>,
    ) -> Result<(), SweepError> {
        for (job, mut solutions) in jobs {
            let refining = self.times.refine.enter();
            let index = |at: usize| index_at(&job.pieces, at).unwrap_or(0);
            let sure = self.refiners.refine(self.plan, self.sampler, &job.batch, &mut solutions, &index)?;
            if let Some(second_paths) = &mut self.second_paths {
                for (samples, _) in pieces_of(&job.pieces) {
                    second_paths.check(self.plan, self.sampler, &samples, &mut solutions, &sure)?;
                }
            }
            drop(refining);
            let mut branches = None;
            if let Some(search) = &mut self.search {
                let _searching = self.times.search.enter();
                let found = search.find(&job.batch, &solutions, &|| self.options.is_interrupted())?;
                let Some(found) = found else { return Ok(()) };
                branches = Some(rows_of(self.plan, &found, &solutions));
            }
            let in_rows = self.times.rows.enter();
            let (rows, cells) = match &branches {
                Some((rows, cells)) => (rows, Some(&cells[..])),
                None => (&solutions, None),
            };
            let solved = Solved { batch: &job.batch, from_rest: &solutions, rows, branches: cells };
            for (samples, piece) in pieces_of(&job.pieces) {
                self.add_rows(&samples, &solved);
                if piece.is_last {
                    let table = self.take_table();
                    if self.spec.format != Format::None && finished.send((piece.chunk, table)).is_err() {
                        return Ok(());
                    }
                    if let Ok(mut used) = spare.try_recv() {
                        used.clear();
                        self.table = used;
                    }
                }
            }
            // The solver may be done.
            let _ = used.send(solutions);
            drop(in_rows);
            self.report(false);
        }
        Ok(())
    }

    /// Takes in what came back of a range whose other samples were counted by the engine.
    pub fn finish_returned(&mut self, returned: Returned) -> Result<(), SweepError> {
        let refining = self.times.refine.enter();
        let Returned { indices, batch, mut solutions, counted } = returned;
        let index = |at: usize| indices.get(at).copied().unwrap_or(0);
        let sure = self.refiners.refine(self.plan, self.sampler, &batch, &mut solutions, &index)?;
        if let Some(second_paths) = &mut self.second_paths {
            second_paths.check(self.plan, self.sampler, &Samples::Listed(&indices), &mut solutions, &sure)?;
        }
        drop(refining);
        let in_rows = self.times.rows.enter();
        let solved = Solved { batch: &batch, from_rest: &solutions, rows: &solutions, branches: None };
        self.add_rows(&Samples::Listed(&indices), &solved);
        self.take_table();
        self.solved += counted.iter().sum::<u64>();
        self.reduction.add_counted(counted);
        drop(in_rows);
        self.report(false);
        Ok(())
    }

    /// Takes in the table that has been filled, and goes on with an empty one.
    fn take_table(&mut self) -> Table {
        self.solved += std::mem::take(&mut self.in_table);
        self.reduction.add(&self.table);
        std::mem::replace(&mut self.table, self.layout.empty().clone())
    }

    /// Adds the rows of some samples of a batch.
    fn add_rows(&mut self, samples: &Samples, solved: &Solved) {
        let places = samples.places();
        if let Some(chosen) = &mut self.spot_samples {
            chosen.offer(samples, solved.from_rest);
        }
        let range = solved.range(places.clone());
        for row in range.clone() {
            self.note(solved.rows, row);
            let (status, estimate) = (solved.rows.status(row), solved.rows.get(row, Quantity::ErrorEstimate));
            if self.tally.concerns(status, estimate) {
                self.tally.add(samples.index(solved.sample(row)), status, estimate);
            }
        }
        if self.spec.format == Format::None && self.search.is_none() {
            return self.count(samples, solved);
        }
        if self.in_table == 0 {
            self.table.reserve(self.options.chunk.min(CHUNK).min(self.total) as usize);
        }
        let Solved { batch, rows: solutions, branches, .. } = *solved;
        let rows = Rows { plan: self.plan, batch, solutions, range, branches };
        self.layout.append(&mut self.table, &rows, self.sampler, &|at| samples.index(at));
        self.in_table += places.len() as u64;
    }

    /// Takes in samples whose rows are not written: only those that are kept become rows.
    fn count(&mut self, samples: &Samples, solved: &Solved) {
        let solutions = solved.from_rest;
        let tip_is_single = self.layout.tip_is_single();
        for at in samples.places() {
            let tip = tip_is_single.filter(|_| solutions.is_equilibrium(at)).map(|is_single| {
                let p = solutions.vector(at, Quantity::TipPosition);
                if is_single { p.map(|x| f64::from(x as f32)) } else { p }
            });
            self.reduction.add_sample(solutions.status(at), tip);
        }
        let kept = samples.chosen(self.reduction.selection());
        self.solved += samples.places().len() as u64;
        if kept.is_empty() {
            return;
        }
        let index = |at: usize| kept.get(at).map_or(0, |place| samples.index(*place));
        let batch = self.plan.batch(kept.len(), |at, row| self.sampler.values(index(at), row));
        let mut of_kept = Solutions::new(self.plan, kept.len());
        kept.iter().enumerate().for_each(|(to, from)| of_kept.copy_row(to, solutions, *from));
        let rows = Rows { plan: self.plan, batch: &batch, solutions: &of_kept, range: 0..kept.len(), branches: None };
        self.layout.append(&mut self.table, &rows, self.sampler, &index);
        self.reduction.keep_rows(&self.table);
        self.table.clear();
    }

    /// Statistics of one row.
    fn note(&mut self, solutions: &Solutions, row: usize) {
        let status = solutions.status(row);
        if status.is_converged() {
            self.worst_residual = self.worst_residual.max(solutions.get(row, Quantity::Residual));
        }
        if status.is_success() || status.is_converged() && self.search.is_some() {
            let estimate = solutions.get(row, Quantity::ErrorEstimate);
            self.worst_error_estimate = self.worst_error_estimate.max(estimate);
            self.above_tolerance += u64::from(estimate > self.spec.tolerance);
        } else {
            self.failed += 1;
        }
    }

    pub fn report(&self, checking: bool) {
        let Some(progress) = self.options.progress else { return };
        let rows = self.solved + self.in_table;
        let rate = rows as f64 / self.start.elapsed().as_secs_f64().max(1e-9);
        let elsewhere = self.others.as_ref().map_or(0, |others| others.elsewhere.load(Ordering::Relaxed));
        let done = (self.resumed + rows + elsewhere).min(self.total);
        let left = (rate > 0.0).then(|| Duration::from_secs_f64((self.total - done) as f64 / rate));
        progress(&Progress { done, total: self.total, failed: self.failed, rate, left, checking });
    }
}
