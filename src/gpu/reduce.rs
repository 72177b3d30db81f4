//! A sweep without rows: samples are made, solved and counted in voxels on the device.
//!
//! A sample comes back where the host wants it, where it failed or is doubtful, where it lies beyond what the host has
//! seen so far, and where round-off may decide on its voxel. So the device needs neither extremes nor sums.

use super::buffers::{ALL_PATHS, Flight, QUICK_PATHS, Step, read_back};
use super::cache::Cache;
use super::counter::{Counter, Place, dispatch_limit, generator, pilot_tips};
use super::device::failed;
use super::engine::{Gpu, SLOTS};
use super::pace::Pace;
use super::recipe::Generator;
use super::returned::{returned, samples};
use super::tally::{Bounds, HEADER, Request, VoxelGrid};
use crate::backend::{BackendError, Precision, ReduceJob, Reduced, Returned};
use crate::model::BLOCK;
use bytemuck::pod_collect_to_vec;
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
    bounds: Bounds,
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
    let counter = match Counter::new(gpu, job.voxel, &generator, grid) {
        Err(BackendError::OutOfMemory { reason }) => {
            return Ok(Reduced::Declined(format!("the device has no memory for the counts ({reason})")));
        }
        counter => counter?,
    };
    let limit = dispatch_limit(gpu);
    let mut run = Run {
        gpu,
        job,
        generator,
        counter,
        left: job.ranges.iter().filter(|range| !range.is_empty()).cloned().collect(),
        flying: VecDeque::new(),
        next: 0,
        places: Vec::new(),
        pace: Pace::new(limit),
        bounds: Bounds::none(),
        recent: usize::MAX,
        voxels: HashMap::new(),
        unread: 0,
        on_device: Vec::new(),
        stragglers: Vec::new(),
    };
    run.all(give)?;
    run.gpu.device.cache.iter().for_each(Cache::store);
    Ok(Reduced::Voxels(run.voxels))
}

/// A run under way.
struct Run<'a> {
    gpu: &'a mut Gpu,
    job: &'a ReduceJob<'a>,
    generator: Generator,
    counter: Counter,
    /// Samples that are still to be solved.
    left: VecDeque<Range<u64>>,
    flying: VecDeque<Flying>,
    /// The place of the next dispatch.
    next: usize,
    places: Vec<Place>,
    pace: Pace,
    bounds: Bounds,
    /// Rows that came back from the last dispatch beside those wanted.
    recent: usize,
    voxels: HashMap<[i32; 3], u32>,
    /// Samples counted since counts were read.
    unread: u64,
    /// Their dispatches: samples, and the bounds within which they were counted.
    on_device: Vec<(Range<u64>, Bounds)>,
    /// Samples left for a dispatch of their own.
    stragglers: Vec<u64>,
}

