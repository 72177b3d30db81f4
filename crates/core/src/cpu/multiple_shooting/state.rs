//! The nodes of a register of rods, and a pass over all their intervals.

use super::drives::{Drive, driving_forces};
use super::elimination::{Changes, Elimination};
use super::interval::{Node, Transfer, defect, load_interval};
use super::mesh::{Interval, Mesh};
use crate::cpu::algebra::{Mat3, Vec3};
use crate::cpu::rod::base::{moment_columns, rotation_columns};
use crate::cpu::rod::columns::{By, Columns};
use crate::cpu::rod::problem::shoot;
use crate::cpu::rod::problem::{Problem, Record, Tip, Workspace};
use crate::cpu::rod::program::{Program, Resolution};
use crate::cpu::rod::segments::Rod;
use crate::cpu::rod::source::Source;
use crate::cpu::rod::stability::canonical;
use crate::cpu::simd::apart::apart;
use crate::cpu::simd::lane::Lane;
use crate::model::Tableau;

/// A register of rods by their nodes.
pub struct Nodes<L: Lane> {
    pub mesh: Mesh<L>,
    /// One interval at work.
    pub alone: Rod<L>,
    pub resolution: Resolution,
    /// At the start of each interval: on trial, accepted last, before that, and earlier.
    pub nodes: Vec<Node<L>>,
    pub accepted: Vec<Node<L>>,
    pub before: Vec<Node<L>>,
    pub earlier: Vec<Node<L>>,
    /// The end of a load step that is looked at halfway.
    pub at_end: Vec<Node<L>>,
    pub transfers: Vec<Transfer<L>>,
    pub defects: Vec<(Vec3<L>, Vec3<L>)>,
    /// Of each interval, `drive_count` threes.
    pub drives: Vec<Drive<L>>,
    pub drive_count: usize,
    /// By reciprocity, what the columns leave on each segment of each interval: what is collected of three traces.
    pub traces: Vec<Vec3<L>>,
    /// The rod's end, its position summed over the intervals.
    pub tip: Tip<L>,
    pub elimination: Elimination<L>,
    pub changes: Vec<(Vec3<L>, Vec3<L>)>,
    /// The responses to unit tip moments.
    pub by_moment: Changes<L>,
}

impl<L: Lane> Nodes<L> {
    pub fn new(token: L::Token, program: &Program) -> Self {
        let zero = L::splat(token, 0.0);
        let v = Vec3::splat(zero);
        let count = program.segments.len();
        Self {
            mesh: Mesh::new(),
            alone: Rod::new(token),
            resolution: Resolution { steps: vec![1; count], ratios: vec![1.0; count], ..program.fine },
            nodes: Vec::new(),
            accepted: Vec::new(),
            before: Vec::new(),
            earlier: Vec::new(),
            at_end: Vec::new(),
            transfers: Vec::new(),
            defects: Vec::new(),
            drives: Vec::new(),
            drive_count: 0,
            traces: Vec::new(),
            tip: Tip { p: v, d1: v, t: v, m: v, n: v },
            elimination: Elimination::new(zero),
            changes: Vec::new(),
            by_moment: Vec::new(),
        }
    }

    /// Integrates every piece in so many steps from now on.
    pub fn resolve(&mut self, tableau: &'static Tableau, steps: usize) {
        self.resolution.tableau = tableau;
        self.resolution.steps.fill(steps);
    }

    /// Puts the nodes where they are at rest.
    #[inline(always)]
    pub fn rest(&mut self, problem: &Problem<'_, L>, workspace: &mut Workspace<L>) {
        let rod = problem.rod;
        let zero = rod.t.x.constant(0.0);
        let no_moment = Vec3::splat(zero);
        let mut node = Node { d1: rod.d1, t: rod.t, m: no_moment };
        self.nodes.clear();
        for i in 0..self.mesh.intervals.len() {
            self.nodes.push(node);
            load_interval(rod, &self.mesh, i, &node, &mut self.alone);
            let alone = Problem { rod: &self.alone, ..*problem };
            let end = shoot(&alone, &self.resolution, zero, node.m, &mut [], Record::Nothing, workspace);
            let there = self.mesh.intervals[i].is_there(zero);
            node = Node::select(there, Node::new(end.d1, end.t, no_moment), node);
        }
    }

    /// A pass over every interval: defects, transfers, tip and, if asked for, drives.
    #[inline(always)]
    pub fn pass(&mut self, problem: &Problem<'_, L>, lambda: L, what: Purpose, workspace: &mut Workspace<L>) {
        L::apart(lambda.token(), PassNodes { nodes: self, problem, lambda, what, workspace })
    }

