//! From rest to the full load: all loads grow together, and every step must stay on the stable branch.
//!
//! Predictions and corrections are measured at every station, since coils that turn against each other leave the tip at rest. A path
//! is followed twice, by steps of two sizes, and counts where both end alike.

use super::chain::Chain;
use super::extrapolation::{Extrapolation, RunAway};
use super::places::Node;
use super::shooting::{Passage, pass_by_sections};
use super::stability;
use super::state::Column;
use nalgebra::{Matrix3, Vector3};

/// Error per step of the integrator on the way; only the end of the path must be sharp.
pub(super) const TOLERANCE: f64 = 1e-8;
/// Newton's step at which the corrector has arrived.
pub(super) const ARRIVED: f64 = 1e-5;
/// It turns no station by more (rad): a large load at the base hides a turn.
pub(super) const ARRIVED_TURN: f64 = 1e-3;
/// Each of Newton's steps must be shorter than the last by this factor.
pub(super) const CONTRACTION: f64 = 0.3;
/// The predictor may turn no station by more in the first step (rad).
pub(super) const FIRST_TURN: f64 = 0.5;
/// Corrections may be this large against the predicted step, ...
pub(super) const CORRECTION: f64 = 0.3;
/// ... or against this change of the base moment, where hardly any is predicted.
const SMALL_MOMENT: f64 = 0.1;
/// No correction may turn any station by more (rad).
pub(super) const CORRECTION_TURN: f64 = 0.1;
/// After a first correction below this share of what is allowed the next load step is longer.
pub(super) const QUICK: f64 = 0.3;
/// Stations on each flexible segment.
pub(super) const SECTIONS: usize = 2;
/// Paths are followed by steps of these sizes, until two in a row end alike.
const PACES: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
/// Ends of two paths are alike within this: base load over 1 plus its size; shares of the load where they end.
pub(super) const ALIKE: f64 = 1e-3;
/// Below this margin of the symmetric form a step may change it by ...
const NEAR: f64 = 0.3;
/// ... this factor: stability may be lost and won again between.
const WIDENING: f64 = 2.0;
/// Under a dead tip moment a step may change dr/dm0 by this share of itself: below 1 its determinant keeps its sign.
pub(super) const DEPARTURE: f64 = 0.5;
/// Load steps below this share of the load so far, or next to rest of [`LITTLE_LOAD`], mean that the path ends.
pub(super) const SMALLEST_STEP: f64 = 1e-7;
/// A share of the full load.
pub(super) const LITTLE_LOAD: f64 = 0.01;
/// Passages over the rod before giving up.
pub(super) const MOST_PASSES: usize = 5000;

/// Follows a path at one pace after another, the first of which may be there already, until two in a row end alike. Returns that end,
/// and whether there was one.
pub(super) fn twice<P>(first: Option<P>, follow: impl Fn(f64) -> P, are_alike: impl Fn(&P, &P) -> bool) -> (P, bool) {
    let mut path = first.unwrap_or_else(|| follow(PACES[0]));
    for pace in &PACES[1..] {
        let finer = follow(*pace);
        if are_alike(&path, &finer) {
            return (finer, true);
        }
        path = finer;
    }
    (path, false)
}

/// Where the path from rest leads.
pub(super) struct Path {
    pub m0_body: Vector3<f64>,
    /// Share of the load reached.
    pub lambda: f64,
    pub steps: usize,
    pub passes: usize,
    /// Ended by the bound on passages, not by the path.
    pub gave_up: bool,
}

/// Follows the equilibrium from the unloaded rod as far as it stays stable, under a dead tip moment as far as dr/dm0 stays regular, and
/// whether two paths ended alike.
pub(super) fn from_rest(chain: &Chain) -> (Path, bool) {
    twice(
        None,
        |pace| follow(chain, pace),
        |a, b| {
            let same_load = (a.lambda - b.lambda).abs() <= ALIKE * b.lambda && a.gave_up == b.gave_up;
            let is_end = b.lambda < 1.0;
            same_load && (is_end || (a.m0_body - b.m0_body).norm() <= ALIKE * (1.0 + b.m0_body.norm()))
        },
    )
}

