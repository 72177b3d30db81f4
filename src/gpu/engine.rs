//! The GPU engine: cuts a batch into dispatches, keeps two in flight, converts what comes back to SI.
//!
//! The kernel computes in the plan's units, with the base at the origin.

use super::buffers::{ALL_PATHS, Dispatch, Flight, GUARDED_PATH, Paths, QUICK_PATHS, Sizes, Slot};
use super::cache::Cache;
use super::device::{Device, failed};
use super::kernel::{KERNELS, Kernel, WORKGROUP_SIZE};
use super::pace::Pace;
use super::record::input_units;
use super::self_test::expect_right;
use super::slots::integrated;
use super::solver::Solver;
use super::terms::pass_limit;
use super::timings::Timings;
use super::unpack::{Unpack, output_units};
use crate::backend::{Backend, BackendError, BackendInfo, BackendKind, Precision, ReduceJob, Reduced, Returned};
use crate::model::path::newton_tolerance;
use crate::model::{BLOCK, Batch, Blocks, Plan, Solutions, Status};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Dispatches in flight: one computes while the other is unpacked.
pub(super) const SLOTS: usize = 2;

/// Outputs of one dispatch at most [bytes].
const OUTPUT_BUDGET: u64 = 64 << 20;

/// Full dispatches in a batch of the recommended size.
const DISPATCHES_PER_BATCH: usize = 4;

/// A path over the rod needs this many passes in all but the hardest cases.
const FEWEST_PASSES: f64 = 40.0;

/// Distance of two marks; above every status code.
const MARK_STEP: u32 = 16;

/// Marks before the first comes back; all exact in f32.
const MARK_COUNT: u32 = 4096;

/// The GPU engine for one plan.
pub struct Gpu {
    pub(super) device: Device,
    pub(super) plan: Plan,
    pub(super) precision: Precision,
    pub(super) kernel: Kernel,
    pub(super) solver: Solver,
    /// Whether sweeps without rows are counted on the device.
    counts: bool,
    pub(super) slots: Vec<Slot>,
    pub(super) pace: Pace,
    block_limit: usize,
    mark: u32,
    input_units: Vec<f64>,
    output_units: Vec<f64>,
    pub(super) timings: Timings,
    pub(super) was_reopened: bool,
    pub(super) notes: Vec<String>,
    /// The note on memory that did not suffice.
    pub(super) shortage: Option<usize>,
}

/// A dispatch in flight and the blocks it solves.
struct Piece {
    slot: usize,
    first_block: usize,
    block_count: usize,
    mark: f64,
    submitted: Instant,
    flight: Flight,
}

impl Gpu {
    /// Prepares the solving kernel for a plan, on a device that computes right. In f64 the adapter must have f64.
    pub fn new(device: Device, plan: &Plan, precision: Precision) -> Result<Self, BackendError> {
        if precision == Precision::F64 && !device.adapter().has_f64 {
            return Err(BackendError::Unsupported {
                backend: BackendKind::Gpu,
                what: format!("f64 on {}, which has none", device.adapter().name),
                remedy: "use `--precision f32`, or `--backend cpu` for f64".into(),
            });
        }
        if pass_limit(plan) < FEWEST_PASSES {
            return Err(BackendError::Unsupported {
                backend: BackendKind::Gpu,
                what: format!(
                    "as many as {} steps",
                    integrated(plan).iter().map(|segment| segment.steps).sum::<usize>()
                ),
                remedy: "take fewer steps of a higher order (`--stepper dop853`), or use `--backend cpu`".into(),
            });
        }
        let kernel = Kernel::new(&KERNELS[0], plan, precision).map_err(failed)?;
        expect_right(&device)?;
        Self::with_kernel(device, plan, &kernel)
    }

