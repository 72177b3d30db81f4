//! From rest to full load on the coarse grid: load steps, prediction, Newton's method with a bound. R4
//!
//! A sample's iterations depend on that sample alone: a lane that has finished is frozen while its neighbours go on.

use crate::cpu::algebra::{
    Mat3, Vec3, affordable, axpy, columns_cross_sub, cross, dot, inverse, length, select_matrix,
};
use crate::cpu::rod::base::{moment_columns, rotation_columns};
use crate::cpu::rod::problem::shoot;
use crate::cpu::rod::problem::{Problem, Record, Workspace, stiff};
use crate::cpu::rod::shoot::tip_moment_columns;
use crate::cpu::rod::stability::{departure, has_no_energy, is_above, is_sharp, squared_norm, stability_index};
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::tolerances::{
    AIM, CONTRACTION, CORRECTIONS, DEPARTURE, DEPARTURE_AIM, FIRST_BEND, FOLD_MARGIN, FULL_LOAD_TOLERANCE, LEAST_RATIO,
    LITTLE_LOAD, LOAD_STEP_TOLERANCE, MOST_RATIO, NARROW_MARGIN, NEAR_MARGIN, NEAR_TOLERANCE, NEARBY, PASS_LIMIT,
    PATH_TOLERANCE, RETREAT, RETREATS, SAFE_MARGIN, SMALLEST_GUARDED_STEP, SMALLEST_RAMP_STEP, SMALLEST_SHARP_STEP,
    SMALLEST_UNSYMMETRIC_STEP, SPENT, TRUST, WIDENING,
};

/// How to reach the full load; each is tried where the one before did not lead to a stable equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// From the base moment that anchors predict, along no path at all.
    Anchored,
    /// In as many load steps as it takes to contract, one if that will do; never across a change of sign of
    /// det(dr/dm0).
    Ramp,
    /// Along the curve of equilibria on a finer grid, with a stability index of zero on every step, through a turn of the load. It
    /// tells of folds alone.
    Curve,
    /// A ramp on that grid, with a stability index of zero on every step.
    GuardedRamp,
    /// Not from rest: from a given base moment, away from known equilibria.
    Search,
}

/// Where a group stands after the path.
pub struct PathEnd<L: Lane> {
    pub m0: Vec3<L>,
    pub inverse: Mat3<L>,
    pub lambda: L,
    /// dm0/dlambda there, about.
    pub heading: Vec3<L>,
    pub passes: L,
    pub reached: L::Mask,
    /// In more than one load step.
    pub ramped: L::Mask,
    /// Anchors tell it so well that no step need come before the check.
    pub close: L::Mask,
    pub exhausted: L::Mask,
    /// Not reached, and near a fold or a bifurcation.
    pub fold: L::Mask,
    /// Its load was seen to turn there.
    pub turned: L::Mask,
    /// Error of lambda at a fold whose turn was seen, else 1.
    pub load_error: L,
}

/// How the equilibrium sets out from rest.
#[derive(Clone, Copy)]
pub struct RestSlope<L> {
    /// dm0/dlambda: the moment of all loads on the unbent rod, R4 at u = u*.
    pub m0: Vec3<L>,
    /// The largest moment by all loads inside the unbent rod, at its base and at the ends of its flexible segments. Loads that
    /// cancel at the base bend the rod between them all the same.
    pub largest: L,
}

/// dm0/dlambda at rest, and the largest moment inside the unbent rod.
#[inline(always)]
pub fn rest_slope<L: Lane>(problem: &Problem<'_, L>, workspace: &mut Workspace<L>) -> RestSlope<L> {
    let Problem { program, rod, .. } = *problem;
    let zero = rod.t.x.constant(0.0);
    let one = zero.constant(1.0);
    let stiff = Problem { rod: &stiff(rod), ..*problem };
    let tip = shoot(&stiff, &program.coarse, one, Vec3::splat(zero), &mut [], Record::Moments, workspace);
    let m0 = rod.l_tip - tip.m;
    // The base moment of a rod that stays where it is adds to each moment inside.
    let largest = workspace.moments.iter().fold(length(m0), |largest, m| largest.max(length(*m + m0)));
    RestSlope { m0, largest }
}

/// The last accepted states, for the prediction of the next.
struct History<L> {
    /// Load fraction and base moment accepted last.
    lambda: L,
    m0: Vec3<L>,
    /// Load fraction before that, and the secant between the two.
    lambda_before: L,
    secant: Vec3<L>,
    /// Second divided difference.
    bend: Vec3<L>,
}

impl<L: Lane> History<L> {
    /// Base moment at load fraction `target` by quadratic extrapolation.
    #[inline(always)]
    fn predict(&self, target: L) -> Vec3<L> {
        let ahead = target - self.lambda;
        let slope = axpy(ahead + self.lambda - self.lambda_before, self.bend, self.secant);
        axpy(ahead, slope, self.m0)
    }

