//! How far a rod is from a fold anywhere along it: what a moment at each node turns there. N6

use super::elimination::rotate;
use super::interval::{Node, turn};
use super::mesh::Interval;
use super::state::Nodes;
use crate::cpu::algebra::{Mat3, Vec3, cross, dot, inverse, outer, transpose};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::segments::Segment;
use crate::cpu::simd::lane::Lane;
use crate::model::tolerances::NODE_USUAL;

/// The stability margin, after a pass with transfers and an elimination from S = 0 at the tip: `by_tip` is that of the rod's
/// end. Where the compliance at a node, relative to that of the same shape without loads, is large, it counts.
#[inline(always)]
pub fn node_margin<L: Lane>(problem: &Problem<'_, L>, nodes: &Nodes<L>, by_tip: L) -> L {
    let zero = nodes.tip.p.x.constant(0.0);
    let one = zero.constant(1.0);
    let (mut compliance, mut at_rest) = (Mat3::zero(zero), Mat3::zero(zero));
    let (mut bent, mut largest) = (zero, zero);
    for (i, transfer) in nodes.transfers.iter().enumerate() {
        let pivot = nodes.elimination.pivots[i].inverse;
        compliance = (transpose(pivot) * compliance + transfer.b) * pivot; // N6
        if let Interval::Piece { segment, start, share, .. } = nodes.mesh.intervals[i]
            && let Segment::Flexible(flexible) = &problem.rod.segments[segment]
        {
            let piece = flexible.piece(start, share);
            let (from, to) = (nodes.nodes[i], nodes.end_of(i));
            let half = turn(&from, &to) * zero.constant(0.5);
            let middle = Node { d1: rotate(half, from.d1), t: rotate(half, from.t), m: from.m };
            let near = piece.stiffness;
            let rise = piece.stiffness_rise;
            let sum = give(&from, near) + give(&to, near + rise);
            let sum = sum + give(&middle, near + rise * zero.constant(0.5)) * zero.constant(4.0);
            at_rest = at_rest + sum * (piece.length * zero.constant(1.0 / 6.0));
            bent = bent + piece.length;
        }
        let relative = inverse(at_rest) * compliance;
        let rows = transpose(relative);
        let squared = dot(relative.x, rows.x) + dot(relative.y, rows.y) + dot(relative.z, rows.z);
        largest = L::select(zero.lt(bent) & largest.lt(squared), squared, largest);
    }
    let beyond = (largest * one.constant(1.0 / 3.0)).sqrt() - one.constant(NODE_USUAL);
    one / beyond.max(one / by_tip) // N6
}

/// What a moment turns per length of an unloaded rod: R K^-1 R^T.
#[inline(always)]
fn give<L: Lane>(node: &Node<L>, stiffness: Vec3<L>) -> Mat3<L> {
    let one = stiffness.x.constant(1.0);
    let d2 = cross(node.t, node.d1);
    let along_d1 = outer(node.d1, node.d1 * (one / stiffness.x), Mat3::zero(one));
    outer(node.t, node.t * (one / stiffness.z), outer(d2, d2 * (one / stiffness.y), along_d1))
}