    /// Prepares a kernel for a plan. It must call `store_status` for every sample.
    pub fn with_kernel(device: Device, plan: &Plan, kernel: &Kernel) -> Result<Self, BackendError> {
        let start = Instant::now();
        let solver = Solver::new(&device, plan, kernel)?;
        let compile = start.elapsed().as_secs_f64();
        let precision = kernel.precision;
        let block_limit = block_limit(&device, plan, precision);
        let counts = !device.adapter().is_software();
        let mut gpu = Self {
            timings: Timings { open: device.open_seconds, compile, ..Timings::default() },
            device,
            plan: plan.clone(),
            precision,
            kernel: kernel.clone(),
            counts,
            solver,
            slots: Vec::new(),
            pace: Pace::new(block_limit),
            block_limit,
            mark: 0,
            input_units: input_units(plan),
            output_units: output_units(plan),
            was_reopened: false,
            notes: Vec::new(),
            shortage: None,
        };
        gpu.warm_up()?;
        Ok(gpu)
    }

    /// The same engine with samples that need the guarded ramp solved in dispatches of their own, or among others.
    pub fn with_stages(mut self, in_stages: bool) -> Self {
        self.solver.in_stages = in_stages && self.plan.start.is_none();
        self
    }

    /// The same engine with the tips of sweeps without rows counted on the device, or by the host.
    pub fn with_counting(mut self, counts: bool) -> Self {
        self.counts = counts;
        self
    }

    pub fn device(&self) -> &Device {
        &self.device
    }

    pub fn timings(&self) -> &Timings {
        &self.timings
    }

    /// Dispatches no samples, so that the driver compiles now.
    pub(super) fn warm_up(&mut self) -> Result<(), BackendError> {
        let start = Instant::now();
        self.reserve(0, 1)?;
        let slot = &self.slots[0];
        let copies = [(&slot.outputs, self.output_bytes(1))];
        let flight = slot.submit(&self.device, &self.solver, &self.dispatch(0.0, ALL_PATHS, 0, &copies));
        slot.finish(&self.device, &flight, |_| {})?;
        self.timings.first_dispatch = start.elapsed().as_secs_f64();
        self.device.cache.iter().for_each(Cache::store);
        Ok(())
    }

