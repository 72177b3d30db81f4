//! Newton's method on the fine grid and the row of each sample, in a field that varies. F5, J5

use super::arrival::{Led, VaryingPath};
use super::base_load::{Load, margin, norm, select};
use super::chord::{Check, check_pass, chord_steps, newton_step, shoot};
use super::fold::write_fold_rows;
use crate::cpu::algebra::{Vec3, cross, dot, inverse, length};
use crate::cpu::contact::press::press;
use crate::cpu::contact::press_curve::follow_press;
use crate::cpu::contact::wall_rows::{Answered, lack_by, write_contact, write_force_rows};
use crate::cpu::rod::field::ends::slopes;
use crate::cpu::rod::field::index::index;
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::rod::field::pass::VaryingPasses;
use crate::cpu::rod::field::state::State;
use crate::cpu::rod::field::workspace::{Carried, VaryingWorkspace};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::program::Outputs;
use crate::cpu::rod::section::velocity;
use crate::cpu::rod::segments::Segment;
use crate::cpu::rod::stability::has_no_energy;
use crate::cpu::simd::apart::apart;
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::tolerances::{
    DIFFERENCE, FIELD_COLUMN_NOISE, FINE_TRUST, LITTLE_TURN, NEWTON_LIMIT, REACH, ROUND_OFF, SAFE_MARGIN, SECOND_ORDER,
    THROUGH_WALL,
};
use crate::model::{DerivativeScale, NO_EQUILIBRIUM, Quantity, Status};

/// Without care, answers nearer to a fold or a bifurcation than this (stability margin) are followed again with it.
const ANSWER_MARGIN: f64 = 0.5 * SAFE_MARGIN;

/// Solves one group from where its paths ended and writes its rows, in the plan's units, to `out`. Of paths that have ended before, without
/// care, lanes that are not led to a stable equilibrium are `Pending`.
#[inline(always)]
pub fn solve_varying<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    led: Led<'_>,
    mut end: VaryingPath<L>,
    workspace: &mut VaryingWorkspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, rod, .. } = *problem;
    let one = rod.t.x.constant(1.0);
    let care = !matches!(led, Led::Before);
    for k in 0..workspace.parameters.len() {
        workspace.parameters[k].load(problem, 3 * k, None);
    }
    let mut check = chord_steps(problem, &mut end, workspace);
    // Without care the path has brought the wall along.
    if care && workspace.wall.is_some() {
        let free = settle(problem, Carried::Base, &mut end, workspace);
        end.reached = end.reached & free.converged;
        match led {
            Led::Curve { .. } | Led::FreeCurve if L::Scalar::SHARP => follow_press(problem, &mut end, workspace),
            _ => press(problem, Some(&program.curve), false, &mut end, workspace),
        }
        settle(problem, Carried::Base, &mut end, workspace);
    }
    // With a wall the index is that of both together, which no path has counted; without energy a path goes on beyond an index of 0.
    let counts = care || workspace.wall.is_some() || program.load_without_energy;
    let what = if counts { Carried::Parameters } else { Carried::Columns };
    let Settled { converged, mut has_moved, left } = settle(problem, what, &mut end, workspace);
    if workspace.wall.is_some() {
        has_moved = one.lt(one.constant(2.0));
    }
    if L::any(has_moved) {
        // The columns belong to the last pass on the fine grid, so its tip state is put back.
        let tip = workspace.tip;
        let again = check_pass(problem, end.base, workspace);
        workspace.tip = tip;
        check = Check {
            base: select::<L>(has_moved, again.base, check.base),
            tip: State::select(has_moved, &again.tip, &check.tip),
        };
    }
    write(problem, &end, (converged, care, counts), (&check, left), workspace, out);
    write_fold_rows(problem, &end, workspace, out);
}

/// Where Newton's method has come to on the fine grid: lanes that converged, lanes that have moved, and the step that is left.
struct Settled<L: Lane> {
    converged: L::Mask,
    has_moved: L::Mask,
    left: Load<L>,
}

/// Newton's method on the fine grid, by passes that carry `what`.
#[inline(always)]
fn settle<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    what: Carried,
    end: &mut VaryingPath<L>,
    workspace: &mut VaryingWorkspace<L>,
) -> Settled<L> {
    L::apart(problem.token(), Settle { problem, what, end, workspace })
}

apart!(
    Settle<'a, L: VaryingPasses>(
        problem: &'a Problem<'a, L>, what: Carried, end: &'a mut VaryingPath<L>, workspace: &'a mut VaryingWorkspace<L>
    ) -> Settled<L>,
    settle_apart(problem, what, end, workspace)
);

