//! Derivatives by nodes: what loads and parameters do to all nodes, and rows of the Jacobian from it. N2, J5

use super::elimination::Changes;
use super::mesh::Interval;
use super::state::Nodes;
use super::traces::Response;
use crate::cpu::algebra::{Mat3, columns_cross_add, hat, outer};
use crate::cpu::rod::base::base_slope;
use crate::cpu::rod::columns::{By, Columns};
use crate::cpu::rod::problem::{Problem, Workspace};
use crate::cpu::rod::program::Outputs;
use crate::cpu::rod::rows::{Responses, store_rows, write_rows};
use crate::cpu::rod::trace::Trace;
use crate::cpu::simd::lane::Lane;

/// Writes the rows of the derivatives after a pass with drives and its elimination.
#[inline(always)]
pub fn write_node_rows<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &mut Nodes<L>,
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let program = problem.program;
    if program.forward {
        write_forward_rows(problem, nodes, workspace, out);
    } else if !program.derivatives.is_empty() {
        write_reciprocal_rows(problem, nodes, workspace, out);
    }
}

/// Rows of forward columns.
#[inline(always)]
fn write_forward_rows<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &mut Nodes<L>,
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, rod, .. } = *problem;
    let m0 = nodes.nodes[0].m;
    let half = m0.x.constant(0.5);
    let base = base_slope(program.terms, rod, m0, rod.base_force(program.terms));
    let mut changes = Vec::new();
    for (three, sources) in workspace.sources.iter().enumerate() {
        let w_base = outer(base.omega, sources.insertion, sources.w0);
        let defect = |i: usize| {
            let drive = &nodes.drives[i * nodes.drive_count + three];
            Some((drive.w, drive.mu))
        };
        nodes.elimination.solve(&nodes.transfers, defect, sources.dl_tip, w_base, &mut changes);
        let (w_tip, dp_tip) = tip_change(nodes, &changes, Some(three));
        let position = outer(base.v, sources.insertion, sources.dp0) + dp_tip;
        let dm0 = columns_cross_add(w_base, m0 * half, changes[0].1);
        let base_moment = outer(base.torque, sources.insertion, dm0);
        for k in 0..(program.derivatives.len() - 3 * three).min(3) {
            store_rows(program, 3 * three + k, &[position[k], w_tip[k], base_moment[k]], out);
        }
    }
}

/// Rotation and displacement of the tip by unit tip moments, whose responses are kept.
#[inline(always)]
pub fn tip_response<L: Lane>(nodes: &mut Nodes<L>) -> (Mat3<L>, Mat3<L>) {
    let one = nodes.tip.p.x.constant(1.0);
    let Nodes { elimination, transfers, by_moment, .. } = &mut *nodes;
    elimination.solve(transfers, |_| None, Mat3::identity(one), Mat3::zero(one), by_moment);
    tip_change(nodes, &nodes.by_moment, None)
}

/// Rotation and displacement of the tip by changes of the nodes, and by what drives the intervals.
#[inline(always)]
fn tip_change<L: Lane>(nodes: &Nodes<L>, changes: &Changes<L>, drive: Option<usize>) -> (Mat3<L>, Mat3<L>) {
    let mut dp = Mat3::zero(nodes.tip.p.x);
    for (i, (transfer, (w, mu))) in nodes.transfers.iter().zip(changes).enumerate() {
        dp = dp + transfer.dp_w * *w + transfer.dp_mu * *mu;
        if let Some(drive) = drive {
            dp = dp + nodes.drives[i * nodes.drive_count + drive].dp;
        }
    }
    (changes[nodes.transfers.len()].0, dp)
}

/// Rows by reciprocity: the responses to a unit tip moment, a unit tip force and a unit rotation of the base.
#[inline(always)]
fn write_reciprocal_rows<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &mut Nodes<L>,
    workspace: &mut Workspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, rod, .. } = *problem;
    let one = nodes.tip.p.x.constant(1.0);
    let zero = Mat3::zero(one);
    let identity = Mat3::identity(one);
    let base_rotation = nodes.elimination.pivots[0].s;
    if program.load_without_energy {
        // The adjoint condition, dm - w x l_tip = unit.
        nodes.elimination.factor(&nodes.transfers, hat(rod.l_tip * one.constant(-0.5)));
    }
    let Nodes { elimination, transfers, drives, by_moment, .. } = &mut *nodes;
    let count = if program.base_moment_rows { 3 } else { 2 };
    let mut responses: Vec<Changes<L>> = vec![Vec::new(); count];
    // That to a tip moment is at hand, but for the adjoint condition.
    responses[0] = std::mem::take(by_moment);
    if program.load_without_energy {
        elimination.solve(transfers, |_| None, identity, zero, &mut responses[0]);
    }
    elimination.solve(transfers, |i| Some((drives[i].w, drives[i].mu)), zero, zero, &mut responses[1]);
    if count == 3 {
        elimination.solve(transfers, |_| None, zero, identity, &mut responses[2]);
    }
    let by = [By::BaseMoment, By::TipForce, By::BaseRotation];
    let mut columns = Vec::with_capacity(count);
    for (changes, by) in responses.iter().zip(by) {
        let (w, dp) = tip_change(nodes, changes, (by == By::TipForce).then_some(0));
        columns.push(Columns { w, dp, dM: zero, by, dn: zero });
    }
    collect_responses(problem, nodes, &responses, workspace);
    // The columns are the responses themselves.
    let base = [responses[1][0].1, responses[0][0].1];
    let responses = Responses { force: zero, moment: identity, rotation: zero, base, base_rotation };
    write_rows(problem, nodes.nodes[0].m, &columns, &responses, workspace, out);
}

/// Leaves the integrals of the responses in the workspace's traces, from those of the columns of every interval.
#[inline(always)]
fn collect_responses<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &Nodes<L>,
    responses: &[Changes<L>],
    workspace: &mut Workspace<L>,
) {
    let Problem { program, rod, .. } = *problem;
    if !program.collects() {
        return;
    }
    let one = nodes.tip.p.x.constant(1.0);
    for (traces, collect) in workspace.traces.iter_mut().zip(&program.collect) {
        traces.iter_mut().for_each(|trace| trace.clear(*collect, one.constant(0.0)));
    }
    let mut dp = [Mat3::zero(one); 3];
    let mut kept = nodes.traces.iter();
    let mut columns = [Trace::zero(one.constant(0.0)); 3];
    for (i, interval) in nodes.mesh.intervals.iter().enumerate() {
        let (first, count, piece) = match *interval {
            Interval::Piece { segment, start, share, is_last } => (segment, 1, Some((start, share, is_last))),
            Interval::Rigid { first, count, .. } => (first, count, None),
        };
        for at in first..first + count {
            columns.iter_mut().for_each(|trace| trace.take_back(program.collect[at], &mut kept));
            for (k, changes) in responses.iter().enumerate() {
                let (w, mu) = changes[i];
                let response = Response { w, mu, drives: k == 1 };
                let trace = &mut workspace.traces[at][k];
                trace.add(&columns, program.collect[at], &response, piece, &rod.segments[at], dp[k]);
            }
        }
        for (k, changes) in responses.iter().enumerate() {
            let (w, mu) = changes[i];
            let transfer = &nodes.transfers[i];
            dp[k] = dp[k] + transfer.dp_w * w + transfer.dp_mu * mu;
            if k == 1 {
                dp[k] = dp[k] + nodes.drives[i].dp;
            }
        }
    }
}
