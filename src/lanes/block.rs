//! A block of samples: registers of those that bend alike, then of those that are left.

use super::algebra::{Vec3, length};
use super::lane::{Lane, Scalar};
use super::path::{Path, rest_slope};
use super::program::{Inputs, Outputs, Program};
use super::rod::{Rod, Terms};
use super::shoot::Workspace;
use super::solve::solve_group;
use crate::model::{BLOCK, Quantity, Status};
use pulp::{Simd, WithSimd};
use std::any::Any;
use std::marker::PhantomData;

/// Lanes of the widest register.
pub const WIDEST: usize = 16;

/// One block of samples for the kernel, numbers column by column in the plan's units.
pub struct Job<'a, S: Scalar> {
    pub program: &'a Program,
    pub inputs: &'a [S],
    /// Of each sample.
    pub bad: &'a [bool],
    /// The samples in the order in which they are solved.
    pub order: &'a mut Vec<usize>,
    /// What was found, in that order.
    pub values: &'a mut [S],
    /// `Memory` of the block before.
    pub memory: &'a mut Option<Box<dyn Any + Send + Sync>>,
}

/// Registers' worth of memory, kept from block to block: to make it anew takes as long as to solve a register.
struct Memory<L> {
    rod: Rod<L>,
    workspace: Workspace<L>,
}

/// Solves a block by the ramp, then what is left with care.
#[inline(always)]
pub fn solve_job<L: Lane, T: Terms>(token: L::Token, job: Job<'_, L::Scalar>) {
    let Job { program, inputs, bad, order, values, memory } = job;
    let mut own = match memory.take().map(|memory| memory.downcast::<Memory<L>>()) {
        Some(Ok(own)) => own,
        _ => Box::new(Memory { rod: Rod::new(token), workspace: Workspace::new(token, program) }),
    };
    let columns = |numbers: &[L::Scalar]| numbers.len() / BLOCK;
    let mut block = Block::<L, T> {
        program,
        token,
        inputs,
        rest_slopes: vec![L::Scalar::default(); 3 * BLOCK],
        packed: vec![L::Scalar::default(); (columns(inputs) + 3) * L::COUNT],
        found: vec![L::Scalar::default(); columns(values) * L::COUNT],
        rod: &mut own.rod,
        workspace: &mut own.workspace,
        terms: PhantomData,
    };
    order.clear();
    order.extend((0..bad.len()).filter(|sample| !bad[*sample]));
    let is_search = program.start.is_some();
    if !is_search {
        let bends = block.bends(bad.len());
        order.sort_by(|a, b| bends[*a].total_cmp(&bends[*b]));
    }
    let path = if is_search { Path::Search } else { Path::Ramp };
    for offset in (0..order.len()).step_by(L::COUNT) {
        let samples = &order[offset..order.len().min(offset + L::COUNT)];
        block.solve(samples, path, Outputs { data: values, stride: BLOCK, offset });
    }
    let status = Quantity::Status.column() * BLOCK;
    let pending: Vec<usize> = (0..order.len()).filter(|place| !is_settled(values[status + place])).collect();
    for places in pending.chunks(L::COUNT) {
        let samples: Vec<usize> = places.iter().map(|place| order[*place]).collect();
        let mut found = std::mem::take(&mut block.found);
        block.solve(&samples, Path::GuardedRamp, Outputs { data: &mut found, stride: L::COUNT, offset: 0 });
        for (to, from) in values.chunks_mut(BLOCK).zip(found.chunks(L::COUNT)) {
            places.iter().zip(from).for_each(|(place, from)| to[*place] = *from);
        }
        block.found = found;
    }
    let solved = order.len();
    order.extend((0..bad.len()).filter(|sample| bad[*sample]));
    let code = L::Scalar::from_f64(f64::from(Status::BadParameter.code()));
    values[status + solved..status + order.len()].fill(code);
    *memory = Some(own);
}

/// Whether a status is final: anything but `Pending`, NaN included in pending.
fn is_settled<S: Scalar>(status: S) -> bool {
    status.to_f64() < f64::from(Status::Pending.code())
}

