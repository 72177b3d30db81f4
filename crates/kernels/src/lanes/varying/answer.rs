//! Newton's method on the fine grid and the row of each sample, in a field that varies. F5, J5

use super::ends::slopes;
use super::index::index;
use super::matrix::Mat6;
use super::pass::{Pass, VaryingWorkspace, What};
use super::path::{VaryingPath, follow_varying, margin, norm, size};
use crate::lanes::algebra::{Vec3, cross, dot, length};
use crate::lanes::kernels::Kernels;
use crate::lanes::lane::{Lane, Scalar};
use crate::lanes::problem::Problem;
use crate::lanes::program::{Outputs, Resolution};
use crate::lanes::rod::Segment;
use crate::lanes::section::velocity;
use crate::model::path::{COLUMN_NOISE, CONTRACTION, DIFFERENCE, REACH, ROUND_OFF, TRUST};
use crate::model::{DerivativeScale, NO_EQUILIBRIUM, Quantity, Status};

/// Passes on the fine grid, the first of them for chord steps.
const PASSES: usize = 14;
const CHORDS: usize = 8;

/// Solves one group and writes its rows, in the plan's units, to `out`. Without care, lanes whose path asks for short
/// steps are `Pending`.
#[inline(always)]
pub fn solve_varying<L: Kernels>(
    problem: &Problem<'_, L>,
    care: bool,
    workspace: &mut VaryingWorkspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, rod, .. } = *problem;
    let zero = rod.t.x.constant(0.0);
    let one = zero.constant(1.0);
    workspace.space.load(problem);
    for k in 0..workspace.parameters.len() {
        workspace.parameters[k].load(problem, 3 * k);
    }
    let mut end = follow_varying(problem, care, workspace);
    let tolerance = one.constant(program.newton_tolerance);
    let (mut moving, mut converged) = (end.reached, one.lt(zero));
    // Chord steps with the path's inverse while they bring much, else Newton's.
    let mut bound = one.constant(TRUST);
    let mut chords = true;
    for pass in 0..PASSES {
        let what = if pass < CHORDS && chords { What::State } else { What::Base };
        shoot(problem, &program.fine, end.base, what, workspace);
        if what == What::Base {
            end.inverse = workspace.matrix.solve(&Mat6::identity(one));
            bound = one.constant(TRUST);
        }
        let tip = workspace.tip;
        let (dn, dm) = end.inverse.on(rod.f_tip - tip.n, rod.l_tip - tip.m); // F5
        let (change, share) = (norm((dn, dm)), size((dn, dm), end.base));
        let trusted = moving & change.lt(bound);
        end.passes = L::select(moving, end.passes + one, end.passes);
        end.base =
            (Vec3::select(trusted, end.base.0 + dn, end.base.0), Vec3::select(trusted, end.base.1 + dm, end.base.1));
        converged = converged | (trusted & share.lt(tolerance));
        chords = chords && L::any(trusted);
        bound = L::select(trusted, change * one.constant(CONTRACTION), bound);
        moving = moving & !converged;
        if !L::any(moving) {
            break;
        }
    }
    write(problem, &end, (converged, care), workspace, out);
}

#[inline(always)]
fn shoot<L: Kernels>(
    problem: &Problem<'_, L>,
    resolution: &Resolution,
    base: (Vec3<L>, Vec3<L>),
    what: What,
    workspace: &mut VaryingWorkspace<L>,
) {
    let lambda = base.0.x.constant(1.0);
    let points = problem.program.field.as_ref().map_or(&[][..], |field| field.points);
    L::varying_pass(Pass { problem: *problem, resolution, lambda, base, what, points, workspace });
}

/// What a change of the base's load does to the tip: displacement and rotation.
#[inline(always)]
fn moved<L: Lane>(workspace: &VaryingWorkspace<L>, change: (Vec3<L>, Vec3<L>)) -> (Vec3<L>, Vec3<L>) {
    workspace.pose.on(change.0, change.1)
}