#[inline(always)]
fn settle_apart<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    what: Carried,
    end: &mut VaryingPath<L>,
    workspace: &mut VaryingWorkspace<L>,
) -> Settled<L> {
    let Problem { program, rod, .. } = *problem;
    let one = rod.t.x.constant(1.0);
    let (mut moving, mut converged, mut has_moved) = (end.reached, one.lt(rod.t.x.constant(0.0)), one.lt(one));
    let mut left = end.base;
    for pass in 0..NEWTON_LIMIT {
        shoot(problem, &program.fine, end.base, what, workspace);
        let mut matrix = workspace.matrix;
        if let Some(wall) = &workspace.wall {
            matrix = wall.rows(rod, &workspace.tip, &workspace.pose, &matrix);
        }
        end.inverse = matrix.solve(&Mat6::identity(one));
        left = newton_step(problem, &workspace.tip, &end.inverse, workspace.wall.as_ref());
        let change = norm(left);
        let tolerance = one.constant(program.newton_tolerance) * (norm(end.base) + one);
        let first_order = margin(&end.inverse) * one.constant(program.first_order_tolerance);
        let is_still = norm(moved(workspace, left)).lt(one.constant(program.turn_tolerance));
        converged = end.reached & change.lt(tolerance.max(first_order)) & is_still;
        end.passes = L::select(moving, end.passes + one, end.passes);
        moving = moving & !converged & change.lt(one.constant(FINE_TRUST));
        if pass + 1 == NEWTON_LIMIT || !L::any(moving) {
            break;
        }
        end.base = select::<L>(moving, (end.base.0 + left.0, end.base.1 + left.1), end.base);
        has_moved = has_moved | moving;
    }
    Settled { converged, has_moved, left }
}

/// What a change of the base's load does to the tip: displacement and rotation.
#[inline(always)]
fn moved<L: Lane>(workspace: &VaryingWorkspace<L>, change: (Vec3<L>, Vec3<L>)) -> (Vec3<L>, Vec3<L>) {
    workspace.pose.on(change.0, change.1)
}

/// Position and frame of a tip after a change of the load at the base, to first order.
#[inline(always)]
fn moved_tip<L: Lane>(tip: &State<L>, workspace: &VaryingWorkspace<L>, change: Load<L>) -> (Vec3<L>, Vec3<L>, Vec3<L>) {
    let (dp, turn) = moved(workspace, change);
    (tip.p + dp, tip.d1 + cross(turn, tip.d1), tip.t + cross(turn, tip.t))
}

