//! Many samples of a plan at once, block by block on all threads.

use super::multiples::Multiples;
use super::record::BASE_POSITION_AT;
use super::sample::Sample;
use super::{BLOCK, Batch, Blocks, Entry, Plan, Quantity};
use crate::clock::Busy;
use rayon::prelude::*;

impl Plan {
    /// Builds a batch: `values(i, &mut row)` writes the value of each axis for sample `i` of the batch.
    pub fn batch(&self, sample_count: usize, values: impl Fn(usize, &mut [f64]) + Sync) -> Batch {
        let mut inputs = Blocks::new(self.input_count, sample_count);
        let mut bad = vec![false; sample_count];
        let block_len = inputs.block_len().max(1);
        if self.input_count == 0 {
            return Batch { inputs, bad };
        }
        let first = Sample::new(self);
        // Finding the short way takes some samples' time.
        let multiples = if sample_count > BLOCK { Multiples::of(self, &first) } else { None };
        let busy = Busy::here();
        let fill = |block: usize, out: &mut [f64], bad: &mut [bool]| {
            let _busy = busy.enter();
            let mut row = vec![0.0; self.axes.len()];
            if let Some(multiples) = &multiples {
                for (lane, bad) in bad.iter_mut().enumerate() {
                    values(block * BLOCK + lane, &mut row);
                    *bad = !multiples.put(&row, |column, value| out[column * BLOCK + lane] = value);
                }
                return;
            }
            let mut sample = first.clone();
            for (lane, bad) in bad.iter_mut().enumerate() {
                values(block * BLOCK + lane, &mut row);
                *bad = !sample.set(&row);
                sample.varying().for_each(|(column, value)| out[column * BLOCK + lane] = value);
            }
        };
        inputs
            .data_mut()
            .par_chunks_mut(block_len)
            .zip(bad.par_chunks_mut(BLOCK))
            .enumerate()
            .for_each(|(block, (out, bad))| fill(block, out, bad));
        Batch { inputs, bad }
    }

    /// Raises the error estimates of a block of rows, column by column, to [`PlanOptions::error_floor`](super::PlanOptions::error_floor).
    pub fn raise_error_estimates(&self, block: &mut [f64]) {
        let (first, floor) = (Quantity::ErrorEstimate.column() * BLOCK, self.options.error_floor);
        block[first..first + BLOCK]
            .iter_mut()
            .filter(|estimate| **estimate < floor)
            .for_each(|estimate| *estimate = floor);
    }

    /// Adds the positions of bases to the tips of a block of rows, column by column, in SI; `samples` are those of its rows in
    /// order. What this rounds counts in their error estimates.
    pub fn add_base_positions(&self, batch: &Batch, samples: impl Iterator<Item = usize> + Clone, block: &mut [f64]) {
        let error = Quantity::ErrorEstimate.column() * BLOCK;
        for axis in 0..3 {
            let record = BASE_POSITION_AT + axis;
            if matches!(self.entries[record], Entry::Constant(0.0)) {
                continue;
            }
            for (place, sample) in samples.clone().enumerate() {
                let base = self.entry(batch, sample, record);
                block[axis * BLOCK + place] += base;
                block[error + place] += f64::EPSILON * base.abs() / self.units.length;
            }
        }
    }
}
