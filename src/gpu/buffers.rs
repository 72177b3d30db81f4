//! The buffers of one dispatch in flight: settings, inputs and outputs on the device, a copy for the host.

use super::device::{Device, failed};
use super::kernel::WORKGROUP_SIZE;
use super::solver::Solver;
use crate::backend::{BackendError, Precision};
use crate::model::BLOCK;
use crate::model::path::chord_tolerance;
use std::mem::offset_of;
use std::ops::Range;
use std::sync::mpsc::{Receiver, channel};
use wgpu::BufferUsages as Usage;

/// The uniform that every kernel reads; `Settings` in `shaders/batch.wgsl`, with floats of the kernel's precision.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Settings<S> {
    /// Added to every status.
    pub mark: S,
    /// Newton's, in the plan's unit of moment.
    pub tolerance: S,
    /// Where chord steps end, in the same unit and over the stability margin.
    pub chord_tolerance: S,
    pub sample_count: u32,
    /// Always zero.
    pub zero: u32,
    /// Ways to the full load that are tried, see `shaders/path.wgsl`.
    pub first_path: u32,
    pub last_path: u32,
}

/// Ways to the full load, from the first to the last, as `shaders/path.wgsl` numbers them.
pub(super) type Paths = (u32, u32);
pub(super) const ALL_PATHS: Paths = (0, 1);
/// All but the guarded ramp, and that alone.
pub(super) const QUICK_PATHS: Paths = (0, 0);
pub(super) const GUARDED_PATH: Paths = (1, 1);

impl Settings<f64> {
    /// As the kernels of a precision read them.
    pub fn bytes(&self, precision: Precision) -> Vec<u8> {
        let floats = [self.mark, self.tolerance, self.chord_tolerance];
        let mut bytes = float_bytes(&floats, precision);
        bytes.extend_from_slice(bytemuck::bytes_of(&[self.sample_count, self.zero, self.first_path, self.last_path]));
        bytes
    }
}

/// Numbers as the kernels of a precision read them.
pub(super) fn float_bytes(values: &[f64], precision: Precision) -> Vec<u8> {
    match precision {
        Precision::F32 => bytemuck::cast_slice(&values.iter().map(|x| *x as f32).collect::<Vec<_>>()).to_vec(),
        Precision::F64 => bytemuck::cast_slice(values).to_vec(),
    }
}

macro_rules! offsets {
    ($float:ty) => {
        [
            ("mark", offset_of!(Settings<$float>, mark)),
            ("tolerance", offset_of!(Settings<$float>, tolerance)),
            ("chord_tolerance", offset_of!(Settings<$float>, chord_tolerance)),
            ("sample_count", offset_of!(Settings<$float>, sample_count)),
            ("zero", offset_of!(Settings<$float>, zero)),
            ("first_path", offset_of!(Settings<$float>, first_path)),
            ("last_path", offset_of!(Settings<$float>, last_path)),
        ]
    };
}

/// Members of `Settings` and their offsets, to compare with the shaders.
pub fn settings_members(precision: Precision) -> [(&'static str, usize); 7] {
    match precision {
        Precision::F32 => offsets!(f32),
        Precision::F64 => offsets!(f64),
    }
}

/// Bytes of the timestamps before the outputs in the staging buffer: kernels begin, kernels end, copies end.
const STAMP_BYTES: u64 = 24;

/// Samples of a slot, and bytes of what it holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sizes {
    pub samples: u64,
    pub inputs: u64,
    pub outputs: u64,
    /// Of what comes back.
    pub staging: u64,
}

/// One dispatch's buffers.
pub(super) struct Slot {
    settings: wgpu::Buffer,
    pub inputs: wgpu::Buffer,
    pub outputs: wgpu::Buffer,
    staging: wgpu::Buffer,
    stamps: Option<Stamps>,
    bind_group: wgpu::BindGroup,
    pub capacity: Sizes,
}

struct Stamps {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    /// Whether copies are timed, too.
    of_copies: bool,
}

/// Seconds by the device's clock, where it tells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Spent {
    pub kernels: Option<f64>,
    pub copies: Option<f64>,
}

/// Work given to the device.
pub(super) struct Flight {
    landing: Landing,
    number: u64,
    /// Where rows start among what comes back.
    rows_at: usize,
    precision: Precision,
}

/// Bytes on their way to the host.
struct Landing {
    submission: wgpu::SubmissionIndex,
    mapped: Mapped,
    bytes: u64,
}

