//! From the path onto the fine grid without columns, and the pass on twice the steps, from which the answer comes. F5

use super::arrival::VaryingPath;
use super::base_load::{Load, margin, norm, select};
use crate::cpu::algebra::{Vec3, dot};
use crate::cpu::contact::wall::Wall;
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::rod::field::pass::{Pass, VaryingPasses};
use crate::cpu::rod::field::state::State;
use crate::cpu::rod::field::workspace::{Carried, VaryingWorkspace};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::program::Resolution;
use crate::cpu::simd::lane::Lane;
use crate::model::tolerances::{CHORD_LIMIT, CHORD_TRUST};

/// What a pass on twice the fine steps found, and from which load at the base.
pub struct Check<L: Lane> {
    pub base: Load<L>,
    pub tip: State<L>,
}

/// Moves the load at the base to the fine grid's equilibrium by steps with the path's inverse, from the second on secant steps
/// along the one before (Broyden's update). The last is one on twice the fine steps, but for rods beside a wall; returns what it found.
#[inline(always)]
pub fn chord_steps<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    end: &mut VaryingPath<L>,
    workspace: &mut VaryingWorkspace<L>,
) -> Check<L> {
    let Problem { program, rod, .. } = *problem;
    let one = rod.t.x.constant(1.0);
    // The nearer to a bifurcation, the less a step brings.
    let tolerance = margin(&end.inverse) * one.constant(program.chord_tolerance);
    let trust = one.constant(CHORD_TRUST);
    let none = Vec3::splat(rod.t.x.constant(0.0));
    let (mut last, mut square) = ((none, none), one);
    let (mut moving, mut trusted) = (end.reached, end.reached);
    for _ in 0..CHORD_LIMIT {
        if !L::any(moving) {
            break;
        }
        shoot(problem, &program.fine, end.base, Carried::State, workspace);
        let step =
            chord_step(newton_step(problem, &workspace.tip, &end.inverse, workspace.wall.as_ref()), last, square);
        let change = norm(step);
        // A chord step that is not small says that the coarse grid was too coarse: Newton's method takes over.
        trusted = trusted & (!moving | change.lt(trust));
        end.base = select::<L>(moving & trusted, (end.base.0 + step.0, end.base.1 + step.1), end.base);
        end.passes = L::select(moving, end.passes + one, end.passes);
        (last, square) = (select::<L>(moving, step, last), L::select(moving, change * change, square));
        moving = moving & trusted & !change.lt(tolerance);
    }
    // That pass is made where the answer has settled.
    if workspace.wall.is_some() {
        return Check { base: end.base, tip: workspace.tip };
    }
    let check = check_pass(problem, end.base, workspace);
    let step = newton_step(problem, &check.tip, &end.inverse, workspace.wall.as_ref());
    let step = chord_step(step, last, square);
    let is_taken = trusted & norm(step).lt(trust);
    end.base = select::<L>(is_taken, (end.base.0 + step.0, end.base.1 + step.1), end.base);
    end.passes = L::select(end.reached, end.passes + one, end.passes);
    check
}

/// A step with the path's inverse, corrected by the one before and its square.
#[inline(always)]
fn chord_step<L: Lane>(step: Load<L>, last: Load<L>, square: L) -> Load<L> {
    let one = square.constant(1.0);
    let factor = one / (one - (dot(last.0, step.0) + dot(last.1, step.1)) / square);
    (step.0 * factor, step.1 * factor)
}

/// The step of the load at the base to equilibrium. F5, W3
#[inline(always)]
pub fn newton_step<L: Lane>(
    problem: &Problem<'_, L>,
    tip: &State<L>,
    inverse: &Mat6<L>,
    wall: Option<&Wall<L>>,
) -> Load<L> {
    let rod = problem.rod;
    let lack = wall.map_or((rod.f_tip - tip.n, rod.l_tip - tip.m), |wall| wall.lack(rod, tip));
    inverse.on(lack.0, lack.1)
}

/// A pass on twice the fine steps, with more points on rigid segments.
#[inline(always)]
pub fn check_pass<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    base: Load<L>,
    workspace: &mut VaryingWorkspace<L>,
) -> Check<L> {
    let what = if workspace.wall.is_some() { Carried::Watched } else { Carried::State };
    let resolution = &problem.program.check;
    let lambda = base.0.x.constant(1.0);
    let points = problem.program.field.as_ref().map_or(&[][..], |field| &field.check_points);
    L::varying_pass(Pass { problem: *problem, resolution, lambda, base, what, points, workspace });
    Check { base, tip: workspace.tip }
}

#[inline(always)]
pub fn shoot<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    resolution: &Resolution,
    base: (Vec3<L>, Vec3<L>),
    what: Carried,
    workspace: &mut VaryingWorkspace<L>,
) {
    let lambda = base.0.x.constant(1.0);
    let points = problem.program.field.as_ref().map_or(&[][..], |field| &field.fine_points);
    L::varying_pass(Pass { problem: *problem, resolution, lambda, base, what, points, workspace });
}
