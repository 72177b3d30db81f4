//! Blocks of samples in mixed precision: as many as a register of f32 holds, then those as registers of f64 hold them.

use super::{ColumnsOnly, HANDED_COLUMNS, Settle, Single};
use crate::lanes::block::Block;
use crate::lanes::kernels::Kernels;
use crate::lanes::lane::{Lane, Scalar};
use crate::lanes::memory::{Memory, pack};
use crate::lanes::path::Path;
use crate::lanes::program::{Outputs, Program};
use crate::model::{BLOCK, Quantity, Status};

/// What lies between the two precisions.
#[derive(Default)]
pub struct Handed<C, S> {
    /// Rows, and what [`settle`] needs, by lane of the answer.
    found: Vec<C>,
    handed: Vec<C>,
    /// The latter in f64.
    settled: Vec<S>,
    /// Rows of samples that f32 left in doubt.
    again: Vec<S>,
}

impl<L: Kernels> Block<'_, L> {
    /// Solves samples whose `path` has arrived, columns by the program `single`. From anchors what f32 leaves in doubt goes the
    /// way from rest; from there it is solved in f64 at once.
    #[inline(always)]
    pub(in crate::lanes) fn solve_mixed(
        &mut self,
        single: &Program,
        samples: &[usize],
        path: Path,
        values: &mut [L::Scalar],
    ) {
        let lanes = L::Coarse::COUNT;
        for (group, samples) in samples.chunks(lanes).enumerate() {
            self.solve_group_mixed(single, samples, path, group * lanes, values);
        }
        if path == Path::Ramp {
            self.solve_pending(samples, path, values);
        }
    }

    /// As many samples as a coarse register holds, or fewer.
    #[inline(always)]
    fn solve_group_mixed(
        &mut self,
        single: &Program,
        samples: &[usize],
        path: Path,
        offset: usize,
        values: &mut [L::Scalar],
    ) {
        let Memory { paths, answers, ends, mixed, .. } = &mut *self.memory;
        let (program, token, lanes) = (self.program, self.token, L::Coarse::COUNT);
        let Handed { found, handed, settled, .. } = mixed;
        found.resize(values.len() / BLOCK * lanes, Scalar::from_f64(0.0));
        handed.resize(HANDED_COLUMNS * lanes, Scalar::from_f64(0.0));
        settled.resize(HANDED_COLUMNS * L::COUNT, Scalar::from_f64(0.0));
        paths.pack(self.inputs, samples);
        pack(ends, samples, lanes, &mut paths.start);
        let [out, handed_out] =
            [&mut *found, &mut *handed].map(|data| Outputs { data: &mut data[..], stride: lanes, offset: 0 });
        L::Coarse::columns(ColumnsOnly { program: single, token, path, tools: paths, out, handed: handed_out });
        for (to, from) in values.chunks_exact_mut(BLOCK).zip(found.chunks_exact(lanes)) {
            convert(from, &mut to[offset..]);
        }
        for (part, samples) in samples.chunks(L::COUNT).enumerate() {
            let from = part * L::COUNT;
            answers.pack(self.inputs, samples);
            for (to, numbers) in settled.chunks_exact_mut(L::COUNT).zip(handed.chunks_exact(lanes)) {
                convert(&numbers[from..from + L::COUNT], to);
            }
            let out = Outputs { data: &mut *values, stride: BLOCK, offset: offset + from };
            let epsilon = <L::Coarse as Lane>::Scalar::EPSILON;
            L::settle(Settle { program, token, epsilon, handed: settled, tools: answers, out });
        }
    }

    /// Solves those of the samples that are pending by `path` in f64.
    #[inline(always)]
    fn solve_pending(&mut self, samples: &[usize], path: Path, values: &mut [L::Scalar]) {
        let status = &values[Quantity::Status.column() * BLOCK..];
        let pending = f64::from(Status::Pending.code());
        let places: Vec<usize> = (0..samples.len()).filter(|place| status[*place].to_f64() == pending).collect();
        let mut again = std::mem::take(&mut self.memory.mixed.again);
        again.resize(values.len() / BLOCK * L::COUNT, Scalar::from_f64(0.0));
        for places in places.chunks(L::COUNT) {
            let group: Vec<usize> = places.iter().map(|place| samples[*place]).collect();
            self.solve(&group, path, Outputs { data: &mut again, stride: L::COUNT, offset: 0 });
            for (to, from) in values.chunks_exact_mut(BLOCK).zip(again.chunks_exact(L::COUNT)) {
                places.iter().zip(from).for_each(|(place, value)| to[*place] = *value);
            }
        }
        self.memory.mixed.again = again;
    }
}

#[inline(always)]
fn convert<From: Scalar, To: Scalar>(from: &[From], to: &mut [To]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = To::from_f64(from.to_f64()));
}
