//! The paths of a block of samples in a field that varies, without care: in f32, those that set out alike at a time.

use crate::lanes::kernels::{FollowVarying, InVarying, Kernels, Led};
use crate::lanes::lane::{Lane, Scalar};
use crate::lanes::memory::Block;
use crate::lanes::memory::Memory;
use crate::lanes::program::{Outputs, Program};
use crate::lanes::tools::{pack, unpack};
use crate::model::BLOCK;

/// Follows the paths of all samples in `order`; puts those that arrive first and returns their number.
#[inline(always)]
pub fn follow_block<L: Kernels>(
    program: &Program,
    token: L::Token,
    inputs: &[L::Scalar],
    memory: &mut Memory<L>,
    order: &mut Vec<usize>,
) -> usize {
    let read = program.rod_columns * BLOCK;
    for (to, from) in memory.inputs.iter_mut().zip(&inputs[..read]) {
        *to = Scalar::from_f64(from.to_f64());
    }
    for sets_out in [true, false] {
        let Memory { paths: tools, varying_paths: varying, inputs, rests, ends, .. } = &mut *memory;
        let lanes = L::Coarse::COUNT;
        for samples in order.chunks(lanes) {
            tools.pack(&inputs[..read], samples);
            if !sets_out {
                pack(rests, samples, lanes, &mut tools.start);
            }
            L::Coarse::follow_varying(FollowVarying { program, token, sets_out, varying, tools });
            let to = if sets_out { &mut *rests } else { &mut *ends };
            unpack(&tools.start, samples, lanes, to);
        }
        if sets_out {
            let bend = |sample: usize| (0..6).map(|k| rests[k * BLOCK + sample].to_f64().powi(2)).sum::<f64>();
            order.sort_by(|a, b| bend(*a).total_cmp(&bend(*b)));
        }
    }
    let has_arrived = |sample: &usize| memory.ends[*sample].to_f64() > 0.5;
    let (mut arrived, others): (Vec<usize>, Vec<usize>) = order.iter().partition(|sample| has_arrived(sample));
    let count = arrived.len();
    arrived.extend(others);
    *order = arrived;
    count
}

impl<L: Kernels> Block<'_, L> {
    /// Solves as many samples as a register holds, or fewer, in a field that varies in space.
    #[inline(always)]
    pub(in crate::lanes) fn solve_in_varying(&mut self, samples: &[usize], led: Led<'_>, out: Outputs<'_, L::Scalar>) {
        let Memory { answers: tools, varying, ends, .. } = &mut *self.memory;
        tools.pack(self.inputs, samples);
        if matches!(led, Led::Before) {
            pack(ends, samples, L::COUNT, &mut tools.start);
        }
        L::in_varying(InVarying { program: self.program, token: self.token, led, varying, tools, out });
    }
}