/// Writes the row of the equilibrium on twice the fine steps, `check` moved to first order. On the fine steps it is the last
/// pass moved by what is `left`; where both differ by no more than round-off, fewer steps have less of it.
#[inline(always)]
fn write<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    end: &VaryingPath<L>,
    (converged, care, counts): (L::Mask, bool, bool),
    (check, left): (&Check<L>, Load<L>),
    workspace: &VaryingWorkspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, rod, .. } = *problem;
    let one = rod.t.x.constant(1.0);
    let (tip, inverse) = (workspace.tip, end.inverse);
    let wall = workspace.wall.as_ref();
    let step = newton_step(problem, &check.tip, &inverse, wall);
    let answer = (check.base.0 + step.0, check.base.1 + step.1);
    let (p, d1, t) = moved_tip(&check.tip, workspace, step);
    let (fine_p, fine_d1, fine_t) = moved_tip(&tip, workspace, left);
    let difference = (length(p - fine_p) / rod.length()).max(length(d1 - fine_d1)).max(length(t - fine_t));
    let answers = workspace.pose.times(&inverse);
    let mut square = one;
    for x in answers.0.as_flattened() {
        square = x.mul_add(*x, square);
    }
    let responses = square.sqrt();
    let amplification = (norm(check.base) + one) * responses;
    let rounding = one.constant(ROUND_OFF * L::Scalar::EPSILON);
    let round_off = amplification * rounding;
    let is_rounded = difference.lt(round_off * one.constant(program.rounded));
    let share = L::select(is_rounded, one, one.constant(program.error_share));
    let (shift, turn) = moved(workspace, step);
    let turned = (dot(shift, shift) + dot(turn, turn)) * one.constant(SECOND_ORDER);
    let second_order = amplification * (dot(step.0, step.0) + dot(step.1, step.1)) + turned;
    let far = (length(check.base.1) - one.constant(LITTLE_TURN)).max(one.constant(0.0));
    let far = far * responses * one.constant(program.bend_noise) * rounding;
    let mut of_pose = round_off.mul_add(one.constant(program.stage_noise), far);
    if let Some(wall) = wall {
        of_pose = wall.round_off(rod, &tip).mul_add(responses, of_pose);
    }
    let error = difference * one.constant(DIFFERENCE) * share + of_pose + second_order;
    let (p, d1) = (Vec3::select(is_rounded, fine_p, p), Vec3::select(is_rounded, fine_d1, d1));
    let t = Vec3::select(is_rounded, fine_t, t);
    if program.first_beyond_rigid.is_some() {
        let u = workspace.first.u + workspace.first.moved(left);
        out.store_vector(Quantity::COUNT + program.rows * program.derivatives.len(), u);
    }
    if let Some(first) = program.base_force {
        out.store_vector(first, answer.0);
    }
    let margin = margin(&inverse);
    // Without care the path has counted the index; that says nothing next to a fold.
    let mut index = if counts { index(&workspace.transfers, one).index } else { one.constant(0.0) };
    if let Some(wall) = wall {
        index = wall.index(rod, &tip, index, &workspace.pose, &workspace.matrix);
    }
    let least = one.constant(if care || program.bold { 0.0 } else { ANSWER_MARGIN });
    let mut stable = index.lt(one.constant(0.5)) & least.lt(margin);
    if program.load_without_energy {
        stable = stable | (has_no_energy(rod) & one.constant(0.0).lt(determinant(&inverse)));
    }
    let within_reach = length(tip.p).lt(one.constant(REACH));
    let zero = one.constant(0.0);
    let (is_far, is_inside) = (zero.lt(workspace.leeway), zero.lt(workspace.inside));
    let clear = is_far & is_inside;

    let solved = if program.searches { Status::Ok } else { Status::Ramped };
    let mut status = L::select(stable, code(one, solved), code(one, Status::Unstable));
    let unsolved = L::select(length(tip.p).is_finite(), code(one, Status::NotConverged), code(one, Status::NonFinite));
    let mut converged = converged & within_reach;
    let meeting = wall.map(|wall| {
        // Round-off of the contact force is that of the pose, by how much more the force follows the residual.
        let mut square = one;
        for x in workspace.matrix.times(&inverse).0[..3].as_flattened() {
            square = x.mul_add(*x, square);
        }
        let noise = of_pose * square.sqrt() / responses;
        let answered = Answered { p, check: check.tip, fine: tip, step, left, share, noise };
        answered.meeting(rod, wall, &workspace.matrix)
    });
    let mut left_wall = one.lt(zero);
    if let (Some(wall), Some(meeting)) = (wall.filter(|_| care), &meeting) {
        // A tip that just touches is behind its wall, or pulled by it, by what the row may be off.
        let lets_be = wall.lets_be(&check.tip, error * rod.length());
        left_wall = converged & meeting.pulls(wall);
        converged = converged & (lets_be | (wall.touching & !left_wall));
    }
    status = L::select(converged, status, unsolved);
    status = L::select(is_inside, status, code(one, Status::OutsideMap));
    status = L::select(is_far, status, code(one, Status::TooNearMagnet));
    let mut lost = L::select(end.exhausted, code(one, Status::StepLimit), code(one, Status::NotConverged));
    lost = L::select(end.fold, code(one, Status::Fold), lost);
    lost = L::select(end.outside, code(one, Status::OutsideMap), lost);
    lost = L::select(end.too_near, code(one, Status::TooNearMagnet), lost);
    let mut body_gap = one.constant(0.0);
    if let Some(wall) = wall {
        body_gap = wall.body_gap(&check.tip);
        let through = body_gap.lt(one.constant(-THROUGH_WALL)) & stable & converged & clear;
        status = L::select(through, code(one, Status::ThroughWall), status);
    }
    let mut status = L::select(end.reached, status, lost);
    // A tip that has left its wall on the way has jumped there.
    status = L::select(left_wall, code(one, Status::Fold), status);
    let lambda = L::select(left_wall, one + one, end.lambda);
    if let Some(wall) = wall
        && !care
    {
        // Which tips the wall touches a path in single precision may not tell.
        stable = stable & wall.agrees(rod, &check.tip);
    }
    if !care {
        // Only a stable equilibrium has no need of care.
        status = L::select(end.reached & converged & stable & clear, status, code(one, Status::Pending));
    }
    if let Some(wall) = wall {
        status = L::select(wall.out_of_reach, code(one, Status::OutOfReach), status);
        status = L::select(wall.undefined, code(one, Status::BadParameter), status);
    }
    let is_equilibrium = end.reached & converged & clear;

    out.store_vector(Quantity::TipPosition.column(), p);
    out.store_vector(Quantity::TipD1.column(), d1);
    out.store_vector(Quantity::TipTangent.column(), t);
    out.store_vector(Quantity::BaseMoment.column(), answer.1);
    let mut residual = length(tip.n - rod.f_tip).max(length(tip.m - rod.l_tip));
    if let Some(wall) = wall {
        let (rows, moment) = wall.lack(rod, &tip);
        residual = length(rows).max(length(moment));
    }
    out.store(Quantity::Residual.column(), residual);
    out.store(Quantity::StabilityMargin.column(), L::select(stable, margin, -margin));
    out.store(Quantity::StabilityIndex.column(), L::select(is_equilibrium, index, one.constant(NO_EQUILIBRIUM)));
    out.store(Quantity::Iterations.column(), end.passes);
    out.store(Quantity::LoadFraction.column(), lambda);
    out.store(Quantity::LoadFractionError.column(), end.load_error);
    out.store(Quantity::Status.column(), status);

    out.store(Quantity::ErrorEstimate.column(), error);
    // Columns are those at the load that the last pass began with.
    let off = (answer.0 - end.base.0, answer.1 - end.base.1);
    let both = difference + (norm(off) / margin).max(norm(moved(workspace, off)));
    let DerivativeScale { share: of_columns, floor } = program.derivative_scale;
    let noise = (round_off + far) / margin * one.constant(FIELD_COLUMN_NOISE);
    let derivative_error = (both * one.constant(of_columns)).max(one.constant(floor)) + noise;
    out.store(Quantity::DerivativeError.column(), derivative_error);
    write_rows(problem, end, workspace, out);
    if let (Some(meeting), Some(wall)) = (meeting, &workspace.wall) {
        write_contact(problem, &meeting, body_gap, wall, out);
    }
}

