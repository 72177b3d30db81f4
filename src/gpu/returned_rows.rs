//! The few rows that come back from a dispatch of a sweep without rows.

use super::device::failed;
use super::dispatcher::Dispatcher;
use super::shader::Bounds;
use crate::backend::{BackendError, ReduceJob, Returned};
use crate::clock::Busy;
use crate::model::{BLOCK, Batch, Blocks, Plan, Quantity, Solutions, Status};
use bytemuck::Pod;
use rayon::prelude::*;
use std::ops::Range;

/// A batch of samples by their index.
pub(super) fn batch_of(plan: &Plan, job: &ReduceJob, indices: &[u64]) -> Batch {
    plan.batch(indices.len(), |at, row| {
        if let Some(index) = indices.get(at) {
            (job.values)(*index, row);
        }
    })
}

/// Those rows of what several dispatches gave back that are `wanted`, as one; none was counted on the device.
pub(super) fn picked(plan: &Plan, parts: &[Returned], wanted: impl Fn(Status) -> bool) -> Returned {
    let rows = parts.iter().flat_map(|part| (0..part.indices.len()).map(move |row| (part, row)));
    let rows: Vec<_> = rows.filter(|(part, row)| wanted(part.solutions.status(*row))).collect();
    let mut inputs = Blocks::new(plan.input_count, rows.len());
    let mut solutions = Solutions::new(plan, rows.len());
    for (to, (part, from)) in rows.iter().enumerate() {
        (0..plan.input_count).for_each(|column| inputs.set(to, column, part.batch.inputs.get(*from, column)));
        solutions.copy_row(to, &part.solutions, *from);
    }
    let bad = rows.iter().map(|(part, row)| part.batch.bad[*row]).collect();
    let indices = rows.iter().map(|(part, row)| part.indices[*row]).collect();
    Returned { indices, batch: Batch { inputs, bad }, solutions, counted: [0; 2] }
}

/// Which rows one dispatch gave back.
pub(super) struct ReturnedRows<'a> {
    pub job: &'a ReduceJob<'a>,
    /// Samples of the dispatch.
    pub range: Range<u64>,
    /// What the dispatch added to each status.
    pub mark: f64,
    /// Sample of each row, counted from the first of the dispatch.
    pub list: &'a [u32],
}

impl ReturnedRows<'_> {
    /// Sorts the rows by sample and converts them.
    ///
    /// `rows` lie block by block in the plan's units. They widen the bounds.
    pub fn read<S: Pod + Send + Sync + Into<f64>>(
        &self,
        dispatcher: &Dispatcher,
        rows: &[S],
        bounds: &mut Bounds,
    ) -> Result<Returned, BackendError> {
        let (plan, list) = (&dispatcher.plan, self.list);
        let name = &dispatcher.device.adapter().name;
        let width = plan.output_count();
        let value = |row: usize, column: usize| rows[(row / BLOCK * width + column) * BLOCK + row % BLOCK];
        let mut order: Vec<usize> = (0..list.len()).collect();
        order.sort_unstable_by_key(|at| list[*at]);
        if order.windows(2).any(|pair| list[pair[0]] == list[pair[1]]) {
            return Err(failed(format!("{name}: a sample came back twice")));
        }
        let index = |row: usize| self.range.start + u64::from(list[row]);
        let indices: Vec<u64> = order.iter().map(|row| index(*row)).collect();
        let batch = batch_of(plan, self.job, &indices);
        let mut solutions = Solutions::new(plan, indices.len());
        let mut sorted = vec![S::zeroed(); solutions.values.data().len()];
        let busy = Busy::here();
        sorted.par_chunks_mut(width * BLOCK).zip(order.par_chunks(BLOCK)).for_each(|(block, rows)| {
            let _busy = busy.enter();
            for (column, values) in block.chunks_mut(BLOCK).enumerate() {
                values.iter_mut().zip(rows).for_each(|(to, from)| *to = value(*from, column));
            }
        });
        let conversion = dispatcher.conversion(&batch, self.mark);
        let block_len = solutions.values.block_len();
        let blocks = solutions.values.data_mut().par_chunks_mut(block_len).zip(sorted.par_chunks(block_len));
        let convert = |(block, (to, from)): (usize, (&mut [f64], &[S]))| {
            let _busy = busy.enter();
            conversion.block(block, from, to)
        };
        let unwritten: usize = blocks.enumerate().map(convert).sum();
        if unwritten > 0 {
            let samples = self.range.end - self.range.start;
            return Err(failed(format!("{name}: the kernel left {unwritten} of {samples} samples unwritten")));
        }
        for (at, from) in order.iter().enumerate() {
            let column = |quantity: Quantity, axis: usize| value(*from, quantity.column() + axis).into();
            let estimate: f64 = column(Quantity::ErrorEstimate, 0);
            let tip = [0, 1, 2].map(|axis| column(Quantity::TipPosition, axis));
            // A doubtful row is solved again and may change.
            let is_certain = solutions.status(at).is_success() && estimate <= self.job.tolerance;
            if is_certain && tip.iter().all(|x: &f64| x.is_finite()) {
                bounds.widen(tip, column(Quantity::Residual, 0), estimate);
            }
        }
        Ok(Returned { indices, batch, solutions, counted: [0; 2] })
    }
}
