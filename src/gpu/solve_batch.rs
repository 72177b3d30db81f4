//! Solves a batch: cuts it into dispatches, keeps two in flight, converts what comes back.

use super::conversion::pack;
use super::device::failed;
use super::dispatch_buffers::{Dispatch, Submission};
use super::dispatcher::{DISPATCHES_IN_FLIGHT, Dispatcher};
use super::node_batch::solve_grown;
use super::varying_batch::solve_varying;
use crate::backend::{BackendError, Precision};
use crate::clock::Busy;
use crate::model::{BLOCK, Batch, Solutions};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// A dispatch in flight and the blocks that it solves.
struct InFlight {
    /// Place of its buffers.
    place: usize,
    first_block: usize,
    block_count: usize,
    mark: f64,
    submitted: Instant,
    submission: Submission,
}

/// Solves every sample of a batch. After a loss of the device it does so once more, on the device opened again.
pub(super) fn solve(dispatcher: &mut Dispatcher, batch: &Batch) -> Result<Solutions, BackendError> {
    attempt(dispatcher, batch).or_else(|error| {
        dispatcher.reopen(error)?;
        attempt(dispatcher, batch)
    })
}

fn attempt(dispatcher: &mut Dispatcher, batch: &Batch) -> Result<Solutions, BackendError> {
    let solved = dispatcher.device.check().and_then(|()| solve_rods(dispatcher, batch));
    if solved.is_err() {
        // Buffers may still be in flight or mapped.
        dispatcher.buffers.clear();
    }
    solved
}

fn solve_rods(dispatcher: &mut Dispatcher, batch: &Batch) -> Result<Solutions, BackendError> {
    if dispatcher.plan.terms.varying_field {
        return solve_varying(dispatcher, batch);
    }
    let mut solutions = solve_all(dispatcher, batch)?;
    solve_grown(dispatcher, batch, &mut solutions)?;
    Ok(solutions)
}

fn solve_all(dispatcher: &mut Dispatcher, batch: &Batch) -> Result<Solutions, BackendError> {
    let mut solutions = Solutions::new(&dispatcher.plan, batch.sample_count());
    let block_count = batch.sample_count().div_ceil(BLOCK);
    let (mut next_block, mut next_place) = (0, 0);
    let mut in_flight = VecDeque::new();
    loop {
        if next_block < block_count && in_flight.len() < DISPATCHES_IN_FLIGHT {
            let submitted = submit(dispatcher, batch, next_place, next_block)?;
            next_block += submitted.block_count;
            next_place = (next_place + 1) % DISPATCHES_IN_FLIGHT;
            in_flight.push_back(submitted);
        } else if let Some(submitted) = in_flight.pop_front() {
            finish(dispatcher, batch, submitted, &mut solutions)?;
        } else {
            return Ok(solutions);
        }
    }
}

fn submit(
    dispatcher: &mut Dispatcher,
    batch: &Batch,
    place: usize,
    first_block: usize,
) -> Result<InFlight, BackendError> {
    let start = Instant::now();
    let left = batch.sample_count().div_ceil(BLOCK) - first_block;
    let block_count = dispatcher.reserve(place, dispatcher.size.blocks().min(left))?;
    let mark = dispatcher.next_mark();
    let samples = (batch.sample_count() - first_block * BLOCK).min(block_count * BLOCK);
    let blocks = first_block..first_block + block_count;
    let inputs = pack(&batch.inputs, blocks, &dispatcher.input_units, dispatcher.precision);
    let buffers = &dispatcher.buffers[place];
    let copies = [(&buffers.outputs, dispatcher.output_bytes(block_count))];
    let dispatch = Dispatch { inputs: &inputs, ..dispatcher.dispatch(mark, samples as u32, &copies) };
    let submission = buffers.submit(&dispatcher.device, &dispatcher.solver, &dispatch);
    dispatcher.timings.upload += start.elapsed().as_secs_f64();
    Ok(InFlight { place, first_block, block_count, mark, submitted: Instant::now(), submission })
}

fn finish(
    dispatcher: &mut Dispatcher,
    batch: &Batch,
    flight: InFlight,
    solutions: &mut Solutions,
) -> Result<(), BackendError> {
    let start = Instant::now();
    let (mut waited, mut converted) = (0.0, 0.0);
    let (unwritten, busy) = (AtomicUsize::new(0), Busy::here());
    let block_len = solutions.values.block_len();
    let range = flight.first_block * block_len..(flight.first_block + flight.block_count) * block_len;
    let rows = &mut solutions.values.data_mut()[range];
    let conversion = dispatcher.conversion(batch, flight.mark);
    let bytes = dispatcher.precision.size() * block_len;
    let buffers = &dispatcher.buffers[flight.place];
    let time = buffers.finish(&dispatcher.device, &flight.submission, |outputs| {
        waited = start.elapsed().as_secs_f64();
        rows.par_chunks_mut(block_len).zip(outputs.par_chunks(bytes)).enumerate().for_each(|(at, (to, from))| {
            let _busy = busy.enter();
            let block = flight.first_block + at;
            let count = match dispatcher.precision {
                Precision::F32 => conversion.block::<f32>(block, bytemuck::cast_slice(from), to),
                Precision::F64 => conversion.block::<f64>(block, bytemuck::cast_slice(from), to),
            };
            unwritten.fetch_add(count, Ordering::Relaxed);
        });
        converted = start.elapsed().as_secs_f64() - waited;
    })?;
    let samples = (batch.sample_count() - flight.first_block * BLOCK).min(flight.block_count * BLOCK);
    let on_the_wall = start.duration_since(flight.submitted).as_secs_f64() + waited;
    let timings = &mut dispatcher.timings;
    dispatcher.size.learn(flight.block_count, timings.add(&time, on_the_wall, samples));
    timings.wait += waited;
    timings.unpack += converted;
    match unwritten.into_inner() {
        0 => Ok(()),
        count => Err(failed(format!(
            "{}: the kernel left {count} of {samples} samples unwritten",
            dispatcher.device.adapter().name
        ))),
    }
}
