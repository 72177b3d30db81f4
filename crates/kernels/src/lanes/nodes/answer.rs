//! Answers by nodes: the path from rest, Newton's method on ever finer steps, and the row of each rod. N4

use super::path::follow_nodes;
use super::responses::{tip_response, write_node_rows};
use super::state::{Nodes, What};
use crate::lanes::algebra::{Mat3, length};
use crate::lanes::lane::{Lane, Scalar};
use crate::lanes::problem::{Problem, Workspace};
use crate::lanes::program::Outputs;
use crate::lanes::shoot::Tip;
use crate::lanes::stability::{margin, squared_norm};
use crate::model::path::{
    COLUMN_NOISE, NODE_COLUMNS_GOOD, NODE_CORRECTIONS, NODE_GOOD, NODE_NEWTON, NODE_PATH_STEPS, NODE_ROUND_OFF,
    NODE_SPACINGS, NODE_STEPPER, NODE_STEPS, PATH_STEPPER, REACH,
};
use crate::model::{NO_EQUILIBRIUM, Quantity, Status};

/// Solves one group by nodes and writes its rows, in the plan's units, to `out`.
///
/// A fold is said where the path ends there on a mesh and on one twice as fine.
#[inline(always)]
pub fn solve_nodes<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &mut Nodes<L>,
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let one = problem.rod.t.x.constant(1.0);
    let zero = one.constant(0.0);
    let nobody = one.lt(zero);
    for k in 0..workspace.sources.len() {
        workspace.sources[k].load(problem, 3 * k);
    }
    let (mut done, mut fold, mut exhausted) = (nobody, !nobody, nobody);
    let (mut passes, mut lambda) = (zero, zero);
    for spacing in NODE_SPACINGS {
        nodes.mesh.cut(problem, spacing);
        nodes.resolve(PATH_STEPPER.tableau(), NODE_PATH_STEPS);
        let end = follow_nodes(problem, nodes, !done, workspace);
        passes = passes + end.passes;
        lambda = L::select(done, lambda, end.lambda);
        (fold, exhausted) = (fold & end.fold, end.exhausted);
        done = done | answer(problem, nodes, end.reached, passes, workspace, out);
        if !L::any(!done) {
            return;
        }
    }
    let code = |status: Status| one.constant(f64::from(status.code()));
    let lost = L::select(exhausted, code(Status::StepLimit), code(Status::NotConverged));
    let lost = L::select(fold, code(Status::Fold), lost);
    merge(out, Quantity::Status.column(), !done, lost);
    merge(out, Quantity::StabilityIndex.column(), !done, one.constant(NO_EQUILIBRIUM));
    merge(out, Quantity::Iterations.column(), !done, passes);
    merge(out, Quantity::LoadFraction.column(), !done, lambda);
}

/// Writes a column of some lanes.
#[inline(always)]
fn merge<L: Lane>(out: &mut Outputs<'_, L::Scalar>, column: usize, mask: L::Mask, value: L) {
    let at = column * out.stride + out.offset;
    let before = L::load(value.token(), &out.data[at..]);
    out.store(column, L::select(mask, value, before));
}

/// What is compared from one number of steps to the next: the tip, and how it answers a tip moment.
struct Compared<L> {
    tip: Tip<L>,
    w: Mat3<L>,
    dp: Mat3<L>,
}

/// Takes ever more steps in `wanted` lanes until tip and columns no longer change, writes their rows, and returns those
/// that have one.
#[inline(always)]
fn answer<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &mut Nodes<L>,
    wanted: L::Mask,
    mut passes: L,
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) -> L::Mask {
    let program = problem.program;
    let one = passes.constant(1.0);
    let bound = |good: f64| one.constant(good.max(100.0 * L::Scalar::EPSILON));
    let row_count = if program.base_moment_rows { 9 } else { 6 };
    let columns = Quantity::COUNT + row_count * program.derivatives.len();
    let mut rows = vec![L::Scalar::default(); columns * L::COUNT];
    let (mut written, mut left) = (one.lt(one), wanted);
    let mut coarser: Option<Compared<L>> = None;
    for (k, steps) in NODE_STEPS.into_iter().enumerate() {
        if !L::any(left) {
            break;
        }
        nodes.resolve(NODE_STEPPER.tableau(), steps);
        let converged = balance(problem, nodes, left, &mut passes, workspace);
        let (w, dp) = tip_response(nodes);
        let finer = Compared { tip: nodes.tip, w, dp };
        if let Some(coarser) = &coarser {
            let (error, columns_error) = difference(coarser, &finer, problem.rod.length());
            let good = error.lt(bound(NODE_GOOD)) & columns_error.lt(bound(NODE_COLUMNS_GOOD));
            let is_last = k + 1 == NODE_STEPS.len();
            let ready = if is_last { left } else { left & (good | !converged) };
            if L::any(ready) {
                let mut row = Outputs { data: &mut rows, stride: L::COUNT, offset: 0 };
                let stable = nodes.elimination.index.lt(one.constant(0.5));
                let fits = ready & converged & stable & length(nodes.tip.p).lt(one.constant(REACH));
                let noise = round_off(nodes);
                write_row(
                    problem,
                    nodes,
                    (error + noise, columns_error + noise * one.constant(COLUMN_NOISE)),
                    passes,
                    workspace,
                    &mut row,
                );
                for column in 0..columns {
                    merge(out, column, fits, L::load(one.token(), &rows[column * L::COUNT..]));
                }
                written = written | fits;
                left = left & !ready;
            }
        }
        coarser = Some(finer);
    }
    written
}

