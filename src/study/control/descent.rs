//! One target: damped least squares on the analytic Jacobian, i += Jᵀ (J Jᵀ + μ I)⁻¹ (x_d − x(i)), within limits.
//!
//! A state machine, so that one loop serves a trajectory and a hundred thousand targets: `propose` says where to solve
//! next, `judge` takes what came back. Inputs are scaled by half their range; the damping follows the gain.

use super::Outcome;
use super::engines::{LOST, estimate};
use super::inputs::{Inputs, MOST_INPUTS};
use super::least_squares::{Columns, LEAST_DAMPING, NormalEquations, ROWS, dot, norm2};
use super::task::Task;
use crate::model::{Parameter, Quantity, Solutions, Vector, WallParameter};
use crate::results::Contact;
use crate::spec::{Redundancy, Target};

/// Damping over the mean eigenvalue of J Jᵀ: first, and where a search ends in vain. As long as much is missing
/// (over the tip's travel), it is at least `LEAST_DAMPING`.
const FIRST_DAMPING: f64 = 1e-4;
const MUCH: f64 = 0.01;
const MOST_DAMPING: f64 = 1e8;
/// A step in vain raises the damping by so much, the next in a row by twice as much; from where it stands, since where J
/// is nearly singular only a small damping lets the tip move at all.
const RISE: f64 = 8.0;
const SMALL_DAMPING: f64 = 1e-12;
/// What a step of some gain or more makes of the damping.
const EASING: [(f64, f64); 2] = [(0.75, 0.05), (0.25, 0.5)];
/// Longest step of one input, over half its range.
pub(super) const LONGEST: f64 = 0.3;
/// A search that leaves more than this share of what was missing so many iterations ago has come as near as it can.
const HARDLY: f64 = 0.9999;
const PATIENCE: usize = 8;
/// No input changes by less (over half its range) without the search being at its end.
const SHORTEST: f64 = 1e-11;
/// A point is stationary where no input that is free to move has more than this share of the gradient's bound.
const STATIONARY: f64 = 1e-6;
/// Largest distance of the new base moment from its prediction: over the predicted change, and in the rod's unit.
const ASTRAY: f64 = 0.5;
const CLOSE: f64 = 1e-3;
/// Share of the way to the smallest currents that a step goes along directions in which the tip stays.
const RELAXATION: f64 = 0.5;
/// Square of the longest such step over the length of the other.
const SECOND_ORDER: f64 = 0.02;

/// An equilibrium and what the inputs do to it. Inputs are scaled.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub z: Inputs,
    pub m0: Vector,
    pub tip: Vector,
    pub tangent: Vector,
    pub margin: f64,
    pub error_estimate: f64,
    pub contact: Option<Contact>,
    /// By the scaled inputs: tip position, tangent, base moment.
    rates: [[f64; 9]; MOST_INPUTS],
    /// Likewise: by how much the tip presses.
    pressing: Inputs,
}

/// An ended search without what only its steps need: a million of them fit into memory.
#[derive(Clone, Debug)]
pub(super) struct Ended {
    pub target: Target,
    pub z: Inputs,
    pub m0: Vector,
    pub tip: Vector,
    pub tangent: Vector,
    pub margin: f64,
    pub error_estimate: f64,
    pub contact: Option<Contact>,
    /// Distance to the target (m), a missing tangent and a missing force included as lengths.
    pub residual: f64,
    pub iterations: usize,
    pub outcome: Outcome,
}

/// Whether a base moment is about where it was predicted, from one that was there before.
pub(super) fn is_near(task: &Task, m0: Vector, predicted: Vector, before: Vector) -> bool {
    let distance = |a: Vector, b: Vector| norm2(&[a[0] - b[0], a[1] - b[1], a[2] - b[2]]).sqrt();
    distance(m0, predicted) <= ASTRAY * distance(predicted, before) + CLOSE * task.unit
}

