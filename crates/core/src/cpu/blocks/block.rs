//! A block of samples: paths from rest in f32, a register of samples that bend alike at a time, then answers of those
//! that arrived; or both with care.

use super::field_block::follow_block;
use super::field_block::press_block;
use super::group::{load_rest, store_end, store_rest};
use super::kernels::{Answer, Follow, Job, Kernels, Load};
use super::memory::{Block, CoarseScalar, Memory};
use super::tools::Tools;
use super::tools::{pack, unpack};
use crate::cpu::equilibrium::anchors::anchored_end;
use crate::cpu::equilibrium::field::arrival::Led;
use crate::cpu::equilibrium::path::{Path, rest_slope};
use crate::cpu::ladder::{Rung, is_left};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::program::{Inputs, Outputs};
use crate::cpu::simd::lane::{Lane, Scalar, WIDEST};
use crate::model::{Anchors, BLOCK, Quantity, Status};
use pulp::{Simd, WithSimd};

/// The arguments of [`solve_job`].
pub struct AsKernel<'a, L: Lane>(pub L::Token, pub Job<'a, L::Scalar>);

impl<L: Kernels> WithSimd for AsKernel<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        solve_job::<L>(self.0, self.1);
    }
}

/// Solves a block.
#[inline(always)]
fn solve_job<L: Kernels>(token: L::Token, job: Job<'_, L::Scalar>) {
    let Job { program, inputs, bad, rung, free, order, left, values, memory } = job;
    let kept = memory.take().and_then(|memory| memory.downcast::<Memory<L>>().ok());
    let mut kept = kept.unwrap_or_else(|| Box::new(Memory::new(token, program, inputs.len())));
    order.clear();
    order.extend((0..bad.len()).filter(|sample| !bad[*sample]));
    let solved = order.len();
    let mut block = Block::<L> { program, token, inputs, free, memory: &mut kept };
    let (mut path, mut ready) = (Path::Search, solved);
    if program.field.is_none()
        && program.start.is_none()
        && !matches!(rung, Rung::LimpShooting | Rung::MultipleShooting)
    {
        (path, ready) = match (rung, &program.anchors) {
            (Rung::Anchors, Some((grid, column))) => (Path::Anchored, block.predict(grid, *column, order)),
            (Rung::GuardedSteps | Rung::Curve, _) => {
                block.sort_by_bend(bad.len(), order);
                (if rung == Rung::GuardedSteps { Path::GuardedRamp } else { Path::Curve }, solved)
            }
            _ => {
                block.sort_by_bend(bad.len(), order);
                (Path::Ramp, block.follow(order))
            }
        };
    }
    match rung {
        Rung::FieldSteps => ready = follow_block(program, token, inputs, block.memory, order),
        Rung::ComingWall => ready = press_block(program, token, inputs, free, block.memory, order),
        _ => {}
    }
    for offset in (0..ready).step_by(L::COUNT) {
        let samples = &order[offset..ready.min(offset + L::COUNT)];
        let out = Outputs { data: &mut *values, stride: BLOCK, offset };
        match rung {
            Rung::LimpShooting | Rung::MultipleShooting => {
                let from = offset % L::Coarse::COUNT;
                if from == 0 {
                    block.follow_nodes(&order[offset..ready.min(offset + L::Coarse::COUNT)]);
                }
                block.solve_by_nodes(samples, from, out);
            }
            Rung::FieldSteps | Rung::ComingWall => block.solve_in_varying(samples, Led::Before, out),
            Rung::FreeTip => block.solve_in_varying(samples, Led::Free, out),
            Rung::FieldCurve if free.is_empty() => block.solve_in_varying(samples, Led::Curve { careful: false }, out),
            Rung::FieldCurve => block.solve_in_varying(samples, Led::FreeCurve, out),
            Rung::FieldFineCurve => block.solve_in_varying(samples, Led::Curve { careful: true }, out),
            Rung::GuardedWall => block.solve_in_varying(samples, Led::FreeWithCare, out),
            Rung::FieldGuardedSteps => block.solve_in_varying(samples, Led::Ramp(&program.careful), out),
            Rung::FieldFineSteps => block.solve_in_varying(samples, Led::Ramp(&program.fine), out),
            _ => block.solve(samples, path, out),
        }
    }
    let status = Quantity::Status.column() * BLOCK;
    let is_left = |place: &usize| *place >= ready || is_left(rung, values[status + *place]);
    left.extend((0..solved).filter(is_left).map(|place| order[place]));
    order.extend((0..bad.len()).filter(|sample| bad[*sample]));
    let code = L::Scalar::from_f64(f64::from(Status::BadParameter.code()));
    values[status + solved..status + order.len()].fill(code);
    *memory = Some(kept);
}