/// Writes the row; what is left of the residual is taken out to first order.
#[inline(always)]
fn write<L: Kernels>(
    problem: &Problem<'_, L>,
    end: &VaryingPath<L>,
    (converged, care): (L::Mask, bool),
    workspace: &mut VaryingWorkspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, rod, .. } = *problem;
    let one = rod.t.x.constant(1.0);
    // On twice the steps, for the error estimate.
    shoot(problem, &program.check, end.base, What::State, workspace);
    let check = workspace.tip;
    shoot(problem, &program.fine, end.base, What::Parameters, workspace);
    let tip = workspace.tip;
    let inverse = workspace.matrix.solve(&Mat6::identity(one));
    let left = inverse.on(rod.f_tip - tip.n, rod.l_tip - tip.m); // F5
    let converged = converged & size(left, end.base).lt(one.constant(10.0 * program.newton_tolerance));
    let (dp, turn) = moved(workspace, left);
    let position = tip.p + dp;
    let (d1, t) = (tip.d1 + cross(turn, tip.d1), tip.t + cross(turn, tip.t));
    let m0 = end.base.1 + left.1;
    if program.first_beyond_rigid.is_some() {
        let u = workspace.first.u + workspace.first.moved(left);
        out.store_vector(Quantity::COUNT + program.rows * program.derivatives.len(), u);
    }
    let index = index(&workspace.transfers, one);
    let stable = index.lt(one.constant(0.5));
    let margin = margin(&inverse);
    let within_reach = length(tip.p).lt(one.constant(REACH));
    let zero = one.constant(0.0);
    let (is_far, is_inside) = (zero.lt(workspace.clearance), zero.lt(workspace.inside));
    let clear = is_far & is_inside;

    let mut status = L::select(stable, code(one, Status::Ramped), code(one, Status::Unstable));
    let unsolved = L::select(length(tip.p).is_finite(), code(one, Status::NotConverged), code(one, Status::NonFinite));
    let converged = converged & within_reach;
    status = L::select(converged, status, unsolved);
    status = L::select(is_inside, status, code(one, Status::OutsideMap));
    status = L::select(is_far, status, code(one, Status::TooNearMagnet));
    let mut lost = L::select(end.exhausted, code(one, Status::StepLimit), code(one, Status::NotConverged));
    lost = L::select(end.fold, code(one, Status::Fold), lost);
    lost = L::select(end.outside, code(one, Status::OutsideMap), lost);
    lost = L::select(end.too_near, code(one, Status::TooNearMagnet), lost);
    let lost = if care { lost } else { code(one, Status::Pending) };
    let status = L::select(end.reached, status, lost);
    let is_equilibrium = end.reached & converged & clear;

    out.store_vector(Quantity::TipPosition.column(), position);
    out.store_vector(Quantity::TipD1.column(), d1);
    out.store_vector(Quantity::TipTangent.column(), t);
    out.store_vector(Quantity::BaseMoment.column(), m0);
    let residual = length(tip.n - rod.f_tip).max(length(tip.m - rod.l_tip));
    out.store(Quantity::Residual.column(), residual);
    out.store(Quantity::StabilityMargin.column(), L::select(stable, margin, -margin));
    out.store(Quantity::StabilityIndex.column(), L::select(is_equilibrium, index, one.constant(NO_EQUILIBRIUM)));
    out.store(Quantity::Iterations.column(), end.passes);
    out.store(Quantity::LoadFraction.column(), end.lambda);
    out.store(Quantity::Status.column(), status);

    let delta = inverse.on(rod.f_tip - check.n, rod.l_tip - check.m);
    let (shift, turned) = moved(workspace, delta);
    let by_position = length(check.p + shift - position) / rod.length();
    let by_d1 = length(check.d1 + cross(turned, check.d1) - d1);
    let by_t = length(check.t + cross(turned, check.t) - t);
    let answers = workspace.pose.times(&inverse);
    let mut square = one;
    for x in answers.0.as_flattened() {
        square = x.mul_add(*x, square);
    }
    let load = (length(end.base.0) + length(m0) + one) * one.constant(ROUND_OFF * L::Scalar::EPSILON);
    let error = by_position.max(by_d1).max(by_t) * one.constant(DIFFERENCE) + load * square.sqrt();
    out.store(Quantity::ErrorEstimate.column(), error);
    let steps = (dot(delta.0, delta.0) + dot(delta.1, delta.1)).sqrt();
    let both = by_position.max(by_d1).max(by_t) + steps / margin;
    let DerivativeScale { share, floor } = program.derivative_scale;
    let noise = load * square.sqrt() / margin * one.constant(COLUMN_NOISE);
    let derivative_error = (both * one.constant(share)).max(one.constant(floor)) + noise;
    out.store(Quantity::DerivativeError.column(), derivative_error);
    write_rows(problem, end, &inverse, workspace, out);
}

/// The rows of every derivative: dX = dX|base + (dX/d(base)) d(base). J5
#[inline(always)]
fn write_rows<L: Lane>(
    problem: &Problem<'_, L>,
    end: &VaryingPath<L>,
    inverse: &Mat6<L>,
    workspace: &VaryingWorkspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, rod, .. } = *problem;
    let rows = program.rows / 3;
    let base = super::step::State {
        p: Vec3::splat(rod.t.x.constant(0.0)),
        d1: rod.d1,
        t: rod.t,
        m: end.base.1,
        n: end.base.0,
    };
    let mut slope = base.p;
    if let Some(Segment::Flexible(first)) = rod.segments.first() {
        let v = velocity(program.terms, first, base.d1, cross(base.t, base.d1), base.t, base.n);
        slope = slopes(&workspace.space, first, &base, v).0;
    }
    for (three, (parameters, columns)) in workspace.parameters.iter().zip(&workspace.columns).enumerate() {
        for k in 0..3.min(program.derivatives.len() - 3 * three) {
            let dn = parameters.df_tip[k] - columns.dn[k];
            let dm = parameters.sources.dl_tip[k] - columns.dm[k];
            let change = inverse.on(dn, dm);
            let (dp, w) = moved(workspace, change);
            // What is inserted lies proximal to the former base.
            let dm0 = change.1 - slope * parameters.sources.insertion[k];
            let mut du0 = dm0;
            if program.first_beyond_rigid.is_some() {
                du0 = workspace.first.by_parameters[three][k] + workspace.first.moved(change);
            }
            let all = [columns.dp[k] + dp, columns.w[k] + w, dm0, du0];
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