impl State {
    /// Row `at` of a solution.
    pub(crate) fn new(task: &Task, z: Inputs, solutions: &Solutions, at: usize) -> State {
        let tangent = solutions.vector(at, Quantity::TipTangent);
        let mut rates = [[0.0; 9]; MOST_INPUTS];
        for (k, rates) in rates.iter_mut().enumerate().take(task.inputs.len()) {
            let row = |row: usize| solutions.derivative(at, k, row) * task.scale(k);
            let w = [row(3), row(4), row(5)];
            let turn: Vector =
                std::array::from_fn(|a| w[(a + 1) % 3] * tangent[(a + 2) % 3] - w[(a + 2) % 3] * tangent[(a + 1) % 3]);
            *rates = [row(0), row(1), row(2), turn[0], turn[1], turn[2], row(6), row(7), row(8)];
        }
        let contact = Contact::beside(task.wall.as_ref(), solutions, at);
        let mut pressing = [0.0; MOST_INPUTS];
        if let Some(contact) = &contact {
            for (k, pressing) in pressing.iter_mut().enumerate().take(task.inputs.len()) {
                *pressing = match contact.touching {
                    true => task.yielding * solutions.force_derivative(at, k)[0] * task.scale(k),
                    false => -gap_rate(task, contact, k, &rates[k]),
                };
            }
        }
        State {
            z,
            m0: solutions.vector(at, Quantity::BaseMoment),
            tip: solutions.vector(at, Quantity::TipPosition),
            tangent,
            margin: solutions.get(at, Quantity::StabilityMargin),
            error_estimate: solutions.get(at, Quantity::ErrorEstimate),
            contact,
            rates,
            pressing,
        }
    }

    /// How hard the tip presses, as the length that such a force bends the rod; away from the wall less than nothing (m).
    fn press(&self, task: &Task) -> f64 {
        let press = |contact: &Contact| match contact.touching {
            true => task.yielding * contact.normal_force,
            false => -contact.gap,
        };
        self.contact.as_ref().map_or(f64::NAN, press)
    }

    /// The base moment after a small change of the inputs, to first order (N·m).
    pub(crate) fn moment_after(&self, change: &Inputs) -> Vector {
        let mut m0 = self.m0;
        for (rates, dz) in self.rates.iter().zip(change) {
            (0..3).for_each(|a| m0[a] += rates[6 + a] * dz);
        }
        m0
    }

    /// Residual of a target: differences of the controlled coordinates (m), of the tangent times its weight (m), and of the force as a length (m).
    pub(crate) fn missing(&self, task: &Task, target: &Target) -> [f64; ROWS] {
        let mut e = [0.0; ROWS];
        let way = std::array::from_fn(|a| target.position[a] - self.tip[a]);
        e[..3].copy_from_slice(&task.options.controlled(way));
        if let Some(tangent) = target.tangent {
            (0..3).for_each(|a| e[3 + a] = task.options.tangent_weight * (tangent[a] - self.tangent[a]));
        }
        if let Some(force) = target.normal_force {
            e[6] = task.yielding * force - self.press(task);
        }
        e
    }

    /// Derivatives of the controlled numbers by the scaled inputs.
    pub(crate) fn jacobian(&self, task: &Task, target: &Target) -> Columns {
        let mut columns = [[0.0; ROWS]; MOST_INPUTS];
        for ((column, rates), pressing) in columns.iter_mut().zip(&self.rates).zip(self.pressing) {
            column[..3].copy_from_slice(&task.options.controlled([rates[0], rates[1], rates[2]]));
            let weight = if target.tangent.is_some() { task.options.tangent_weight } else { 0.0 };
            (0..3).for_each(|a| column[3 + a] = weight * rates[3 + a]);
            column[6] = if target.normal_force.is_some() { pressing } else { 0.0 };
        }
        columns
    }
}

/// How the gap of a tip that does not touch follows a scaled input (m).
fn gap_rate(task: &Task, contact: &Contact, k: usize, rates: &[f64; 9]) -> f64 {
    let by_tip: f64 = (0..3).map(|axis| contact.normal[axis] * rates[axis]).sum();
    match task.inputs[k].parameter {
        Parameter::Wall(WallParameter::Position(axis)) => by_tip - contact.normal[axis.index()] * task.scale(k),
        _ => by_tip,
    }
}

impl Ended {
    /// Estimated error of what is controlled, over the rod's length.
    pub(crate) fn error(&self, task: &Task) -> f64 {
        let of_force = |contact: &Contact| match (self.target.normal_force, contact.touching) {
            (Some(_), true) => task.yielding * contact.force_error / task.length,
            _ => 0.0,
        };
        // Also NaN where either is.
        let force = self.contact.as_ref().map_or(0.0, of_force);
        if force > self.error_estimate || force.is_nan() { force } else { self.error_estimate }
    }
}

