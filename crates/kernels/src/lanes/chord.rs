//! From the path onto the fine grid without columns, and the error estimate, whose pass is the last step there. R4
//!
//! A sample's steps depend on that sample alone: a lane that has finished is frozen while its neighbours go on.

use super::algebra::{Mat3, Vec3, cross, dot, length, transpose};
use super::column::Columns;
use super::lane::{Lane, Scalar};
use super::path::{Path, PathEnd};
use super::problem::{Problem, Workspace};
use super::rod::Rod;
use super::shoot::{Record, Tip, shoot};
use super::stability::margin;
use crate::model::path::{ANCHOR_CONTRACTION, ANCHOR_TRUST, CHORD_LIMIT, CHORD_TRUST, DIFFERENCE, ROUND_OFF};

/// Moves the base moment to the fine grid's equilibrium by steps with the path's inverse of W.
///
/// From the second on they are secant steps along the one before (Broyden's update). The last is one on twice the
/// fine steps; returns what it found. From anchors a sample counts as led there only where its first step is short and
/// each further one much shorter.
#[inline(always)]
pub fn chord_steps<L: Lane>(
    problem: &Problem<'_, L>,
    path: Path,
    end: &mut PathEnd<L>,
    workspace: &mut Workspace<L>,
) -> Tip<L> {
    let Problem { program, rod, .. } = *problem;
    let one = end.lambda.constant(1.0);
    // The nearer to a bifurcation, the less a step brings.
    let tolerance = margin(&end.inverse) * one.constant(program.chord_tolerance);
    let is_anchored = path == Path::Anchored;
    let trust = one.constant(if is_anchored { ANCHOR_TRUST } else { CHORD_TRUST });
    let mut bound = trust;
    let mut last = Vec3::splat(one.constant(0.0));
    let mut square = one;
    let mut moving = end.reached;
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
    let tip = check_pass(problem, end.m0, workspace);
    let delta = chord_step(&end.inverse, tip.m - rod.l_tip, last, square);
    end.m0 = Vec3::select(trusted & length(delta).lt(trust), end.m0 + delta, end.m0);
    end.passes = L::select(end.reached, end.passes + one, end.passes);
    if is_anchored {
        // What no chord steps certify goes the way from rest.
        end.reached = trusted & !moving;
    }
    tip
}

/// A step with the path's inverse, corrected by the one before and its square.
#[inline(always)]
fn chord_step<L: Lane>(inverse: &Mat3<L>, residual: Vec3<L>, last: Vec3<L>, square: L) -> Vec3<L> {
    let delta = -(*inverse * residual);
    let one = square.constant(1.0);
    delta * (one / (one - dot(last, delta) / square))
}

/// A pass on twice the fine steps.
#[inline(always)]
pub fn check_pass<L: Lane>(problem: &Problem<'_, L>, m0: Vec3<L>, workspace: &mut Workspace<L>) -> Tip<L> {
    let one = m0.x.constant(1.0);
    shoot(problem, &problem.program.check, one, m0, &mut [], Record::Nothing, workspace)
}

/// Difference to the equilibrium on twice as many steps, by a pass `check` near it, plus what round-off can do through
/// dm0/dr.
#[inline(always)]
pub fn error_estimate<L: Lane>(
    rod: &Rod<L>,
    m0: Vec3<L>,
    check: &Tip<L>,
    by_moment: &Columns<L>,
    w_inverse: Mat3<L>,
    (p, d1, t): (Vec3<L>, Vec3<L>, Vec3<L>),
) -> L {
    let one = m0.x.constant(1.0);
    let delta = -(w_inverse * (check.m - rod.l_tip));
    let turn = by_moment.w * delta;
    let dp = length(check.p + by_moment.dp * delta - p) / rod.length();
    let dd1 = length(check.d1 + cross(turn, check.d1) - d1);
    let dt = length(check.t + cross(turn, check.t) - t);
    let columns = transpose(by_moment.w * w_inverse);
    let amplification = length(columns.x) + length(columns.y) + length(columns.z);
    let round_off = (one + amplification) * one.constant(ROUND_OFF * L::Scalar::EPSILON);
    dp.max(dd1).max(dt) * one.constant(DIFFERENCE) + round_off * (one + length(m0))
}