    /// A dispatch of samples whose inputs are there, by itself.
    pub(super) fn dispatch<'a>(
        &self,
        mark: f64,
        paths: Paths,
        sample_count: u32,
        copies: &'a [(&'a wgpu::Buffer, u64)],
    ) -> Dispatch<'a> {
        let tolerance = newton_tolerance(self.plan.options.tolerance, self.precision.epsilon());
        Dispatch { mark, tolerance, paths, sample_count, inputs: &[], before: None, after: None, copies }
    }

    /// What the next dispatch adds to each status.
    pub(super) fn next_mark(&mut self) -> f64 {
        self.mark = self.mark % MARK_COUNT + 1;
        f64::from(self.mark * MARK_STEP)
    }

    pub(super) fn output_bytes(&self, block_count: usize) -> u64 {
        (self.precision.size() * BLOCK * self.output_units.len() * block_count) as u64
    }

    /// Of a slot of so many blocks.
    pub(super) fn sizes(&self, block_count: usize) -> Sizes {
        let inputs = (self.precision.size() * BLOCK * self.input_units.len() * block_count) as u64;
        let outputs = self.output_bytes(block_count);
        Sizes { samples: (BLOCK * block_count) as u64, inputs, outputs, staging: outputs }
    }

    fn submit(&mut self, batch: &Batch, paths: Paths, slot: usize, first_block: usize) -> Result<Piece, BackendError> {
        let start = Instant::now();
        let left = batch.sample_count().div_ceil(BLOCK) - first_block;
        let block_count = self.reserve(slot, self.pace.blocks().min(left))?;
        let mark = self.next_mark();
        let samples = (batch.sample_count() - first_block * BLOCK).min(block_count * BLOCK);
        let inputs = self.pack(batch, first_block, block_count);
        let held = &self.slots[slot];
        let copies = [(&held.outputs, self.output_bytes(block_count))];
        let dispatch = Dispatch { inputs: &inputs, ..self.dispatch(mark, paths, samples as u32, &copies) };
        let flight = held.submit(&self.device, &self.solver, &dispatch);
        self.timings.upload += start.elapsed().as_secs_f64();
        Ok(Piece { slot, first_block, block_count, mark, submitted: Instant::now(), flight })
    }

    /// Inputs of some blocks in the plan's units.
    fn pack(&self, batch: &Batch, first_block: usize, block_count: usize) -> Vec<u8> {
        let block_len = batch.inputs.block_len();
        let values = &batch.inputs.data()[first_block * block_len..(first_block + block_count) * block_len];
        let size = self.precision.size();
        let mut packed = vec![0; size * values.len()];
        packed.par_chunks_mut(size * BLOCK).zip(values.par_chunks(BLOCK)).enumerate().for_each(|(at, (to, from))| {
            let unit = self.input_units[at % self.input_units.len()];
            for (to, from) in to.chunks_exact_mut(size).zip(from) {
                match self.precision {
                    Precision::F32 => to.copy_from_slice(&((from / unit) as f32).to_ne_bytes()),
                    Precision::F64 => to.copy_from_slice(&(from / unit).to_ne_bytes()),
                }
            }
        });
        packed
    }

    pub(super) fn unpack<'a>(&'a self, batch: &'a Batch, mark: f64) -> Unpack<'a> {
        Unpack { plan: &self.plan, batch, units: &self.output_units, mark, in_stages: self.solver.in_stages }
    }

    fn finish(&mut self, batch: &Batch, piece: Piece, solutions: &mut Solutions) -> Result<(), BackendError> {
        let start = Instant::now();
        let (mut waited, mut unpacked) = (0.0, 0.0);
        let unwritten = AtomicUsize::new(0);
        let block_len = solutions.values.block_len();
        let range = piece.first_block * block_len..(piece.first_block + piece.block_count) * block_len;
        let rows = &mut solutions.values.data_mut()[range];
        let unpack = self.unpack(batch, piece.mark);
        let spent = self.slots[piece.slot].finish(&self.device, &piece.flight, |outputs| {
            waited = start.elapsed().as_secs_f64();
            let bytes = self.precision.size() * block_len;
            rows.par_chunks_mut(block_len).zip(outputs.par_chunks(bytes)).enumerate().for_each(|(at, (to, from))| {
                let block = piece.first_block + at;
                let count = match self.precision {
                    Precision::F32 => unpack.block::<f32>(block, bytemuck::cast_slice(from), to),
                    Precision::F64 => unpack.block::<f64>(block, bytemuck::cast_slice(from), to),
                };
                unwritten.fetch_add(count, Ordering::Relaxed);
            });
            unpacked = start.elapsed().as_secs_f64() - waited;
        })?;
        let samples = (batch.sample_count() - piece.first_block * BLOCK).min(piece.block_count * BLOCK);
        let on_the_wall = start.duration_since(piece.submitted).as_secs_f64() + waited;
        self.pace.learn(piece.block_count, self.timings.add(spent, on_the_wall, samples));
        self.timings.wait += waited;
        self.timings.unpack += unpacked;
        match unwritten.into_inner() {
            0 => Ok(()),
            count => Err(failed(format!(
                "{}: the kernel left {count} of {samples} samples unwritten",
                self.device.adapter().name
            ))),
        }
    }

    fn solve_pieces(&mut self, batch: &Batch, paths: Paths) -> Result<Solutions, BackendError> {
        let mut solutions = Solutions::new(&self.plan, batch.sample_count());
        let block_count = batch.sample_count().div_ceil(BLOCK);
        let (mut next_block, mut next_slot) = (0, 0);
        let mut flying = VecDeque::new();
        loop {
            if next_block < block_count && flying.len() < SLOTS {
                let piece = self.submit(batch, paths, next_slot, next_block)?;
                next_block += piece.block_count;
                next_slot = (next_slot + 1) % SLOTS;
                flying.push_back(piece);
            } else if let Some(piece) = flying.pop_front() {
                self.finish(batch, piece, &mut solutions)?;
            } else {
                return Ok(solutions);
            }
        }
    }

    /// Solves samples that need the guarded ramp, or fail, together: alone among others each would hold up its
    /// neighbours.
    pub(super) fn solve_stragglers(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        let solved = self.solve_pieces(batch, GUARDED_PATH);
        if solved.is_err() {
            self.slots.clear();
        }
        solved
    }

    fn attempt(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        let solved = self.device.check().and_then(|()| self.solve_in_stages(batch));
        if solved.is_err() {
            // Buffers may still be in flight or mapped.
            self.slots.clear();
        }
        solved
    }

    fn solve_in_stages(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        if !self.solver.in_stages {
            return self.solve_pieces(batch, ALL_PATHS);
        }
        let mut solutions = self.solve_pieces(batch, QUICK_PATHS)?;
        let is_left = |sample: &usize| solutions.status(*sample) == Status::Pending;
        let left: Vec<usize> = (0..batch.sample_count()).filter(is_left).collect();
        if !left.is_empty() {
            let again = self.solve_stragglers(&gathered(batch, &left))?;
            left.iter().enumerate().for_each(|(from, to)| solutions.copy_row(*to, &again, from));
        }
        Ok(solutions)
    }
}

