//! The boundary value problem: Newton's method on the fine grid, and the row of each sample. R4, J5
//!
//! A sample's iterations depend on that sample alone: a lane that has finished is frozen while its neighbours go on.

use super::chord::{Answered, Check, answer, check_pass, chord_steps, newton_step};
use super::fold::{TurnedAt, write_fold_rows};
use super::path::{Path, PathEnd};
use super::search::snap;
use crate::cpu::algebra::{Mat3, Vec3, cross, dot, inverse, length};
use crate::cpu::rod::base::{force_columns, forward_columns, moment_columns, rotation_columns};
use crate::cpu::rod::columns::Columns;
use crate::cpu::rod::problem::shoot;
use crate::cpu::rod::problem::{Problem, Record, Tip, Workspace};
use crate::cpu::rod::program::Outputs;
use crate::cpu::rod::rows::{Responses, write_forward_rows, write_rows};
use crate::cpu::rod::shoot::tip_moment_columns;
use crate::cpu::rod::stability::{
    by_rotation, has_no_energy, is_grown, is_sharp, margin, stability_index, whole_index,
};
use crate::cpu::simd::lane::Lane;
use crate::model::tolerances::{FINE_TRUST, NEWTON_LIMIT, REACH};
use crate::model::{NO_EQUILIBRIUM, Quantity, Status};

/// Solves one group from where its `path` ended and writes its rows, in the plan's units, to `out`.
///
/// Lanes that the path does not lead to a stable equilibrium are `Pending`, except on the last path.
#[inline(always)]
pub fn solve_group<L: Lane>(
    problem: &Problem<'_, L>,
    path: Path,
    mut end: PathEnd<L>,
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let turned = TurnedAt::new(&end);
    let snapped = if L::any(end.fold) { snap(problem, &mut end, workspace) } else { end.fold };
    end.reached = end.reached | snapped;
    let mut check = chord_steps(problem, path, &mut end, workspace);
    let found = newton(problem, &mut end, workspace);
    let Found { tip, delta, w, w_inverse, moved, .. } = &found;
    if L::any(*moved) {
        check = Check::select(*moved, check_pass(problem, end.m0, workspace), check);
    }
    let columns = std::mem::take(&mut workspace.columns);
    let answered = answer(problem, &check, (tip, *delta), &columns[0], (end.m0, w, w_inverse));
    write_answer(&answered, length(*w * (answered.m0 - end.m0)), out);
    write_verdict(problem, path, &end, &found, &columns, workspace, out);
    write_derivatives(problem, end.m0, tip, &columns, workspace, out);
    workspace.columns = columns;
    write_fold_rows(problem, &turned, workspace, out);
}

/// What Newton's iteration found on the fine grid; its columns are left in the workspace.
pub struct Found<L: Lane> {
    pub tip: Tip<L>,
    /// The step that would follow, and its size.
    pub delta: Vec3<L>,
    size: L,
    pub w: Mat3<L>,
    pub w_inverse: Mat3<L>,
    converged: L::Mask,
    /// Whether any step was taken.
    moved: L::Mask,
}

/// Newton's iteration on the fine grid, with the columns of the derivatives. J5
#[inline(always)]
pub fn newton<L: Lane>(problem: &Problem<'_, L>, end: &mut PathEnd<L>, workspace: &mut Workspace<L>) -> Found<L> {
    let Problem { program, rod, .. } = *problem;
    let zero = end.lambda.constant(0.0);
    let one = end.lambda.constant(1.0);
    for k in 0..workspace.sources.len() {
        workspace.sources[k].load((problem.program, &problem.inputs), problem.rod, 3 * k, None);
    }
    let mut columns = std::mem::take(&mut workspace.columns);
    let mut moving = end.reached;
    let (mut converged, mut moved) = (one.lt(zero), one.lt(zero));
    let mut tip = Tip { p: rod.t, d1: rod.t, t: rod.t, m: rod.t, n: rod.t };
    let (mut delta, mut size) = (Vec3::splat(zero), one);
    let (mut w, mut w_inverse) = (end.inverse, end.inverse);
    for pass in 0..NEWTON_LIMIT {
        start_columns(problem, end.m0, workspace, &mut columns);
        tip = shoot(problem, &program.fine, one, end.m0, &mut columns, Record::Traces, workspace);
        w = tip_moment_columns(program.terms, &tip, &columns[0]);
        w_inverse = inverse(w);
        delta = newton_step(rod, &tip, &w_inverse);
        size = length(delta);
        let tolerance = one.constant(program.newton_tolerance) * (one + length(end.m0));
        let first_order = margin(&w_inverse) * one.constant(program.first_order_tolerance);
        let is_still = length(columns[0].w * delta).lt(one.constant(program.turn_tolerance));
        converged = end.reached & size.lt(tolerance.max(first_order)) & is_still;
        end.passes = L::select(moving, end.passes + one, end.passes);
        moving = moving & !converged & size.lt(one.constant(FINE_TRUST));
        if pass + 1 == NEWTON_LIMIT || !L::any(moving) {
            break;
        }
        end.m0 = Vec3::select(moving, end.m0 + delta, end.m0);
        moved = moved | moving;
    }
    workspace.columns = columns;
    Found { tip, delta, size, w, w_inverse, converged, moved }
}