/// Follows it by steps and corrections of a share of the usual size.
fn follow(chain: &Chain, pace: f64) -> Path {
    let mut path = Path { m0_body: Vector3::zeros(), lambda: 0.0, steps: 0, passes: 1, gave_up: false };
    let mut integrator = Extrapolation::on_the_way(TOLERANCE);
    let Ok(rest) = loaded_pass(chain, 0.0, path.m0_body, &mut integrator) else { return path };
    let Some(mut tangent) = tangent(&rest) else { return path };
    let mut last = Regular::new(chain, 0.0, &rest, true);
    let mut step = (pace * FIRST_TURN / turn(&rest, tangent)).min(1.0);
    while path.lambda < 1.0 && path.passes < MOST_PASSES {
        let lambda = if path.lambda + step >= 1.0 { 1.0 } else { path.lambda + step };
        let predicted = tangent * (lambda - path.lambda);
        let corrected = correct(chain, (lambda, pace), path.m0_body, predicted, &mut integrator, &mut path.passes);
        match corrected {
            Some((m0_body, passage, (fast, next))) if last.continues(&next) => {
                let Some(next_tangent) = self::tangent(&passage) else { break };
                last = next;
                (path.m0_body, path.lambda, tangent) = (m0_body, lambda, next_tangent);
                path.steps += 1;
                step *= if fast { 2.0 } else { 1.0 };
            }
            _ => {
                step = 0.5 * (lambda - path.lambda);
                if step < pace * SMALLEST_STEP * path.lambda.max(LITTLE_LOAD) {
                    break;
                }
            }
        }
    }
    path.gave_up = path.passes >= MOST_PASSES;
    path
}

/// A passage with the columns of the base moment and of the load.
fn loaded_pass(
    chain: &Chain,
    lambda: f64,
    m0_body: Vector3<f64>,
    integrator: &mut Extrapolation,
) -> Result<Passage, RunAway> {
    let mut variations = chain.base_moment_variations().to_vec();
    variations.push(chain.load_variation(lambda));
    pass_by_sections(&chain.loaded(lambda), m0_body, &variations, SECTIONS, integrator)
}

/// d(base moment)/d(lambda)
fn tangent(passage: &Passage) -> Option<Vector3<f64>> {
    passage.matrix().lu().solve(&-passage.dresidual[3])
}

/// Largest rotation of a station by a unit of load.
fn turn(passage: &Passage, tangent: Vector3<f64>) -> f64 {
    passage.largest(|columns| (by_moment(columns, tangent) + columns[3].w).norm())
}

/// Rotation of a station by a change of the base moment.
fn by_moment(columns: &[Column], change: Vector3<f64>) -> Vector3<f64> {
    (0..3).map(|k| columns[k].w * change[k]).sum()
}

/// sqrt(3) / |W_s^-1|, where W_s is dr/dm0 with its part by tip rotation made symmetric, which a dead tip moment l is
/// not: R W_s = R W - w x l / 2. `None` without a tip moment, where a loss of stability is a singular W.
fn symmetric_margin(chain: &Chain, lambda: f64, passage: &Passage) -> Option<f64> {
    let l_tip = chain.loaded(lambda).numbers.l_tip;
    if chain.numbers.l_tip == Vector3::zeros() {
        return None;
    }
    let turned = |k: usize| 0.5 * passage.tip.R.tr_mul(&passage.tip.columns[k].w.cross(&l_tip));
    let form = passage.matrix() - Matrix3::from_columns(&[turned(0), turned(1), turned(2)]);
    Some(form.try_inverse().map_or(0.0, |inverse| 3.0_f64.sqrt() / inverse.norm()))
}

fn index_at(chain: &Chain, m0_body: Vector3<f64>, integrator: &mut Extrapolation) -> Option<usize> {
    stability::index(chain, &[Node::base(chain, m0_body)], integrator)
}

/// Evidence that no load step led over a point where the path ends. S6
pub(super) struct Regular {
    /// A dead moment acts at the tip.
    pub is_dead: bool,
    /// The second variation, or its symmetric part, is positive.
    pub is_definite: bool,
    /// The margin of the symmetric form.
    pub margin: Option<f64>,
    pub evidence: Evidence,
}

