//! Newton's method on all nodes of a register of rods: its steps, and what becomes of the nodes. N2

use super::elimination::rotate;
use super::interval::Node;
use super::state::Nodes;
use crate::cpu::algebra::{Mat3, Vec3, cross_add, dot, hat, length};
use crate::cpu::rod::problem::{Problem, Tip};
use crate::cpu::simd::lane::Lane;

impl<L: Lane> Nodes<L> {
    /// Newton's step at all nodes, after a pass with transfers, under a share of the load; its size, against the largest
    /// moment.
    #[inline(always)]
    pub fn newton_step(&mut self, problem: &Problem<'_, L>, lambda: L) -> L {
        let rod = problem.rod;
        let half = lambda.constant(0.5);
        let l_tip = rod.l_tip * lambda;
        let has_moment = problem.program.load_without_energy;
        if has_moment {
            self.factor_symmetric();
        }
        let (index, least) = (self.elimination.index, self.elimination.least);
        self.elimination.factor(&self.transfers, hat(l_tip * half)); // N2
        if has_moment {
            (self.elimination.index, self.elimination.least) = (index, least);
        }
        self.chord_step(l_tip);
        self.step_size()
    }

    /// The step that a pass asks for under a tip moment, with the elimination of another pass over the same nodes.
    #[inline(always)]
    pub fn chord_step(&mut self, l_tip: Vec3<L>) {
        let defects = &self.defects;
        let no_turn = Vec3::splat(l_tip.x.constant(0.0));
        self.elimination.solve(&self.transfers, |i| Some(defects[i]), l_tip - self.tip.m, no_turn, &mut self.changes);
    }

    /// The tip after the step in hand, to first order.
    #[inline(always)]
    pub fn moved_tip(&self) -> Tip<L> {
        let mut p = self.tip.p;
        for (transfer, (w, mu)) in self.transfers.iter().zip(&self.changes) {
            p = p + transfer.dp_w * *w + transfer.dp_mu * *mu;
        }
        let (w, _) = self.changes[self.transfers.len()];
        Tip { p, d1: rotate(w, self.tip.d1), t: rotate(w, self.tip.t), ..self.tip }
    }

    /// Stability is that of the symmetric part.
    #[inline(always)]
    pub fn factor_symmetric(&mut self) {
        self.elimination.factor(&self.transfers, Mat3::zero(self.tip.m.x)); // N5
    }

    #[inline(always)]
    fn step_size(&self) -> L {
        let one = self.tip.m.x.constant(1.0);
        let half = one.constant(0.5);
        let (mut turn, mut change, mut largest) = (one.constant(0.0), one.constant(0.0), one.constant(0.0));
        for (node, (w, mu)) in self.nodes.iter().zip(&self.changes) {
            // A number that is none stays one.
            let squared = dot(*w, *w);
            turn = L::select(squared.lt(turn), turn, squared);
            let dm = cross_add(*w, node.m * half, *mu);
            let squared = dot(dm, dm);
            change = L::select(squared.lt(change), change, squared);
            largest = largest.max(dot(node.m, node.m));
        }
        let turn = turn.sqrt();
        let relative = change.sqrt() / (one + largest.sqrt());
        L::select(relative.lt(turn), turn, relative)
    }

    /// Takes Newton's step in some lanes. N2
    #[inline(always)]
    pub fn take_step(&mut self, mask: L::Mask) {
        for (node, (w, mu)) in self.nodes.iter_mut().zip(&self.changes) {
            let half = w.x.constant(0.5);
            let m = node.m + cross_add(*w, node.m * half, *mu);
            let moved = Node::new(rotate(*w, node.d1), rotate(*w, node.t), m);
            *node = Node::select(mask, moved, *node);
        }
    }

    /// Puts the base where it is held, and with it what pieces of no length part from it: nothing else would correct them.
    #[inline(always)]
    pub fn hold_base(&mut self, problem: &Problem<'_, L>) {
        let rod = problem.rod;
        self.nodes[0] = Node { d1: rod.d1, t: rod.t, m: self.nodes[0].m };
        for i in 1..self.nodes.len() {
            let is_there = self.mesh.intervals[i - 1].is_there(rod.t.x);
            self.nodes[i] = Node::select(is_there, self.nodes[i], self.nodes[i - 1]);
        }
    }

    /// The node at the end of an interval; beyond the last it is the tip.
    #[inline(always)]
    pub fn end_of(&self, i: usize) -> Node<L> {
        let Tip { d1, t, m, .. } = self.tip;
        self.nodes.get(i + 1).copied().unwrap_or(Node { d1, t, m })
    }

    /// Puts the nodes of lanes that looked at a load step halfway back to its end.
    #[inline(always)]
    pub fn end_check(&mut self, lanes: L::Mask) {
        if L::any(lanes) {
            for (node, at_end) in self.nodes.iter_mut().zip(&self.at_end) {
                *node = Node::select(lanes, *at_end, *node);
            }
        }
    }

    /// Accepts the nodes on trial in some lanes.
    #[inline(always)]
    pub fn keep(&mut self, accept: L::Mask) {
        if !L::any(accept) {
            return;
        }
        for (i, node) in self.nodes.iter().enumerate() {
            self.earlier[i] = Node::select(accept, self.before[i], self.earlier[i]);
            self.before[i] = Node::select(accept, self.accepted[i], self.before[i]);
            self.accepted[i] = Node::select(accept, *node, self.accepted[i]);
        }
    }

    /// The largest defect, at a node or at the tip: after a chord step, what that has taken away.
    #[inline(always)]
    pub fn residual(&self, l_tip: Vec3<L>) -> L {
        let mut largest = length(self.tip.m - l_tip);
        for (e_w, e_mu) in &self.defects {
            largest = largest.max(length(*e_w)).max(length(*e_mu));
        }
        largest
    }
}
