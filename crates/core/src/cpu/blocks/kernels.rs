//! Kernels by name, and their arguments: what a register type can be asked for. `table.rs` has them for every register type.

use super::tools::Tools;
use crate::cpu::equilibrium::field::arrival::Led;
use crate::cpu::equilibrium::path::{Path, PathEnd, RestSlope};
use crate::cpu::ladder::Rung;
use crate::cpu::multiple_shooting::{Nodes, QuickEnd};
use crate::cpu::rod::field::pass::VaryingPasses;
use crate::cpu::rod::field::workspace::VaryingWorkspace;
use crate::cpu::rod::problem::{Passes, Problem, Workspace};
use crate::cpu::rod::program::{Inputs, Outputs, Program};
use crate::cpu::rod::segments::Rod;
use crate::cpu::simd::lane::{Lane, Scalar};
use std::any::Any;

/// A register type with all kernels.
pub trait Kernels: Passes + VaryingPasses {
    /// A type with numbers that do for a path on the coarse grid: f32, twice as many, where registers hold several.
    type Coarse: Kernels<Token = Self::Token>;
    fn job(token: Self::Token, job: Job<'_, Self::Scalar>);
    fn load_rods(load: Load<'_, Self>);
    fn follow(follow: Follow<'_, Self>) -> PathEnd<Self>;
    fn answer(answer: Answer<'_, Self>);
    fn follow_nodes(follow: FollowNodes<'_, Self>);
    fn by_nodes(by_nodes: ByNodes<'_, Self>);
    fn follow_varying(follow: FollowVarying<'_, Self>);
    fn in_varying(in_varying: InVarying<'_, Self>);
}

/// One block of samples for the kernel, numbers column by column in the plan's units.
pub struct Job<'a, S: Scalar> {
    pub program: &'a Program,
    pub inputs: &'a [S],
    /// Of each sample.
    pub bad: &'a [bool],
    /// How samples are led to their loads.
    pub rung: Rung,
    /// Their free rods, where a wall comes to those: numbers of [`FREE_COLUMNS`](crate::cpu::contact::free_tip::FREE_COLUMNS), by sample.
    pub free: &'a [S],
    /// The samples in the order in which they are solved.
    pub order: &'a mut Vec<usize>,
    /// Those that need care, without an answer.
    pub left: &'a mut Vec<usize>,
    /// What was found, in that order.
    pub values: &'a mut [S],
    /// The kernel's, kept from block to block of one program.
    pub memory: &'a mut Option<Box<dyn Any + Send + Sync>>,
}

/// The arguments of `Rod::load`.
pub struct Load<'a, L: Lane> {
    pub program: &'a Program,
    pub token: L::Token,
    pub inputs: Inputs<'a, L::Scalar>,
    pub rod: &'a mut Rod<L>,
}

impl<L: Lane> Load<'_, L> {
    pub fn token(&self) -> L::Token {
        self.token
    }
}

/// The arguments of `follow_path`.
pub struct Follow<'a, L: Lane> {
    pub problem: Problem<'a, L>,
    pub path: Path,
    pub rest: RestSlope<L>,
    pub workspace: &'a mut Workspace<L>,
}

impl<L: Lane> Follow<'_, L> {
    pub fn token(&self) -> L::Token {
        self.problem.token()
    }
}

/// The arguments of `solve_group`, on any path.
pub struct Answer<'a, L: Lane> {
    pub program: &'a Program,
    pub token: L::Token,
    pub path: Path,
    pub tools: &'a mut Tools<L>,
    pub out: Outputs<'a, L::Scalar>,
}

impl<L: Lane> Answer<'_, L> {
    pub fn token(&self) -> L::Token {
        self.token
    }
}

/// The arguments of `solve_nodes`.
pub struct ByNodes<'a, L: Kernels> {
    pub program: &'a Program,
    pub token: L::Token,
    pub nodes: &'a mut Nodes<L>,
    /// The ends of their quick paths, in the lanes from `offset` on.
    pub quick: &'a Nodes<L::Coarse>,
    pub quick_end: &'a QuickEnd,
    pub offset: usize,
    pub tools: &'a mut Tools<L>,
    pub out: Outputs<'a, L::Scalar>,
}

impl<L: Kernels> ByNodes<'_, L> {
    pub fn token(&self) -> L::Token {
        self.token
    }
}

/// The arguments of `follow_quickly`.
pub struct FollowNodes<'a, L: Lane> {
    pub program: &'a Program,
    pub token: L::Token,
    pub nodes: &'a mut Nodes<L>,
    pub end: &'a mut QuickEnd,
    pub tools: &'a mut Tools<L>,
}

impl<L: Lane> FollowNodes<'_, L> {
    pub fn token(&self) -> L::Token {
        self.token
    }
}

/// The parts of a path in a field that varies, or to a wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leg {
    /// How samples set out from rest.
    SetOut,
    /// From there to their ends.
    Follow,
    /// From free rods under their full loads, behind a wall or to be held by it: the wall comes.
    Wall,
}

/// The arguments of one leg of a path without care.
pub struct FollowVarying<'a, L: Lane> {
    pub program: &'a Program,
    pub token: L::Token,
    pub leg: Leg,
    pub varying: &'a mut VaryingWorkspace<L>,
    pub tools: &'a mut Tools<L>,
}

impl<L: Lane> FollowVarying<'_, L> {
    pub fn token(&self) -> L::Token {
        self.token
    }
}

/// The arguments of `solve_varying`.
pub struct InVarying<'a, L: Lane> {
    pub program: &'a Program,
    pub token: L::Token,
    pub led: Led<'a>,
    pub varying: &'a mut VaryingWorkspace<L>,
    pub tools: &'a mut Tools<L>,
    pub out: Outputs<'a, L::Scalar>,
}

impl<L: Lane> InVarying<'_, L> {
    pub fn token(&self) -> L::Token {
        self.token
    }
}