/// Evidence that det(dr/dm0) keeps its sign over a load step.
pub(super) enum Evidence {
    /// dr/dm0 in the world frame.
    Matrix(Matrix3<f64>),
    /// Sign of its determinant, and the logarithm of its size: on a limp rod the matrix changes by powers of e.
    Determinant { sign: f64, size: f64 },
}

impl Regular {
    fn new(chain: &Chain, lambda: f64, passage: &Passage, is_definite: bool) -> Regular {
        Regular {
            is_dead: chain.has_no_energy(),
            is_definite,
            margin: symmetric_margin(chain, lambda, passage),
            evidence: Evidence::Matrix(passage.tip.R * passage.matrix()),
        }
    }

    /// Whether a load step from here to `next` stays on the branch: the form stays positive, or, under a dead tip moment, dr/dm0
    /// changes so little that its determinant keeps its sign on the way.
    pub fn continues(&self, next: &Regular) -> bool {
        if !self.is_dead {
            return next.is_definite;
        }
        let stays_definite = self.is_definite && next.is_definite && !leaps(self.margin, next.margin);
        let keeps_sign = match (&self.evidence, &next.evidence) {
            (Evidence::Matrix(from), Evidence::Matrix(to)) => departure(*from, *to) < DEPARTURE,
            (Evidence::Determinant { sign: a, size }, Evidence::Determinant { sign: b, size: next }) => {
                a == b && (size - next).abs() <= WIDENING.ln()
            }
            _ => false,
        };
        stays_definite || keeps_sign
    }
}

/// |W0^-1 W - 1|; NaN where there is no inverse.
fn departure(from: Matrix3<f64>, to: Matrix3<f64>) -> f64 {
    from.try_inverse().map_or(f64::NAN, |inverse| (inverse * to - Matrix3::identity()).norm())
}

/// Whether a step takes a small margin so far that it may have been zero between.
pub(super) fn leaps(before: Option<f64>, after: Option<f64>) -> bool {
    let (Some(before), Some(after)) = (before, after) else { return false };
    differs_widely(before, after, NEAR, WIDENING)
}

/// Whether two numbers, one of them below `near`, differ more than `most` times.
pub(super) fn differs_widely(a: f64, b: f64, near: f64, most: f64) -> bool {
    a.min(b) < near && (a > most * b || b > most * a)
}

/// Newton's iteration from the predicted moment: the equilibrium it contracts to, the passage there, whether it was
/// reached fast, and what it tells of the branch.
fn correct(
    chain: &Chain,
    (lambda, pace): (f64, f64),
    m0_body: Vector3<f64>,
    predicted: Vector3<f64>,
    integrator: &mut Extrapolation,
    passes: &mut usize,
) -> Option<(Vector3<f64>, Passage, (bool, Regular))> {
    let mut m0_body = m0_body + predicted;
    let allowed_turn = pace * CORRECTION_TURN;
    let allowed_first = pace * CORRECTION * predicted.norm().max(SMALL_MOMENT);
    let mut allowed = allowed_first;
    let mut first = None;
    loop {
        let passage = loaded_pass(chain, lambda, m0_body, integrator).ok()?;
        *passes += 1;
        let step: Vector3<f64> = passage.matrix().lu().solve(&-passage.residual)?;
        let size = step.norm();
        let turn = passage.largest(|columns| by_moment(columns, step).norm());
        let share = *first.get_or_insert((size / allowed_first).max(turn / allowed_turn));
        if size <= ARRIVED * (1.0 + m0_body.norm()) && turn <= ARRIVED_TURN {
            *passes += 1;
            let is_stable = index_at(&chain.loaded(lambda), m0_body, integrator) == Some(0);
            tangent(&passage)?;
            let regular = Regular::new(chain, lambda, &passage, is_stable);
            let holds = is_stable || regular.is_dead;
            return holds.then_some((m0_body + step, passage, (share < QUICK, regular)));
        }
        // Also false for NaN.
        let contracts = size <= allowed && turn <= allowed_turn;
        if !contracts {
            return None;
        }
        allowed = CONTRACTION * size;
        m0_body += step;
    }
}