impl Run<'_> {
    fn all(&mut self, give: &mut dyn FnMut(Returned) -> bool) -> Result<(), BackendError> {
        loop {
            match self.advance(give) {
                Ok(true) => {}
                Ok(false) => return Ok(()),
                Err(error) => self.recover(error)?,
            }
        }
    }

    /// One dispatch more, or what came of one; false at the end.
    fn advance(&mut self, give: &mut dyn FnMut(Returned) -> bool) -> Result<bool, BackendError> {
        let is_full = self.flying.len() == SLOTS || self.unread >= FLUSH;
        match self.left.front().cloned() {
            Some(range) if !is_full => {
                let (samples, bounds) = (self.reserve(self.next, range.end - range.start)?, self.bounds);
                let end = range.start + samples;
                let piece = self.submit(self.next, range.start..end, bounds)?;
                match self.left.front_mut() {
                    Some(range) if range.end > end => range.start = end,
                    _ => drop(self.left.pop_front()),
                }
                self.flying.push_back(piece);
                self.next = (self.next + 1) % SLOTS;
                return Ok(true);
            }
            _ => {}
        }
        let goes_on = match self.flying.pop_front() {
            Some(piece) => {
                let returned = self.finish_or_keep(piece)?;
                give(returned) && (self.stragglers.len() < STRAGGLERS || give(self.finish_stragglers()?))
            }
            None if self.left.is_empty() => {
                if !self.stragglers.is_empty() {
                    give(self.finish_stragglers()?);
                }
                return self.read_voxels().map(|()| false);
            }
            None => self.read_voxels().map(|()| true)?,
        };
        if !goes_on {
            // Nothing may be in flight while counts are read.
            while let Some(piece) = self.flying.pop_front() {
                self.finish(&piece)?;
            }
            self.read_voxels()?;
        }
        Ok(goes_on)
    }

    /// After a loss: another device; what only the lost one had counted is counted again, within the bounds of then, so
    /// that the same samples are counted and no row comes back twice.
    fn recover(&mut self, error: BackendError) -> Result<(), BackendError> {
        self.gpu.reopen(error)?;
        self.places.clear();
        self.pace.ease();
        for piece in self.flying.drain(..).rev() {
            self.left.push_front(piece.range);
        }
        self.counter = Counter::new(self.gpu, self.job.voxel, &self.generator, self.counter.grid)?;
        let stragglers = std::mem::take(&mut self.stragglers);
        self.unread = 0;
        for (range, bounds) in std::mem::take(&mut self.on_device) {
            let mut start = range.start;
            while start < range.end {
                let end = start + self.reserve(0, range.end - start)?;
                let piece = self.submit(0, start..end, bounds)?;
                self.finish(&piece)?;
                start = end;
            }
        }
        self.stragglers = stragglers;
        Ok(())
    }

    fn finish_stragglers(&mut self) -> Result<Returned, BackendError> {
        let indices = std::mem::take(&mut self.stragglers);
        let batch = samples(self.gpu, self.job, &indices);
        match self.gpu.solve_stragglers(&batch) {
            Ok(solutions) => Ok(Returned { indices, batch, solutions, counted: [0; 2] }),
            Err(error) => {
                self.stragglers = indices;
                Err(error)
            }
        }
    }

    /// Buffers for the next of so many samples, as many as pace and memory allow. Returns how many.
    fn reserve(&mut self, place: usize, sample_count: u64) -> Result<u64, BackendError> {
        loop {
            let blocks = (self.pace.blocks() as u64).min(sample_count.div_ceil(BLOCK as u64)) as usize;
            let samples = (blocks * BLOCK) as u64;
            if self.places.get(place).is_some_and(|held| held.slot.capacity.samples >= samples) {
                return Ok(samples.min(sample_count));
            }
            let asked = self.pace.blocks();
            match (self.counter.place(self.gpu, asked), self.places.get_mut(place)) {
                (Err(error @ BackendError::OutOfMemory { .. }), _) if self.pace.halve(asked) => {
                    self.gpu.note_shortage(&error, self.pace.blocks());
                }
                (made, Some(old)) => *old = made?,
                (made, None) => self.places.push(made?),
            }
        }
    }

    fn submit(&mut self, place: usize, range: Range<u64>, bounds: Bounds) -> Result<Flying, BackendError> {
        let start = Instant::now();
        let sample_count = (range.end - range.start) as usize;
        let block_count = sample_count.div_ceil(BLOCK);
        let mark = self.gpu.next_mark();
        let (gpu, counter, held) = (&*self.gpu, &self.counter, &self.places[place]);
        let wanted: Vec<u32> =
            (self.job.wanted)(range.clone()).iter().map(|index| (index - range.start) as u32).collect();
        let expected = wanted.len().saturating_add(self.recent.saturating_mul(2)).min(sample_count);
        let expected = expected.div_ceil(BLOCK).clamp(1, block_count) * BLOCK;
        let wanted_at = HEADER + held.slot.capacity.samples as usize;
        let request = Request {
            mark,
            bounds,
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
        Ok(Flying { place, range, expected, bounds, mark, submitted: Instant::now(), flight })
    }

    fn finish_or_keep(&mut self, piece: Flying) -> Result<Returned, BackendError> {
        let finished = self.finish(&piece);
        if finished.is_err() {
            self.flying.push_front(piece);
        }
        finished
    }

    fn finish(&mut self, piece: &Flying) -> Result<Returned, BackendError> {
        let start = Instant::now();
        let (gpu, held) = (&*self.gpu, &self.places[piece.place]);
        let sample_count = (piece.range.end - piece.range.start) as usize;
        let (mut header, mut list, mut rows, mut waited) = ([0u32; HEADER], Vec::new(), Vec::new(), 0.0);
        let spent = held.slot.finish(&gpu.device, &piece.flight, |bytes| {
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
        let of = (&piece.range, piece.mark);
        let given = match gpu.precision {
            Precision::F32 => returned::<f32>(gpu, self.job, of, (&list, &pod_collect_to_vec(&rows)), bounds, left)?,
            Precision::F64 => returned::<f64>(gpu, self.job, of, (&list, &pod_collect_to_vec(&rows)), bounds, left)?,
        };
        let counted = (sample_count - count) as u64;
        let Some(direct) = counted.checked_sub(ramped) else {
            return Err(failed(format!("{}: {ramped} of {counted} samples ramped", gpu.device.adapter().name)));
        };
        let wanted = (self.job.wanted)(piece.range.clone()).len();
        self.recent = count.saturating_sub(wanted);
        self.unread += sample_count as u64;
        self.on_device.push((piece.range.clone(), piece.bounds));
        let on_the_wall = start.duration_since(piece.submitted).as_secs_f64() + waited;
        let timings = &mut self.gpu.timings;
        timings.wait += waited;
        timings.unpack += unpack.elapsed().as_secs_f64();
        self.pace.learn(sample_count.div_ceil(BLOCK), timings.add(spent, on_the_wall, sample_count));
        Ok(Returned { counted: [direct, ramped], ..given })
    }

    /// Takes the counts off the device.
    fn read_voxels(&mut self) -> Result<(), BackendError> {
        let mut read: HashMap<[i32; 3], u32> = HashMap::new();
        let (device, counter) = (&self.gpu.device, &self.counter);
        let bytes = 4 * counter.grid.cell_count();
        for from in (0..bytes).step_by(READ as usize) {
            read_back(device, &counter.voxels, from..bytes.min(from + READ), |counts| {
                let counts: &[u32] = bytemuck::cast_slice(counts);
                for (at, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
                    read.insert(counter.grid.voxel(from as usize / 4 + at), *count);
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
        encoder.clear_buffer(&counter.voxels, 0, None);
        device.queue.submit([encoder.finish()]);
        Ok(())
    }
}
