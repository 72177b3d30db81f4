//! What a group of samples is solved with: what a shader has in its module's scope.

use super::algebra::Vec3;
use super::column::Columns;
use super::kernels::{PassKernel, Passes};
use super::lane::Lane;
use super::program::{Inputs, Program};
use super::rod::{Rod, Segment};
use super::shoot::Tip;
use super::source::Sources;
use super::stability::Station;
use super::step::Stages;
use super::trace::Trace;

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