/// The way to one target.
#[derive(Clone, Debug)]
pub(super) struct Descent {
    pub at: State,
    pub target: Target,
    /// Equilibria computed.
    pub iterations: usize,
    pub outcome: Option<Outcome>,
    damping: f64,
    rise: f64,
    trial: Inputs,
    trial_m0: Vector,
    /// |e|² that the step should leave.
    promised: f64,
    /// What was missing at the last check of the progress, and the next check.
    checked: f64,
    next_check: usize,
}

impl Descent {
    pub(crate) fn new(task: &Task, at: State, target: Target) -> Descent {
        let (trial, trial_m0) = (at.z, at.m0);
        let mut descent = Descent {
            at,
            target,
            iterations: 0,
            outcome: None,
            damping: FIRST_DAMPING,
            rise: RISE,
            trial,
            trial_m0,
            promised: 0.0,
            checked: f64::INFINITY,
            next_check: PATIENCE,
        };
        descent.settle(task);
        descent
    }

    /// The end of the search.
    pub(crate) fn ended(&self, task: &Task) -> Ended {
        let State { z, m0, tip, tangent, margin, error_estimate, contact, .. } = self.at;
        Ended {
            target: self.target,
            z,
            m0,
            tip,
            tangent,
            margin,
            error_estimate,
            contact,
            residual: norm2(&self.at.missing(task, &self.target)).sqrt(),
            iterations: self.iterations,
            outcome: self.outcome.unwrap_or(Outcome::IterationLimit),
        }
    }

    fn settle(&mut self, task: &Task) {
        if norm2(&self.at.missing(task, &self.target)).sqrt() <= task.options.tolerance {
            self.outcome = Some(Outcome::Reached);
        }
    }

    /// The scaled inputs to solve for and the base moment to start from; `None` once the search has ended.
    pub(crate) fn propose(&mut self, task: &Task) -> Option<(Inputs, Vector)> {
        if self.outcome.is_none() && self.iterations >= task.options.most_iterations {
            self.outcome = Some(Outcome::IterationLimit);
        }
        if self.outcome.is_some() {
            return None;
        }
        let e = self.at.missing(task, &self.target);
        let columns = self.at.jacobian(task, &self.target);
        if let Some(outcome) = self.stationary(task, &columns, &e).or_else(|| self.hardly_moves(task, &e)) {
            self.outcome = Some(outcome);
            return None;
        }
        let count = task.inputs.len();
        let travel = columns[..count].iter().map(norm2).sum::<f64>().sqrt();
        let share = (norm2(&e).sqrt() / (MUCH * travel + f64::MIN_POSITIVE)).min(1.0);
        self.damping = self.damping.max(LEAST_DAMPING * share);
        let step = self.step(task, &columns, &e);
        if step[..count].iter().all(|dz| dz.abs() < SHORTEST) {
            self.outcome = Some(Outcome::Stuck);
            return None;
        }
        let (mut left, mut change) = (e, [0.0; MOST_INPUTS]);
        for k in 0..count {
            self.trial[k] = (self.at.z[k] + step[k]).clamp(task.low(k), task.high(k));
            change[k] = self.trial[k] - self.at.z[k];
            (0..ROWS).for_each(|row| left[row] -= columns[k][row] * change[k]);
        }
        self.trial_m0 = self.at.moment_after(&change);
        self.promised = norm2(&left);
        Some((self.trial, self.trial_m0))
    }

    /// Takes the equilibrium at what was proposed; goes there if it is stable, where it should be, and nearer.
    pub(crate) fn judge(&mut self, task: &Task, solutions: &Solutions, row: usize) {
        self.iterations += 1;
        let before = norm2(&self.at.missing(task, &self.target));
        // Also false for NaN.
        if estimate(solutions, row) <= LOST {
            let m0 = solutions.vector(row, Quantity::BaseMoment);
            let near = is_near(task, m0, self.trial_m0, self.at.m0);
            let state = State::new(task, self.trial, solutions, row);
            let after = norm2(&state.missing(task, &self.target));
            let gain = (before - after) / (before - self.promised);
            let arrived = after.sqrt() <= task.options.tolerance;
            if near && (arrived || (gain > 1e-3 && after < before)) {
                self.at = state;
                self.damping *= EASING.iter().find(|(least, _)| gain > *least).map_or(1.0, |(_, factor)| *factor);
                self.rise = RISE;
                self.settle(task);
                return;
            }
        }
        self.damping = self.damping.max(SMALL_DAMPING) * self.rise;
        self.rise *= 2.0;
        if self.damping > MOST_DAMPING {
            self.outcome = Some(Outcome::Stuck);
        }
    }

