//! The path from rest in a field that stays: the rod's dipoles and all other loads grow, each step on the stable branch.
//!
//! A rod's steps depend on that rod alone: a lane that has finished is frozen while its neighbours go on.

use super::arrival::VaryingPath;
use super::base_load::{margin, norm, select, size};
use super::rest::Rest;
use crate::cpu::algebra::{Vec3, affordable, differs_widely, length};
use crate::cpu::rod::field::index::index;
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::rod::field::pass::{Pass, VaryingPasses};
use crate::cpu::rod::field::workspace::{Carried, VaryingWorkspace};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::program::Resolution;
use crate::cpu::rod::stability::has_no_energy;
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::CoilLoad;
use crate::model::tolerances::{
    AIM, CONTRACTION, CORRECTIONS, DEPARTURE, DEPARTURE_AIM, FIELD_LITTLE_STEP, FIELD_LOAD_TOLERANCE,
    FIELD_NEAR_MARGIN, FIELD_PASS_LIMIT, FIELD_SMALLEST_STEP, FIELD_SOFT, FIELD_SOFT_RATIO, FIELD_TELLING,
    FIELD_TOLERANCE, FIRST_BEND, FOLD_MARGIN, FOLD_STEEPNESS, FULL_LOAD_TOLERANCE, LITTLE_LOAD, NEAR_MARGIN,
    NEAR_TOLERANCE, NODE_LEAST_RATIO, NODE_MOST_RATIO, NODE_PASS_LIMIT, NODE_RETREAT, PATH_TOLERANCE, SAFE_MARGIN,
    SMALLEST_GUARDED_STEP, SMALLEST_RAMP_STEP, SPENT, TRUST, WIDENING,
};

/// The share of a correction's bounds that holds at a margin, where the path is `sharp`: next to a bifurcation other branches
/// are as near as its root.
#[inline(always)]
pub fn narrowed<L: Lane>(margin: L, sharp: bool) -> L {
    let one = margin.constant(1.0);
    if sharp { (margin * one.constant(1.0 / NEAR_MARGIN)).min(one).sqrt() } else { one }
}

/// Whether a load step changes the margin so much, where it is small, that stability may be lost and won again between.
#[inline(always)]
pub fn leaps<L: Lane>(margin: L, last: L) -> L::Mask {
    differs_widely(margin, last, FIELD_NEAR_MARGIN, WIDENING.sqrt())
}

/// By how much the derivative of the residual differs from an earlier one with the inverse `before`, relative to it: below 1 its
/// determinant has the same sign.
#[inline(always)]
pub fn departure<L: Lane>(before: &Mat6<L>, matrix: &Mat6<L>) -> L {
    let one = before.0[0][0].constant(1.0);
    let change = before.times(matrix).minus(&Mat6::identity(one));
    change.0.as_flattened().iter().fold(one.constant(0.0), |sum, x| x.mul_add(*x, sum)).sqrt()
}

/// The same of the determinant of the second variation.
#[inline(always)]
fn softens<L: Lane>(determinant: L, last: L) -> L::Mask {
    differs_widely(determinant, last, FIELD_SOFT, FIELD_SOFT_RATIO)
}

/// Whether the rod may have passed through a magnet in a load step: its tip moved farther than its leeway before and after,
/// both together.
#[inline(always)]
fn passes_by<L: Lane>(way: L, before: L, after: L) -> L::Mask {
    !way.lt(before + after)
}