/// A block at work.
struct Block<'a, L: Lane, T: Terms> {
    program: &'a Program,
    token: L::Token,
    inputs: &'a [L::Scalar],
    /// dm0/dlambda at rest of each sample.
    rest_slopes: Vec<L::Scalar>,
    /// Inputs and slopes at rest of the samples in hand.
    packed: Vec<L::Scalar>,
    /// What was found of those that were left.
    found: Vec<L::Scalar>,
    rod: &'a mut Rod<L>,
    workspace: &'a mut Workspace<L>,
    terms: PhantomData<T>,
}

impl<L: Lane, T: Terms> Block<'_, L, T> {
    /// How far each sample would bend to first order, in plan units of moment.
    #[inline(always)]
    fn bends(&mut self, count: usize) -> [f64; BLOCK] {
        let mut bends = [0.0; BLOCK];
        for offset in (0..count).step_by(L::COUNT) {
            let rest = AtRest::<L, T> {
                program: self.program,
                token: self.token,
                inputs: Inputs { data: self.inputs, stride: BLOCK, offset },
                rod: self.rod,
                workspace: self.workspace,
                terms: PhantomData,
            };
            let slope = L::vectorize(self.token, rest);
            Outputs { data: &mut self.rest_slopes, stride: BLOCK, offset }.store_vector(0, slope);
            let mut bend = [L::Scalar::default(); WIDEST];
            length(slope).store(&mut bend);
            bends[offset..].iter_mut().zip(bend).take(L::COUNT).for_each(|(to, bend)| *to = bend.to_f64());
        }
        bends
    }

    /// Solves as many samples as a register holds, or fewer.
    #[inline(always)]
    fn solve(&mut self, samples: &[usize], path: Path, out: Outputs<'_, L::Scalar>) {
        // Lanes without a sample do as the last one does, and take no time of their own.
        let last = samples[samples.len() - 1];
        for (to, from) in
            self.packed.chunks_mut(L::COUNT).zip(self.inputs.chunks(BLOCK).chain(self.rest_slopes.chunks(BLOCK)))
        {
            to.iter_mut().for_each(|to| *to = from[last]);
            to.iter_mut().zip(samples).for_each(|(to, sample)| *to = from[*sample]);
        }
        let (inputs, slopes) = self.packed.split_at(self.packed.len() - 3 * L::COUNT);
        let group = Group::<L, T> {
            program: self.program,
            token: self.token,
            inputs: Inputs { data: inputs, stride: L::COUNT, offset: 0 },
            path,
            rest_slope: Inputs { data: slopes, stride: L::COUNT, offset: 0 }.vector(self.token, 0),
            rod: self.rod,
            workspace: self.workspace,
            out,
            terms: PhantomData,
        };
        L::vectorize(self.token, group);
    }
}

/// The arguments of [`rest_slope`].
struct AtRest<'a, L: Lane, T: Terms> {
    program: &'a Program,
    token: L::Token,
    inputs: Inputs<'a, L::Scalar>,
    rod: &'a mut Rod<L>,
    workspace: &'a mut Workspace<L>,
    terms: PhantomData<T>,
}

impl<L: Lane, T: Terms> WithSimd for AtRest<'_, L, T> {
    type Output = Vec3<L>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec3<L> {
        let AtRest { program, token, inputs, rod, workspace, .. } = self;
        rod.load(program, token, &inputs);
        rest_slope::<L, T>(program, rod, workspace)
    }
}

/// The arguments of [`solve_group`]: one compiled function for all paths.
struct Group<'a, L: Lane, T: Terms> {
    program: &'a Program,
    token: L::Token,
    inputs: Inputs<'a, L::Scalar>,
    path: Path,
    rest_slope: Vec3<L>,
    rod: &'a mut Rod<L>,
    workspace: &'a mut Workspace<L>,
    out: Outputs<'a, L::Scalar>,
    terms: PhantomData<T>,
}

impl<L: Lane, T: Terms> WithSimd for Group<'_, L, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Group { program, token, inputs, path, rest_slope, rod, workspace, mut out, .. } = self;
        solve_group::<L, T>(program, token, &inputs, path, rest_slope, rod, workspace, &mut out);
    }
}
