//! A sweep without rows: samples are made, solved and counted in voxels on the device.
//!
//! A sample comes back where the host wants it, where it failed or is doubtful, where it lies beyond what the host has
//! seen so far, and where round-off may decide on its voxel. So the device needs neither extremes nor sums.

use super::buffers::{ALL_PATHS, Flight, QUICK_PATHS, Step, read_back};
use super::counter::{Counter, Place, dispatch_limit, generator, pilot_tips};
use super::device::failed;
use super::engine::{Gpu, SLOTS};
use super::pace::Pace;
use super::tally::{Bounds, HEADER, Request, VoxelGrid};
use crate::backend::{BackendError, Precision, ReduceJob, Reduced, Returned};
use crate::model::{BLOCK, Batch, Quantity, Solutions, Status};
use bytemuck::Pod;
use rayon::prelude::*;
use std::collections::{HashMap, VecDeque};
use std::ops::Range;
use std::time::Instant;

/// Counts of all voxels at most [bytes].
const VOXEL_BUDGET: u64 = 512 << 20;
/// Samples after which counts are taken off the device, so that none overflows.
const FLUSH: u64 = 1 << 31;
/// Samples that need the guarded ramp are solved so many at a time: enough for every processor of a device.
const STRAGGLERS: usize = 1 << 14;
/// Counts that are read back at once [bytes].
const READ: u64 = 64 << 20;

/// A dispatch in flight.
struct Flying {
    place: usize,
    range: Range<u64>,
    /// Rows that come back with it; a multiple of a block.
    expected: usize,
    mark: f64,
    submitted: Instant,
    flight: Flight,
}

/// Solves a sweep; see [`crate::backend::Backend::reduce`].
pub(super) fn reduce(
    gpu: &mut Gpu,
    job: &ReduceJob,
    give: &mut dyn FnMut(Returned) -> bool,
) -> Result<Reduced, BackendError> {
    let generator = match generator(&gpu.plan, job) {
        Ok(generator) => generator,
        Err(reason) => return Ok(Reduced::Declined(reason)),
    };
    let grid = VoxelGrid::around(&pilot_tips(gpu, job)?);
    let limits = gpu.device.adapter();
    let most = VOXEL_BUDGET.min(limits.max_storage_binding_size).min(limits.max_buffer_size);
    if grid.cell_count().saturating_mul(4) > most {
        let cells = grid.cell_count();
        return Ok(Reduced::Declined(format!("{cells} voxels take more than {} MiB", most >> 20)));
    }
    let counter = Counter::new(gpu, job.voxel, &generator, grid)?;
    let limit = dispatch_limit(gpu);
    let mut run = Run {
        gpu,
        job,
        counter,
        places: Vec::new(),
        pace: Pace::new(limit),
        bounds: Bounds::none(),
        recent: usize::MAX,
        voxels: HashMap::new(),
        unread: 0,
        stragglers: Vec::new(),
    };
    run.all(give)?;
    Ok(Reduced::Voxels(run.voxels))
}

/// A run under way.
struct Run<'a> {
    gpu: &'a mut Gpu,
    job: &'a ReduceJob<'a>,
    counter: Counter,
    places: Vec<Place>,
    pace: Pace,
    bounds: Bounds,
    /// Rows that came back from the last dispatch beside those wanted.
    recent: usize,
    voxels: HashMap<[i32; 3], u32>,
    /// Samples counted since counts were read.
    unread: u64,
    /// Samples left for a dispatch of their own.
    stragglers: Vec<u64>,
}

