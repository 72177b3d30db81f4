//! From the path onto the fine grid without columns, and the pass on twice the steps, from which the answer comes. R4
//!
//! A sample's steps depend on that sample alone: a lane that has finished is frozen while its neighbours go on.

use super::path::{Path, PathEnd};
use crate::cpu::algebra::{Mat3, Vec3, cross, dot, length, transpose};
use crate::cpu::rod::columns::Columns;
use crate::cpu::rod::problem::shoot;
use crate::cpu::rod::problem::{Problem, Record, Tip, Workspace};
use crate::cpu::rod::segments::Rod;
use crate::cpu::rod::stability::{margin, squared_norm};
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::DerivativeScale;
use crate::model::tolerances::{
    ANCHOR_CONTRACTION, ANCHOR_TRUST, CHORD_LIMIT, CHORD_TRUST, COLUMN_NOISE, DIFFERENCE, GROWTH_NOISE, LITTLE_TURN,
    ROUND_OFF, SECOND_ORDER,
};

/// What a pass on twice the fine steps found, and from which base moment.
pub struct Check<L: Lane> {
    pub m0: Vec3<L>,
    pub tip: Tip<L>,
}

impl<L: Lane> Check<L> {
    #[inline(always)]
    pub fn select(mask: L::Mask, if_true: Self, if_false: Self) -> Self {
        let m0 = Vec3::select(mask, if_true.m0, if_false.m0);
        Self { m0, tip: Tip::select(mask, if_true.tip, if_false.tip) }
    }
}

/// Moves the base moment to the fine grid's equilibrium by steps with the path's inverse of W.
///
/// From the second on they are secant steps along the one before (Broyden's update). The last step is on twice the fine steps, whose
/// pass is returned. From anchors a sample counts as led there only where its first step is short and each further one much
/// shorter. Where its cell tells it `close`, the check is the first step.
#[inline(always)]
pub fn chord_steps<L: Lane>(
    problem: &Problem<'_, L>,
    path: Path,
    end: &mut PathEnd<L>,
    workspace: &mut Workspace<L>,
) -> Check<L> {
    let Problem { program, rod, .. } = *problem;
    let one = end.lambda.constant(1.0);
    // The nearer to a bifurcation, the less a step brings.
    let tolerance = margin(&end.inverse) * one.constant(program.chord_tolerance);
    let is_anchored = path == Path::Anchored;
    let trust = one.constant(if is_anchored { ANCHOR_TRUST } else { CHORD_TRUST });
    let mut bound = trust;
    let mut last = Vec3::splat(one.constant(0.0));
    let mut square = one;
    let close = end.close;
    let mut moving = end.reached & !close;
    let mut trusted = end.reached;
    for _ in 0..CHORD_LIMIT {
        if !L::any(moving) {
            break;
        }
        let tip = shoot(problem, &program.fine, one, end.m0, &mut [], Record::Nothing, workspace);
        let delta = chord_step(&end.inverse, tip.m - rod.l_tip, last, square);
        let size = length(delta);
        // A chord step that is not small says that the coarse grid was too coarse: Newton's method takes over.
        trusted = trusted & (!moving | size.lt(bound));
        if is_anchored {
            bound = size * one.constant(ANCHOR_CONTRACTION);
        }
        end.m0 = Vec3::select(moving & trusted, end.m0 + delta, end.m0);
        end.passes = L::select(moving, end.passes + one, end.passes);
        (last, square) = (Vec3::select(moving, delta, last), L::select(moving, dot(delta, delta), square));
        moving = moving & trusted & !size.lt(tolerance);
    }
    let check = check_pass(problem, end.m0, workspace);
    let delta = chord_step(&end.inverse, check.tip.m - rod.l_tip, last, square);
    let far = moving | (close & !length(delta).lt(tolerance));
    end.m0 = Vec3::select(trusted & length(delta).lt(trust), end.m0 + delta, end.m0);
    end.passes = L::select(end.reached, end.passes + one, end.passes);
    if path == Path::Anchored {
        // What no chord steps certify goes the way from rest.
        end.reached = trusted & !far;
    }
    check
}

/// A step with the path's inverse, corrected by the one before and its square.
#[inline(always)]
fn chord_step<L: Lane>(inverse: &Mat3<L>, residual: Vec3<L>, last: Vec3<L>, square: L) -> Vec3<L> {
    let delta = -(*inverse * residual);
    let one = square.constant(1.0);
    delta * (one / (one - dot(last, delta) / square))
}

