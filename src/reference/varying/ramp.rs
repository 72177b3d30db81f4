//! From rest to the full load in a field that stays: the rod's dipoles and all other loads grow together, and every
//! step must stay on the stable branch and clear of magnets.

use super::hessian::{Stability, stability};
use super::passage::{Passage, combined};
use super::shooting::pass_by_sections;
use super::state::{BaseLoad, Column, Varying};
use crate::reference::extrapolation::Extrapolation;
use crate::reference::ramp::{
    ALIKE, ARRIVED, ARRIVED_TURN, CONTRACTION, CORRECTION, CORRECTION_TURN, DEPARTURE, FIRST_TURN, LITTLE_LOAD,
    MOST_PASSES, QUICK, SECTIONS, SMALLEST_STEP, TOLERANCE, differs_widely, twice,
};
use crate::reference::stability::margin;
use nalgebra::{Matrix6, Vector3, Vector6};

/// The predictor may take a station this share of the way to a magnet, in steps no smaller than `LITTLE_STEP`.
pub(super) const APPROACH: f64 = 0.2;
/// A least eigenvalue below this share of that at rest may grow or shrink so many times in a step.
pub(super) const SOFT: f64 = 0.5;
pub(super) const RATIO: f64 = 2.5;
/// A path that ends while it is above this share has met no fold; nor has one that ends with a larger margin than `FOLD_MARGIN`.
const AT_FOLD: f64 = 0.25;
pub(super) const FOLD_MARGIN: f64 = 0.25;
/// No load step need be smaller for its sake.
pub(super) const LITTLE_STEP: f64 = 1e-4;
/// Corrections are measured against this change of the base load at least, where hardly any is predicted.
pub(super) const SMALL_LOAD: f64 = 0.1;

/// How a path ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    Arrived,
    Fold,
    TooNear,
    Outside,
    GaveUp,
}

/// Where the path from rest leads.
pub(super) struct Path {
    pub base: BaseLoad,
    /// Share of the load reached.
    pub lambda: f64,
    pub steps: usize,
    pub passes: usize,
    pub end: End,
}

/// An equilibrium on the path.
struct Step {
    base: BaseLoad,
    /// d(base load)/d(lambda)
    tangent: Vector6<f64>,
    passage: Passage,
    leeway: f64,
    /// Eigenvalue of the second variation; under a dead tip moment there may be no positive one.
    least: Option<f64>,
    /// Derivative of the residual by the base load, world frame.
    w: Matrix6<f64>,
    fast: bool,
}

enum Refused {
    TooNear,
    Outside,
    Other,
}

/// Follows the equilibrium from the unloaded rod as far as it stays stable, and whether two paths ended alike.
pub(super) fn from_rest(rod: &Varying) -> (Path, bool) {
    twice(
        None,
        |pace| follow(rod, pace),
        |a, b| {
            let same_load = (a.lambda - b.lambda).abs() <= ALIKE * b.lambda && a.end == b.end;
            let apart = (a.base.n - b.base.n).norm().max((a.base.m_body - b.base.m_body).norm());
            same_load && (b.end != End::Arrived || apart <= ALIKE * (1.0 + b.base.norm()))
        },
    )
}

/// Follows it by steps and corrections of a share of the usual size.
fn follow(rod: &Varying, pace: f64) -> Path {
    let mut path = Path { base: BaseLoad::zero(), lambda: 0.0, steps: 0, passes: 1, end: End::Fold };
    let mut integrator = Extrapolation::on_the_way(TOLERANCE);
    let rest = correct(rod, (0.0, pace), path.base, Vector6::zeros(), &mut integrator, &mut path.passes);
    let mut last = match rest {
        Ok(rest) => rest,
        Err(Refused::TooNear) => return Path { end: End::TooNear, ..path },
        Err(Refused::Outside) => return Path { end: End::Outside, ..path },
        Err(Refused::Other) => return path,
    };
    let mut step = first_step(&last, pace);
    let at_rest = last.least.unwrap_or(1.0);
    let (soft, at_fold) = (SOFT * at_rest, AT_FOLD * at_rest);
    let (mut too_near, mut outside) = (false, false);
    while path.lambda < 1.0 {
        if path.passes >= MOST_PASSES {
            return Path { end: End::GaveUp, ..path };
        }
        let lambda = if path.lambda + step >= 1.0 { 1.0 } else { path.lambda + step };
        let predicted = last.tangent * (lambda - path.lambda);
        let found = correct(rod, (lambda, pace), path.base, predicted, &mut integrator, &mut path.passes);
        match found.and_then(|next| if continues(rod, &last, &next, soft) { Ok(next) } else { Err(Refused::Other) }) {
            Ok(next) => {
                (too_near, outside) = (false, false);
                path.steps += 1;
                step = (step * if next.fast { 2.0 } else { 1.0 }).min(first_step(&next, pace));
                if let (Some(before), Some(least)) = (last.least, next.least)
                    && least < soft
                {
                    // As far as it takes, as things go, to half of it.
                    let slope = (before - least).abs() / (lambda - path.lambda);
                    step = step.min((0.5 * least / slope).max(pace * LITTLE_STEP));
                }
                (path.base, path.lambda) = (next.base, lambda);
                last = next;
            }
            Err(refused) => {
                too_near |= matches!(refused, Refused::TooNear);
                outside |= matches!(refused, Refused::Outside);
                step = 0.5 * (lambda - path.lambda);
                if step < pace * SMALLEST_STEP * path.lambda.max(LITTLE_LOAD) {
                    path.end = match (too_near, outside) {
                        (true, _) => End::TooNear,
                        (_, true) => End::Outside,
                        _ if is_firm(&last) => End::GaveUp,
                        _ if !rod.chain.has_no_energy() && last.least.is_none_or(|least| least > at_fold) => {
                            End::GaveUp
                        }
                        _ => End::Fold,
                    };
                    return path;
                }
            }
        }
    }
    Path { end: End::Arrived, ..path }
}

