//! A sweep without rows: samples are made, solved and counted in voxels on the device.
//!
//! The row of a sample comes back if the host asks for it, if the sample failed or is doubtful, if it lies beyond all
//! rows so far, or so near the side of a voxel that round-off decides. So the device needs neither extremes nor sums.

use super::device::failed;
use super::device_time::Stage;
use super::dispatch_buffers::{KernelPass, Submission, read_back};
use super::dispatch_size::DispatchSize;
use super::dispatcher::{DISPATCHES_IN_FLIGHT, Dispatcher, block_limit};
use super::node_batch::solve_grown;
use super::returned_rows::{ReturnedRows, picked};
use super::shader::{Bounds, Generator, HEADER, Request, VoxelGrid};
use super::voxel_kernels::{VoxelBuffers, VoxelKernels};
use super::voxel_pilot::{generator, pilot_tips};
use crate::backend::{BackendError, Precision, ReduceJob, Reduced, Returned};
use crate::model::{BLOCK, Status};
use bytemuck::pod_collect_to_vec;
use std::collections::{HashMap, VecDeque};
use std::ops::Range;
use std::time::Instant;

/// Outputs of one dispatch at most (bytes). The device holds as much again for the rows that come back.
const OUTPUT_BUDGET: u64 = 256 << 20;
/// Counts of all voxels at most (bytes).
const VOXEL_BUDGET: u64 = 512 << 20;
/// Samples after which counts are taken off the device, so that none overflows.
const MOST_UNREAD: u64 = 1 << 31;
/// Rows are given to the host so many at a time: second attempts take few samples no faster than many. Also after this time (s).
const MOST_HELD: usize = 1 << 17;
const HELD_FOR: f64 = 0.5;
/// Failed rows are given to the host so many at a time: a batch of them lasts as long as the hardest.
const MOST_FAILED: usize = 1 << 14;
/// Counts that are read back at once (bytes).
const READ_BYTES: u64 = 64 << 20;

/// A dispatch in flight.
struct InFlight {
    /// Place of its buffers.
    place: usize,
    range: Range<u64>,
    /// Rows that come back with it; a multiple of a block.
    expected: usize,
    /// Samples within these were counted.
    bounds: Bounds,
    mark: f64,
    submitted: Instant,
    submission: Submission,
}

/// Solves a sweep; see [`crate::backend::Backend::reduce`].
pub(super) fn run(
    dispatcher: &mut Dispatcher,
    job: &ReduceJob,
    give: &mut dyn FnMut(Returned) -> bool,
) -> Result<Reduced, BackendError> {
    let generator = match generator(&dispatcher.plan, job) {
        Ok(generator) => generator,
        Err(reason) => return Ok(Reduced::Declined(reason)),
    };
    let grid = VoxelGrid::around(&pilot_tips(dispatcher, job)?);
    let limits = dispatcher.device.adapter();
    let most = VOXEL_BUDGET.min(limits.max_storage_binding_size).min(limits.max_buffer_size);
    if grid.cell_count().saturating_mul(4) > most {
        let cells = grid.cell_count();
        return Ok(Reduced::Declined(format!("{cells} voxels take more than {} MiB", most >> 20)));
    }
    let kernels = match VoxelKernels::new(dispatcher, job.voxel, &generator, grid) {
        Err(BackendError::OutOfMemory { reason }) => {
            return Ok(Reduced::Declined(format!("the device has no memory for the counts ({reason})")));
        }
        kernels => kernels?,
    };
    let limit = block_limit(&dispatcher.device, &dispatcher.plan, dispatcher.precision, OUTPUT_BUDGET);
    let kind = dispatcher.device.adapter().kind;
    let mut sweep = VoxelSweep {
        dispatcher,
        job,
        generator,
        kernels,
        left: job.ranges.iter().filter(|range| !range.is_empty()).cloned().collect(),
        in_flight: VecDeque::new(),
        next_place: 0,
        buffers: Vec::new(),
        size: DispatchSize::new(limit, kind),
        bounds: Bounds::none(),
        last_unasked: usize::MAX,
        voxels: HashMap::new(),
        unread: 0,
        on_device: Vec::new(),
        held: Vec::new(),
        failed: Vec::new(),
        given: Instant::now(),
    };
    sweep.run(give)?;
    sweep.dispatcher.store_pipelines();
    Ok(Reduced::Voxels(sweep.voxels))
}

