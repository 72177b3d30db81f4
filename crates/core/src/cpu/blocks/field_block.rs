//! The paths of a block of samples in a field that varies, without care: in f32, those that set out alike at a time.

use super::kernels::{FollowVarying, InVarying, Kernels, Leg};
use super::memory::{Block, Memory, made};
use super::tools::{pack, unpack};
use crate::cpu::equilibrium::field::arrival::Led;
use crate::cpu::rod::field::workspace::VaryingWorkspace;
use crate::cpu::rod::program::{Outputs, Program};
use crate::cpu::simd::lane::{Lane, Scalar};
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
    follow_leg(Leg::SetOut, program, token, inputs, memory, order);
    let rests = &memory.rests;
    let bend = |sample: usize| (0..6).map(|k| rests[k * BLOCK + sample].to_f64().powi(2)).sum::<f64>();
    order.sort_by(|a, b| bend(*a).total_cmp(&bend(*b)));
    follow_leg(Leg::Follow, program, token, inputs, memory, order);
    put_arrived_first(memory, order)
}

/// Brings the wall to the `free` rods of all samples in `order`; puts those that arrive first and returns their number.
#[inline(always)]
pub fn press_block<L: Kernels>(
    program: &Program,
    token: L::Token,
    inputs: &[L::Scalar],
    free: &[L::Scalar],
    memory: &mut Memory<L>,
    order: &mut Vec<usize>,
) -> usize {
    for (to, from) in memory.rests.iter_mut().zip(free) {
        *to = Scalar::from_f64(from.to_f64());
    }
    follow_leg(Leg::Wall, program, token, inputs, memory, order);
    put_arrived_first(memory, order)
}

/// One leg of the paths of all samples in `order`, from where the memory has them.
#[inline(always)]
fn follow_leg<L: Kernels>(
    leg: Leg,
    program: &Program,
    token: L::Token,
    inputs: &[L::Scalar],
    memory: &mut Memory<L>,
    order: &[usize],
) {
    let read = program.rod_columns * BLOCK;
    let Memory { paths: tools, varying_paths: varying, inputs: own, rests, ends, .. } = memory;
    if leg != Leg::Follow {
        for (to, from) in own.iter_mut().zip(&inputs[..read]) {
            *to = Scalar::from_f64(from.to_f64());
        }
    }
    let varying = made(varying, || VaryingWorkspace::new(token, program));
    let lanes = L::Coarse::COUNT;
    for samples in order.chunks(lanes) {
        tools.pack(&own[..read], samples);
        if leg != Leg::SetOut {
            pack(rests, samples, lanes, &mut tools.start);
        }
        L::Coarse::follow_varying(FollowVarying { program, token, leg, varying, tools });
        unpack(&tools.start, samples, lanes, if leg == Leg::SetOut { &mut *rests } else { &mut *ends });
    }
}

/// Puts the samples whose paths have arrived first, and returns their number.
fn put_arrived_first<L: Kernels>(memory: &Memory<L>, order: &mut Vec<usize>) -> usize {
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
    pub(in crate::cpu) fn solve_in_varying(&mut self, samples: &[usize], led: Led<'_>, out: Outputs<'_, L::Scalar>) {
        let Memory { answers: tools, varying, ends, .. } = &mut *self.memory;
        tools.pack(self.inputs, samples);
        match led {
            Led::Before => pack(ends, samples, L::COUNT, &mut tools.start),
            Led::Free | Led::FreeCurve | Led::FreeWithCare => pack(self.free, samples, L::COUNT, &mut tools.start),
            Led::Curve { .. } | Led::Ramp(_) => {}
        }
        let (program, token) = (self.program, self.token);
        let varying = made(varying, || VaryingWorkspace::new(token, program));
        L::in_varying(InVarying { program, token, led, varying, tools, out });
    }
}