type Mapped = Receiver<Result<(), wgpu::BufferAsyncError>>;

/// A kernel that runs beside the solving one.
#[derive(Clone, Copy)]
pub(super) struct Step<'a> {
    pub pipeline: &'a wgpu::ComputePipeline,
    pub bind_group: &'a wgpu::BindGroup,
}

/// What to do with a slot.
pub(super) struct Dispatch<'a> {
    pub mark: f64,
    pub tolerance: f64,
    pub paths: Paths,
    pub sample_count: u32,
    /// As the kernel reads them; empty where they are there already.
    pub inputs: &'a [u8],
    pub before: Option<Step<'a>>,
    pub after: Option<Step<'a>>,
    /// What comes back: the first bytes of these buffers, that of rows last.
    pub copies: &'a [(&'a wgpu::Buffer, u64)],
}

/// Buffers of a kind for each binding from 0 on.
pub(super) fn layout_of(
    device: &Device,
    label: &str,
    kinds: &[wgpu::BufferBindingType],
) -> Result<wgpu::BindGroupLayout, BackendError> {
    let entries: Vec<_> = (0..)
        .zip(kinds)
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty: *ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        })
        .collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries };
    device.scoped("bind group layout", || device.raw.create_bind_group_layout(&descriptor))
}

/// These buffers at the bindings from 0 on.
pub(super) fn group_of(
    device: &Device,
    layout: &wgpu::BindGroupLayout,
    buffers: &[&wgpu::Buffer],
) -> Result<wgpu::BindGroup, BackendError> {
    let entries: Vec<_> = (0..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    let descriptor = wgpu::BindGroupDescriptor { label: None, layout, entries: &entries };
    device.scoped("bind group", || device.raw.create_bind_group(&descriptor))
}

impl Slot {
    pub fn new(device: &Device, solver: &Solver, capacity: Sizes) -> Result<Self, BackendError> {
        let settings =
            device.buffer("settings", size_of::<Settings<f64>>() as u64, Usage::UNIFORM | Usage::COPY_DST)?;
        let both = Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC;
        // A binding may not be empty.
        let inputs = device.buffer("inputs", capacity.inputs.max(8), both)?;
        let outputs = device.buffer("outputs", capacity.outputs, Usage::STORAGE | Usage::COPY_SRC)?;
        let staging = device.buffer("staging", capacity.staging + STAMP_BYTES, Usage::MAP_READ | Usage::COPY_DST)?;
        let buffers = [&settings, &solver.constants, &inputs, &outputs];
        let bind_group = group_of(device, &solver.layout, &buffers)?;
        let stamps = if device.adapter().has_timestamps { Some(timestamps(device)?) } else { None };
        Ok(Self { settings, inputs, outputs, staging, stamps, bind_group, capacity })
    }

    /// Submits one dispatch.
    pub fn submit(&self, device: &Device, solver: &Solver, dispatch: &Dispatch) -> Flight {
        let Dispatch { mark, tolerance, paths: (first_path, last_path), sample_count, .. } = *dispatch;
        let chord_tolerance = chord_tolerance(tolerance);
        let settings = Settings { mark, tolerance, chord_tolerance, sample_count, zero: 0, first_path, last_path };
        device.queue.write_buffer(&self.settings, 0, &settings.bytes(solver.precision));
        if !dispatch.inputs.is_empty() {
            device.queue.write_buffer(&self.inputs, 0, dispatch.inputs);
        }
        let mut encoder = device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let timestamp_writes = self.stamps.as_ref().map(|stamps| wgpu::ComputePassTimestampWrites {
            query_set: &stamps.set,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        });
        let mut pass =
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("solve"), timestamp_writes });
        let solve = Step { pipeline: &solver.pipeline, bind_group: &self.bind_group };
        for step in dispatch.before.iter().chain([&solve]).chain(&dispatch.after) {
            pass.set_pipeline(step.pipeline);
            pass.set_bind_group(0, step.bind_group, &[]);
            pass.dispatch_workgroups(sample_count.max(1).div_ceil(WORKGROUP_SIZE), 1, 1);
        }
        drop(pass);
        let (mut at, mut rows_at) = (STAMP_BYTES, STAMP_BYTES);
        for (buffer, bytes) in dispatch.copies {
            encoder.copy_buffer_to_buffer(buffer, 0, &self.staging, at, *bytes);
            (at, rows_at) = (at + bytes, at);
        }
        if let Some(Stamps { set, resolved, of_copies }) = &self.stamps {
            if *of_copies {
                encoder.write_timestamp(set, 2);
            }
            let count = 2 + u32::from(*of_copies);
            encoder.resolve_query_set(set, 0..count, resolved, 0);
            encoder.copy_buffer_to_buffer(resolved, 0, &self.staging, 0, u64::from(8 * count));
        }
        let submission = device.queue.submit([encoder.finish()]);
        let (number, is_lost) = device.faults.dispatch();
        if is_lost {
            device.destroy();
        }
        let rows_at = (rows_at - STAMP_BYTES) as usize;
        let landing = Landing { submission, mapped: map(&self.staging, at), bytes: at };
        Flight { landing, number, rows_at, precision: solver.precision }
    }

    /// Waits for a dispatch, hands what came back to `read` and returns the time that the device took.
    pub fn finish(&self, device: &Device, flight: &Flight, read: impl FnOnce(&[u8])) -> Result<Spent, BackendError> {
        let mut spent = Spent::default();
        receive(device, &self.staging, &flight.landing, |bytes| {
            let (stamps, outputs) = bytes.split_at(STAMP_BYTES as usize);
            if let Some(Stamps { of_copies, .. }) = &self.stamps {
                let stamp = |at: usize| u64::from_le_bytes(std::array::from_fn(|byte| stamps[at + byte]));
                let period = f64::from(device.queue.get_timestamp_period()) * 1e-9;
                let seconds = |from: usize, to: usize| stamp(to).saturating_sub(stamp(from)) as f64 * period;
                spent = Spent { kernels: Some(seconds(0, 8)), copies: of_copies.then(|| seconds(8, 16)) };
            }
            let block_bytes = (self.capacity.outputs * BLOCK as u64 / self.capacity.samples.max(1)) as usize;
            let layout = (block_bytes, flight.precision);
            match device.faults.flipped(flight.number, outputs, flight.rows_at, layout) {
                Some(changed) => read(&changed),
                None => read(outputs),
            }
        })?;
        Ok(spent)
    }
}

