//! Inputs and outputs between SI in f64 and the plan's units in the kernel's precision.

use crate::backend::Precision;
use crate::clock::Busy;
use crate::model::{BLOCK, Batch, Blocks, ColumnNoise, Plan, Quantity, Status};
use rayon::prelude::*;
use std::ops::Range;

/// Some blocks of inputs as the kernel reads them; `units` has the unit of each column.
pub(super) fn pack(inputs: &Blocks<f64>, blocks: Range<usize>, units: &[f64], precision: Precision) -> Vec<u8> {
    let block_len = inputs.block_len();
    let values = &inputs.data()[blocks.start * block_len..blocks.end * block_len];
    let size = precision.size();
    let mut packed = vec![0; size * values.len()];
    let busy = Busy::here();
    packed.par_chunks_mut(size * BLOCK).zip(values.par_chunks(BLOCK)).enumerate().for_each(|(at, (to, from))| {
        let _busy = busy.enter();
        let unit = units[at % units.len()];
        for (to, from) in to.chunks_exact_mut(size).zip(from) {
            match precision {
                Precision::F32 => to.copy_from_slice(&((from / unit) as f32).to_ne_bytes()),
                Precision::F64 => to.copy_from_slice(&(from / unit).to_ne_bytes()),
            }
        }
    });
    packed
}

/// How one dispatch's outputs become solutions of a batch.
pub(super) struct OutputConversion<'a> {
    pub plan: &'a Plan,
    pub batch: &'a Batch,
    /// Unit of each output column.
    pub units: &'a [f64],
    pub column_noise: Option<&'a ColumnNoise>,
    /// What the dispatch added to each status.
    pub mark: f64,
}

impl OutputConversion<'_> {
    /// Converts one block and returns how many of its samples the kernel has not written.
    pub fn block<S: Copy + Into<f64>>(&self, block: usize, from: &[S], to: &mut [f64]) -> usize {
        let first = block * BLOCK;
        let lanes = (self.batch.sample_count() - first).min(BLOCK);
        let columns = from.chunks_exact(BLOCK).zip(to.chunks_exact_mut(BLOCK)).zip(self.units);
        for ((from, to), unit) in columns {
            for (to, from) in to[..lanes].iter_mut().zip(from) {
                *to = (*from).into() * unit;
            }
        }
        self.plan.raise_error_estimates(to);
        self.plan.add_base_positions(self.batch, first..first + lanes, to);
        if let Some(noise) = self.column_noise {
            noise.add(to);
        }
        let mut unwritten = 0;
        let status = Quantity::Status.column() * BLOCK;
        for lane in 0..lanes {
            match self.written_status(from[status + lane].into()) {
                None => unwritten += 1,
                Some(_) if self.batch.bad[first + lane] => {
                    to.iter_mut().skip(lane).step_by(BLOCK).for_each(|x| *x = f64::NAN);
                    to[status + lane] = f64::from(Status::BadParameter.code());
                }
                Some(code) => to[status + lane] = f64::from(code.code()),
            }
        }
        unwritten
    }

    /// The status that a kernel stored under this mark.
    fn written_status(&self, stored: f64) -> Option<Status> {
        let code = stored - self.mark;
        let is_code = (0.0..256.0).contains(&code) && code.fract() == 0.0;
        let status = if is_code { Status::from_code(code as u8) } else { None };
        status.filter(|status| *status != Status::Pending)
    }
}

/// Unit of each output column.
pub(super) fn output_units(plan: &Plan) -> Vec<f64> {
    let units = &plan.units;
    let mut scale = vec![1.0; plan.output_count()];
    let mut set = |first: usize, unit: f64| scale[first..first + 3].fill(unit);
    set(Quantity::TipPosition.column(), units.length);
    set(Quantity::BaseMoment.column(), units.moment());
    for derivative in 0..plan.derivatives.len() {
        let first = Quantity::COUNT + plan.rows() * derivative;
        set(first, units.length);
        if plan.options.base_moment_rows {
            set(first + 6, units.moment());
        }
        if plan.rows() > 9 {
            set(first + 9, units.curvature());
        }
    }
    if plan.first_beyond_rigid().is_some() {
        set(plan.output_count() - 3, units.curvature());
    }
    scale
}
