//! What a thread keeps from block to block, and how samples of a block are put side by side.

use super::kernels::Kernels;
use super::tools::{Tools, end_columns};
use crate::cpu::equilibrium::field::rest::REST_COLUMNS;
use crate::cpu::multiple_shooting::{Nodes, QuickEnd};
use crate::cpu::rod::field::workspace::VaryingWorkspace;
use crate::cpu::rod::program::Program;
use crate::cpu::simd::lane::Lane;
use crate::model::BLOCK;

pub type CoarseScalar<L> = <<L as Kernels>::Coarse as Lane>::Scalar;

/// Memory of a thread.
pub struct Memory<L: Kernels> {
    pub paths: Tools<L::Coarse>,
    pub answers: Tools<L>,
    pub nodes: Nodes<L>,
    pub quick: Nodes<L::Coarse>,
    pub quick_end: QuickEnd,
    pub varying: VaryingWorkspace<L>,
    pub varying_paths: VaryingWorkspace<L::Coarse>,
    /// Inputs of the block, how its samples set out from rest (dm0/dlambda, where the field varies d(n0, m0)/dlambda) and the ends
    /// of their paths, by sample.
    pub inputs: Vec<CoarseScalar<L>>,
    pub rests: Vec<CoarseScalar<L>>,
    pub ends: Vec<CoarseScalar<L>>,
}

impl<L: Kernels> Memory<L> {
    pub fn new(token: L::Token, program: &Program, inputs: usize) -> Self {
        let zero = CoarseScalar::<L>::default();
        Self {
            paths: Tools::new(token, program, inputs / BLOCK),
            answers: Tools::new(token, program, inputs / BLOCK),
            nodes: Nodes::new(token, program),
            quick: Nodes::new(token, program),
            quick_end: QuickEnd::new(),
            varying: VaryingWorkspace::new(token, program),
            varying_paths: VaryingWorkspace::new(token, program),
            inputs: vec![zero; inputs],
            rests: vec![zero; REST_COLUMNS * BLOCK],
            ends: vec![zero; end_columns(program) * BLOCK],
        }
    }
}

/// A block at work.
pub(in crate::cpu) struct Block<'a, L: Kernels> {
    pub program: &'a Program,
    pub token: L::Token,
    pub inputs: &'a [L::Scalar],
    /// Free rods beside a wall, as a [`Job`](super::kernels::Job) has them.
    pub free: &'a [L::Scalar],
    pub memory: &'a mut Memory<L>,
}