/// Some samples of a batch.
fn gathered(batch: &Batch, samples: &[usize]) -> Batch {
    let mut inputs = Blocks::new(batch.inputs.column_count(), samples.len());
    for (to, from) in samples.iter().enumerate() {
        (0..inputs.column_count()).for_each(|column| inputs.set(to, column, batch.inputs.get(*from, column)));
    }
    Batch { inputs, bad: samples.iter().map(|sample| batch.bad[*sample]).collect() }
}

impl Backend for Gpu {
    fn info(&self) -> BackendInfo {
        let adapter = self.device.adapter();
        BackendInfo {
            kind: BackendKind::Gpu,
            precision: self.precision,
            device: format!("{}, {}", adapter.name, adapter.kind),
            driver: format!("{} {}", adapter.api, adapter.driver),
        }
    }

    fn plan(&self) -> &Plan {
        &self.plan
    }

    fn batch_size(&self) -> usize {
        DISPATCHES_PER_BATCH * self.block_limit * BLOCK
    }

    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        self.attempt(batch).or_else(|error| {
            self.reopen(error)?;
            self.attempt(batch)
        })
    }

    fn reduce(
        &mut self,
        job: &ReduceJob,
        give: &mut dyn FnMut(Returned) -> bool,
    ) -> Result<Option<Reduced>, BackendError> {
        if !self.counts {
            let reason = "a software adapter counts no faster than the host";
            return Ok(Some(Reduced::Declined(reason.into())));
        }
        super::reduce::reduce(self, job, give).map(Some)
    }

    fn take_notes(&mut self) -> Vec<String> {
        self.shortage = None;
        std::mem::take(&mut self.notes)
    }

    fn timings(&self) -> Vec<(&'static str, f64)> {
        self.timings.named()
    }
}

/// Blocks of one dispatch that the device's limits and our budget allow.
fn block_limit(device: &Device, plan: &Plan, precision: Precision) -> usize {
    let limits = device.adapter();
    let columns = plan.output_count().max(plan.input_count);
    let bytes = OUTPUT_BUDGET.min(limits.max_buffer_size / 2).min(limits.max_storage_binding_size);
    let by_size = bytes / (precision.size() * BLOCK * columns) as u64;
    let by_workgroups = u64::from(limits.max_workgroups) * u64::from(WORKGROUP_SIZE) / BLOCK as u64;
    by_size.min(by_workgroups).max(1) as usize
}