/// Leads all lanes from rest to their full load. With care, on a grid for it, the index is 0 at every step. Without, those arrive that ask for
/// no short steps, come near no fold and end with an index of 0.
#[inline(always)]
pub fn follow_varying<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    care: Option<&Resolution>,
    from: &Rest<L>,
    workspace: &mut VaryingWorkspace<L>,
) -> VaryingPath<L> {
    let program = problem.program;
    let rod = problem.rod;
    let zero = rod.t.x.constant(0.0);
    let one = zero.constant(1.0);
    let nobody = one.lt(zero);
    let resolution = care.unwrap_or(&program.coarse);
    let care = care.is_some();
    let rest = (Vec3::splat(zero), Vec3::splat(zero));
    let (mut accepted, mut end_inverse) = (rest, Mat6::identity(one));
    let slope = from.largest.max(one.constant(1e-6));
    // In single precision round-off hides what lies closer.
    let sharp = care && L::Scalar::SHARP;
    // Without care the field acts, but for stretches under a tip moment, as if it did at the middles of rigid segments; the answer corrects it.
    let points = match &program.field {
        Some(field) if care || program.load_without_energy => field.points,
        _ => CoilLoad::Middle.points(),
    };
    let smallest = one.constant(match (care, sharp) {
        (false, _) => SMALLEST_RAMP_STEP,
        (true, false) => SMALLEST_GUARDED_STEP,
        (true, true) => FIELD_SMALLEST_STEP,
    });
    let most_passes = if care { FIELD_PASS_LIMIT } else { NODE_PASS_LIMIT };
    let mut secant = from.slope;
    let mut lambda = zero;
    let mut step = (one.constant(FIRST_BEND * program.pace) / slope).min(one);
    let mut target = step;
    let mut base = (secant.0 * target, secant.1 * target);
    let trust = TRUST * program.pace;
    let first_bound = one.constant(trust / CONTRACTION);
    let (mut last_size, mut first_size) = (first_bound, zero);
    let (mut corrections, mut passes) = (zero, zero);
    let (mut reached, mut exhausted, mut unstable) = (nobody, nobody, nobody);
    let mut too_near = !zero.lt(from.leeway);
    let mut outside = !too_near & !zero.lt(from.inside);
    let mut failed = too_near | outside;
    let (mut last_tip, mut last_leeway) = (from.tip, from.leeway);
    let (mut weakest, mut last_margin, mut last_determinant) = (one, one, one);
    let dead = if program.load_without_energy { has_no_energy(rod) } else { nobody };
    loop {
        let active = !(reached | failed);
        if !L::any(active) {
            break;
        }
        let partial = target.lt(one);
        let counts = !care && L::any(active & !partial);
        let what = if counts { Carried::Transfers } else { Carried::Base };
        L::varying_pass(Pass { problem: *problem, resolution, lambda: target, base, what, points, workspace });
        let inverse = workspace.matrix.solve_soon(&Mat6::identity(one));
        let tip = workspace.tip;
        let (dn, dm) = inverse.on(rod.f_tip * target - tip.n, rod.l_tip * target - tip.m); // F5
        let correction = size((dn, dm), base);
        // Moments and radians, as on other paths.
        let moved = norm((dn, dm)).max(length(workspace.pose.on(dn, dm).1));
        let margin = margin(&inverse);
        let enough = match sharp || program.load_without_energy {
            true => narrowed(margin, sharp) * one.constant(PATH_TOLERANCE),
            false => L::select(partial, one.constant(FIELD_LOAD_TOLERANCE), one.constant(FULL_LOAD_TOLERANCE)),
        };
        let mut converged = active & correction.lt(enough);
        if care {
            let near = margin.lt(one.constant(NEAR_MARGIN));
            // The error left after a correction shifts the next one, so the tolerance shrinks with the trust.
            let left = L::select(near, one.constant(NEAR_TOLERANCE), one.constant(FIELD_TOLERANCE * program.pace));
            converged = converged & moved.lt(left);
        }
        let (is_far, is_inside) = (zero.lt(workspace.leeway), zero.lt(workspace.inside));
        let leeway = workspace.leeway;
        let passes_by = passes_by(length(tip.p - last_tip), last_leeway, leeway);
        let clear = is_far & is_inside & !passes_by;
        let (mut stable, mut determinant) = (converged, one);
        if L::any(converged & if care { converged } else { !partial }) {
            if care {
                let what = Carried::Transfers;
                L::varying_pass(Pass { problem: *problem, resolution, lambda: target, base, what, points, workspace });
            }
            let found = index(&workspace.transfers, one);
            stable = found.index.lt(one.constant(0.5));
            if program.load_without_energy {
                // A dead moment has no second variation: the matrix itself must stay regular.
                determinant = L::select(dead, one, found.determinant);
                stable = stable | (dead & converged);
            }
        }
        let contracting = moved.lt(last_size * one.constant(CONTRACTION));
        let converged = converged & contracting;
        let go_on = active & !converged & contracting & corrections.lt(one.constant(CORRECTIONS));
        let mut leaps = leaps(margin, last_margin) | softens(determinant, last_determinant);
        let mut departed = zero;
        if program.load_without_energy {
            // The first step sets out from the unloaded rod, where the matrix is regular.
            departed = L::select(zero.lt(lambda), departure(&end_inverse, &workspace.matrix), zero);
            leaps = leaps | (dead & !departed.lt(one.constant(DEPARTURE)));
        }
        let accept = converged & stable & clear & !leaps;
        let reject = active & !accept & !go_on;
        let least = one.constant(if program.bold { 0.0 } else { SAFE_MARGIN });
        let is_narrow = if care { nobody } else { converged & (!stable | margin.lt(least)) };
        unstable = (unstable & !active) | (reject & converged & !stable);
        too_near = (too_near & !active) | (reject & (!is_far | (converged & passes_by)));
        outside = (outside & !active) | (reject & is_far & !is_inside);
        weakest = L::select(accept, weakest.min(margin), weakest);
        let used = target - lambda;
        let mut most = one + one;
        if care {
            most = affordable(margin, last_margin, used, NEAR_MARGIN, SPENT);
            if program.load_without_energy {
                let far = used * one.constant(DEPARTURE_AIM * DEPARTURE) / departed;
                most = L::select(dead & far.lt(most), far, most);
            }
        }
        last_margin = L::select(accept, margin, last_margin);
        last_tip = Vec3::select(accept, tip.p, last_tip);
        last_leeway = L::select(accept, leeway, last_leeway);

        base = select::<L>(accept | go_on, (base.0 + dn, base.1 + dm), base);
        let per = one / used;
        let change = (base.0 - accepted.0, base.1 - accepted.1);
        // A step no longer than what its last correction may have left tells no direction.
        let tells = accept & (moved * one.constant(FIELD_TELLING)).lt(norm(change));
        secant = select::<L>(tells, (change.0 * per, change.1 * per), secant);
        accepted = select::<L>(accept, base, accepted);
        lambda = L::select(accept, target, lambda);
        end_inverse = Mat6::select(accept, &inverse, &end_inverse);
        reached = reached | (accept & !partial & !is_narrow);
        first_size = L::select(corrections.lt(one.constant(0.5)), moved, first_size);
        let narrow = narrowed(last_margin, sharp);
        let ratio = (narrow * one.constant(AIM * trust) / first_size.max(one.constant(1e-6))).sqrt();
        let ratio = ratio.max(one.constant(NODE_LEAST_RATIO)).min(one.constant(NODE_MOST_RATIO));
        step = L::select(accept, (used * ratio).min(most), L::select(reject, used * one.constant(NODE_RETREAT), step));
        let changes = (last_determinant - determinant).abs() * per;
        let halfway = (determinant * one.constant(0.5) / changes).max(one.constant(FIELD_LITTLE_STEP));
        let is_soft = accept & determinant.lt(one.constant(FIELD_SOFT));
        step = L::select(is_soft, step.min(halfway), step);
        last_determinant = L::select(accept, determinant, last_determinant);
        let load = if sharp { lambda.max(one.constant(LITTLE_LOAD)) } else { one };
        failed = failed | (reject & step.lt(smallest * load)) | is_narrow;
        let restart = (accept | reject) & !reached;
        target = L::select(restart, (lambda + step).min(one), target);
        let ahead = target - lambda;
        let predicted = (accepted.0 + secant.0 * ahead, accepted.1 + secant.1 * ahead);
        base = select::<L>(restart, predicted, base);
        last_size = L::select(go_on, moved, narrow * first_bound);
        corrections = L::select(go_on, corrections + one, zero);
        passes = L::select(active, passes + one, passes);
        let over = active & !reached & !passes.lt(one.constant(most_passes));
        exhausted = exhausted | over;
        failed = failed | over;
    }
    let lost = !(reached | exhausted);
    // At a fold the margin goes to zero as the path grows steep. Where it is not steep, the path may bend sharply and go on.
    let is_steep = one.constant(if sharp { FOLD_STEEPNESS } else { 0.0 }).lt(norm(secant) * last_margin);
    let is_weak = weakest.lt(one.constant(FOLD_MARGIN));
    // Under a tip moment the margin does not tell where stability is lost.
    let at_fold = is_steep & if program.load_without_energy { unstable | is_weak } else { is_weak };
    let fold = lost & !too_near & !outside & at_fold;
    let is_finite = length(accepted.1).is_finite();
    VaryingPath {
        base: accepted,
        inverse: end_inverse,
        reached: reached & is_finite,
        fold,
        turned: one.lt(zero),
        along: secant,
        too_near: lost & too_near,
        outside: lost & outside,
        exhausted,
        lambda,
        load_error: one,
        passes,
    }
}