/// Whether dr/dm0 is far from singular: then no load turns there.
fn is_firm(at: &Step) -> bool {
    margin(at.passage.moment_inverse(), false) > FOLD_MARGIN
}

/// Whether a load step stays on the branch: the least eigenvalue stays positive and changes little where it is small, or, under a
/// dead tip moment, the derivative of the residual changes so little that its determinant keeps its sign. S6
fn continues(rod: &Varying, last: &Step, next: &Step, soft: f64) -> bool {
    let stays_definite = last.least.zip(next.least).is_some_and(|(before, least)| !leaps(least, before, soft));
    let change = || last.w.try_inverse().map_or(f64::NAN, |inverse| (inverse * next.w - Matrix6::identity()).norm());
    stays_definite || rod.chain.has_no_energy() && change() < DEPARTURE
}

/// Whether a step changes the least eigenvalue so much, where it is small, that stability may be lost and won again between.
fn leaps(least: f64, last: f64, soft: f64) -> bool {
    differs_widely(least, last, soft, RATIO)
}

/// A step of the load after which a tangent still tells.
fn first_step(at: &Step, pace: f64) -> f64 {
    let moved = |of: fn(&Column) -> Vector3<f64>| -> f64 {
        at.passage.largest(|columns| (of(&columns[6]) + combined(columns, of, &at.tangent)).norm())
    };
    let turn = pace * FIRST_TURN / moved(|column| column.w);
    let approach = APPROACH * at.leeway / moved(|column| column.dp);
    turn.min(approach.max(pace * LITTLE_STEP)).min(1.0)
}

/// Newton's iteration from the predicted load: the equilibrium it contracts to.
fn correct(
    rod: &Varying,
    (lambda, pace): (f64, f64),
    base: BaseLoad,
    predicted: Vector6<f64>,
    integrator: &mut Extrapolation,
    passes: &mut usize,
) -> Result<Step, Refused> {
    let loaded = rod.loaded(lambda);
    let mut changes = loaded.base_changes();
    changes.push(rod.load_change(lambda));
    let mut base = base.moved(&predicted);
    let allowed_turn = pace * CORRECTION_TURN;
    let allowed_first = pace * CORRECTION * predicted.norm().max(SMALL_LOAD);
    let mut allowed = allowed_first;
    let mut first = None;
    loop {
        let passage = pass_by_sections(&loaded, &base, &changes, SECTIONS, integrator).map_err(|_| Refused::Other)?;
        *passes += 1;
        let matrix = passage.matrix().lu();
        let step: Vector6<f64> = matrix.solve(&-passage.residual).ok_or(Refused::Other)?;
        let size = step.norm();
        let turn = passage.largest(|columns| combined(columns, |column| column.w, &step).norm());
        let share = *first.get_or_insert((size / allowed_first).max(turn / allowed_turn));
        if size <= ARRIVED * (1.0 + base.norm()) && turn <= ARRIVED_TURN {
            *passes += 1;
            let found = stability(&loaded, &base, None, integrator).ok_or(Refused::Other)?;
            let Stability { leeway, inside, .. } = found;
            if leeway <= 0.0 {
                return Err(Refused::TooNear);
            }
            if inside <= 0.0 {
                return Err(Refused::Outside);
            }
            let least = found.least_eigenvalue();
            if least.is_none() && !rod.chain.has_no_energy() {
                return Err(Refused::Other);
            }
            let mut w = passage.matrix();
            let of_moment = passage.tip.R * w.fixed_rows::<3>(3);
            w.fixed_rows_mut::<3>(3).copy_from(&of_moment);
            let tangent = matrix.solve(&-passage.dresidual[6]).ok_or(Refused::Other)?;
            return Ok(Step { base: base.moved(&step), tangent, passage, leeway, least, w, fast: share < QUICK });
        }
        // Also false for NaN.
        let contracts = size <= allowed && turn <= allowed_turn;
        if !contracts {
            return Err(Refused::Other);
        }
        allowed = CONTRACTION * size;
        base = base.moved(&step);
    }
}