    #[inline(always)]
    fn accept(&mut self, accept: L::Mask, target: L, m0: Vec3<L>) {
        let one = target.constant(1.0);
        let secant = (m0 - self.m0) * (one / (target - self.lambda));
        let bend = (secant - self.secant) * (one / (target - self.lambda_before));
        self.bend = Vec3::select(accept, bend, self.bend);
        self.secant = Vec3::select(accept, secant, self.secant);
        self.lambda_before = L::select(accept, self.lambda, self.lambda_before);
        self.lambda = L::select(accept, target, self.lambda);
        self.m0 = Vec3::select(accept, m0, self.m0);
    }
}

/// The share of a correction's bounds that holds at a margin, where the path is `sharp`: next to a bifurcation other branches
/// are as near as its root.
#[inline(always)]
fn narrowed<L: Lane>(square: L, sharp: bool) -> L {
    let one = square.constant(1.0);
    if sharp { (square.constant(3.0_f64.sqrt() / NEAR_MARGIN) / square.sqrt()).min(one).sqrt() } else { one }
}

/// Whether a load step takes the margin so far, where it is small, that stability may be lost and won again between.
#[inline(always)]
fn leaps<L: Lane>(square: L, last_square: L) -> L::Mask {
    let most = square.constant(WIDENING);
    let near = !is_above(square.max(last_square), NEAR_MARGIN);
    near & ((square * most).lt(last_square) | (last_square * most).lt(square))
}

