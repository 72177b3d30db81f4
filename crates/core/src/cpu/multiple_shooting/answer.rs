//! Answers by nodes: the path from rest, Newton's method on ever finer steps, and the row of each rod. N4

use super::margin::node_margin;
use super::mesh::softness;
use super::path::follow_nodes;
use super::responses::{tip_response, write_node_rows};
use super::state::{Nodes, Purpose};
use crate::cpu::algebra::{Mat3, length};
use crate::cpu::equilibrium::fold::leave_folds_empty;
use crate::cpu::rod::problem::{Problem, Tip, Workspace};
use crate::cpu::rod::program::Outputs;
use crate::cpu::rod::stability::{has_no_energy, margin, squared_norm};
use crate::cpu::simd::apart::apart;
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::tolerances::{
    COLUMN_NOISE, NODE_COLUMNS_ERROR, NODE_CONTRACTION, NODE_CORRECTIONS, NODE_ENOUGH, NODE_ERROR_SHARE, NODE_GOOD,
    NODE_LEFT_OVER, NODE_LEVELS, NODE_NEARBY, NODE_PACES, NODE_ROUND_OFF, PATH_STEPPER, REACH, node_columns_good,
    node_integrals,
};
use crate::model::{NO_EQUILIBRIUM, Quantity, Status};

/// Solves one group by nodes and writes its rows, in the plan's units, to `out`; `arrived` are those whose nodes have come
/// to their full load by a quick path, in so many passes.
///
/// A fold is said where the path ends there on a mesh and on one twice as fine. N4
#[inline(always)]
pub fn solve_nodes<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &mut Nodes<L>,
    (arrived, mut passes): (L::Mask, L),
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let one = passes.constant(1.0);
    let zero = one.constant(0.0);
    let nobody = one.lt(zero);
    for k in 0..workspace.sources.len() {
        workspace.sources[k].load((problem.program, &problem.inputs), problem.rod, 3 * k, None);
    }
    leave_folds_empty(problem.program, one, out);
    let mut done = answer(problem, nodes, arrived, passes, workspace, out);
    let (mut fold, mut exhausted, mut lambda) = (!nobody, nobody, zero);
    for pace in &NODE_PACES[1..] {
        if !L::any(!done) {
            return;
        }
        nodes.mesh.cut(problem, pace.spacing);
        nodes.resolve(PATH_STEPPER.tableau(), pace.steps);
        let end = follow_nodes(problem, nodes, *pace, !done, workspace);
        passes = passes + end.passes;
        lambda = L::select(done, lambda, end.lambda);
        (fold, exhausted) = (fold & end.fold, end.exhausted);
        done = done | answer(problem, nodes, end.reached, passes, workspace, out);
    }
    let code = |status: Status| one.constant(f64::from(status.code()));
    let lost = L::select(exhausted, code(Status::StepLimit), code(Status::NotConverged));
    let lost = L::select(fold, code(Status::Fold), lost);
    merge(out, Quantity::Status.column(), !done, lost);
    merge(out, Quantity::StabilityIndex.column(), !done, one.constant(NO_EQUILIBRIUM));
    merge(out, Quantity::Iterations.column(), !done, passes);
    merge(out, Quantity::LoadFraction.column(), !done, lambda);
    out.store(Quantity::LoadFractionError.column(), one);
}

/// Writes a column of some lanes.
#[inline(always)]
fn merge<L: Lane>(out: &mut Outputs<'_, L::Scalar>, column: usize, mask: L::Mask, value: L) {
    let at = column * out.stride + out.offset;
    let before = L::load(value.token(), &out.data[at..]);
    out.store(column, L::select(mask, value, before));
}

/// What is compared from one level to the next: the tip, and how it answers a tip moment.
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
    passes: L,
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) -> L::Mask {
    let out = Outputs { data: &mut *out.data, ..*out };
    L::apart(passes.token(), AnswerNodes { problem, nodes, wanted, passes, workspace, out })
}