    /// Whether no permitted change of the inputs brings the tip nearer, to first order (Karush, Kuhn and Tucker).
    fn stationary(&self, task: &Task, columns: &Columns, e: &[f64; ROWS]) -> Option<Outcome> {
        let count = task.inputs.len();
        let size = columns[..count].iter().map(norm2).sum::<f64>().sqrt() * norm2(e).sqrt();
        let mut held = false;
        for (k, column) in columns.iter().enumerate().take(count) {
            let slope = dot(column, e);
            let at_low = self.at.z[k] <= task.low(k) && slope < 0.0;
            let at_high = self.at.z[k] >= task.high(k) && slope > 0.0;
            if slope.abs() > STATIONARY * size {
                if !(at_low || at_high) {
                    return None;
                }
                held = true;
            }
        }
        Some(if held { Outcome::AtLimit } else { Outcome::Unreachable })
    }

    /// Whether the last iterations brought next to nothing: where J is singular, the way to the nearest point is endless.
    fn hardly_moves(&mut self, task: &Task, e: &[f64; ROWS]) -> Option<Outcome> {
        if self.iterations < self.next_check {
            return None;
        }
        let missing = norm2(e).sqrt();
        let hardly = missing > HARDLY * self.checked;
        (self.checked, self.next_check) = (missing, self.iterations + PATIENCE);
        let held = (0..task.inputs.len()).any(|k| self.at.z[k] <= task.low(k) || self.at.z[k] >= task.high(k));
        hardly.then_some(if held { Outcome::AtLimit } else { Outcome::Unreachable })
    }

    /// Bounded least squares: inputs that the damped step takes past a limit are put on it, the others solved again.
    fn step(&self, task: &Task, columns: &Columns, e: &[f64; ROWS]) -> Inputs {
        let count = task.inputs.len();
        let mut free = [true; MOST_INPUTS];
        let mut step = [0.0; MOST_INPUTS];
        for _ in 0..=count {
            let mut left = *e;
            for k in (0..count).filter(|k| !free[*k]) {
                (0..ROWS).for_each(|row| left[row] -= columns[k][row] * step[k]);
            }
            self.free_step(task, columns, &left, &free, &mut step);
            let past = |k: &usize| {
                let z = self.at.z[*k] + step[*k];
                (task.low(*k) - z).max(z - task.high(*k))
            };
            let worst = (0..count).filter(|k| free[*k]).max_by(|a, b| past(a).total_cmp(&past(b)));
            match worst.filter(|k| past(k) > 0.0) {
                None => break,
                Some(k) => {
                    let z = (self.at.z[k] + step[k]).clamp(task.low(k), task.high(k));
                    (free[k], step[k]) = (false, z - self.at.z[k]);
                }
            }
        }
        let longest = step[..count].iter().fold(0.0f64, |longest, dz| longest.max(dz.abs()));
        if longest > LONGEST { step.map(|dz| dz * LONGEST / longest) } else { step }
    }

    /// (34), (35): the damped step of the inputs that are free.
    fn free_step(
        &self,
        task: &Task,
        columns: &Columns,
        e: &[f64; ROWS],
        free: &[bool; MOST_INPUTS],
        step: &mut Inputs,
    ) {
        let equations = NormalEquations::new(columns, free);
        let free = || (0..task.inputs.len()).filter(|k| free[*k]);
        let descent = equations.damped(self.damping).step(e);
        free().for_each(|k| step[k] = descent[k]);
        if task.options.redundancy == Redundancy::LeastCurrent {
            // Towards zero, as far as the tip does not notice.
            let mut relaxed = [0.0; MOST_INPUTS];
            free().filter(|k| task.is_current(*k)).for_each(|k| relaxed[k] = -RELAXATION * self.at.z[k]);
            let relaxed = equations.damped(LEAST_DAMPING).unnoticed(relaxed);
            // What a long step of this kind does to the tip in second order must not undo what the other achieves.
            let largest = |of: &dyn Fn(usize) -> f64| free().map(|k| of(k).abs()).fold(f64::MIN_POSITIVE, f64::max);
            let caution = (FIRST_DAMPING / self.damping).min(1.0);
            let bound = caution * (SECOND_ORDER * largest(&|k| step[k])).sqrt();
            let share = (bound / largest(&|k| relaxed[k])).min(1.0);
            free().for_each(|k| step[k] += share * relaxed[k]);
        }
    }
}