/// A sweep under way.
struct VoxelSweep<'a> {
    dispatcher: &'a mut Dispatcher,
    job: &'a ReduceJob<'a>,
    generator: Generator,
    kernels: VoxelKernels,
    /// Samples that are still to be solved.
    left: VecDeque<Range<u64>>,
    in_flight: VecDeque<InFlight>,
    /// Place of the next dispatch's buffers.
    next_place: usize,
    buffers: Vec<VoxelBuffers>,
    size: DispatchSize,
    /// Of the rows that came back so far.
    bounds: Bounds,
    /// Rows of the last dispatch that came back though the host had not asked for them.
    last_unasked: usize,
    voxels: HashMap<[i32; 3], u32>,
    /// Samples solved since counts were read.
    unread: u64,
    /// Their dispatches: samples, and the bounds within which they were counted.
    on_device: Vec<(Range<u64>, Bounds)>,
    /// What came back and is not yet given to the host.
    held: Vec<Returned>,
    /// Rows that have failed and are not yet given to the host.
    failed: Vec<Returned>,
    /// When something was given.
    given: Instant,
}

fn row_count(parts: &[Returned]) -> usize {
    parts.iter().map(|part| part.indices.len()).sum()
}

impl VoxelSweep<'_> {
    fn run(&mut self, give: &mut dyn FnMut(Returned) -> bool) -> Result<(), BackendError> {
        loop {
            match self.advance(give) {
                Ok(true) => {}
                Ok(false) => return Ok(()),
                Err(error) => self.recover(error)?,
            }
        }
    }

    /// Submits one more dispatch, or gives what came of one; false at the end.
    fn advance(&mut self, give: &mut dyn FnMut(Returned) -> bool) -> Result<bool, BackendError> {
        let is_full = self.in_flight.len() == DISPATCHES_IN_FLIGHT || self.unread >= MOST_UNREAD;
        match self.left.front().cloned() {
            Some(range) if !is_full => {
                let (samples, bounds) = (self.reserve(self.next_place, range.end - range.start)?, self.bounds);
                let end = range.start + samples;
                let submitted = self.submit(self.next_place, range.start..end, bounds)?;
                match self.left.front_mut() {
                    Some(range) if range.end > end => range.start = end,
                    _ => drop(self.left.pop_front()),
                }
                self.in_flight.push_back(submitted);
                self.next_place = (self.next_place + 1) % DISPATCHES_IN_FLIGHT;
                return Ok(true);
            }
            _ => {}
        }
        let goes_on = match self.in_flight.pop_front() {
            Some(flight) => {
                let returned = self.finish_or_keep(flight)?;
                self.held.push(returned);
                let is_due = row_count(&self.held) >= MOST_HELD || self.given.elapsed().as_secs_f64() > HELD_FOR;
                let goes_on = !is_due || give(self.take_held());
                goes_on && (row_count(&self.failed) < MOST_FAILED || give(self.take_failed()))
            }
            None if self.left.is_empty() => {
                give(self.take_held());
                give(self.take_failed());
                return self.read_voxels().map(|()| false);
            }
            None => self.read_voxels().map(|()| true)?,
        };
        if !goes_on {
            // Nothing may be in flight while counts are read.
            while let Some(flight) = self.in_flight.pop_front() {
                self.finish(&flight)?;
            }
            self.read_voxels()?;
        }
        Ok(goes_on)
    }

    /// After a loss: another device. It counts again what only the lost one had counted. The bounds are those of then,
    /// so that the same samples are counted and no row comes back twice.
    fn recover(&mut self, error: BackendError) -> Result<(), BackendError> {
        self.dispatcher.reopen(error)?;
        self.buffers.clear();
        self.size.ease();
        for flight in self.in_flight.drain(..).rev() {
            self.left.push_front(flight.range);
        }
        self.kernels = VoxelKernels::new(self.dispatcher, self.job.voxel, &self.generator, self.kernels.grid)?;
        self.unread = 0;
        for (range, bounds) in std::mem::take(&mut self.on_device) {
            let mut start = range.start;
            while start < range.end {
                let end = start + self.reserve(0, range.end - start)?;
                let flight = self.submit(0, start..end, bounds)?;
                self.finish(&flight)?;
                start = end;
            }
        }
        Ok(())
    }

    /// What came back since something was given, but for rows that have failed.
    fn take_held(&mut self) -> Returned {
        self.given = Instant::now();
        let (plan, held) = (&self.dispatcher.plan, std::mem::take(&mut self.held));
        let mut given = picked(plan, &held, Status::is_success);
        given.counted = held.iter().fold([0; 2], |sum, part| [sum[0] + part.counted[0], sum[1] + part.counted[1]]);
        self.failed.push(picked(plan, &held, |status| !status.is_success()));
        given
    }

    /// The rows that have failed.
    fn take_failed(&mut self) -> Returned {
        picked(&self.dispatcher.plan, &std::mem::take(&mut self.failed), |_| true)
    }

    /// Buffers for the next of so many samples, as many as time and memory allow. Returns how many.
    fn reserve(&mut self, place: usize, sample_count: u64) -> Result<u64, BackendError> {
        loop {
            let blocks = (self.size.blocks() as u64).min(sample_count.div_ceil(BLOCK as u64)) as usize;
            let samples = (blocks * BLOCK) as u64;
            if self.buffers.get(place).is_some_and(|held| held.solve.capacity.samples >= samples) {
                return Ok(samples.min(sample_count));
            }
            let asked = self.size.blocks();
            match (self.kernels.buffers(self.dispatcher, asked), self.buffers.get_mut(place)) {
                (Err(error @ BackendError::OutOfMemory { .. }), _) if self.size.halve(asked) => {
                    self.dispatcher.note_shortage(&error, self.size.blocks());
                }
                (made, Some(old)) => *old = made?,
                (made, None) => self.buffers.push(made?),
            }
        }
    }

    fn submit(&mut self, place: usize, range: Range<u64>, bounds: Bounds) -> Result<InFlight, BackendError> {
        let start = Instant::now();
        let sample_count = (range.end - range.start) as usize;
        let block_count = sample_count.div_ceil(BLOCK);
        let mark = self.dispatcher.next_mark();
        let (dispatcher, kernels, held) = (&*self.dispatcher, &self.kernels, &self.buffers[place]);
        let wanted: Vec<u32> =
            (self.job.wanted)(range.clone()).iter().map(|index| (index - range.start) as u32).collect();
        let expected = wanted.len().saturating_add(self.last_unasked.saturating_mul(2)).min(sample_count);
        let expected = expected.div_ceil(BLOCK).clamp(1, block_count) * BLOCK;
        let wanted_at = HEADER + held.solve.capacity.samples as usize;
        let request = Request {
            mark,
            bounds,
            cells: kernels.cells,
            base: kernels.base,
            grid: kernels.grid,
            sample_count: sample_count as u32,
            wanted_count: wanted.len() as u32,
            wanted_at: wanted_at as u32,
        };
        let queue = &dispatcher.device.queue;
        held.set_range(&dispatcher.device, range.start, sample_count);
        queue.write_buffer(&held.request, 0, &request.bytes(dispatcher.precision));
        queue.write_buffer(&held.tally, 0, bytemuck::bytes_of(&[0u32; HEADER]));
        if !wanted.is_empty() {
            queue.write_buffer(&held.tally, 4 * wanted_at as u64, bytemuck::cast_slice(&wanted));
        }
        let row_bytes = dispatcher.output_bytes(expected / BLOCK);
        let copies = [(&held.tally, 4 * (HEADER + expected) as u64), (&held.returned, row_bytes)];
        let mut dispatch = dispatcher.dispatch(mark, sample_count as u32, &copies);
        dispatch.before =
            Some(KernelPass { stage: Stage::Generate, pipeline: &kernels.generate, bind_group: &held.generate });
        dispatch.after = Some(KernelPass { stage: Stage::Reduce, pipeline: &kernels.reduce, bind_group: &held.reduce });
        let submission = held.solve.submit(&dispatcher.device, &dispatcher.solver, &dispatch);
        self.dispatcher.timings.upload += start.elapsed().as_secs_f64();
        Ok(InFlight { place, range, expected, bounds, mark, submitted: Instant::now(), submission })
    }

    fn finish_or_keep(&mut self, flight: InFlight) -> Result<Returned, BackendError> {
        let finished = self.finish(&flight);
        if finished.is_err() {
            self.in_flight.push_front(flight);
        }
        finished
    }

    fn finish(&mut self, flight: &InFlight) -> Result<Returned, BackendError> {
        let start = Instant::now();
        let (dispatcher, held) = (&*self.dispatcher, &self.buffers[flight.place]);
        let sample_count = (flight.range.end - flight.range.start) as usize;
        let (mut header, mut list, mut rows, mut waited) = ([0u32; HEADER], Vec::new(), Vec::new(), 0.0);
        let time = held.solve.finish(&dispatcher.device, &flight.submission, |bytes| {
            waited = start.elapsed().as_secs_f64();
            let (words, returned) = bytes.split_at(4 * (HEADER + flight.expected));
            let words: &[u32] = bytemuck::cast_slice(words);
            header.copy_from_slice(&words[..HEADER]);
            let count = header[0] as usize;
            if count <= flight.expected {
                list = words[HEADER..HEADER + count].to_vec();
                rows = returned[..dispatcher.output_bytes(count.div_ceil(BLOCK)) as usize].to_vec();
            }
        })?;
        let count = (header[0] as usize).min(sample_count);
        if count > flight.expected {
            let listed = 4 * HEADER as u64..4 * (HEADER + count) as u64;
            read_back(&dispatcher.device, &held.tally, listed, |bytes| list = bytemuck::cast_slice(bytes).to_vec())?;
            let bytes = dispatcher.output_bytes(count.div_ceil(BLOCK));
            read_back(&dispatcher.device, &held.returned, 0..bytes, |bytes| rows = bytes.to_vec())?;
        }
        let conversion = Instant::now();
        let returned = ReturnedRows { job: self.job, range: flight.range.clone(), mark: flight.mark, list: &list };
        let mut returned = match dispatcher.precision {
            Precision::F32 => returned.read::<f32>(dispatcher, &pod_collect_to_vec(&rows), &mut self.bounds)?,
            Precision::F64 => returned.read::<f64>(dispatcher, &pod_collect_to_vec(&rows), &mut self.bounds)?,
        };
        // Before anything is kept: whoever fails here is solved anew.
        solve_grown(self.dispatcher, &returned.batch, &mut returned.solutions)?;
        let (counted, ramped) = ((sample_count - count) as u64, u64::from(header[1]));
        let Some(direct) = counted.checked_sub(ramped) else {
            let name = &self.dispatcher.device.adapter().name;
            return Err(failed(format!("{name}: {ramped} of {counted} samples ramped")));
        };
        self.last_unasked = count.saturating_sub((self.job.wanted)(flight.range.clone()).len());
        self.unread += sample_count as u64;
        self.on_device.push((flight.range.clone(), flight.bounds));
        let on_the_wall = start.duration_since(flight.submitted).as_secs_f64() + waited;
        let timings = &mut self.dispatcher.timings;
        timings.wait += waited;
        timings.unpack += conversion.elapsed().as_secs_f64();
        self.size.learn(sample_count.div_ceil(BLOCK), timings.add(&time, on_the_wall, sample_count));
        returned.counted = [direct, ramped];
        Ok(returned)
    }

    /// Takes the counts off the device.
    fn read_voxels(&mut self) -> Result<(), BackendError> {
        let mut read: HashMap<[i32; 3], u32> = HashMap::new();
        let (device, kernels) = (&self.dispatcher.device, &self.kernels);
        let bytes = 4 * kernels.grid.cell_count();
        for from in (0..bytes).step_by(READ_BYTES as usize) {
            read_back(device, &kernels.voxels, from..bytes.min(from + READ_BYTES), |counts| {
                let counts: &[u32] = bytemuck::cast_slice(counts);
                for (at, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
                    read.insert(kernels.grid.voxel(from as usize / 4 + at), *count);
                }
            })?;
        }
        for (cell, more) in read {
            let count = self.voxels.entry(cell).or_default();
            *count = count.saturating_add(more);
        }
        self.unread = 0;
        self.on_device.clear();
        let mut encoder = device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.clear_buffer(&kernels.voxels, 0, None);
        device.queue.submit([encoder.finish()]);
        Ok(())
    }
}
