//! Derivatives by nodes: what loads and parameters do to all nodes, and rows of the Jacobian from it. N2, J5

use super::mesh::Interval;
use super::state::Nodes;
use crate::lanes::algebra::{Mat3, Vec3, axpy, columns_cross_add, hat, outer, row_times, transpose};
use crate::lanes::base::base_slope;
use crate::lanes::column::{By, Columns};
use crate::lanes::lane::Lane;
use crate::lanes::problem::{Problem, Workspace};
use crate::lanes::program::Outputs;
use crate::lanes::rod::Segment;
use crate::lanes::rows::{Responses, store_rows, write_rows};
use crate::lanes::trace::Trace;

/// Changes of (w, mu) at every node by three loads.
type Changes<L> = Vec<(Mat3<L>, Mat3<L>)>;

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
            (drive.w, drive.mu)
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

/// Rotation and displacement of the tip by unit tip moments.
#[inline(always)]
pub fn tip_response<L: Lane>(nodes: &Nodes<L>) -> (Mat3<L>, Mat3<L>) {
    let one = nodes.tip.p.x.constant(1.0);
    let (zero, identity) = (Mat3::zero(one), Mat3::identity(one));
    let mut changes = Vec::new();
    nodes.elimination.solve(&nodes.transfers, |_| (zero, zero), identity, zero, &mut changes);
    tip_change(nodes, &changes, None)
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
    if program.tip_moment {
        // The adjoint condition, dm - w x l_tip = unit.
        nodes.elimination.factor(&nodes.transfers, hat(rod.l_tip * one.constant(-0.5)));
    }
    let Nodes { elimination, transfers, drives, .. } = &*nodes;
    let count = if program.base_moment_rows { 3 } else { 2 };
    let mut responses: Vec<Changes<L>> = vec![Vec::new(); count];
    let none = |_: usize| (zero, zero);
    elimination.solve(transfers, none, identity, zero, &mut responses[0]);
    elimination.solve(transfers, |i| (drives[i].w, drives[i].mu), zero, zero, &mut responses[1]);
    if count == 3 {
        elimination.solve(transfers, none, zero, identity, &mut responses[2]);
    }
    let by = [By::BaseMoment, By::TipForce, By::BaseRotation];
    let columns: Vec<Columns<L>> = responses
        .iter()
        .zip(by)
        .map(|(changes, by)| {
            let (w, dp) = tip_change(nodes, changes, (by == By::TipForce).then_some(0));
            Columns { w, dp, dM: zero, by, dn: zero }
        })
        .collect();
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
    let mut sums = vec![[Trace::zero(one.constant(0.0)); 3]; rod.segments.len()];
    let mut dp = [Mat3::zero(one); 3];
    let mut traces = nodes.traces.iter();
    for (i, interval) in nodes.mesh.intervals.iter().enumerate() {
        let (first, count, piece) = match *interval {
            Interval::Piece { segment, start, share, is_last } => (segment, 1, Some((start, share, is_last))),
            Interval::Rigid { first, count, .. } => (first, count, None),
        };
        for (at, columns) in (first..first + count).zip(&mut traces) {
            for (k, changes) in responses.iter().enumerate() {
                let (w, mu) = changes[i];
                let trace = Trace::of_response(columns, w, mu, k == 1);
                sums[at][k].add(&trace, piece, &rod.segments[at], dp[k]);
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
    for (traces, sums) in workspace.traces.iter_mut().zip(sums) {
        *traces = sums;
    }
}

/// Three responses at the start of an interval; one of them may drive it.
#[derive(Clone, Copy)]
struct Response<L> {
    w: Mat3<L>,
    mu: Mat3<L>,
    drives: bool,
}

impl<L: Lane> Response<L> {
    /// A row of theirs, from the same row of the columns by moment, by what drives, by rotation.
    #[inline(always)]
    fn row(&self, by_moment: Vec3<L>, by_drive: Vec3<L>, by_rotation: Vec3<L>) -> Vec3<L> {
        let sum = row_times(by_moment, self.mu) + row_times(by_rotation, self.w);
        if self.drives { sum + by_drive } else { sum }
    }

    #[inline(always)]
    fn rows(&self, a: &[Vec3<L>; 3], b: &[Vec3<L>; 3], c: &[Vec3<L>; 3]) -> [Vec3<L>; 3] {
        [self.row(a[0], b[0], c[0]), self.row(a[1], b[1], c[1]), self.row(a[2], b[2], c[2])]
    }
}

impl<L: Lane> Trace<L> {
    /// What three responses leave on an interval, from what its columns leave: by moment, by what drives, by rotation.
    #[inline(always)]
    fn of_response(columns: &[Self; 3], w: Mat3<L>, mu: Mat3<L>, drives: bool) -> Self {
        let [a, b, c] = columns;
        let response = Response { w, mu, drives };
        Self {
            rest_curvature: response.rows(&a.rest_curvature, &b.rest_curvature, &c.rest_curvature),
            rest_curvature_rise: response.rows(&a.rest_curvature_rise, &b.rest_curvature_rise, &c.rest_curvature_rise),
            stiffness: response.rows(&a.stiffness, &b.stiffness, &c.stiffness),
            stiffness_rise: response.rows(&a.stiffness_rise, &b.stiffness_rise, &c.stiffness_rise),
            shear_compliance: response.rows(&a.shear_compliance, &b.shear_compliance, &c.shear_compliance),
            load: response.rows(&a.load, &b.load, &c.load),
            dipole: response.rows(&a.dipole, &b.dipole, &c.dipole),
            field: response.rows(&a.field, &b.field, &c.field),
            length: response.row(a.length, b.length, c.length),
        }
    }

    /// Adds what responses leave on an interval, which sees displacements from its start alone; that has moved by `dp`.
    #[inline(always)]
    fn add(&mut self, part: &Self, piece: Option<(L, L, bool)>, segment: &Segment<L>, dp: Mat3<L>) {
        let moved = transpose(dp);
        let length = match (piece, segment) {
            (Some((_, share, _)), Segment::Flexible(flexible)) => flexible.length * share,
            _ => dp.x.x.constant(1.0),
        };
        for j in 0..3 {
            self.rest_curvature[j] = self.rest_curvature[j] + part.rest_curvature[j];
            self.stiffness[j] = self.stiffness[j] + part.stiffness[j];
            if let Some((start, share, _)) = piece {
                let from_start = axpy(start, part.rest_curvature[j], self.rest_curvature_rise[j]);
                self.rest_curvature_rise[j] = axpy(share, part.rest_curvature_rise[j], from_start);
                let from_start = axpy(start, part.stiffness[j], self.stiffness_rise[j]);
                self.stiffness_rise[j] = axpy(share, part.stiffness_rise[j], from_start);
            }
            self.shear_compliance[j] = self.shear_compliance[j] + part.shear_compliance[j];
            self.load[j] = axpy(length, moved[j], self.load[j] + part.load[j]);
            self.dipole[j] = self.dipole[j] + part.dipole[j];
            self.field[j] = self.field[j] + part.field[j];
        }
        match (piece, segment) {
            (Some((_, _, true)), Segment::Flexible(flexible)) => {
                self.length = part.length + row_times(flexible.w, dp);
            }
            (None, _) => self.length = part.length,
            _ => {}
        }
    }
}
