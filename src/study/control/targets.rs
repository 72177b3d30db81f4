//! Many targets at once: each starts from near tips of a coarse table, all are solved together, those that have ended
//! stay as they are.

use super::controller::GROUP;
use super::descent::{Descent, Ended, State};
use super::engines::{LOST, estimate};
use super::inputs::MOST_INPUTS;
use super::least_squares::norm2;
use super::task::Task;
use super::{ControlError, Controller, Outcome, TargetOptions, TargetResult};
use crate::model::Solutions;
use crate::spec::Target;
use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;

/// Starts of one target differ by more than this in some input, over half its range; further ones by more.
const APART: f64 = 0.25;
const FAR_APART: f64 = 1.0;
/// Little, over the rod's length: so near to a target that can be reached a search may end where J is singular.
const LITTLE: f64 = 0.01;

impl Controller {
    /// Inputs for each of many targets, whatever their order. `progress` hears how many have ended.
    ///
    /// # Errors
    ///
    /// No stable equilibrium within the limits, or an engine that fails.
    pub fn reach(
        &mut self,
        targets: &[Target],
        options: &TargetOptions,
        progress: &mut dyn FnMut(usize),
    ) -> Result<Vec<TargetResult>, ControlError> {
        let begun = Instant::now();
        let mut results = Vec::with_capacity(targets.len());
        for group in targets.chunks(GROUP) {
            let before = results.len();
            results.extend(self.reach_group(group, options, &mut |ended| progress(before + ended))?);
        }
        let seconds = begun.elapsed().as_secs_f64() / targets.len().max(1) as f64;
        results.iter_mut().for_each(|result| result.seconds = seconds);
        Ok(results)
    }

    fn reach_group(
        &mut self,
        targets: &[Target],
        options: &TargetOptions,
        progress: &mut dyn FnMut(usize),
    ) -> Result<Vec<TargetResult>, ControlError> {
        let table = self.table(options.table)?;
        let table = table.as_slice();
        let task = Arc::clone(&self.task);
        let task = &*task;
        let little = LITTLE * self.task.length;
        let start = |target: &Target, attempt: usize| {
            // Of those farther apart the first has been tried.
            let (rank, apart) = match attempt.checked_sub(options.attempts) {
                None => (attempt, APART),
                Some(further) => (further + 1, FAR_APART),
            };
            let state = table[*nearest(task, table, target, rank + 1, apart).get(rank)?].clone();
            Some(Descent::new(task, state, *target))
        };
        let mut best: Vec<Descent> = targets.par_iter().filter_map(|target| start(target, 0)).collect();
        self.descend_all(&mut best, progress)?;
        let mut results = self.results(&ended(task, &best))?;
        for attempt in 1..options.attempts + options.further {
            let wanting = |i: &usize| {
                let TargetResult { outcome, from_rest, residual, .. } = results[*i];
                match attempt < options.attempts {
                    true => outcome != Outcome::Reached || !from_rest,
                    false => outcome != Outcome::Reached && residual < little,
                }
            };
            let left: Vec<usize> = (0..targets.len()).filter(wanting).collect();
            let again = left.par_iter().filter_map(|i| Some((*i, start(&targets[*i], attempt)?)));
            let (left, mut others): (Vec<usize>, Vec<Descent>) = again.unzip();
            if left.is_empty() {
                break;
            }
            self.descend_all(&mut others, &mut |_| {})?;
            for (i, other) in left.into_iter().zip(self.results(&ended(task, &others))?) {
                let iterations = results[i].iterations + other.iterations;
                let is_better = better(&other, &results[i]);
                if is_better {
                    results[i] = other;
                }
                results[i].iterations = iterations;
            }
        }
        self.look_closely(&mut results, little)?;
        Ok(results)
    }

    /// Goes on at the highest resolution where little is missing.
    fn look_closely(&mut self, results: &mut [TargetResult], little: f64) -> Result<(), ControlError> {
        let wanting = |i: &usize| results[*i].outcome != Outcome::Reached && results[*i].residual < little;
        let left: Vec<usize> = (0..results.len()).filter(wanting).collect();
        let finest = self.engines.finest();
        let before = std::mem::replace(&mut self.engines.resolution, finest);
        if before < self.engines.resolution && !left.is_empty() {
            let mut again: Vec<TargetResult> = left.iter().map(|i| results[*i].clone()).collect();
            self.finish(&mut again)?;
            for (i, again) in left.into_iter().zip(again) {
                if better(&again, &results[i]) {
                    results[i] = again;
                }
            }
        }
        self.engines.resolution = before;
        Ok(())
    }

    /// Goes on from results of another engine (f32) in this one's arithmetic.
    ///
    /// # Errors
    ///
    /// An engine that fails.
    pub fn finish(&mut self, results: &mut [TargetResult]) -> Result<(), ControlError> {
        results.chunks_mut(GROUP).try_for_each(|group| self.finish_group(group))
    }

