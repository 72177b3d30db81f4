//! The next points of a trajectory, solved together: what a point at a time comes to, in fewer registers.
//!
//! Of all inputs near those of the point before, a point takes the nearest that bring the tip to its target: z_k - z_(k-1)
//! lies in the range of J_kᵀ. That fixes currents which the tip does not need, so that the points of a window are the
//! solution of one system; each pass solves all of them once more, then takes z_k to where J_k says that the target is.

use super::Controller;
use super::descent::{LONGEST, State, is_near};
use super::inputs::{Inputs, MOST_INPUTS};
use super::least_squares::{LEAST_DAMPING, NormalEquations, ROWS, norm2};
use super::task::Task;
use crate::backend::BackendError;
use crate::model::{Solutions, Vector};
use crate::spec::Target;
use std::sync::Arc;

/// Most points solved together: a register of the widest instructions.
pub(super) const WINDOW: usize = 8;
/// Points before them that say where they are likely to lie.
pub(super) const HISTORY: usize = 5;
/// Passes after which a window keeps what it has.
const PASSES: usize = 6;

impl Controller {
    /// States that reach the first of the next targets, as many as follow from the last ones (the latest first) without
    /// doubt: all found, within limits, each about where the one before says. Counts equilibria into `spent`.
    pub(super) fn advance(
        &mut self,
        last: &[State],
        targets: &[Target],
        spent: &mut [usize],
        solutions: &mut Solutions,
    ) -> Result<Vec<State>, BackendError> {
        let task = Arc::clone(&self.task);
        let task = &*task;
        let guess = |(ahead, target)| predict(task, last, target, (ahead + 1) as f64);
        let mut rows: Vec<_> = targets.iter().enumerate().map_while(guess).collect();
        let mut reached: Vec<State> = Vec::with_capacity(targets.len());
        for _ in 0..PASSES.min(task.options.most_iterations) {
            if rows.is_empty() {
                break;
            }
            self.engines.continued(&rows, solutions)?;
            let first = reached.len();
            spent[first..first + rows.len()].iter_mut().for_each(|spent| *spent += 1);
            let tried = std::mem::take(&mut rows);
            let mut all_settled = true;
            let mut before = reached.last().unwrap_or(&last[0]).z;
            for (row, ((z, _), target)) in tried.into_iter().zip(&targets[first..]).enumerate() {
                if !solutions.status(row).is_success() {
                    break;
                }
                let state = State::new(task, z, solutions, row);
                let correction = Correction::new(task, &state, target, &before);
                if all_settled && correction.is_settled {
                    if !follows(task, reached.last().unwrap_or(&last[0]), &state) {
                        return Ok(reached);
                    }
                    before = state.z;
                    reached.push(state);
                    continue;
                }
                all_settled = false;
                let Some(next) = moved(task, &state, &correction.change) else { break };
                before = next.0;
                rows.push(next);
            }
        }
        Ok(reached)
    }
}

/// What is left to change at a state.
struct Correction {
    change: Inputs,
    is_settled: bool,
}

impl Correction {
    /// To the inputs nearest to those `before` that bring the tip to its target.
    fn new(task: &Task, state: &State, target: &Target, before: &Inputs) -> Correction {
        let e = state.missing(task, target);
        let columns = state.jacobian(task, target);
        let equations = NormalEquations::new(&columns, &[true; MOST_INPUTS]);
        let damped = equations.damped(LEAST_DAMPING);
        let back = damped.unnoticed(std::array::from_fn(|k| before[k] - state.z[k]));
        let step = damped.step(&e);
        // Inputs that the tip does not need are told as finely, over half their range, as the tip over the rod's length.
        let settled = task.options.tolerance / task.length;
        let is_settled = norm2(&e).sqrt() <= task.options.tolerance && back.iter().all(|dz| dz.abs() <= settled);
        Correction { change: std::array::from_fn(|k| step[k] + back[k]), is_settled }
    }
}

/// Scaled inputs and base moment after a change, to first order; `None` at and beyond limits.
fn moved(task: &Task, state: &State, change: &Inputs) -> Option<(Inputs, Vector)> {
    let z: Inputs = std::array::from_fn(|k| state.z[k] + change[k]);
    let is_within = (0..task.inputs.len()).all(|k| task.low(k) < z[k] && z[k] < task.high(k));
    is_within.then(|| (z, state.moment_after(change)))
}

/// Scaled inputs and base moment for a target so many points ahead of the last state.
///
/// The last points, continued by the polynomial that misses the target least, and what it misses to first order.
fn predict(task: &Task, last: &[State], target: &Target, ahead: f64) -> Option<(Inputs, Vector)> {
    let missing: Vec<[f64; ROWS]> = last.iter().map(|state| state.missing(task, target)).collect();
    let mut best = (f64::INFINITY, [0.0; HISTORY], [0.0; ROWS]);
    for count in 1..=last.len().min(HISTORY) {
        let weights = continuation(count, ahead);
        let mut left = [0.0; ROWS];
        for (weight, missing) in weights.iter().zip(&missing) {
            (0..ROWS).for_each(|row| left[row] += weight * missing[row]);
        }
        let size = norm2(&left);
        if size < best.0 {
            best = (size, weights, left);
        }
    }
    let (_, weights, left) = best;
    let mut state = last[0].clone();
    (state.z, state.m0) = ([0.0; MOST_INPUTS], [0.0; 3]);
    for (weight, before) in weights.iter().zip(last) {
        (0..MOST_INPUTS).for_each(|k| state.z[k] += weight * before.z[k]);
        (0..3).for_each(|axis| state.m0[axis] += weight * before.m0[axis]);
    }
    let columns = state.jacobian(task, target);
    let step = NormalEquations::new(&columns, &[true; MOST_INPUTS]).damped(LEAST_DAMPING).step(&left);
    moved(task, &state, &step)
}

/// Lagrange's weights at `ahead` of values at 0, -1, ..., 1 - count.
fn continuation(count: usize, ahead: f64) -> [f64; HISTORY] {
    std::array::from_fn(|i| {
        let factor = |other: usize| (ahead + other as f64) / (other as f64 - i as f64);
        if i < count { (0..count).filter(|other| *other != i).map(factor).product() } else { 0.0 }
    })
}

/// Whether a state is the continuation of the one before: a short step, and the base moment changes by about what the
/// derivatives at either end say.
fn follows(task: &Task, before: &State, state: &State) -> bool {
    let change: Inputs = std::array::from_fn(|k| state.z[k] - before.z[k]);
    let back = change.map(|dz| -dz);
    let is_short = change.iter().all(|dz| dz.abs() <= LONGEST);
    let forward = before.moment_after(&change);
    let backward = state.moment_after(&back);
    is_short && is_near(task, state.m0, forward, before.m0) && is_near(task, before.m0, backward, state.m0)
}
