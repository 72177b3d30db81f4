//! The wall comes: from the free rod under its full load, the wall moves in to its place, or draws the tip to where it is held,
//! each step on the stable branch. W4

use super::wall::{Near, Wall};
use crate::cpu::algebra::{Vec3, affordable, length};
use crate::cpu::equilibrium::field::arrival::VaryingPath;
use crate::cpu::equilibrium::field::base_load::{Load, margin, norm, select};
use crate::cpu::equilibrium::field::path::{departure, leaps, narrowed};
use crate::cpu::rod::field::index::index;
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::rod::field::pass::{Pass, VaryingPasses};
use crate::cpu::rod::field::state::State;
use crate::cpu::rod::field::workspace::{Carried, VaryingWorkspace};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::program::Resolution;
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::CoilLoad;
use crate::model::tolerances::{
    AIM, CONTRACTION, CORRECTIONS, CURVE_TOLERANCE, DEPARTURE, FIELD_PASS_LIMIT, FIRST_BEND, FOLD_MARGIN, NEAR_MARGIN,
    NODE_LEAST_RATIO, NODE_MOST_RATIO, NODE_RETREAT, SPENT, TRUST, WALL_LEAST_PULL, WALL_LEAST_SHARP_PULL,
    WALL_SMALLEST_SHARP_STEP, WALL_SMALLEST_STEP,
};

impl<L: Lane> Wall<L> {
    /// Decides which free tips the wall will touch, all that it can if it does `all_behind`, and returns the shift with which it begins.
    /// Lanes that it cannot touch have not reached its place.
    #[inline(always)]
    pub fn meet(&mut self, tip: &State<L>, all_behind: bool, end: &mut VaryingPath<L>) -> Vec3<L> {
        let zero = tip.p.x.constant(0.0);
        let one = zero.constant(1.0);
        let Near { gap, normal, .. } = self.near(tip.p);
        self.sign = L::select(normal.z.lt(zero), -one, one);
        self.undefined = self.undefined | (end.reached & !gap.is_finite());
        end.reached = end.reached & !self.out_of_reach & !self.undefined;
        let behind = if all_behind || self.kind.sticks { end.reached } else { gap.lt(zero) };
        self.touching = end.reached & behind;
        if self.kind.sticks { self.held_at - tip.p } else { Vec3 { x: zero, y: zero, z: -gap } }
    }

    /// Leaves free rods that do not count as stable where they are: no wall comes to them, and they have not reached its place.
    #[inline(always)]
    pub fn leave_unstable(&mut self, stable: L::Mask, end: &mut VaryingPath<L>) {
        end.reached = end.reached & (!self.touching | stable);
        self.touching = self.touching & stable;
    }
}