    #[inline(always)]
    fn pass_apart(&mut self, problem: &Problem<'_, L>, lambda: L, what: Purpose, workspace: &mut Workspace<L>) {
        let Problem { program, rod, .. } = *problem;
        let zero = lambda.constant(0.0);
        let one = lambda.constant(1.0);
        let count = self.mesh.intervals.len();
        let none = Mat3::zero(zero);
        let empty =
            Transfer { a: none, b: none, c: none, d: none, dp_w: none, dp_mu: none, length: zero, bends: false };
        self.transfers.resize(count, empty);
        self.defects.clear();
        if what != Purpose::Tip {
            self.drives.clear();
            self.drive_count = 0;
        }
        let (mut columns, mut forces) = (Vec::new(), Vec::new());
        if what == Purpose::Drives {
            forces = driving_forces(program, workspace, one);
            self.drive_count = forces.len();
            self.traces.clear();
        }
        let mut p = Vec3::splat(zero);
        for i in 0..count {
            let node = self.nodes[i];
            load_interval(rod, &self.mesh, i, &node, &mut self.alone);
            if what != Purpose::Tip {
                self.start_columns(&node, &forces, program.forward, &mut columns);
            }
            let collects = what == Purpose::Drives && (program.forward || program.collects());
            let record = if collects { Record::Traces } else { Record::Nothing };
            let whole = if collects && program.forward { self.cut_sources(i, workspace) } else { None };
            let alone = Problem { rod: &self.alone, ..*problem };
            let end = shoot(&alone, &self.resolution, lambda, node.m, &mut columns, record, workspace);
            if let Some((segment, whole)) = whole {
                let sources = workspace.sources.iter_mut().zip(whole);
                sources.for_each(|(sources, source)| sources.segments[segment] = source);
            }
            if collects && !program.forward {
                self.keep_traces(program, &mut workspace.traces);
            }
            p = p + end.p;
            if what != Purpose::Tip {
                self.push_transfer(problem, i, &end, &columns);
            }
            for (force, three) in forces.iter_mut().zip(&columns[columns.len().min(1)..]) {
                let mu = canonical(program.terms, &end, three);
                self.drives.push(Drive { w: three.w, mu, dp: three.dp });
                *force = three.dn;
            }
            match self.nodes.get(i + 1) {
                Some(next) => {
                    // What is not there leaves nothing, not even round-off.
                    let (there, none) = (self.mesh.intervals[i].is_there(zero), Vec3::splat(zero));
                    let (e_w, e_mu) = defect(&end, next);
                    self.defects.push((Vec3::select(there, e_w, none), Vec3::select(there, e_mu, none)));
                }
                None => {
                    self.defects.push((Vec3::splat(zero), Vec3::splat(zero)));
                    self.tip = Tip { p, ..end };
                }
            }
        }
    }

    #[inline(always)]
    fn push_transfer(&mut self, problem: &Problem<'_, L>, i: usize, end: &Tip<L>, columns: &[Columns<L>]) {
        let terms = problem.program.terms;
        let (by_moment, by_rotation) = (&columns[0], &columns[columns.len() - 1]);
        let transfer = &mut self.transfers[i];
        (transfer.a, transfer.b) = (by_rotation.w, by_moment.w);
        transfer.c = canonical(terms, end, by_rotation);
        transfer.d = canonical(terms, end, by_moment);
        (transfer.dp_w, transfer.dp_mu) = (by_rotation.dp, by_moment.dp);
        transfer.length = self.alone.flexible_length();
        transfer.bends = matches!(self.mesh.intervals[i], Interval::Piece { .. });
    }

    /// The columns of a pass over an interval: by the moment at its start, by what drives it, by the rotation there.
    #[inline(always)]
    pub fn start_columns(&self, node: &Node<L>, forces: &[Mat3<L>], forward: bool, columns: &mut Vec<Columns<L>>) {
        let one = node.m.x.constant(1.0);
        let zero = Mat3::zero(one);
        let by = if forward { By::Parameters } else { By::TipForce };
        columns.resize(forces.len() + 2, moment_columns(one));
        columns[0] = moment_columns(one);
        for (three, dn) in columns[1..].iter_mut().zip(forces) {
            *three = Columns { w: zero, dp: zero, dM: zero, by, dn: *dn };
        }
        columns[forces.len() + 1] = rotation_columns(node.m);
    }

    /// Puts the part of each source that lies in interval `i` in its place; returns what was there.
    #[inline(always)]
    fn cut_sources(&self, i: usize, workspace: &mut Workspace<L>) -> Option<(usize, Vec<Source<L>>)> {
        let Interval::Piece { segment, start, share, is_last } = self.mesh.intervals[i] else { return None };
        let mut whole = Vec::new();
        for sources in &mut workspace.sources {
            let source = &mut sources.segments[segment];
            whole.push(*source);
            *source = source.piece(start, share, is_last);
        }
        Some((segment, whole))
    }
}

apart!(
    PassNodes<'a, L: Lane>(
        nodes: &'a mut Nodes<L>, problem: &'a Problem<'a, L>, lambda: L, what: Purpose, workspace: &'a mut Workspace<L>
    ) -> (),
    nodes.pass_apart(problem, lambda, what, workspace)
);

/// What a pass is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The tip and what is left to balance.
    Tip,
    /// Newton's method.
    Transfers,
    /// And for a row: what tip forces, or the parameters of forward columns, do over each interval.
    Drives,
}