/// The step of the base moment to equilibrium, from a pass with the inverse of W on the fine grid.
#[inline(always)]
pub fn newton_step<L: Lane>(rod: &Rod<L>, tip: &Tip<L>, w_inverse: &Mat3<L>) -> Vec3<L> {
    -(*w_inverse * (tip.m - rod.l_tip)) // J5
}

/// A pass on twice the fine steps.
#[inline(always)]
pub fn check_pass<L: Lane>(problem: &Problem<'_, L>, m0: Vec3<L>, workspace: &mut Workspace<L>) -> Check<L> {
    let one = m0.x.constant(1.0);
    let tip = shoot(problem, &problem.program.check, one, m0, &mut [], Record::Nothing, workspace);
    Check { m0, tip }
}

/// Base moment and tip, and how far the tip and its derivatives may be from the truth.
pub struct Answered<L: Lane> {
    pub m0: Vec3<L>,
    pub p: Vec3<L>,
    pub d1: Vec3<L>,
    pub t: Vec3<L>,
    pub error: L,
    pub derivative_error: L,
}

/// The equilibrium on twice the fine steps: `check`, moved to first order by a step of the base moment. On the fine steps it
/// is `tip` moved by `back`; where both differ by no more than round-off, fewer steps have less of it.
///
/// The error: a share of the difference, the second order of the step, what round-off can do through dm0/dr. That of
/// derivatives, whose columns are those at `m0`: see [`DerivativeScale`].
#[inline(always)]
pub fn answer<L: Lane>(
    problem: &Problem<'_, L>,
    check: &Check<L>,
    (tip, back): (&Tip<L>, Vec3<L>),
    by_moment: &Columns<L>,
    (m0, w, w_inverse): (Vec3<L>, &Mat3<L>, &Mat3<L>),
) -> Answered<L> {
    let Problem { program, rod, .. } = *problem;
    let one = back.x.constant(1.0);
    let delta = newton_step(rod, &check.tip, w_inverse);
    let answer = check.m0 + delta;
    let (p, d1, t) = moved_tip(&check.tip, by_moment, delta);
    let (fine_p, fine_d1, fine_t) = moved_tip(tip, by_moment, back);
    let dp = length(p - fine_p) / rod.length();
    let difference = dp.max(length(d1 - fine_d1)).max(length(t - fine_t));
    let columns = transpose(by_moment.w * *w_inverse);
    let responses = one + length(columns.x) + length(columns.y) + length(columns.z);
    let bend = length(check.m0);
    let amplification = responses * (one + bend);
    let rounding = one.constant(ROUND_OFF * L::Scalar::EPSILON);
    let is_rounded = difference.lt(amplification * rounding * one.constant(program.rounded));
    let share = L::select(is_rounded, one, one.constant(program.error_share));
    let (turn, off) = (by_moment.w * delta, answer - m0);
    let second_order = dot(turn, turn).mul_add(one.constant(SECOND_ORDER), amplification * dot(delta, delta));
    let far = (bend - one.constant(LITTLE_TURN)).max(one.constant(0.0));
    let near = amplification * one.constant(program.stage_noise);
    let round_off = far.mul_add(responses * one.constant(program.bend_noise), near) * rounding;
    let error = difference * one.constant(DIFFERENCE) * share + round_off + second_order;
    // Columns are those at the base moment `m0`.
    let margin = margin(w_inverse);
    let both = difference + (length(off) / margin).max(length(by_moment.w * off));
    let DerivativeScale { share, floor } = program.derivative_scale;
    let noise = amplification / margin * one.constant(COLUMN_NOISE) + squared_norm(w) * one.constant(GROWTH_NOISE);
    let derivative_error =
        (both * one.constant(share)).max(one.constant(floor)) + noise * one.constant(L::Scalar::EPSILON);
    Answered {
        m0: answer,
        p: Vec3::select(is_rounded, fine_p, p),
        d1: Vec3::select(is_rounded, fine_d1, d1),
        t: Vec3::select(is_rounded, fine_t, t),
        error,
        derivative_error,
    }
}

/// Position and frame of a tip after a change of the base moment, to first order.
#[inline(always)]
fn moved_tip<L: Lane>(tip: &Tip<L>, by_moment: &Columns<L>, delta: Vec3<L>) -> (Vec3<L>, Vec3<L>, Vec3<L>) {
    let turn = by_moment.w * delta;
    (tip.p + by_moment.dp * delta, tip.d1 + cross(turn, tip.d1), tip.t + cross(turn, tip.t))
}
