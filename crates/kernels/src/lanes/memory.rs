//! What a thread keeps from block to block, and how samples of a block are put side by side.

use super::group::{Tools, end_columns};
use super::kernels::Kernels;
use super::lane::{Lane, Scalar};
use super::nodes::{Nodes, QuickEnd};
use super::program::Program;
use super::varying::{REST_COLUMNS, VaryingWorkspace};
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

/// Puts columns of some samples of a block side by side; lanes without a sample do as the last one does, and take no
/// time of their own.
#[inline(always)]
pub fn pack<From: Scalar, To: Scalar>(columns: &[From], samples: &[usize], lanes: usize, to: &mut [To]) {
    let last = samples[samples.len() - 1];
    for (to, from) in to.chunks_exact_mut(lanes).zip(columns.chunks_exact(BLOCK)) {
        if samples.len() == lanes {
            (0..lanes).for_each(|lane| to[lane] = To::from_f64(from[samples[lane]].to_f64()));
            continue;
        }
        to.fill(To::from_f64(from[last].to_f64()));
        to.iter_mut().zip(samples).for_each(|(to, sample)| *to = To::from_f64(from[*sample].to_f64()));
    }
}

/// Puts them back.
#[inline(always)]
pub fn unpack<S: Scalar>(from: &[S], samples: &[usize], lanes: usize, columns: &mut [S]) {
    for (to, from) in columns.chunks_exact_mut(BLOCK).zip(from.chunks_exact(lanes)) {
        samples.iter().zip(from).for_each(|(sample, from)| to[*sample] = *from);
    }
}
