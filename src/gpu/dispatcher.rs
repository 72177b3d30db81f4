//! Prepares and submits the dispatches of one plan on one device. Finds memory for them, and opens a lost device again.
//!
//! Kernels compute in the plan's units, with the base at the origin.

use super::conversion::{OutputConversion, output_units};
use super::device::{Device, failed, reason};
use super::dispatch_buffers::{Capacity, Dispatch, DispatchBuffers};
use super::dispatch_size::DispatchSize;
use super::pipelines::{SolvePipeline, TurnPipeline};
use super::self_test::expect_right;
use super::shader::{HANDOVER_COUNT, Kernel, Settings, WORKGROUP_SIZE, input_units};
use super::timings::Timings;
use crate::backend::{BackendError, Precision};
use crate::model::{BLOCK, Batch, ColumnNoise, Plan};
use std::time::Instant;

/// Dispatches in flight: the device computes one while the host converts the other.
pub(super) const DISPATCHES_IN_FLIGHT: usize = 2;

/// Distance of two marks; above every status code.
const MARK_STEP: u32 = 16;

/// Marks before the first comes back; all exact in f32.
const MARK_COUNT: u32 = 4096;

/// One device, prepared for one plan.
pub(super) struct Dispatcher {
    pub device: Device,
    pub plan: Plan,
    pub precision: Precision,
    kernel: Kernel,
    pub solver: SolvePipeline,
    /// Made when first needed.
    pub nodes: Option<TurnPipeline>,
    /// The device does not take that kernel.
    pub refuses_nodes: bool,
    /// Buffers of the dispatches in flight.
    pub buffers: Vec<DispatchBuffers>,
    pub size: DispatchSize,
    mark: u32,
    pub input_units: Vec<f64>,
    pub output_units: Vec<f64>,
    column_noise: Option<ColumnNoise>,
    pub timings: Timings,
    was_reopened: bool,
    notes: Vec<String>,
    /// Place of the note on memory that did not suffice.
    shortage: Option<usize>,
}

impl Dispatcher {
    /// Compiles the kernel; dispatches have at most `block_limit` blocks.
    pub fn new(device: Device, plan: &Plan, kernel: &Kernel, block_limit: usize) -> Result<Self, BackendError> {
        let start = Instant::now();
        let solver = SolvePipeline::new(&device, plan, kernel)?;
        let compile = start.elapsed().as_secs_f64();
        let kind = device.adapter().kind;
        let mut dispatcher = Self {
            timings: Timings { open: device.open_seconds, compile, ..Timings::default() },
            device,
            plan: plan.clone(),
            precision: kernel.precision,
            kernel: kernel.clone(),
            solver,
            nodes: None,
            refuses_nodes: false,
            buffers: Vec::new(),
            size: DispatchSize::new(block_limit, kind),
            mark: 0,
            input_units: input_units(plan),
            output_units: output_units(plan),
            column_noise: ColumnNoise::new(plan, kernel.precision.epsilon()),
            was_reopened: false,
            notes: Vec::new(),
            shortage: None,
        };
        dispatcher.warm_up()?;
        Ok(dispatcher)
    }

