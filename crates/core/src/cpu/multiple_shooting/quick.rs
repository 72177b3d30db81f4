//! The quick path by nodes, in f32, and Newton's first steps on the answer's mesh: an answer in other lanes goes on from there.

use super::interval::Node;
use super::mesh::Mesh;
use super::path::follow_nodes;
use super::state::{Nodes, Purpose};
use crate::cpu::algebra::Vec3;
use crate::cpu::rod::problem::{Problem, Workspace};
use crate::cpu::simd::lane::{Lane, Scalar, WIDEST};
use crate::model::tolerances::{NODE_LEVELS, NODE_NEARBY, NODE_PACES, PATH_STEPPER};

/// The end of the quick paths of a register.
pub struct QuickEnd {
    reached: [bool; WIDEST],
    passes: [f64; WIDEST],
}

impl QuickEnd {
    pub fn new() -> Self {
        Self { reached: [false; WIDEST], passes: [0.0; WIDEST] }
    }
}

/// Leads a register of rods from rest to their full load; their nodes are left for [`Nodes::take_over`].
#[inline(always)]
pub fn follow_quickly<L: Lane>(
    problem: &Problem<'_, L>,
    nodes: &mut Nodes<L>,
    workspace: &mut Workspace<L>,
    end: &mut QuickEnd,
) {
    let one = problem.rod.t.x.constant(1.0);
    let zero = one.constant(0.0);
    let pace = NODE_PACES[0];
    nodes.mesh.cut(problem, pace.spacing);
    nodes.resolve(PATH_STEPPER.tableau(), pace.steps);
    let path = follow_nodes(problem, nodes, pace, zero.lt(one), workspace);
    let (stepper, steps) = NODE_LEVELS[0];
    nodes.resolve(stepper.tableau(), steps);
    nodes.pass(problem, one, Purpose::Transfers, workspace);
    let reached = path.reached & nodes.newton_step(problem, one).lt(one.constant(NODE_NEARBY));
    nodes.take_step(reached);
    nodes.pass(problem, one, Purpose::Tip, workspace);
    nodes.chord_step(problem.rod.l_tip);
    nodes.take_step(reached);
    end.reached = numbers(L::select(reached, one, zero), 0).map(|reached: f64| reached > 0.5);
    end.passes = numbers(path.passes, 0);
}

impl<L: Lane> Nodes<L> {
    /// Takes over the ends of quick paths, those from lane `offset` on: who has arrived, and in how many passes.
    #[inline(always)]
    pub fn take_over<C: Lane>(
        &mut self,
        problem: &Problem<'_, L>,
        from: &Nodes<C>,
        end: &QuickEnd,
        offset: usize,
    ) -> (L::Mask, L) {
        let of = problem.rod.t.x;
        self.mesh.lay_as(problem, &from.mesh, offset);
        self.nodes.clear();
        for node in &from.nodes {
            let [d1, t, m] = [node.d1, node.t, node.m].map(|v| vector(of, v, offset));
            self.nodes.push(Node::new(d1, t, m));
        }
        self.hold_base(problem);
        let reached: [f64; WIDEST] = end.reached.map(|reached| f64::from(u8::from(reached)));
        let [reached, passes] = [reached, end.passes].map(|numbers| lanes(of, &numbers[offset..]));
        (of.constant(0.5).lt(reached), passes)
    }
}

impl<L: Lane> Mesh<L> {
    /// The intervals of rods that stand in other lanes, from lane `offset` on.
    #[inline(always)]
    fn lay_as<C: Lane>(&mut self, problem: &Problem<'_, L>, other: &Mesh<C>, offset: usize) {
        self.ends.clone_from(&other.ends);
        self.ends.iter_mut().flatten().for_each(|ends| ends.rotate_left(offset));
        self.lay(problem);
    }
}

#[inline(always)]
fn vector<C: Lane, L: Lane>(of: L, v: Vec3<C>, offset: usize) -> Vec3<L> {
    let number = |x: C| lanes(of, &numbers(x, offset));
    Vec3 { x: number(v.x), y: number(v.y), z: number(v.z) }
}

/// The numbers of all lanes, that of lane `offset` first.
#[inline(always)]
fn numbers<L: Lane>(x: L, offset: usize) -> [f64; WIDEST] {
    let mut stored = [L::Scalar::default(); WIDEST];
    x.store(&mut stored);
    stored.rotate_left(offset);
    stored.map(Scalar::to_f64)
}

/// And back.
#[inline(always)]
fn lanes<L: Lane>(of: L, numbers: &[f64]) -> L {
    let mut stored = [L::Scalar::default(); WIDEST];
    stored.iter_mut().zip(numbers).for_each(|(to, from)| *to = L::Scalar::from_f64(*from));
    L::load(of.token(), &stored)
}