#[inline(always)]
fn determinant<L: Lane>(m: &Mat6<L>) -> L {
    let first = m.block(0, 0);
    let rest = m.block(3, 3) - m.block(3, 0) * (inverse(first) * m.block(0, 3));
    dot(first.x, cross(first.y, first.z)) * dot(rest.x, cross(rest.y, rest.z))
}

/// The rows of every derivative: dX = dX|base + (dX/d(base)) d(base). J5
#[inline(always)]
fn write_rows<L: Lane>(
    problem: &Problem<'_, L>,
    end: &VaryingPath<L>,
    workspace: &VaryingWorkspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, rod, .. } = *problem;
    let rows = program.rows / 3;
    let base = State { p: Vec3::splat(rod.t.x.constant(0.0)), d1: rod.d1, t: rod.t, m: end.base.1, n: end.base.0 };
    let mut slope = (base.p, base.p);
    if let Some(Segment::Flexible(first)) = rod.segments.first() {
        let v = velocity(program.terms, first, base.d1, cross(base.t, base.d1), base.t, base.n);
        slope = slopes(&workspace.space, first, &base, v);
    }
    for (three, (parameters, columns)) in workspace.parameters.iter().zip(&workspace.columns).enumerate() {
        for k in 0..3.min(program.derivatives.len() - 3 * three) {
            let column = (columns.dp[k], columns.dn[k], columns.dm[k]);
            let (rows_of_force, of_moment) = lack_by(problem, (parameters, k), column, workspace);
            let change = end.inverse.on(rows_of_force, of_moment);
            let (dp, w) = moved(workspace, change);
            // What is inserted lies proximal to the former base.
            let inserted = parameters.sources.insertion[k];
            let (dm0, dn0) = (change.1 - slope.0 * inserted, change.0 - slope.1 * inserted);
            // The fourth row holds the curvature beyond rigid segments. Without such segments it holds the force at the base.
            let mut fourth = dn0;
            if program.first_beyond_rigid.is_some() {
                fourth = workspace.first.by_parameters[three][k] + workspace.first.moved(change);
            }
            let all = [columns.dp[k] + dp, columns.w[k] + w, dm0, fourth, dn0];
            let df = columns.dn[k] - parameters.df_tip[k] + workspace.matrix.on(change.0, change.1).0;
            write_force_rows(problem, 3 * three + k, (parameters, k), (columns.dp[k] + dp, df), workspace, out);
            for (row, value) in all.into_iter().enumerate().take(rows) {
                out.store_vector(Quantity::COUNT + 3 * (rows * (3 * three + k) + row), value);
            }
        }
    }
}

#[inline(always)]
fn code<L: Lane>(of: L, status: Status) -> L {
    of.constant(f64::from(status.code()))
}