/// Newton's method in `wanted` lanes, then a pass with everything that a row needs; returns those that have converged.
#[inline(always)]
fn balance<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &mut Nodes<L>,
    wanted: L::Mask,
    passes: &mut L,
    workspace: &mut Workspace<L>,
) -> L::Mask {
    let one = passes.constant(1.0);
    let tolerance = one.constant(NODE_NEWTON.max(64.0 * L::Scalar::EPSILON));
    let (mut moving, mut converged) = (wanted, one.lt(one));
    for _ in 0..NODE_CORRECTIONS {
        if !L::any(moving) {
            break;
        }
        nodes.pass(problem, one, What::Transfers, workspace);
        let size = nodes.newton_step(problem, one);
        nodes.take_step(moving);
        *passes = L::select(moving, *passes + one, *passes);
        converged = converged | (moving & size.lt(tolerance));
        moving = moving & !converged & size.lt(one);
    }
    nodes.pass(problem, one, What::Drives, workspace);
    nodes.newton_step(problem, one);
    converged
}

/// The largest change of the tip, over the rod's length or in radians, and that of the columns, relative to them.
#[inline(always)]
fn difference<L: Lane>(coarser: &Compared<L>, finer: &Compared<L>, rod_length: L) -> (L, L) {
    let shift = length(finer.tip.p - coarser.tip.p) / rod_length;
    let turned = length(finer.tip.d1 - coarser.tip.d1).max(length(finer.tip.t - coarser.tip.t));
    let relative = |a: Mat3<L>, b: Mat3<L>| (squared_norm(&(a - b)) / squared_norm(&a)).sqrt();
    (shift.max(turned), relative(finer.w, coarser.w).max(relative(finer.dp, coarser.dp)))
}

/// What rounding does: the larger the moments, the more it turns.
#[inline(always)]
fn round_off<L: Lane>(nodes: &Nodes<L>) -> L {
    let one = nodes.tip.p.x.constant(1.0);
    let largest = nodes.nodes.iter().fold(one.constant(0.0), |largest, node| largest.max(length(node.m)));
    let count = nodes
        .mesh
        .intervals
        .iter()
        .fold(one.constant(0.0), |count, interval| L::select(interval.is_there(one), count + one, count));
    (one + largest) * (one + count.sqrt()) * one.constant(NODE_ROUND_OFF * L::Scalar::EPSILON)
}

/// Writes the row of an equilibrium after [`balance`].
#[inline(always)]
fn write_row<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &mut Nodes<L>,
    (error, derivative_error): (L, L),
    passes: L,
    workspace: &mut Workspace<L>,
    row: &mut Outputs<'_, L::Scalar>,
) {
    let one = passes.constant(1.0);
    row.store_vector(Quantity::TipPosition.column(), nodes.tip.p);
    row.store_vector(Quantity::TipD1.column(), nodes.tip.d1);
    row.store_vector(Quantity::TipTangent.column(), nodes.tip.t);
    row.store_vector(Quantity::BaseMoment.column(), nodes.nodes[0].m);
    row.store(Quantity::Residual.column(), nodes.residual(problem.rod.l_tip));
    row.store(Quantity::ErrorEstimate.column(), error);
    row.store(Quantity::DerivativeError.column(), derivative_error);
    row.store(Quantity::StabilityMargin.column(), margin(&nodes.elimination.w_inverse));
    row.store(Quantity::StabilityIndex.column(), nodes.elimination.index);
    row.store(Quantity::Iterations.column(), passes);
    row.store(Quantity::LoadFraction.column(), one);
    row.store(Quantity::Status.column(), one.constant(f64::from(Status::Ramped.code())));
    write_node_rows(problem, nodes, workspace, row);
}