/// Writes pose, base moment, residual and error estimates.
#[inline(always)]
pub fn write_answer<L: Lane>(answered: &Answered<L>, residual: L, out: &mut Outputs<'_, L::Scalar>) {
    out.store_vector(Quantity::TipPosition.column(), answered.p);
    out.store_vector(Quantity::TipD1.column(), answered.d1);
    out.store_vector(Quantity::TipTangent.column(), answered.t);
    out.store_vector(Quantity::BaseMoment.column(), answered.m0);
    out.store(Quantity::Residual.column(), residual);
    out.store(Quantity::ErrorEstimate.column(), answered.error);
    out.store(Quantity::DerivativeError.column(), answered.derivative_error);
}

/// Writes stability, status and what the way there took.
#[inline(always)]
pub fn write_verdict<L: Lane>(
    problem: &Problem<'_, L>,
    path: Path,
    end: &PathEnd<L>,
    found: &Found<L>,
    columns: &[Columns<L>],
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let program = problem.program;
    let Found { tip, size, w, w_inverse, converged, .. } = found;
    let one = size.constant(1.0);
    let within_reach = length(tip.p).lt(one.constant(REACH));
    let mut index = stability_index(program.terms, &workspace.station, tip, columns);
    let doubtful = *converged & !index.lt(one.constant(0.5));
    if by_rotation(columns).is_none() && L::any(doubtful) {
        index = L::select(doubtful, whole_index(problem, end.m0, workspace), index);
    }
    let stable = index.lt(one.constant(0.5));
    let certain = if path == Path::Search { !one.lt(one) } else { stable | is_sharp(w) };
    let converged = *converged & within_reach & certain;
    let margin = margin(w_inverse);
    // Under a dead tip moment det W tells whether the rod has diverged; few steps to get there do not tell. S6
    let mut stable = stable;
    if program.load_without_energy && matches!(path, Path::GuardedRamp | Path::Search) {
        let undiverged = one.constant(0.0).lt(dot(w.x, cross(w.y, w.z)));
        stable = stable | (has_no_energy(problem.rod) & undiverged);
    }
    let margin = L::select(stable, margin, -margin);
    let finite = size.is_finite() & within_reach;
    let status = status_codes(end, path, converged, stable, is_grown(w), finite, one);
    let index = L::select(converged, index, one.constant(NO_EQUILIBRIUM));

    out.store(Quantity::StabilityMargin.column(), margin);
    out.store(Quantity::StabilityIndex.column(), index);
    out.store(Quantity::Iterations.column(), end.passes);
    out.store(Quantity::LoadFraction.column(), end.lambda);
    out.store(Quantity::Status.column(), status);
    out.store(Quantity::LoadFractionError.column(), end.load_error);
}

/// Writes the rows of the derivatives, by forward columns or by reciprocity.
#[inline(always)]
pub fn write_derivatives<L: Lane>(
    problem: &Problem<'_, L>,
    m0: Vec3<L>,
    tip: &Tip<L>,
    columns: &[Columns<L>],
    workspace: &Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, rod, .. } = *problem;
    if program.forward {
        write_forward_rows(problem, m0, tip, columns, workspace, out);
    } else if !program.derivatives.is_empty() {
        let responses = Responses::new(program.terms, rod, tip, columns);
        write_rows(problem, m0, columns, &responses, workspace, out);
    }
}

/// The columns of a pass at the base: by base moment, and what the derivatives need.
#[inline(always)]
pub fn start_columns<L: Lane>(
    problem: &Problem<'_, L>,
    m0: Vec3<L>,
    workspace: &Workspace<L>,
    columns: &mut Vec<Columns<L>>,
) {
    let Problem { program, rod, .. } = *problem;
    let one = m0.x.constant(1.0);
    columns.clear();
    columns.push(moment_columns(one));
    for sources in &workspace.sources {
        columns.push(forward_columns(program.terms, rod, sources, m0));
    }
    if !program.forward && !program.derivatives.is_empty() {
        columns.push(force_columns(one));
        if program.base_moment_rows {
            columns.push(rotation_columns(m0));
        }
    }
}

/// Status of each lane, as codes.
#[inline(always)]
fn status_codes<L: Lane>(
    end: &PathEnd<L>,
    path: Path,
    converged: L::Mask,
    stable: L::Mask,
    grown: L::Mask,
    finite: L::Mask,
    one: L,
) -> L {
    let ok = code(one, Status::Ok);
    let pending = code(one, Status::Pending);
    let unsolved = L::select(finite, code(one, Status::NotConverged), code(one, Status::NonFinite));
    match path {
        Path::Anchored => L::select(converged & stable & !grown, ok, pending),
        Path::Ramp => {
            let done = L::select(end.ramped, code(one, Status::Ramped), ok);
            L::select(converged & stable & !grown, done, pending)
        }
        Path::Curve => L::select(end.fold, code(one, Status::Fold), pending),
        Path::Search => {
            let done = L::select(stable, ok, code(one, Status::Unstable));
            L::select(end.reached & converged, done, unsolved)
        }
        Path::GuardedRamp => {
            let lost = L::select(end.exhausted, code(one, Status::StepLimit), unsolved);
            let done = L::select(stable, code(one, Status::Ramped), code(one, Status::Unstable));
            let done = L::select(grown, pending, done);
            let end_status = L::select(end.reached, L::select(converged, done, unsolved), lost);
            L::select(end.fold, code(one, Status::Fold), end_status)
        }
    }
}

#[inline(always)]
fn code<L: Lane>(of: L, status: Status) -> L {
    of.constant(f64::from(status.code()))
}
