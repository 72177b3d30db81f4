//! The boundary value problem: from rest to full load, Newton's method on the base moment. R4, J5
//!
//! A sample's iterations depend on that sample alone: a lane that has finished is frozen while its neighbours go on.

use super::algebra::{Mat3, Vec3, axpy, cross, dot, inverse, length, transpose};
use super::column::Columns;
use super::lane::{Lane, Scalar};
use super::program::{Inputs, Outputs, Program};
use super::rod::{Rod, Segment, Terms};
use super::rows::{Responses, write_rows};
use super::shoot::{Tip, Workspace, force_columns, moment_columns, rotation_columns, shoot, tip_moment_columns};
use super::stability::stability_index;
use crate::model::path::{
    CHORD_LIMIT, CHORD_TOLERANCE, CHORD_TRUST, CONTRACTION, CORRECTIONS, EASY, FIRST_RAMP_STEP, NEWTON_LIMIT,
    PASS_LIMIT, PATH_TOLERANCE, ROUND_OFF, SMALLEST_GUARDED_STEP, SMALLEST_RAMP_STEP, TRUST,
};
use crate::model::{Quantity, Status};

/// How to reach the full load; each is tried where the one before did not lead to a stable equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// In one step, if Newton's method contracts at once.
    Direct,
    /// In as many steps as it takes to contract, never across a change of sign of det(dr/dm0).
    Ramp,
    /// The same, with a stability index of zero on every step.
    GuardedRamp,
}

/// Where a group stands after the path.
struct PathEnd<L: Lane> {
    m0: Vec3<L>,
    inverse: Mat3<L>,
    lambda: L,
    passes: L,
    reached: L::Mask,
    exhausted: L::Mask,
}

