//! One interval between nodes: a pass over it alone, and how its end changes with its start. N1

use super::mesh::{Interval, Mesh};
use crate::cpu::algebra::{Mat3, Vec3, axpy, columns_axpy, cross, cross_add, dot, length};
use crate::cpu::rod::problem::Tip;
use crate::cpu::rod::section::Flexible;
use crate::cpu::rod::segments::{Rod, Segment};
use crate::cpu::rod::source::Source;
use crate::cpu::simd::lane::Lane;

/// Orientation and moment at a node.
#[derive(Clone, Copy, Debug)]
pub struct Node<L> {
    pub d1: Vec3<L>,
    pub t: Vec3<L>,
    pub m: Vec3<L>,
}

impl<L: Lane> Node<L> {
    /// Where a pass left the orientation at right angles but for its error.
    #[inline(always)]
    pub fn new(d1: Vec3<L>, t: Vec3<L>, m: Vec3<L>) -> Self {
        let one = t.x.constant(1.0);
        let t = t * (one / length(t));
        let d1 = axpy(-dot(d1, t), t, d1);
        Self { d1: d1 * (one / length(d1)), t, m }
    }

    #[inline(always)]
    pub fn select(mask: L::Mask, if_true: Self, if_false: Self) -> Self {
        Self {
            d1: Vec3::select(mask, if_true.d1, if_false.d1),
            t: Vec3::select(mask, if_true.t, if_false.t),
            m: Vec3::select(mask, if_true.m, if_false.m),
        }
    }
}

/// How the end of an interval moves with its start, in the canonical pair (w, mu). S1, N1
#[derive(Clone, Copy, Debug)]
pub struct Transfer<L> {
    pub a: Mat3<L>,
    pub b: Mat3<L>,
    pub c: Mat3<L>,
    pub d: Mat3<L>,
    /// Displacement of the end relative to the start, by w and by mu.
    pub dp_w: Mat3<L>,
    pub dp_mu: Mat3<L>,
    /// Its length where it bends.
    pub length: L,
    pub bends: bool,
}

/// The rod of interval `i` alone: its base at the node, the force of what lies beyond at its tip.
#[inline(always)]
pub fn load_interval<L: Lane>(rod: &Rod<L>, mesh: &Mesh<L>, i: usize, node: &Node<L>, alone: &mut Rod<L>) {
    (alone.d1, alone.t, alone.B, alone.f_tip, alone.l_tip) = (node.d1, node.t, rod.B, mesh.n[i], rod.l_tip);
    alone.segments.clear();
    alone.free = None;
    match mesh.intervals[i] {
        Interval::Piece { segment, start, share, .. } => {
            alone.first = segment;
            if let Segment::Flexible(flexible) = &rod.segments[segment] {
                alone.segments.push(Segment::Flexible(flexible.piece(start, share)));
            }
        }
        Interval::Rigid { first, count, is_tip } => {
            alone.first = first;
            alone.segments.extend_from_slice(&rod.segments[first..first + count]);
            if is_tip {
                alone.free = rod.free;
            }
        }
    }
}

/// What is left between the end of an interval and the node there: rotation and canonical moment. N1
#[inline(always)]
pub fn defect<L: Lane>(end: &Tip<L>, node: &Node<L>) -> (Vec3<L>, Vec3<L>) {
    let half = end.m.x.constant(0.5);
    let e_w = turn(node, &Node { d1: end.d1, t: end.t, m: end.m });
    (e_w, cross_add(node.m * half, e_w, end.m - node.m))
}

/// The rotation vector from one node's orientation to another's, to second order.
#[inline(always)]
pub fn turn<L: Lane>(from: &Node<L>, to: &Node<L>) -> Vec3<L> {
    let half = from.t.x.constant(0.5);
    let d2 = cross(cross(from.t, from.d1), cross(to.t, to.d1));
    (cross(from.d1, to.d1) + d2 + cross(from.t, to.t)) * half
}

impl<L: Lane> Flexible<L> {
    /// A piece of it: where it starts and how long it is, as shares of the whole.
    #[inline(always)]
    pub fn piece(&self, start: L, share: L) -> Self {
        Self {
            length: self.length * share,
            stiffness: axpy(start, self.stiffness_rise, self.stiffness),
            stiffness_rise: self.stiffness_rise * share,
            u_star: axpy(start, self.u_star_rise, self.u_star),
            u_star_rise: self.u_star_rise * share,
            ..*self
        }
    }
}

impl<L: Lane> Source<L> {
    /// The same of a piece; what lengthens the segment does so at its end.
    #[inline(always)]
    pub fn piece(&self, start: L, share: L, is_last: bool) -> Self {
        let one = start.constant(1.0);
        let zero = Mat3::zero(one);
        Self {
            dL: if is_last { self.dL } else { zero.x },
            dK: columns_axpy(start, self.dK_rise, self.dK),
            dK_rise: columns_axpy(share, self.dK_rise, zero),
            du_star: columns_axpy(start, self.du_star_rise, self.du_star),
            du_star_rise: columns_axpy(share, self.du_star_rise, zero),
            ..*self
        }
    }
}