    /// Name of the function that solves.
    pub fn entry_point(&self) -> &'static str {
        self.kernel.entry_point
    }

    /// Solves by short kernels, or by one.
    pub fn set_stages(&mut self, in_stages: bool) -> Result<(), BackendError> {
        // Bind groups are those of the kernels.
        self.buffers.clear();
        self.solver.set_stages(&self.device, &self.kernel, in_stages)
    }

    /// Dispatches no samples, so that the driver compiles now. A kernel that takes turns has no buffers yet.
    fn warm_up(&mut self) -> Result<(), BackendError> {
        if self.kernel.takes_turns() {
            self.store_pipelines();
            return Ok(());
        }
        let start = Instant::now();
        self.reserve(0, 1)?;
        let buffers = &self.buffers[0];
        let copies = [(&buffers.outputs, self.output_bytes(1))];
        let submission = buffers.submit(&self.device, &self.solver, &self.dispatch(0.0, 0, &copies));
        buffers.finish(&self.device, &submission, |_| {})?;
        self.timings.first_dispatch = start.elapsed().as_secs_f64();
        self.store_pipelines();
        Ok(())
    }

    /// Keeps what the driver has compiled for later runs.
    pub fn store_pipelines(&self) {
        self.device.cache.iter().for_each(|cache| cache.store());
    }

    /// A dispatch of samples whose inputs the device has; no other kernel runs before or after.
    pub fn dispatch<'a>(&self, mark: f64, sample_count: u32, copies: &'a [(&'a wgpu::Buffer, u64)]) -> Dispatch<'a> {
        let of_plan = Settings::of(&self.plan, self.precision);
        let settings = Settings { mark, sample_count, ..of_plan };
        Dispatch { settings, inputs: &[], before: None, after: None, copies }
    }

    /// What the next dispatch adds to each status. A status without it was not written by that dispatch.
    pub fn next_mark(&mut self) -> f64 {
        self.mark = self.mark % MARK_COUNT + 1;
        f64::from(self.mark * MARK_STEP)
    }

    /// Of so many blocks.
    pub fn output_bytes(&self, block_count: usize) -> u64 {
        (self.precision.size() * BLOCK * self.output_units.len() * block_count) as u64
    }

    /// Of a dispatch of so many blocks.
    pub fn capacity(&self, block_count: usize) -> Capacity {
        let inputs = (self.precision.size() * BLOCK * self.input_units.len() * block_count) as u64;
        let outputs = self.output_bytes(block_count);
        Capacity { samples: (BLOCK * block_count) as u64, inputs, outputs, staging: outputs }
    }

    /// How the outputs of a dispatch become solutions of a batch.
    pub fn conversion<'a>(&'a self, batch: &'a Batch, mark: f64) -> OutputConversion<'a> {
        let column_noise = self.column_noise.as_ref();
        OutputConversion { plan: &self.plan, batch, units: &self.output_units, column_noise, mark }
    }

    /// Makes sure that these buffers exist and hold so many blocks, or fewer where memory does not suffice. Returns how
    /// many.
    pub fn reserve(&mut self, place: usize, mut block_count: usize) -> Result<usize, BackendError> {
        let made = loop {
            let outputs = self.output_bytes(block_count);
            if self.buffers.get(place).is_some_and(|held| held.capacity.outputs >= outputs) {
                return Ok(block_count);
            }
            match DispatchBuffers::new(&self.device, &self.solver, self.capacity(block_count)) {
                Err(error @ BackendError::OutOfMemory { .. }) => {
                    if !self.size.halve(block_count) {
                        return Err(error);
                    }
                    block_count /= 2;
                    self.note_shortage(&error, block_count);
                }
                made => break made?,
            }
        };
        match self.buffers.get_mut(place) {
            Some(old) => *old = made,
            None => self.buffers.push(made),
        }
        Ok(block_count)
    }

    /// Opens a lost device again, once. Any other error is returned. What was under way must be solved anew.
    pub fn reopen(&mut self, error: BackendError) -> Result<(), BackendError> {
        if self.was_reopened || !self.device.is_lost() {
            return Err(error);
        }
        self.was_reopened = true;
        // Says why, whatever the loss looked like where it was noticed.
        let loss = reason(&self.device.check().err().unwrap_or(error));
        let again = |error: BackendError| failed(format!("{loss}; then, opening it again, {}", reason(&error)));
        self.try_reopening().map_err(again)?;
        // Systems reset a device that is busy for too long or short of memory.
        self.size.ease();
        self.notes.push(format!("{loss}; it was opened again, and solved anew in smaller dispatches"));
        Ok(())
    }

    fn try_reopening(&mut self) -> Result<(), BackendError> {
        let device = self.device.reopen()?;
        expect_right(&device)?;
        let in_stages = self.solver.is_in_stages();
        self.buffers.clear();
        self.nodes = None;
        self.solver = SolvePipeline::new(&device, &self.plan, &self.kernel)?;
        self.solver.set_stages(&device, &self.kernel, in_stages)?;
        self.device = device;
        self.warm_up()
    }

    /// One note for all shortages.
    pub fn note_shortage(&mut self, error: &BackendError, block_count: usize) {
        let BackendError::OutOfMemory { reason } = error else { return };
        let name = &self.device.adapter().name;
        let samples = BLOCK * block_count;
        let note = format!("{name} has too little memory ({reason}); going on with {samples} samples a dispatch");
        match &mut self.shortage {
            Some(at) if *at < self.notes.len() => self.notes[*at] = note,
            _ => {
                self.shortage = Some(self.notes.len());
                self.notes.push(note);
            }
        }
    }

    /// The device does not take the kernel by nodes.
    pub fn refuse_nodes(&mut self, error: &BackendError) {
        self.refuses_nodes = true;
        let name = &self.device.adapter().name;
        self.notes.push(format!("{name} does not solve limp and taut rods: {}", reason(error)));
    }

    /// Samples for nodes that the device has no room for.
    pub fn note_too_long(&mut self, samples: usize) {
        let name = &self.device.adapter().name;
        self.notes.push(format!("{name} has no room for the nodes of {samples} limp or taut rods"));
    }

    /// What users should know, each note once.
    pub fn take_notes(&mut self) -> Vec<String> {
        self.shortage = None;
        std::mem::take(&mut self.notes)
    }
}

/// Blocks of one dispatch that the device's limits allow, and outputs of `budget` (bytes).
pub(super) fn block_limit(device: &Device, plan: &Plan, precision: Precision, budget: u64) -> usize {
    let limits = device.adapter();
    let columns = plan.output_count().max(plan.input_count);
    let block_bytes = |columns: usize| (precision.size() * BLOCK * columns) as u64;
    let largest = limits.max_storage_binding_size.min(limits.max_buffer_size / 2);
    let by_size = (budget / block_bytes(columns)).min(largest / block_bytes(columns.max(HANDOVER_COUNT)));
    let by_workgroups = u64::from(limits.max_workgroups) * u64::from(WORKGROUP_SIZE) / BLOCK as u64;
    by_size.min(by_workgroups).max(1) as usize
}