impl Run<'_> {
    fn all(&mut self, give: &mut dyn FnMut(Returned) -> bool) -> Result<(), BackendError> {
        let mut left: VecDeque<Range<u64>> = self.job.ranges.iter().filter(|r| !r.is_empty()).cloned().collect();
        let mut flying: VecDeque<Flying> = VecDeque::new();
        let mut next = 0;
        loop {
            let is_full = flying.len() == SLOTS || self.unread >= FLUSH;
            match left.front_mut() {
                Some(range) if !is_full => {
                    let end = range.end.min(range.start + (self.pace.blocks() * BLOCK) as u64);
                    let piece = range.start..end;
                    range.start = end;
                    if range.is_empty() {
                        left.pop_front();
                    }
                    flying.push_back(self.submit(next, piece)?);
                    next = (next + 1) % SLOTS;
                }
                _ => {
                    let goes_on = match flying.pop_front() {
                        Some(piece) => {
                            let returned = self.finish(piece)?;
                            give(returned) && (self.stragglers.len() < STRAGGLERS || give(self.finish_stragglers()?))
                        }
                        None if left.is_empty() => {
                            if !self.stragglers.is_empty() {
                                give(self.finish_stragglers()?);
                            }
                            return self.read_voxels();
                        }
                        None => self.read_voxels().map(|()| true)?,
                    };
                    if !goes_on {
                        // Nothing may be in flight while counts are read.
                        for piece in flying {
                            self.finish(piece)?;
                        }
                        return self.read_voxels();
                    }
                }
            }
        }
    }

    fn finish_stragglers(&mut self) -> Result<Returned, BackendError> {
        let indices = std::mem::take(&mut self.stragglers);
        let batch = samples(self.gpu, self.job, &indices);
        let solutions = self.gpu.solve_stragglers(&batch)?;
        Ok(Returned { indices, batch, solutions, counted: [0; 2] })
    }

    fn submit(&mut self, place: usize, range: Range<u64>) -> Result<Flying, BackendError> {
        let start = Instant::now();
        let sample_count = (range.end - range.start) as usize;
        let block_count = sample_count.div_ceil(BLOCK);
        if self.places.get(place).is_none_or(|held| held.slot.capacity.samples < (block_count * BLOCK) as u64) {
            let made = self.counter.place(self.gpu, block_count.max(self.pace.blocks()))?;
            match self.places.get_mut(place) {
                Some(old) => *old = made,
                None => self.places.push(made),
            }
        }
        let mark = self.gpu.next_mark();
        let (gpu, counter, held) = (&*self.gpu, &self.counter, &self.places[place]);
        let wanted: Vec<u32> =
            (self.job.wanted)(range.clone()).iter().map(|index| (index - range.start) as u32).collect();
        let expected = wanted.len().saturating_add(self.recent.saturating_mul(2)).min(sample_count);
        let expected = expected.div_ceil(BLOCK).clamp(1, block_count) * BLOCK;
        let wanted_at = HEADER + held.slot.capacity.samples as usize;
        let request = Request {
            mark,
            bounds: self.bounds,
            cells: counter.cells,
            base: counter.base,
            grid: counter.grid,
            sample_count: sample_count as u32,
            wanted_count: wanted.len() as u32,
            wanted_at: wanted_at as u32,
        };
        let queue = &gpu.device.queue;
        held.set_range(&gpu.device, range.start, sample_count);
        queue.write_buffer(&held.request, 0, &request.bytes(gpu.precision));
        queue.write_buffer(&held.tally, 0, bytemuck::bytes_of(&[0u32; HEADER]));
        if !wanted.is_empty() {
            queue.write_buffer(&held.tally, 4 * wanted_at as u64, bytemuck::cast_slice(&wanted));
        }
        let copies =
            [(&held.tally, 4 * (HEADER + expected) as u64), (&held.returned, gpu.output_bytes(expected / BLOCK))];
        let paths = if gpu.solver.in_stages { QUICK_PATHS } else { ALL_PATHS };
        let mut dispatch = gpu.dispatch(mark, paths, sample_count as u32, &copies);
        dispatch.before = Some(Step { pipeline: &counter.generate, bind_group: &held.generate });
        dispatch.after = Some(Step { pipeline: &counter.reduce, bind_group: &held.reduce });
        let flight = held.slot.submit(&gpu.device, &gpu.solver, &dispatch);
        self.gpu.timings.upload += start.elapsed().as_secs_f64();
        Ok(Flying { place, range, expected, mark, submitted: Instant::now(), flight })
    }

    fn finish(&mut self, piece: Flying) -> Result<Returned, BackendError> {
        let start = Instant::now();
        let (gpu, held) = (&*self.gpu, &self.places[piece.place]);
        let sample_count = (piece.range.end - piece.range.start) as usize;
        let (mut header, mut list, mut rows, mut waited) = ([0u32; HEADER], Vec::new(), Vec::new(), 0.0);
        let seconds = held.slot.finish(&gpu.device, &piece.flight, |bytes| {
            waited = start.elapsed().as_secs_f64();
            let (words, returned) = bytes.split_at(4 * (HEADER + piece.expected));
            let words: &[u32] = bytemuck::cast_slice(words);
            header.copy_from_slice(&words[..HEADER]);
            let count = header[0] as usize;
            if count <= piece.expected {
                list = words[HEADER..HEADER + count].to_vec();
                rows = returned[..gpu.output_bytes(count.div_ceil(BLOCK)) as usize].to_vec();
            }
        })?;
        let count = (header[0] as usize).min(sample_count);
        if count > piece.expected {
            let listed = 4 * HEADER as u64..4 * (HEADER + count) as u64;
            read_back(&gpu.device, &held.tally, listed, |bytes| list = bytemuck::cast_slice(bytes).to_vec())?;
            let bytes = gpu.output_bytes(count.div_ceil(BLOCK));
            read_back(&gpu.device, &held.returned, 0..bytes, |bytes| rows = bytes.to_vec())?;
        }
        let unpack = Instant::now();
        let ramped = u64::from(header[1]);
        let (bounds, left) = (&mut self.bounds, &mut self.stragglers);
        let given = match gpu.precision {
            Precision::F32 => {
                returned::<f32>(gpu, self.job, &piece, (&list, bytemuck::cast_slice(&rows)), bounds, left)?
            }
            Precision::F64 => {
                returned::<f64>(gpu, self.job, &piece, (&list, bytemuck::cast_slice(&rows)), bounds, left)?
            }
        };
        let counted = (sample_count - count) as u64;
        let Some(direct) = counted.checked_sub(ramped) else {
            return Err(failed(format!("{}: {ramped} of {counted} samples ramped", gpu.device.adapter().name)));
        };
        let wanted = (self.job.wanted)(piece.range.clone()).len();
        self.recent = count.saturating_sub(wanted);
        self.unread += sample_count as u64;
        let seconds = seconds.unwrap_or(start.duration_since(piece.submitted).as_secs_f64() + waited);
        self.pace.learn(sample_count.div_ceil(BLOCK), seconds);
        let timings = &mut self.gpu.timings;
        timings.kernel += seconds;
        timings.wait += waited;
        timings.unpack += unpack.elapsed().as_secs_f64();
        timings.dispatch_count += 1;
        timings.sample_count += sample_count as u64;
        Ok(Returned { counted: [direct, ramped], ..given })
    }

    /// Takes the counts off the device.
    fn read_voxels(&mut self) -> Result<(), BackendError> {
        self.unread = 0;
        let (device, counter) = (&self.gpu.device, &self.counter);
        let bytes = 4 * counter.grid.cell_count();
        for from in (0..bytes).step_by(READ as usize) {
            read_back(device, &counter.voxels, from..bytes.min(from + READ), |counts| {
                let counts: &[u32] = bytemuck::cast_slice(counts);
                for (at, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
                    let cell = self.voxels.entry(counter.grid.voxel(from as usize / 4 + at)).or_default();
                    *cell = cell.saturating_add(*count);
                }
            })?;
        }
        let mut encoder = device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.clear_buffer(&counter.voxels, 0, None);
        device.queue.submit([encoder.finish()]);
        Ok(())
    }
}

/// A batch of samples by their index.
fn samples(gpu: &Gpu, job: &ReduceJob, indices: &[u64]) -> Batch {
    gpu.plan.batch(indices.len(), |at, row| {
        if let Some(index) = indices.get(at) {
            (job.values)(*index, row);
        }
    })
}

/// Rows that came back, in the order of their samples, less stragglers; takes their numbers into the bounds.
fn returned<S: Pod + Sync + Into<f64>>(
    gpu: &Gpu,
    job: &ReduceJob,
    piece: &Flying,
    (list, rows): (&[u32], &[S]),
    bounds: &mut Bounds,
    stragglers: &mut Vec<u64>,
) -> Result<Returned, BackendError> {
    let Flying { range, mark, .. } = piece;
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
    let unpack = gpu.unpack(&batch, *mark);
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
