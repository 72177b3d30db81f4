//! Equilibria off the path in a field that varies: Newton's method under the full load from a given base moment. F5
//!
//! Where the force at the base is not given, that is found first that goes with the moment; then both are corrected.

use super::arrival::VaryingPath;
use super::base_load::{norm, select};
use super::chord::{newton_step, shoot};
use crate::cpu::algebra::{Mat3, Vec3, inverse, length};
use crate::cpu::equilibrium::search::deflation;
use crate::cpu::equilibrium::start::Start;
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::rod::field::pass::VaryingPasses;
use crate::cpu::rod::field::workspace::{Carried, VaryingWorkspace};
use crate::cpu::rod::problem::Problem;
use crate::model::FAR;
use crate::model::tolerances::{PATH_TOLERANCE, SEARCH_FORCE_LIMIT, SEARCH_LIMIT, SEARCH_STEP};

/// The equilibrium under the full load that a search from the base moment in the inputs comes to.
#[inline(always)]
pub fn search_varying<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    workspace: &mut VaryingWorkspace<L>,
) -> VaryingPath<L> {
    let Problem { program, rod, .. } = *problem;
    let Start { m0, known } = Start::load(problem);
    let n0 = Start::force(problem);
    let one = rod.t.x.constant(1.0);
    let zero = one.constant(0.0);
    let none = one.lt(zero);
    let longest = one.constant(SEARCH_STEP);
    let mut end = VaryingPath {
        base: (Vec3::splat(zero), m0),
        inverse: Mat6::identity(one),
        reached: none,
        fold: none,
        turned: none,
        along: (Vec3::splat(zero), Vec3::splat(zero)),
        too_near: none,
        outside: none,
        exhausted: none,
        lambda: one,
        load_error: one,
        passes: zero,
    };
    let mut failed = none;
    let given = length(n0).lt(one.constant(FAR));
    shoot(problem, &program.coarse, end.base, Carried::State, workspace);
    let without = rod.f_tip - workspace.tip.n;
    end.base.0 = Vec3::select(length(without).is_finite(), without, end.base.0);
    end.base.0 = Vec3::select(given, n0, end.base.0);
    // A lane whose force has settled is frozen: what a sample comes to does not depend on its neighbours.
    let mut settled = given;
    for _ in 0..SEARCH_FORCE_LIMIT {
        shoot(problem, &program.coarse, end.base, Carried::Base, workspace);
        let step = inverse(force_block(&workspace.matrix)) * (rod.f_tip - workspace.tip.n);
        let size = length(step) / (one + length(end.base.0));
        let factor = L::select(size.lt(longest), one, longest / size);
        let moves = !settled & size.is_finite();
        end.base.0 = Vec3::select(moves, end.base.0 + step * factor, end.base.0);
        settled = settled | size.lt(one.constant(PATH_TOLERANCE));
        if !L::any(!settled) {
            break;
        }
    }
    loop {
        let active = !(end.reached | failed);
        if !L::any(active) {
            break;
        }
        shoot(problem, &program.coarse, end.base, Carried::Base, workspace);
        let all = workspace.matrix.solve(&Mat6::identity(one));
        let newton = newton_step(problem, &workspace.tip, &all, None);
        let deflated = deflation(end.base.1, newton.1, &known);
        let step = (newton.0 * deflated, newton.1 * deflated);
        let arrived = norm(step).lt(one.constant(PATH_TOLERANCE) * (one + norm(end.base)));
        let size = length(step.1).max(length(step.0) / (one + length(end.base.0)));
        let factor = L::select(size.lt(longest), one, longest / size);
        // A start that is as good as this grid can tell stays for the fine grid.
        let moves = active & !(arrived & end.passes.lt(one));
        let moved = (end.base.0 + step.0 * factor, end.base.1 + step.1 * factor);
        end.base = select::<L>(moves, moved, end.base);
        end.inverse = Mat6::select(active, &all, &end.inverse);
        end.passes = L::select(active, end.passes + one, end.passes);
        end.reached = end.reached | (active & arrived);
        failed = failed | (active & !(end.passes.lt(one.constant(SEARCH_LIMIT)) & size.is_finite()));
    }
    end
}

/// d(n(L))/d(n0), columns.
#[inline(always)]
fn force_block<L: VaryingPasses>(matrix: &Mat6<L>) -> Mat3<L> {
    let of = |k: usize| Vec3 { x: matrix.0[0][k], y: matrix.0[1][k], z: matrix.0[2][k] };
    Mat3 { x: of(0), y: of(1), z: of(2) }
}
