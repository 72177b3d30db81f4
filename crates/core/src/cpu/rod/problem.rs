//! What a group of samples is solved with: what a shader has in its module's scope.

use super::columns::Columns;
use super::program::{Inputs, Program, Resolution};
use super::segments::{Rod, Segment};
use super::source::Sources;
use super::station::Station;
use super::step::Stages;
use super::terms::ProgramTerms;
use super::trace::Trace;
use crate::cpu::algebra::Vec3;
use crate::cpu::simd::lane::Lane;

/// A group of rods of a program, one a lane.
pub struct Problem<'a, L: Lane> {
    pub program: &'a Program,
    pub inputs: Inputs<'a, L::Scalar>,
    pub rod: &'a Rod<L>,
}

impl<L: Lane> Clone for Problem<'_, L> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L: Lane> Copy for Problem<'_, L> {}

impl<L: Lane> Problem<'_, L> {
    #[inline(always)]
    pub fn token(&self) -> L::Token {
        self.rod.t.x.token()
    }
}

/// A rod that can neither bend nor shear.
#[inline(always)]
pub fn stiff<L: Lane>(rod: &Rod<L>) -> Rod<L> {
    let mut stiff = Rod { segments: Vec::with_capacity(rod.segments.len()), ..*rod };
    for segment in &rod.segments {
        stiff.segments.push(match segment {
            Segment::Flexible(flexible) => Segment::Flexible(flexible.stiff()),
            Segment::Rigid(rigid) => Segment::Rigid(*rigid),
        });
    }
    stiff
}

/// Memory of a kernel, reused from group to group.
pub struct Workspace<L: Lane> {
    /// A pass with the program's terms.
    pub pass: PassKernel<L>,
    pub stages: Stages<L>,
    /// For each segment, one trace for each three columns.
    pub traces: Vec<[Trace<L>; 3]>,
    /// What the last pass came to.
    pub tip: Tip<L>,
    /// The last interval of the stability index.
    pub station: Station<L>,
    /// Moments inside the rod, where a pass records them.
    pub moments: Vec<Vec3<L>>,
    /// Of the forward columns, three parameters each.
    pub sources: Vec<Sources<L>>,
    /// All columns of a pass with derivatives.
    pub columns: Vec<Columns<L>>,
    /// Whether all lanes hold one sample.
    pub alone: bool,
}

impl<L: Passes> Workspace<L> {
    pub fn new(token: L::Token, program: &Program) -> Self {
        let zero = Trace::zero(L::splat(token, 0.0));
        let v = Vec3::splat(L::splat(token, 0.0));
        Self {
            pass: L::pass(program.terms),
            stages: Stages::new(token, program.fine.tableau),
            traces: vec![[zero; 3]; program.all_segments],
            tip: Tip { p: v, d1: v, t: v, m: v, n: v },
            station: Station::new(L::splat(token, 0.0)),
            moments: Vec::new(),
            sources: (0..program.forward_threes()).map(|_| Sources::new(token)).collect(),
            columns: Vec::new(),
            alone: false,
        }
    }
}

/// What a pass leaves in the workspace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Record {
    Nothing,
    /// Moments at both ends of every flexible segment.
    Moments,
    /// The stations of the stability index.
    Stability,
    /// The same, and the traces of the columns.
    Traces,
}

/// The distal end of the rod after a pass.
#[derive(Clone, Copy, Debug)]
pub struct Tip<L> {
    pub p: Vec3<L>,
    pub d1: Vec3<L>,
    pub t: Vec3<L>,
    pub m: Vec3<L>,
    pub n: Vec3<L>,
}

impl<L: Lane> Tip<L> {
    #[inline(always)]
    pub fn select(mask: L::Mask, if_true: Self, if_false: Self) -> Self {
        Self {
            p: Vec3::select(mask, if_true.p, if_false.p),
            d1: Vec3::select(mask, if_true.d1, if_false.d1),
            t: Vec3::select(mask, if_true.t, if_false.t),
            m: Vec3::select(mask, if_true.m, if_false.m),
            n: Vec3::select(mask, if_true.n, if_false.n),
        }
    }
}

/// Integrates the rod from base moment `m0` at load fraction `lambda`, `columns` with it.
#[inline(always)]
pub fn shoot<L: Lane>(
    problem: &Problem<'_, L>,
    resolution: &Resolution,
    lambda: L,
    m0: Vec3<L>,
    columns: &mut [Columns<L>],
    record: Record,
    workspace: &mut Workspace<L>,
) -> Tip<L> {
    let pass = workspace.pass;
    pass(Pass { problem: *problem, resolution, lambda, m0, columns, record, workspace });
    workspace.tip
}

/// A pass over the rod from base moment `m0` at load fraction `lambda`, `columns` with it; the tip is left in the workspace.
pub struct Pass<'a, L: Lane> {
    pub problem: Problem<'a, L>,
    pub resolution: &'a Resolution,
    pub lambda: L,
    pub m0: Vec3<L>,
    pub columns: &'a mut [Columns<L>],
    pub record: Record,
    pub workspace: &'a mut Workspace<L>,
}

/// A pass over the rod. It returns nothing, so that naming it costs no frame of its own on the stack: another 16 bytes
/// there, and what an AVX-512 kernel spills lies across cache lines.
pub type PassKernel<L> = fn(Pass<'_, L>);

/// A register type with passes for every program.
pub trait Passes: Lane {
    fn pass(terms: ProgramTerms) -> PassKernel<Self>;
}