/// Asks for the first bytes of a buffer.
fn map(buffer: &wgpu::Buffer, bytes: u64) -> Mapped {
    let (sender, mapped) = channel();
    buffer.slice(..bytes).map_async(wgpu::MapMode::Read, move |result| {
        // Nobody listens once the batch has failed.
        let _ = sender.send(result);
    });
    mapped
}

/// Waits for a submission and hands the bytes it asked for to `read`.
fn receive(
    device: &Device,
    staging: &wgpu::Buffer,
    landing: &Landing,
    read: impl FnOnce(&[u8]),
) -> Result<(), BackendError> {
    device.wait(Some(landing.submission.clone()))?;
    match landing.mapped.try_recv() {
        Ok(Ok(())) => {}
        Ok(Err(error)) => return Err(failed(format!("results could not be read back: {error}"))),
        Err(_) => return Err(failed("results did not come back")),
    }
    let view = staging.slice(..landing.bytes).get_mapped_range().map_err(failed)?;
    read(&view);
    drop(view);
    staging.unmap();
    device.check()
}

/// Reads some bytes of a buffer, once what was submitted before is done.
pub(super) fn read_back(
    device: &Device,
    buffer: &wgpu::Buffer,
    range: Range<u64>,
    read: impl FnOnce(&[u8]),
) -> Result<(), BackendError> {
    let bytes = range.end - range.start;
    let staging = device.buffer("staging", bytes, Usage::MAP_READ | Usage::COPY_DST)?;
    let mut encoder = device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, range.start, &staging, 0, bytes);
    let submission = device.queue.submit([encoder.finish()]);
    receive(device, &staging, &Landing { submission, mapped: map(&staging, bytes), bytes }, read)
}

fn timestamps(device: &Device) -> Result<Stamps, BackendError> {
    let descriptor = wgpu::QuerySetDescriptor { label: Some("timestamps"), ty: wgpu::QueryType::Timestamp, count: 3 };
    let set = device.scoped("timestamps", || device.raw.create_query_set(&descriptor))?;
    let resolved = device.buffer("timestamps", STAMP_BYTES, Usage::QUERY_RESOLVE | Usage::COPY_SRC)?;
    let of_copies = device.raw.features().contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);
    Ok(Stamps { set, resolved, of_copies })
}