apart!(
    AnswerNodes<'a, L: Lane>(
        problem: &'a Problem<'a, L>, nodes: &'a mut Nodes<L>, wanted: L::Mask, passes: L, workspace: &'a mut Workspace<L>,
        out: Outputs<'a, L::Scalar>
    ) -> L::Mask,
    answer_apart(problem, nodes, wanted, passes, workspace, &mut { out })
);

#[inline(always)]
fn answer_apart<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &mut Nodes<L>,
    wanted: L::Mask,
    mut passes: L,
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) -> L::Mask {
    let program = problem.program;
    let one = passes.constant(1.0);
    let good = program.newton_tolerance.max(NODE_GOOD).max(100.0 * L::Scalar::EPSILON);
    let columns_good = node_columns_good(good, L::Scalar::EPSILON);
    let row_count = if program.base_moment_rows { 9 } else { 6 };
    let columns = Quantity::COUNT + row_count * program.derivatives.len();
    let mut rows = vec![L::Scalar::default(); columns * L::COUNT];
    let soft = softness(problem);
    let (mut written, mut left) = (one.lt(one), wanted);
    let mut coarser: Option<Compared<L>> = None;
    for (k, (stepper, steps)) in NODE_LEVELS.into_iter().enumerate() {
        if !L::any(left) {
            break;
        }
        nodes.resolve(stepper.tableau(), steps);
        let what = if k == 0 { Purpose::Transfers } else { Purpose::Drives };
        let small = NODE_ENOUGH * good;
        let enough = (small, small.min(columns_good / (1.2 * NODE_LEFT_OVER)));
        let (converged, left_over) = balance(problem, nodes, what, left, enough, &mut passes, workspace);
        let (w, dp) = tip_response(nodes);
        let finer = Compared { tip: nodes.tip, w, dp };
        let (stepper, steps_after) = NODE_LEVELS.get(k + 1).copied().unwrap_or((stepper, 2 * steps));
        nodes.resolve(stepper.tableau(), steps_after);
        correct(problem, nodes, converged, workspace);
        if let Some(coarser) = &coarser {
            let (error, columns_error) = difference(coarser, &finer, &nodes.tip, problem.rod.length());
            let error = error * one.constant(NODE_ERROR_SHARE);
            let columns_error = columns_error * one.constant(NODE_COLUMNS_ERROR)
                + left_over * soft * one.constant(NODE_LEFT_OVER)
                + one.constant(node_integrals(steps));
            let is_good = error.lt(one.constant(good)) & columns_error.lt(one.constant(columns_good));
            let is_last = k + 1 == NODE_LEVELS.len();
            let ready = if is_last { left } else { left & (is_good | !converged) };
            if L::any(ready) {
                let mut row = Outputs { data: &mut rows, stride: L::COUNT, offset: 0 };
                let mut stable = nodes.elimination.index.lt(one.constant(0.5));
                if program.load_without_energy {
                    let undiverged = one.constant(0.0).lt(nodes.elimination.least_whole(&nodes.transfers));
                    stable = stable | (has_no_energy(problem.rod) & undiverged);
                }
                let fits = ready & converged & stable & length(nodes.tip.p).lt(one.constant(REACH));
                let noise = round_off(nodes);
                // Responses to a tip moment do not tell the error of an integral over a short taper; the measured floor does.
                let columns_error = columns_error.max(one.constant(program.derivative_scale.known_floor()));
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

/// Newton's method in `wanted` lanes, until a step is below `enough`, or small and no longer much smaller than the one
/// before: it leaves its square. The tip is that after this step, to first order. Returns those that have converged, and
/// that step.
#[inline(always)]
fn balance<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &mut Nodes<L>,
    what: Purpose,
    wanted: L::Mask,
    (small, enough): (f64, f64),
    passes: &mut L,
    workspace: &mut Workspace<L>,
) -> (L::Mask, L) {
    let one = passes.constant(1.0);
    let (mut moving, mut converged) = (wanted, one.lt(one));
    let (mut size, mut last_size) = (one, one);
    for _ in 0..NODE_CORRECTIONS {
        nodes.pass(problem, one, what, workspace);
        size = nodes.newton_step(problem, one);
        *passes = L::select(moving, *passes + one, *passes);
        let stalled = size.lt(one.constant(small)) & !size.lt(last_size * one.constant(NODE_CONTRACTION));
        converged = converged | (moving & (stalled | size.lt(one.constant(enough))));
        last_size = size;
        moving = moving & !converged & size.lt(one.constant(NODE_NEARBY));
        if !L::any(moving) {
            break;
        }
        nodes.take_step(moving);
    }
    // All passes alike for a lane that waits for others: it takes its step with the last.
    nodes.take_step(converged);
    nodes.tip = nodes.moved_tip();
    (converged, size)
}

/// Takes some lanes to the equilibrium of the level beyond, which is so near that the transfers in hand lead there.
#[inline(always)]
fn correct<L: Lane>(problem: &Problem<'_, L>, nodes: &mut Nodes<L>, wanted: L::Mask, workspace: &mut Workspace<L>) {
    nodes.pass(problem, problem.rod.t.x.constant(1.0), Purpose::Tip, workspace);
    nodes.chord_step(problem.rod.l_tip);
    nodes.take_step(wanted);
    nodes.tip = nodes.moved_tip();
}

/// The largest change of the tip to the level beyond, over the rod's length or in radians, and that of the columns from the
/// level before, relative to them.
#[inline(always)]
fn difference<L: Lane>(coarser: &Compared<L>, finer: &Compared<L>, tip: &Tip<L>, rod_length: L) -> (L, L) {
    let shift = length(tip.p - finer.tip.p) / rod_length;
    let turned = length(tip.d1 - finer.tip.d1).max(length(tip.t - finer.tip.t));
    let relative = |a: Mat3<L>, b: Mat3<L>| (squared_norm(&(a - b)) / squared_norm(&a)).sqrt();
    (shift.max(turned), relative(finer.w, coarser.w).max(relative(finer.dp, coarser.dp)))
}

/// What rounding does: the larger the moments, the more it turns.
#[inline(always)]
fn round_off<L: Lane>(nodes: &Nodes<L>) -> L {
    let one = nodes.tip.p.x.constant(1.0);
    let (mut largest, mut count) = (one.constant(0.0), one.constant(0.0));
    for (node, interval) in nodes.nodes.iter().zip(&nodes.mesh.intervals) {
        largest = largest.max(length(node.m));
        count = L::select(interval.is_there(one), count + one, count);
    }
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
    let tip_margin = margin(&nodes.elimination.w_inverse);
    let margin = if problem.program.load_without_energy {
        let kept = nodes.elimination.clone();
        nodes.factor_symmetric();
        let margin = node_margin(problem, nodes, tip_margin);
        nodes.elimination = kept;
        // Where the symmetric part is not definite, its compliance bounds nothing.
        L::select(nodes.elimination.index.lt(one.constant(0.5)), margin, tip_margin)
    } else {
        node_margin(problem, nodes, tip_margin)
    };
    row.store_vector(Quantity::TipPosition.column(), nodes.tip.p);
    row.store_vector(Quantity::TipD1.column(), nodes.tip.d1);
    row.store_vector(Quantity::TipTangent.column(), nodes.tip.t);
    row.store_vector(Quantity::BaseMoment.column(), nodes.nodes[0].m);
    row.store(Quantity::Residual.column(), nodes.residual(problem.rod.l_tip));
    row.store(Quantity::ErrorEstimate.column(), error);
    row.store(Quantity::DerivativeError.column(), derivative_error);
    row.store(Quantity::StabilityMargin.column(), margin);
    row.store(Quantity::StabilityIndex.column(), nodes.elimination.index);
    row.store(Quantity::Iterations.column(), passes);
    row.store(Quantity::LoadFraction.column(), one);
    row.store(Quantity::LoadFractionError.column(), one);
    row.store(Quantity::Status.column(), one.constant(f64::from(Status::Ramped.code())));
    write_node_rows(problem, nodes, workspace, row);
}