/// Follows the equilibrium from rest to the full load on the coarse grid.
#[inline(always)]
pub fn follow_path<L: Lane>(
    problem: &Problem<'_, L>,
    path: Path,
    rest: RestSlope<L>,
    workspace: &mut Workspace<L>,
) -> PathEnd<L> {
    let Problem { program, rod, .. } = *problem;
    let zero = rod.t.x.constant(0.0);
    let one = zero.constant(1.0);
    let nobody = one.lt(zero);
    let guarded = path == Path::GuardedRamp;
    // In single precision round-off hides what lies closer.
    let sharp = guarded && L::Scalar::SHARP;
    let resolution = if guarded { &program.careful } else { &program.coarse };
    let unsymmetric = program.load_without_energy;
    let dead = if unsymmetric { has_no_energy(rod) } else { nobody };
    let smallest_step = zero.constant(match (guarded, sharp) {
        (false, _) => SMALLEST_RAMP_STEP,
        (true, _) if unsymmetric => SMALLEST_UNSYMMETRIC_STEP,
        (true, true) => SMALLEST_SHARP_STEP,
        (true, false) => SMALLEST_GUARDED_STEP,
    });
    let no_vector = Vec3::splat(zero);
    let mut history = History { lambda: zero, m0: no_vector, lambda_before: zero, secant: rest.m0, bend: no_vector };
    let (trust, first_bend) = (zero.constant(TRUST * program.pace), zero.constant(FIRST_BEND * program.pace));
    let mut step = first_bend / rest.largest.max(first_bend);
    let mut target = step;
    let mut m0 = history.predict(target);
    let first_bound = trust * zero.constant(1.0 / CONTRACTION);
    let mut last_size = first_bound;
    let mut first_size = zero;
    let mut corrections = zero;
    let mut passes = one;
    let mut inverse_w = Mat3 { x: no_vector, y: no_vector, z: no_vector };
    // Largest squared norm of the inverse on accepted steps, and that on the last.
    let (mut weakest, mut last_square) = (zero, zero.constant(3.0));
    // (dr/dm0)^-1 there, under a tip moment.
    let mut last_inverse = Mat3::identity(one);
    // Steps in a row that were rejected.
    let mut retreats = zero;
    let (mut reached, mut ramped, mut failed, mut exhausted) = (nobody, nobody, nobody, nobody);
    // The last step was rejected for its stability, not for Newton's method.
    let mut unstable = nobody;
    loop {
        let active = !(reached | failed);
        if !L::any(active) {
            break;
        }
        let mut columns = [moment_columns(one), rotation_columns(m0)];
        let (threes, record) = if guarded { (2, Record::Stability) } else { (1, Record::Nothing) };
        let columns = &mut columns[..threes];
        let tip = shoot(problem, resolution, target, m0, columns, record, workspace);
        let residual = tip.m - rod.l_tip * target;
        let w = tip_moment_columns(program.terms, &tip, &columns[0]);
        let w_inverse = inverse(w);
        let delta = -(w_inverse * residual); // R4
        // In plan units of moment or in radians: a soft rod turns far by little.
        let size = length(delta).max(length(columns[0].w * delta));
        let m_new = m0 + delta;
        let contracting = size.lt(last_size * zero.constant(CONTRACTION)) & corrections.lt(zero.constant(CORRECTIONS));
        // A dead tip moment makes w unsymmetric; the index changes where its symmetric part is singular. Few steps ask for
        // that bound, those with care for w itself. S5, S6
        let (mut form, mut form_inverse) = (w, w_inverse);
        if unsymmetric && !guarded {
            form = columns_cross_sub(columns[0].w, rod.l_tip * (target * zero.constant(0.5)), w);
            form_inverse = inverse(form);
        }
        let mut same_branch = zero.lt(dot(form.x, cross(form.y, form.z)));
        if guarded {
            let index = stability_index(program.terms, &workspace.station, &tip, columns);
            let mut holds = index.lt(zero.constant(0.5));
            if unsymmetric {
                holds = holds | dead;
            }
            same_branch = same_branch & holds;
        }
        let square = squared_norm(&form_inverse);
        let partial = target.lt(one);
        let tolerance = match guarded {
            true => narrowed(square, sharp) * zero.constant(PATH_TOLERANCE),
            false => L::select(partial, zero.constant(LOAD_STEP_TOLERANCE), zero.constant(FULL_LOAD_TOLERANCE)),
        };
        // However small against the load, a correction that is not trusted may have led to another branch.
        let mut enough = tolerance * (one + length(m0));
        if sharp {
            enough = L::select(is_above(square, NEAR_MARGIN), enough, enough.min(zero.constant(NEAR_TOLERANCE)));
        }
        let converged = size.lt(enough) & contracting;
        // Too near a bifurcation to know afterwards on which side it was passed; no long correction may start beyond one.
        let (lost, regular) = if guarded {
            (
                !is_above(weakest, NARROW_MARGIN) & square.lt(weakest * zero.constant(0.25)),
                same_branch | size.lt(narrowed(last_square, sharp) * zero.constant(NEARBY)),
            )
        } else {
            // Whoever retreats so often did not stand on the branch.
            let safe = is_above(square, SAFE_MARGIN) & retreats.lt(zero.constant(RETREATS));
            (!safe, same_branch & safe)
        };
        let lost = active & converged & same_branch & lost;
        let mut accept = active & converged & same_branch & !lost;
        let mut departed = zero;
        if guarded && unsymmetric {
            departed = departure(&last_inverse, &w);
            let near = !dead | departed.lt(zero.constant(DEPARTURE));
            accept = accept & near & !leaps(square, last_square);
        }
        let go_on = active & !converged & contracting & regular;
        let reject = active & !accept & !go_on;
        let destabilised = converged & !same_branch & is_sharp(&w);
        unstable = (unstable & !active) | (reject & destabilised);
        weakest = L::select(accept, weakest.max(square), weakest);
        let used = target - history.lambda;
        let mut most = one + one;
        if guarded {
            let root = zero.constant(3.0_f64.sqrt());
            most = affordable(root / square.sqrt(), root / last_square.sqrt(), used, NEAR_MARGIN, SPENT);
            if unsymmetric {
                let far = used * zero.constant(DEPARTURE_AIM * DEPARTURE) / departed;
                most = L::select(dead & far.lt(most), far, most);
                last_inverse = select_matrix::<L>(accept, w_inverse, last_inverse);
            }
        }
        last_square = L::select(accept, square, last_square);

        inverse_w = select_matrix::<L>(accept | go_on, w_inverse, inverse_w);
        history.accept(accept, target, m_new);
        reached = reached | (accept & !partial);
        ramped = ramped | (accept & partial);
        first_size = L::select(corrections.lt(zero.constant(0.5)), size, first_size);
        let most_ratio = zero.constant(MOST_RATIO);
        let aim = trust * zero.constant(AIM);
        let ratio = first_size / (narrowed(last_square, sharp) * aim);
        let ratio = L::select(ratio.lt(most_ratio), ratio, most_ratio).max(zero.constant(LEAST_RATIO));
        let factor = one / ratio.sqrt().sqrt();
        step = L::select(accept, (used * factor).min(most), step);
        step = L::select(reject, used * factor.min(zero.constant(RETREAT)), step);
        let load = if sharp { history.lambda.max(zero.constant(LITTLE_LOAD)) } else { one };
        if !guarded {
            // Between here and there lies a fold, which this grid may have put elsewhere, or no branch at all.
            failed = failed | (reject & !(same_branch & is_above(square, SAFE_MARGIN)));
        }
        failed = failed | lost | (reject & step.lt(smallest_step * load));
        let restart = accept | reject;
        target = L::select(restart, (history.lambda + step).min(one), target);
        m0 = Vec3::select(restart, Vec3::select(reached, m_new, history.predict(target)), m0);
        m0 = Vec3::select(go_on, m_new, m0);
        last_size = L::select(go_on, size, narrowed(last_square, sharp) * first_bound);
        corrections = L::select(go_on, corrections + one, zero);
        retreats = L::select(reject, retreats + one, L::select(accept, zero, retreats));
        passes = L::select(active, passes + one, passes);
        let over = active & !reached & !passes.lt(zero.constant(PASS_LIMIT));
        exhausted = exhausted | over;
        failed = failed | over;
    }
    let at_fold = if guarded { unstable | !is_above(weakest, FOLD_MARGIN) } else { nobody };
    PathEnd {
        m0: Vec3::select(reached, m0, history.m0),
        inverse: inverse_w,
        lambda: history.lambda,
        heading: history.secant,
        passes,
        reached,
        ramped,
        close: nobody,
        exhausted,
        fold: at_fold & !(reached | exhausted),
        turned: nobody,
        load_error: one,
    }
}