impl<L: Kernels> Block<'_, L> {
    /// Sorts samples, of `count`, by how far they would bend to first order: the largest moment inside, in plan units.
    #[inline(always)]
    fn sort_by_bend(&mut self, count: usize, order: &mut [usize]) {
        let Memory { paths: tools, inputs, rests, .. } = &mut *self.memory;
        let lanes = L::Coarse::COUNT;
        for (to, from) in inputs.iter_mut().zip(self.inputs) {
            *to = Scalar::from_f64(from.to_f64());
        }
        let mut bends = [0.0; BLOCK];
        for offset in (0..count).step_by(lanes) {
            let inputs = Inputs { data: inputs, stride: BLOCK, offset };
            let Tools { rod, workspace, .. } = tools;
            L::Coarse::load_rods(Load { program: self.program, token: self.token, inputs, rod });
            let rest = rest_slope(&Problem { program: self.program, inputs, rod }, workspace);
            store_rest(&rest, &mut Outputs { data: rests, stride: BLOCK, offset });
            let mut bend = [CoarseScalar::<L>::default(); WIDEST];
            rest.largest.store(&mut bend);
            bends[offset..].iter_mut().zip(bend).take(lanes).for_each(|(to, bend)| *to = bend.to_f64());
        }
        order.sort_by(|a, b| bends[*a].total_cmp(&bends[*b]));
    }

    /// Predicts the ends of samples that may start from anchors, puts them first, the surest foremost, and returns their
    /// number.
    #[inline(always)]
    fn predict(&mut self, grid: &Anchors, column: usize, order: &mut Vec<usize>) -> usize {
        let ends = &mut self.memory.ends;
        let newton_tolerance = self.program.newton_tolerance;
        let mut placed = Vec::with_capacity(order.len());
        for sample in order.iter() {
            placed.push((anchored_end((grid, column), newton_tolerance, self.inputs, *sample, ends), *sample));
        }
        placed.sort_by(|a, b| a.0.total_cmp(&b.0));
        order.clear();
        order.extend(placed.iter().map(|(_, sample)| *sample));
        placed.iter().filter(|(mismatch, _)| *mismatch < f32::INFINITY).count()
    }

    /// Follows the paths of all samples in `order`; puts those that arrive first and returns their number.
    #[inline(always)]
    fn follow(&mut self, order: &mut Vec<usize>) -> usize {
        let Memory { paths: tools, inputs, rests, ends, .. } = &mut *self.memory;
        let lanes = L::Coarse::COUNT;
        let mut arrived = Vec::with_capacity(order.len());
        let mut others = Vec::new();
        for samples in order.chunks(lanes) {
            tools.pack(inputs, samples);
            pack(rests, samples, lanes, &mut tools.start);
            let Tools { rod, workspace, inputs, start } = tools;
            let inputs = Inputs { data: inputs, stride: lanes, offset: 0 };
            L::Coarse::load_rods(Load { program: self.program, token: self.token, inputs, rod });
            let rest = load_rest(self.token, &Inputs { data: start, stride: lanes, offset: 0 });
            let problem = Problem { program: self.program, inputs, rod };
            let end = L::Coarse::follow(Follow { problem, path: Path::Ramp, rest, workspace });
            store_end(&end, &mut Outputs { data: start, stride: lanes, offset: 0 });
            unpack(&tools.start, samples, lanes, ends);
            for (sample, reached) in samples.iter().zip(&tools.start) {
                if reached.to_f64() > 0.5 { arrived.push(*sample) } else { others.push(*sample) }
            }
        }
        let count = arrived.len();
        arrived.append(&mut others);
        *order = arrived;
        count
    }

    /// Solves as many samples as a register holds, or fewer.
    #[inline(always)]
    pub(in crate::cpu) fn solve(&mut self, samples: &[usize], path: Path, out: Outputs<'_, L::Scalar>) {
        let Memory { answers: tools, rests, ends, .. } = &mut *self.memory;
        tools.pack(self.inputs, samples);
        match path {
            Path::Anchored | Path::Ramp => pack(ends, samples, L::COUNT, &mut tools.start),
            Path::Curve | Path::GuardedRamp => pack(rests, samples, L::COUNT, &mut tools.start),
            Path::Search => {}
        }
        L::answer(Answer { program: self.program, token: self.token, path, tools, out });
    }
}
