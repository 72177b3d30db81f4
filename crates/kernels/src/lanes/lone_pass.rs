//! One pass over each rod of a batch from a given base moment: neither a search, nor checks, nor rows.

use super::base::moment_columns;
use super::block::{Block, Way};
use super::group::{Load, Tools};
use super::kernels::Kernels;
use super::lane::Scalar;
use super::problem::Problem;
use super::program::{Inputs, Outputs};
use super::scratch::Pool;
use super::shoot::{Record, shoot, tip_moment_columns};
use super::{BlockScalar, Lanes};
use crate::backend::{BackendError, BackendKind, Precision};
use crate::clock::Busy;
use crate::model::{BLOCK, Batch, PassEnds};
use rayon::prelude::*;

/// Numbers of one pass.
const COLUMNS: usize = PassEnds::COLUMNS;

impl Lanes {
    /// Integrates each rod of a batch once, on the plan's steps, from the base moment that the batch gives, with the columns
    /// by that moment. The plan has starts, as of [`Plan::with_lone_starts`](crate::model::Plan::with_lone_starts). What lies
    /// beyond all loads keeps its rest shape, which it has at an equilibrium; a plan without `free` integrates it, too. Of
    /// values that make no rod every number is NaN.
    ///
    /// # Errors
    ///
    /// A plan without starts, or a field that varies in space, where the force at the base is unknown, too.
    pub fn pass(&self, batch: &Batch, ends: &mut PassEnds) -> Result<(), BackendError> {
        let refused = |what: &str, remedy: &str| {
            Err(BackendError::Unsupported { backend: BackendKind::Cpu, what: what.into(), remedy: remedy.into() })
        };
        if self.program.start.is_none() {
            return refused("a lone pass without a base moment", "give it: Plan::with_lone_starts");
        }
        if self.program.field.is_some() {
            return refused("a lone pass in a field that varies", "solve its rods");
        }
        ends.0.reuse(COLUMNS, batch.sample_count());
        match self.precision {
            Precision::F64 | Precision::Mixed => self.pass_blocks(batch, ends, &self.pools.0),
            Precision::F32 => self.pass_blocks(batch, ends, &self.pools.1),
        }
        Ok(())
    }

    fn pass_blocks<S: BlockScalar>(&self, batch: &Batch, ends: &mut PassEnds, pool: &Pool<S>) {
        let (length, moment) = (self.plan.units.length, self.plan.units.moment());
        let mut scales = [1.0; COLUMNS];
        scales[..3].fill(length);
        scales[9..12].fill(moment);
        for column in scales[12..].chunks_exact_mut(9) {
            column[..3].fill(1.0 / moment);
            column[3..6].fill(length / moment);
        }
        let (count, block_len, busy) = (batch.sample_count(), ends.0.block_len(), Busy::here());
        let blocks = ends.0.data_mut().par_chunks_mut(block_len).enumerate();
        blocks.for_each_init(
            || pool.lend(),
            |lent, (block, out)| {
                let _busy = busy.enter();
                let samples: Vec<usize> = (block * BLOCK..count.min((block + 1) * BLOCK)).collect();
                self.solve_samples(batch, &samples, Way::Pass, &scales, &mut lent.scratch, out);
            },
        );
    }
}

impl<L: Kernels> Block<'_, L> {
    /// Takes the samples in `order` over their rods once.
    #[inline(always)]
    pub fn pass_once(&mut self, order: &[usize], values: &mut [L::Scalar]) {
        let program = self.program;
        let one = L::splat(self.token, 1.0);
        for (at, samples) in order.chunks(L::COUNT).enumerate() {
            let tools = &mut self.memory.answers;
            tools.pack(self.inputs, samples);
            let Tools { rod, workspace, inputs, .. } = tools;
            let inputs = Inputs { data: inputs, stride: L::COUNT, offset: 0 };
            L::load_rods(Load { program, token: self.token, inputs, rod });
            let problem = Problem { program, inputs, rod };
            let m0 = program.vector(self.token, &inputs, program.start.unwrap_or_default());
            let mut columns = [moment_columns(one)];
            let tip = shoot(&problem, &program.fine, one, m0, &mut columns, Record::Nothing, workspace);
            let [by_moment] = &columns;
            let dm = tip_moment_columns(program.terms, &tip, by_moment);
            let mut out = Outputs { data: &mut *values, stride: BLOCK, offset: at * L::COUNT };
            for (at, vector) in [tip.p, tip.d1, tip.t, tip.m].into_iter().enumerate() {
                out.store_vector(3 * at, vector);
            }
            for k in 0..3 {
                let first = 12 + 9 * k;
                out.store_vector(first, by_moment.w[k]);
                out.store_vector(first + 3, by_moment.dp[k]);
                out.store_vector(first + 6, dm[k]);
            }
        }
    }
}

/// No numbers for the samples in these places.
pub fn leave_empty<S: Scalar>(places: std::ops::Range<usize>, values: &mut [S]) {
    for column in values.chunks_exact_mut(BLOCK) {
        column[places.clone()].fill(S::from_f64(f64::NAN));
    }
}