    fn finish_group(&mut self, results: &mut [TargetResult]) -> Result<(), ControlError> {
        let begun = Instant::now();
        let task = Arc::clone(&self.task);
        let task = &*task;
        let rows: Vec<_> = results
            .iter()
            .map(|result| {
                let mut z = [0.0; MOST_INPUTS];
                (0..result.inputs.len()).for_each(|k| z[k] = result.inputs[k] / self.task.scale(k));
                (z, result.base_moment)
            })
            .collect();
        let mut solutions = Solutions::default();
        self.engines.continued(&rows, &mut solutions)?;
        // Where this engine finds no stable equilibrium, what the other one found is not to be trusted.
        let found: Vec<usize> = (0..rows.len()).filter(|row| solutions.status(*row).is_success()).collect();
        let start =
            |row: &usize| Descent::new(task, State::new(task, rows[*row].0, &solutions, *row), results[*row].target);
        let mut descents: Vec<Descent> = found.par_iter().map(start).collect();
        self.descend_all(&mut descents, &mut |_| {})?;
        let finished = self.results(&ended(task, &descents))?;
        for (row, result) in results.iter_mut().enumerate() {
            if found.binary_search(&row).is_err() {
                result.outcome = Outcome::Stuck;
            }
        }
        let seconds = begun.elapsed().as_secs_f64() / results.len().max(1) as f64;
        for (row, better) in found.into_iter().zip(finished) {
            let before = &results[row];
            let (iterations, seconds) = (before.iterations + 1 + better.iterations, before.seconds + seconds);
            results[row] = TargetResult { iterations, seconds, ..better };
        }
        Ok(())
    }

    /// Stable equilibria from rest, evenly over the permitted inputs; those of the last call, if as many are wanted again.
    fn table(&mut self, count: usize) -> Result<Arc<Vec<State>>, ControlError> {
        if let Some((_, table)) = self.tabled.as_ref().filter(|(tabled, _)| *tabled == count) {
            return Ok(Arc::clone(table));
        }
        let mut rows = vec![self.home];
        rows.extend((0..count).map(|k| self.task.lattice(k)));
        let solutions = self.engines.solve_from_rest(&rows)?;
        let state = |(row, z)| State::new(&self.task, z, &solutions, row);
        let stable = |(row, _): &(usize, _)| estimate(&solutions, *row) <= LOST;
        let table: Vec<State> = rows.into_iter().enumerate().filter(stable).map(state).collect();
        if table.is_empty() {
            return Err(ControlError::NoTable(count + 1));
        }
        let table = Arc::new(table);
        self.tabled = Some((count, Arc::clone(&table)));
        Ok(table)
    }

    /// Until every search has ended.
    fn descend_all(&mut self, descents: &mut [Descent], progress: &mut dyn FnMut(usize)) -> Result<(), ControlError> {
        let mut solutions = Solutions::default();
        loop {
            let task = Arc::clone(&self.task);
            let task = &*task;
            let proposals: Vec<_> = descents.par_iter_mut().map(|descent| descent.propose(task)).collect();
            let rows: Vec<_> = proposals.iter().flatten().copied().collect();
            progress(descents.len() - rows.len());
            if rows.is_empty() {
                return Ok(());
            }
            self.engines.continued(&rows, &mut solutions)?;
            let solutions = &solutions;
            let mut row = 0;
            let rows: Vec<Option<usize>> =
                proposals.iter().map(|proposal| proposal.map(|_| (row, row += 1).0)).collect();
            descents.par_iter_mut().zip(rows).for_each(|(descent, row)| {
                if let Some(row) = row {
                    descent.judge(task, solutions, row);
                }
            });
        }
    }
}

/// The ends of searches.
fn ended(task: &Task, descents: &[Descent]) -> Vec<Ended> {
    descents.iter().map(|descent| descent.ended(task)).collect()
}

/// Whether one result is to be preferred to another. The equilibrium from rest is the one that a catheter takes when it
/// is switched on.
fn better(one: &TargetResult, other: &TargetResult) -> bool {
    let rank = |result: &TargetResult| (result.outcome != Outcome::Reached, !result.from_rest);
    let is_nearer = rank(one).0 && one.residual < other.residual;
    rank(one) < rank(other) || rank(one) == rank(other) && is_nearer
}

/// The nearest tips of a table, with inputs that differ.
fn nearest(task: &Task, table: &[State], target: &Target, count: usize, apart: f64) -> Vec<usize> {
    let distances: Vec<f64> = table.iter().map(|state| norm2(&state.missing(task, target))).collect();
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < count.max(1) {
        let differs = |i: &usize| {
            let are = |j: &usize| table[*i].z.iter().zip(&table[*j].z).any(|(a, b)| (a - b).abs() > apart);
            chosen.iter().all(are)
        };
        let next = (0..table.len()).filter(differs).min_by(|a, b| distances[*a].total_cmp(&distances[*b]));
        match next {
            Some(i) => chosen.push(i),
            None => break,
        }
    }
    chosen
}
