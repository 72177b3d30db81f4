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

/// Memory of a thread. Most scenes need no multiple shooting and no field that varies: what those need is made when a rung first asks
/// for it.
pub struct Memory<L: Kernels> {
    pub paths: Tools<L::Coarse>,
    pub answers: Tools<L>,
    pub nodes: Option<Box<Nodes<L>>>,
    pub quick: Option<Box<Nodes<L::Coarse>>>,
    pub quick_end: QuickEnd,
    pub varying: Option<Box<VaryingWorkspace<L>>>,
    pub varying_paths: Option<Box<VaryingWorkspace<L::Coarse>>>,
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
            nodes: None,
            quick: None,
            quick_end: QuickEnd::new(),
            varying: None,
            varying_paths: None,
            inputs: vec![zero; inputs],
            rests: vec![zero; REST_COLUMNS * BLOCK],
            ends: vec![zero; end_columns(program) * BLOCK],
        }
    }
}

/// A part of the memory, made where there is none.
pub fn made<T>(kept: &mut Option<Box<T>>, make: impl FnOnce() -> T) -> &mut T {
    kept.get_or_insert_with(|| Box::new(make()))
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
