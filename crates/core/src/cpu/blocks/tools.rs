//! What registers of one kind need: a rod, memory of passes, numbers of the samples in hand.

use crate::cpu::equilibrium::field::arrival::VARYING_END_COLUMNS;
use crate::cpu::rod::problem::{Passes, Workspace};
use crate::cpu::rod::program::Program;
use crate::cpu::rod::segments::Rod;
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::BLOCK;

/// Numbers of the end of a path from rest: reached, in several load steps, passes, lambda, base moment, inverse of W, close.
const END_COLUMNS: usize = 17;

/// Numbers of the end of a path of a program.
pub fn end_columns(program: &Program) -> usize {
    if program.field.is_some() { VARYING_END_COLUMNS } else { END_COLUMNS }
}

/// What registers of one kind need.
pub struct Tools<L: Lane> {
    pub rod: Rod<L>,
    pub workspace: Workspace<L>,
    /// Inputs of the samples in hand.
    pub inputs: Vec<L::Scalar>,
    /// Their slopes at rest, or the ends of their paths.
    pub start: Vec<L::Scalar>,
}

impl<L: Passes> Tools<L> {
    pub fn new(token: L::Token, program: &Program, columns: usize) -> Self {
        Self {
            rod: Rod::new(token),
            workspace: Workspace::new(token, program),
            inputs: vec![L::Scalar::default(); columns * L::COUNT],
            start: vec![L::Scalar::default(); end_columns(program) * L::COUNT],
        }
    }

    /// Takes samples of a block in hand: their inputs, column by column.
    #[inline(always)]
    pub fn pack<From: Scalar>(&mut self, columns: &[From], samples: &[usize]) {
        self.workspace.alone = samples.len() == 1;
        pack(columns, samples, L::COUNT, &mut self.inputs);
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
