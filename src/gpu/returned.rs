//! Rows of a sweep without rows: the few samples that come back.

use super::device::failed;
use super::engine::Gpu;
use super::tally::Bounds;
use crate::backend::{BackendError, ReduceJob, Returned};
use crate::model::{BLOCK, Batch, Quantity, Solutions, Status};
use bytemuck::Pod;
use rayon::prelude::*;
use std::ops::Range;

/// A batch of samples by their index.
pub(super) fn samples(gpu: &Gpu, job: &ReduceJob, indices: &[u64]) -> Batch {
    gpu.plan.batch(indices.len(), |at, row| {
        if let Some(index) = indices.get(at) {
            (job.values)(*index, row);
        }
    })
}

/// Rows that came back of a dispatch, in the order of their samples, less stragglers; takes their numbers into the bounds.
pub(super) fn returned<S: Pod + Sync + Into<f64>>(
    gpu: &Gpu,
    job: &ReduceJob,
    (range, mark): (&Range<u64>, f64),
    (list, rows): (&[u32], &[S]),
    bounds: &mut Bounds,
    stragglers: &mut Vec<u64>,
) -> Result<Returned, BackendError> {
    let width = gpu.plan.output_count();
    let value = |row: usize, column: usize| rows[(row / BLOCK * width + column) * BLOCK + row % BLOCK];
    let mut order: Vec<usize> = (0..list.len()).collect();
    order.sort_unstable_by_key(|at| list[*at]);
    let pending = mark + f64::from(Status::Pending.code());
    let is_left = |row: usize| gpu.solver.in_stages && value(row, Quantity::Status.column()).into() == pending;
    let index = |row: &usize| range.start + u64::from(list[*row]);
    stragglers.extend(order.iter().filter(|row| is_left(**row)).map(index));
    if order.windows(2).any(|pair| list[pair[0]] == list[pair[1]]) {
        return Err(failed(format!("{}: a sample came back twice", gpu.device.adapter().name)));
    }
    order.retain(|row| !is_left(*row));
    let indices: Vec<u64> = order.iter().map(index).collect();
    let batch = samples(gpu, job, &indices);
    let mut solutions = Solutions::new(&gpu.plan, indices.len());
    let mut sorted = vec![S::zeroed(); solutions.values.data().len()];
    for (to, from) in order.iter().enumerate() {
        for column in 0..width {
            sorted[(to / BLOCK * width + column) * BLOCK + to % BLOCK] = value(*from, column);
        }
    }
    let unpack = gpu.unpack(&batch, mark);
    let block_len = solutions.values.block_len();
    let blocks = solutions.values.data_mut().par_chunks_mut(block_len).zip(sorted.par_chunks(block_len));
    let unwritten: usize = blocks.enumerate().map(|(block, (to, from))| unpack.block(block, from, to)).sum();
    if unwritten > 0 {
        let name = &gpu.device.adapter().name;
        let samples = range.end - range.start;
        return Err(failed(format!("{name}: the kernel left {unwritten} of {samples} samples unwritten")));
    }
    for (at, from) in order.iter().enumerate() {
        let column = |quantity: Quantity, axis: usize| value(*from, quantity.column() + axis).into();
        let estimate: f64 = column(Quantity::ErrorEstimate, 0);
        let tip = [0, 1, 2].map(|axis| column(Quantity::TipPosition, axis));
        let status = solutions.status(at);
        // A doubtful row is solved again and may change.
        if status.is_success() && estimate <= job.tolerance && tip.iter().all(|x: &f64| x.is_finite()) {
            bounds.widen(tip, column(Quantity::Residual, 0), estimate);
        }
    }
    Ok(Returned { indices, batch, solutions, counted: [0; 2] })
}