/// Decides which tips the wall touches, unless `all_behind` tells that it does all, and leads those to it. With care, on a grid for it, the
/// index is counted at every step; without, in its place alone. Lanes whose way ends are at a fold, at 1 and the share of the way.
#[inline(always)]
pub fn press<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    care: Option<&Resolution>,
    all_behind: bool,
    end: &mut VaryingPath<L>,
    workspace: &mut VaryingWorkspace<L>,
) {
    let Problem { program, rod, .. } = *problem;
    let Some(mut wall) = workspace.wall.take() else { return };
    let one = rod.t.x.constant(1.0);
    let zero = one.constant(0.0);
    let nobody = one.lt(zero);
    let resolution = care.unwrap_or(&program.coarse);
    let care = care.is_some();
    let points = match &program.field {
        Some(field) if care => field.points,
        _ => CoilLoad::Middle.points(),
    };
    let pass = |base: Load<L>, what: Carried, workspace: &mut VaryingWorkspace<L>| {
        let (problem, lambda) = (*problem, one);
        L::varying_pass(Pass { problem, resolution, lambda, base, what, points, workspace });
    };
    pass(end.base, if care { Carried::Transfers } else { Carried::State }, workspace);
    let way = wall.meet(&workspace.tip, all_behind, end);
    if care {
        // A path without care has counted the index of the free rod.
        wall.leave_unstable(index(&workspace.transfers, one).index.lt(one.constant(0.5)), end);
        wall.soften(&workspace.pose, &workspace.matrix);
    }
    let comes = wall.touching;
    if !L::any(comes) {
        workspace.wall = Some(wall);
        return;
    }
    let pace = program.pace;
    let trust = one.constant(TRUST * pace);
    let bend = one.constant(FIRST_BEND * pace);
    let first_bound = trust * one.constant(1.0 / CONTRACTION);
    let sharp = L::Scalar::SHARP;
    let smallest = one.constant(if sharp { WALL_SMALLEST_SHARP_STEP } else { WALL_SMALLEST_STEP });
    let least_pull = one.constant(if care && sharp { WALL_LEAST_SHARP_PULL } else { WALL_LEAST_PULL });
    let none = Vec3::splat(zero);
    let (mut base, mut accepted, mut inverse) = (end.base, end.base, end.inverse);
    // The first point is the free rod itself: its step is none.
    let (mut tau, mut target, mut step) = (zero, zero, one);
    let (mut last_size, mut first_size, mut corrections) = (first_bound, zero, zero);
    let (mut arrived, mut failed, mut exhausted) = (nobody, nobody, nobody);
    let mut slope = (none, none);
    let mut last_margin = one;
    let (mut begun, mut pulled) = (nobody, nobody);
    loop {
        let active = comes & !(arrived | failed);
        if !L::any(active) {
            break;
        }
        pass(base, Carried::Base, workspace);
        wall.set_out(way, one - target);
        let tip = workspace.tip;
        let rows = wall.rows(rod, &tip, &workspace.pose, &workspace.matrix);
        let (found, whole) = rows.solve_whole(&Mat6::identity(one));
        let lack = wall.lack(rod, &tip);
        let (dn, dm) = found.on(lack.0, lack.1);
        let (dp, w) = workspace.pose.on(dn, dm);
        let moved = length(dm).max(length(w)).max(length(dp)).max(length(dn) / (one + length(base.0)));
        let contracting = moved.lt(last_size * one.constant(CONTRACTION));
        let converged = active & contracting & moved.lt(one.constant(CURVE_TOLERANCE) * (one + norm(base)));
        let counts = if care { converged } else { converged & !target.lt(one) };
        let mut joint = zero;
        if L::any(counts) {
            pass(base, Carried::Transfers, workspace);
            let dead = index(&workspace.transfers, one).index;
            joint = L::select(counts, wall.index(rod, &tip, dead, &workspace.pose, &workspace.matrix), zero);
        }
        // Next to where the rod alone would buckle under its force the count may err; there the rows stay regular. A stable free
        // rod is stable when it is held.
        let stays = departure(&inverse, &rows).lt(one.constant(DEPARTURE));
        let counted = joint.abs().lt(one.constant(0.5)) | (stays & if care { !nobody } else { target.lt(one) });
        let stable = (counted & zero.lt(whole)) | !begun;
        // Next to a bifurcation, where a wall presses end on, other branches are near, and as stable.
        let margin = margin(&found);
        let stable = stable & (!leaps(margin, last_margin) | !begun);
        let pull = wall.pull(rod, &tip, workspace.matrix.on(dn, dm).0);
        let presses = pull.lt(least_pull);
        pulled = (pulled & !converged) | (converged & !presses);
        let clear = zero.lt(workspace.leeway) & zero.lt(workspace.inside);
        let accept = converged & stable & presses & clear;
        let go_on = active & !converged & contracting & corrections.lt(one.constant(CORRECTIONS));
        let reject = active & !accept & !go_on;
        let is_narrow = if care || program.bold { nobody } else { converged & margin.lt(one.constant(NEAR_MARGIN)) };

        base = select::<L>(accept | go_on, (base.0 + dn, base.1 + dm), base);
        accepted = select::<L>(accept, base, accepted);
        inverse = Mat6::select(accept, &found, &inverse);
        let used = target - tau;
        tau = L::select(accept, target, tau);
        arrived = arrived | (accept & !target.lt(one));
        first_size = L::select(corrections.lt(one.constant(0.5)), moved, first_size);
        let narrow = narrowed(last_margin, true);
        let ratio = (narrow * one.constant(AIM) * trust / first_size.max(one.constant(1e-6))).sqrt();
        let ratio = ratio.max(one.constant(NODE_LEAST_RATIO)).min(one.constant(NODE_MOST_RATIO));
        let longer = L::select(begun, used * ratio, one);
        let steep = found.on(-wall.rows_by_share(way, rod, &tip), none);
        slope = select::<L>(accept, steep, slope);
        let (dp, w) = workspace.pose.on(steep.0, steep.1);
        let speed = length(steep.1).max(length(w)).max(length(dp)).max(length(steep.0) / (one + length(base.0)));
        let most = bend / speed.max(bend * one.constant(0.5));
        let most = most.min(L::select(begun, affordable(margin, last_margin, used, NEAR_MARGIN, SPENT), one));
        last_margin = L::select(accept, margin, last_margin);
        step = L::select(accept, longer.min(most), L::select(reject, used * one.constant(NODE_RETREAT), step));
        failed = failed | (reject & (step.lt(smallest) | !begun)) | is_narrow;
        begun = begun | accept;
        let restart = (accept | reject) & !arrived;
        target = L::select(restart, (tau + step).min(one), target);
        let ahead = target - tau;
        let predicted = (accepted.0 + slope.0 * ahead, accepted.1 + slope.1 * ahead);
        base = select::<L>(restart, predicted, base);
        last_size = L::select(go_on, moved, narrowed(last_margin, true) * first_bound);
        corrections = L::select(go_on, corrections + one, zero);
        end.passes = L::select(active, end.passes + one, end.passes);
        let over = active & !arrived & !end.passes.lt(one.constant(FIELD_PASS_LIMIT));
        (exhausted, failed) = (exhausted | over, failed | over);
    }
    wall.set_out(none, zero);
    let lost = comes & !arrived;
    // Far from singular no wall makes a rod snap, unless its tip jumps from the wall.
    let snaps = pulled | last_margin.lt(one.constant(FOLD_MARGIN));
    exhausted = exhausted | (lost & !snaps);
    end.base = select::<L>(comes, accepted, end.base);
    end.inverse = Mat6::select(comes, &inverse, &end.inverse);
    end.lambda = L::select(lost, one + tau, end.lambda);
    end.fold = end.fold | (lost & !exhausted);
    end.exhausted = end.exhausted | (lost & exhausted);
    end.reached = end.reached & !lost;
    wall.touching = arrived;
    workspace.wall = Some(wall);
}