/// dm0/dlambda at rest: the moment of all loads on the unbent rod, R4 at u = u*.
#[inline(always)]
fn rest_slope<L: Lane, T: Terms>(program: &Program, rod: &Rod<L>, workspace: &mut Workspace<L>) -> Vec3<L> {
    let zero = rod.t.x.constant(0.0);
    let mut stiff = Rod { segments: Vec::with_capacity(rod.segments.len()), ..*rod };
    for segment in &rod.segments {
        stiff.segments.push(match segment {
            Segment::Flexible(flexible) => {
                let mut flexible = *flexible;
                flexible.compliance = Vec3::splat(zero);
                Segment::Flexible(flexible)
            }
            Segment::Rigid(rigid) => Segment::Rigid(*rigid),
        });
    }
    let one = zero.constant(1.0);
    let tip = shoot::<L, T>(program, &program.coarse, &stiff, one, Vec3::splat(zero), &mut [], false, workspace);
    rod.l_tip - tip.m
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

/// Follows the equilibrium from rest to the full load on the coarse grid.
#[inline(always)]
fn follow_path<L: Lane, T: Terms>(
    program: &Program,
    rod: &Rod<L>,
    path: Path,
    workspace: &mut Workspace<L>,
) -> PathEnd<L> {
    let zero = rod.t.x.constant(0.0);
    let one = zero.constant(1.0);
    let nobody = one.lt(zero);
    let guarded = path == Path::GuardedRamp;
    let (first_step, smallest_step) = match path {
        Path::Direct => (one, one),
        Path::Ramp => (zero.constant(FIRST_RAMP_STEP), zero.constant(SMALLEST_RAMP_STEP)),
        Path::GuardedRamp => (zero.constant(FIRST_RAMP_STEP), zero.constant(SMALLEST_GUARDED_STEP)),
    };
    let no_vector = Vec3::splat(zero);
    let secant = rest_slope::<L, T>(program, rod, workspace);
    let mut history = History { lambda: zero, m0: no_vector, lambda_before: zero, secant, bend: no_vector };
    let mut step = first_step;
    let mut target = first_step;
    let mut m0 = history.predict(target);
    let first_bound = zero.constant(TRUST / CONTRACTION);
    let mut last_size = first_bound;
    let mut corrections = zero;
    let mut passes = one;
    let mut inverse_w = Mat3 { x: no_vector, y: no_vector, z: no_vector };
    let (mut reached, mut failed, mut exhausted) = (nobody, nobody, nobody);
    loop {
        let active = !(reached | failed);
        if !L::any(active) {
            break;
        }
        let mut columns = [moment_columns(one), rotation_columns(m0)];
        let columns = &mut columns[..if guarded { 2 } else { 1 }];
        let tip = shoot::<L, T>(program, &program.coarse, rod, target, m0, columns, guarded, workspace);
        let residual = tip.m - rod.l_tip * target;
        let w = tip_moment_columns::<L, T>(&tip, &columns[0]);
        let w_inverse = inverse(w);
        let delta = -(w_inverse * residual); // R4
        let size = length(delta);
        let m_new = m0 + delta;
        let converged = size.lt(zero.constant(PATH_TOLERANCE) * (one + length(m0)));
        let contracting = size.lt(last_size * zero.constant(CONTRACTION)) & corrections.lt(zero.constant(CORRECTIONS));
        let mut same_branch = zero.lt(dot(w.x, cross(w.y, w.z)));
        if guarded {
            let index = stability_index::<L, T>(&workspace.stations, &tip, columns);
            same_branch = same_branch & index.lt(zero.constant(0.5));
        }
        let accept = active & converged & same_branch;
        let go_on = active & !converged & contracting;
        let reject = active & !accept & !go_on;

        inverse_w = select_matrix::<L>(accept | go_on, w_inverse, inverse_w);
        history.accept(accept, target, m_new);
        reached = reached | (accept & !target.lt(one));
        let easy = corrections.lt(zero.constant(EASY));
        step = L::select(accept & easy, step + step, step);
        step = L::select(reject, step * zero.constant(0.5), step);
        failed = failed | (reject & step.lt(smallest_step));
        let restart = accept | reject;
        target = L::select(restart, (history.lambda + step).min(one), target);
        m0 = Vec3::select(restart, Vec3::select(reached, m_new, history.predict(target)), m0);
        m0 = Vec3::select(go_on, m_new, m0);
        last_size = L::select(go_on, size, first_bound);
        corrections = L::select(go_on, corrections + one, zero);
        passes = L::select(active, passes + one, passes);
        let over = active & !reached & !passes.lt(zero.constant(PASS_LIMIT));
        exhausted = exhausted | over;
        failed = failed | over;
    }
    PathEnd { m0, inverse: inverse_w, lambda: history.lambda, passes, reached, exhausted }
}

#[inline(always)]
fn select_matrix<L: Lane>(mask: L::Mask, if_true: Mat3<L>, if_false: Mat3<L>) -> Mat3<L> {
    Mat3 {
        x: Vec3::select(mask, if_true.x, if_false.x),
        y: Vec3::select(mask, if_true.y, if_false.y),
        z: Vec3::select(mask, if_true.z, if_false.z),
    }
}

/// Moves the base moment to the fine grid's equilibrium by chord steps, without columns.
#[inline(always)]
fn chord_steps<L: Lane, T: Terms>(program: &Program, rod: &Rod<L>, end: &mut PathEnd<L>, workspace: &mut Workspace<L>) {
    let one = end.lambda.constant(1.0);
    let tolerance = one.constant(program.newton_tolerance);
    let mut moving = end.reached;
    for _ in 0..CHORD_LIMIT {
        if !L::any(moving) {
            break;
        }
        let tip = shoot::<L, T>(program, &program.fine, rod, one, end.m0, &mut [], false, workspace);
        let delta = -(end.inverse * (tip.m - rod.l_tip));
        let size = length(delta);
        // A chord step that is not small says that the coarse grid was too coarse: Newton's method takes over.
        let small = moving & size.lt(one.constant(CHORD_TRUST));
        end.m0 = Vec3::select(small, end.m0 + delta, end.m0);
        end.passes = L::select(moving, end.passes + one, end.passes);
        moving = small & !size.lt(tolerance * one.constant(CHORD_TOLERANCE));
    }
}

/// Solves one group and writes its rows, in the plan's units, to `out`.
///
/// Lanes that the path does not lead to a stable equilibrium are `Pending`, except on the last path.
#[inline(always)]
pub fn solve_group<L: Lane, T: Terms>(
    program: &Program,
    token: L::Token,
    inputs: &Inputs<'_, L::Scalar>,
    path: Path,
    rod: &mut Rod<L>,
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    rod.load(program, token, inputs);
    let zero = L::splat(token, 0.0);
    let one = L::splat(token, 1.0);
    let mut end = follow_path::<L, T>(program, rod, path, workspace);
    if path != Path::GuardedRamp && !L::any(end.reached) {
        out.store(Quantity::Status.column(), code(one, Status::Pending));
        return;
    }
    chord_steps::<L, T>(program, rod, &mut end, workspace);

    let mut moving = end.reached;
    let mut converged = one.lt(zero);
    let mut columns = [moment_columns(one), rotation_columns(end.m0), force_columns(one)];
    let mut tip = Tip { p: rod.t, d1: rod.t, t: rod.t, m: rod.t, n: rod.t };
    let (mut delta, mut size) = (Vec3::splat(zero), one);
    let mut w_inverse = end.inverse;
    for pass in 0..NEWTON_LIMIT {
        columns = [moment_columns(one), rotation_columns(end.m0), force_columns(one)];
        tip = shoot::<L, T>(program, &program.fine, rod, one, end.m0, &mut columns, true, workspace);
        w_inverse = inverse(tip_moment_columns::<L, T>(&tip, &columns[0]));
        delta = -(w_inverse * (tip.m - rod.l_tip)); // J5
        size = length(delta);
        converged = end.reached & size.lt(one.constant(program.newton_tolerance) * (one + length(end.m0)));
        end.passes = L::select(moving, end.passes + one, end.passes);
        moving = moving & !converged & size.lt(one.constant(TRUST));
        if pass + 1 == NEWTON_LIMIT || !L::any(moving) {
            break;
        }
        end.m0 = Vec3::select(moving, end.m0 + delta, end.m0);
    }
    // What is left of the residual is taken out to first order.
    let tip_position = tip.p + columns[0].dp * delta;
    let turn = columns[0].w * delta;
    let (d1, t) = (tip.d1 + cross(turn, tip.d1), tip.t + cross(turn, tip.t));
    let m0 = end.m0 + delta;
    let residual = length(tip.m - rod.l_tip);

    let index = stability_index::<L, T>(&workspace.stations, &tip, &columns);
    let stable = index.lt(one.constant(0.5));
    let norm = length(w_inverse.x) * length(w_inverse.x)
        + length(w_inverse.y) * length(w_inverse.y)
        + length(w_inverse.z) * length(w_inverse.z);
    let margin = (one.constant(3.0) / norm).sqrt();
    let margin = L::select(stable, margin, -margin);
    let status = status_codes(&end, path, converged, stable, size);

    out.store_vector(Quantity::TipPosition.column(), tip_position);
    out.store_vector(Quantity::TipD1.column(), d1);
    out.store_vector(Quantity::TipTangent.column(), t);
    out.store_vector(Quantity::BaseMoment.column(), m0);
    out.store(Quantity::Residual.column(), residual);
    out.store(Quantity::StabilityMargin.column(), margin);
    out.store(Quantity::StabilityIndex.column(), index);
    out.store(Quantity::Iterations.column(), end.passes);
    out.store(Quantity::LoadFraction.column(), end.lambda);
    out.store(Quantity::Status.column(), status);

    let n0 = rod.base_force::<T>();
    let responses = Responses::new::<T>(rod, &tip, &columns);
    write_rows::<L, T>(program, token, inputs, rod, end.m0, n0, &columns, &responses, workspace, out);

    let error = error_estimate::<L, T>(program, rod, &end, &columns[0], w_inverse, (tip_position, d1, t), workspace);
    out.store(Quantity::ErrorEstimate.column(), error);
}

/// Status of each lane, as codes.
#[inline(always)]
fn status_codes<L: Lane>(end: &PathEnd<L>, path: Path, converged: L::Mask, stable: L::Mask, size: L) -> L {
    let ok = code(size, Status::Ok);
    let unsolved = L::select(size.is_finite(), code(size, Status::NotConverged), code(size, Status::NonFinite));
    match path {
        Path::Direct => L::select(converged & stable, ok, code(size, Status::Pending)),
        Path::Ramp => L::select(converged & stable, code(size, Status::Ramped), code(size, Status::Pending)),
        Path::GuardedRamp => {
            let lost = L::select(end.exhausted, code(size, Status::StepLimit), code(size, Status::Fold));
            let done = L::select(stable, code(size, Status::Ramped), code(size, Status::Unstable));
            L::select(end.reached, L::select(converged, done, unsolved), lost)
        }
    }
}

#[inline(always)]
fn code<L: Lane>(of: L, status: Status) -> L {
    of.constant(f64::from(status.code()))
}

/// Difference to the equilibrium on twice as many steps, plus what round-off can do through dm0/dr.
#[inline(always)]
fn error_estimate<L: Lane, T: Terms>(
    program: &Program,
    rod: &Rod<L>,
    end: &PathEnd<L>,
    by_moment: &Columns<L>,
    w_inverse: Mat3<L>,
    (p, d1, t): (Vec3<L>, Vec3<L>, Vec3<L>),
    workspace: &mut Workspace<L>,
) -> L {
    let one = end.lambda.constant(1.0);
    let tip = shoot::<L, T>(program, &program.check, rod, one, end.m0, &mut [], false, workspace);
    let delta = -(w_inverse * (tip.m - rod.l_tip));
    let turn = by_moment.w * delta;
    let dp = length(tip.p + by_moment.dp * delta - p);
    let dd1 = length(tip.d1 + cross(turn, tip.d1) - d1);
    let dt = length(tip.t + cross(turn, tip.t) - t);
    let columns = transpose(by_moment.w * w_inverse);
    let amplification = length(columns.x) + length(columns.y) + length(columns.z);
    let round_off = (one + amplification) * one.constant(ROUND_OFF * L::Scalar::EPSILON);
    dp.max(dd1).max(dt) + round_off * (one + length(end.m0))
}
