//! The buffers of one dispatch: settings, inputs and outputs on the device, and a copy that the host can read.

use super::device::{Device, failed};
use super::device_time::{DeviceTime, LISTS, Stage};
use super::pipelines::SolvePipeline;
use super::rounds::{Rounds, Work};
use super::shader::{Settings, WORKGROUP_SIZE};
use crate::backend::{BackendError, Precision};
use crate::model::BLOCK;
use std::ops::Range;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use wgpu::BufferUsages as Usage;

/// Timestamps of a dispatch at most: start and end of each kernel, end of the copies.
const MOST_STAMPS: u32 = 2 * Stage::COUNT as u32 + 1;
/// Bytes of the timestamps in the staging buffer, and of the counts that follow, before the outputs.
const STAMP_BYTES: u64 = 8 * MOST_STAMPS as u64;
const COUNT_BYTES: u64 = 8 * LISTS as u64;
const HEAD_BYTES: u64 = STAMP_BYTES + COUNT_BYTES;

/// How much a dispatch can hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Capacity {
    pub samples: u64,
    /// In bytes
    pub inputs: u64,
    /// In bytes
    pub outputs: u64,
    /// What is copied back to the host (bytes)
    pub staging: u64,
}

/// The buffers of one dispatch.
pub(super) struct DispatchBuffers {
    settings: wgpu::Buffer,
    pub inputs: wgpu::Buffer,
    pub outputs: wgpu::Buffer,
    staging: wgpu::Buffer,
    rounds: Rounds,
    stamps: Option<Stamps>,
    pub capacity: Capacity,
}

/// Where the device writes the time.
struct Stamps {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    /// Whether copies are timed, too.
    of_copies: bool,
}

/// A dispatch that was handed to the device.
pub(super) struct Submission {
    readback: Readback,
    /// Its number, by which tests plan faults.
    number: u64,
    /// Its kernels, in order.
    stages: Vec<Stage>,
    /// Byte at which rows start among what comes back.
    rows_at: usize,
    precision: Precision,
}

/// Bytes on their way to the host.
struct Readback {
    submission: wgpu::SubmissionIndex,
    mapped: Mapped,
    bytes: u64,
}

type Mapped = Receiver<Result<(), wgpu::BufferAsyncError>>;

/// A kernel for every sample of a dispatch, and its buffers.
#[derive(Clone, Copy)]
pub(super) struct KernelPass<'a> {
    pub stage: Stage,
    pub pipeline: &'a wgpu::ComputePipeline,
    pub bind_group: &'a wgpu::BindGroup,
}

/// What one dispatch has to do.
pub(super) struct Dispatch<'a> {
    pub settings: Settings<f64>,
    /// As the kernel reads them; empty where the device has them already.
    pub inputs: &'a [u8],
    /// Runs before the samples are solved.
    pub before: Option<KernelPass<'a>>,
    /// Runs after they are solved.
    pub after: Option<KernelPass<'a>>,
    /// What comes back: the first bytes of these buffers. The buffer of rows comes last.
    pub copies: &'a [(&'a wgpu::Buffer, u64)],
}

impl DispatchBuffers {
    pub fn new(device: &Device, solver: &SolvePipeline, capacity: Capacity) -> Result<Self, BackendError> {
        let settings =
            device.buffer("settings", size_of::<Settings<f64>>() as u64, Usage::UNIFORM | Usage::COPY_DST)?;
        let both = Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC;
        // A binding may not be empty.
        let inputs = device.buffer("inputs", capacity.inputs.max(8), both)?;
        let outputs = device.buffer("outputs", capacity.outputs, Usage::STORAGE | Usage::COPY_SRC)?;
        let staging = device.buffer("staging", capacity.staging + HEAD_BYTES, Usage::MAP_READ | Usage::COPY_DST)?;
        let rounds = Rounds::new(device, solver, [&settings, &inputs, &outputs], capacity.samples)?;
        let stamps = if device.adapter().has_timestamps { Some(timestamps(device)?) } else { None };
        Ok(Self { settings, inputs, outputs, staging, rounds, stamps, capacity })
    }

    /// Submits one dispatch.
    pub fn submit<'a>(&'a self, device: &Device, solver: &'a SolvePipeline, dispatch: &'a Dispatch) -> Submission {
        device.queue.write_buffer(&self.settings, 0, &dispatch.settings.bytes(solver.precision));
        if !dispatch.inputs.is_empty() {
            device.queue.write_buffer(&self.inputs, 0, dispatch.inputs);
        }
        let mut encoder = device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.rounds.clear(device);
        let sample_count = dispatch.settings.sample_count;
        let all =
            |pass: &KernelPass<'a>| Work { stage: pass.stage, kernels: vec![(pass.pipeline, pass.bind_group, None)] };
        let mut works: Vec<Work> = dispatch.before.iter().map(all).collect();
        works.extend(self.rounds.works(&solver.solver));
        works.extend(dispatch.after.iter().map(all));
        for (k, work) in (0..).zip(&works) {
            let timestamp_writes = self.stamps.as_ref().map(|stamps| wgpu::ComputePassTimestampWrites {
                query_set: &stamps.set,
                beginning_of_pass_write_index: Some(2 * k),
                end_of_pass_write_index: Some(2 * k + 1),
            });
            let label = Some(work.stage.name());
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label, timestamp_writes });
            for (pipeline, bind_group, list) in &work.kernels {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, *bind_group, &[]);
                match list {
                    Some((list, at)) => pass.dispatch_workgroups_indirect(list, *at),
                    None => pass.dispatch_workgroups(sample_count.max(1).div_ceil(WORKGROUP_SIZE), 1, 1),
                }
            }
        }
        self.rounds.copy_counts(&mut encoder, &self.staging, STAMP_BYTES);
        let (mut at, mut rows_at) = (HEAD_BYTES, HEAD_BYTES);
        for (buffer, bytes) in dispatch.copies {
            encoder.copy_buffer_to_buffer(buffer, 0, &self.staging, at, *bytes);
            (at, rows_at) = (at + bytes, at);
        }
        if let Some(Stamps { set, resolved, of_copies }) = &self.stamps {
            let of_kernels = 2 * works.len() as u32;
            if *of_copies {
                encoder.write_timestamp(set, of_kernels);
            }
            let count = of_kernels + u32::from(*of_copies);
            encoder.resolve_query_set(set, 0..count, resolved, 0);
            encoder.copy_buffer_to_buffer(resolved, 0, &self.staging, 0, u64::from(8 * count));
        }
        let submission = device.queue.submit([encoder.finish()]);
        let (number, is_lost) = device.faults.dispatch();
        if is_lost {
            device.destroy();
        }
        let rows_at = (rows_at - HEAD_BYTES) as usize;
        let readback = Readback { submission, mapped: map(&self.staging, at), bytes: at };
        let stages = works.iter().map(|work| work.stage).collect();
        Submission { readback, number, stages, rows_at, precision: solver.precision }
    }

    /// Waits for a dispatch, hands what came back to `read` and returns the time that the device took.
    pub fn finish(
        &self,
        device: &Device,
        submission: &Submission,
        read: impl FnOnce(&[u8]),
    ) -> Result<DeviceTime, BackendError> {
        let mut time = DeviceTime::default();
        receive(device, &self.staging, &submission.readback, |bytes| {
            let (head, outputs) = bytes.split_at(HEAD_BYTES as usize);
            let (stamps, counts) = head.split_at(STAMP_BYTES as usize);
            let word = |at: usize| u32::from_le_bytes(std::array::from_fn(|byte| counts[4 * at + byte]));
            time.left = std::array::from_fn(|list| [word(2 * list), word(2 * list + 1)]);
            if let Some(Stamps { of_copies, .. }) = &self.stamps {
                let stamp = |at: usize| u64::from_le_bytes(std::array::from_fn(|byte| stamps[at + byte]));
                let period = f64::from(device.queue.get_timestamp_period()) * 1e-9;
                let seconds = |from: usize, to: usize| stamp(8 * to).saturating_sub(stamp(8 * from)) as f64 * period;
                let count = submission.stages.len();
                let stages = submission.stages.iter().enumerate();
                time = DeviceTime {
                    kernels: Some(seconds(0, 2 * count - 1)),
                    stages: stages.map(|(k, stage)| (*stage, seconds(2 * k, 2 * k + 1))).collect(),
                    copies: of_copies.then(|| seconds(2 * count - 1, 2 * count)),
                    ..time
                };
            }
            let block_bytes = (self.capacity.outputs * BLOCK as u64 / self.capacity.samples.max(1)) as usize;
            let layout = (block_bytes, submission.precision);
            match device.faults.flipped(submission.number, outputs, submission.rows_at, layout) {
                Some(changed) => read(&changed),
                None => read(outputs),
            }
        })?;
        Ok(time)
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

/// From the end of a submission to the call that tells of it, however busy the machine is.
const TOLD_WITHIN: Duration = Duration::from_secs(60);

/// Waits for a submission and hands the bytes it asked for to `read`.
fn receive(
    device: &Device,
    staging: &wgpu::Buffer,
    readback: &Readback,
    read: impl FnOnce(&[u8]),
) -> Result<(), BackendError> {
    device.wait(Some(readback.submission.clone()))?;
    // Where threads share a device, another one may have noticed the end and be about to tell.
    match readback.mapped.recv_timeout(TOLD_WITHIN) {
        Ok(Ok(())) => {}
        Ok(Err(error)) => return Err(failed(format!("results could not be read back: {error}"))),
        Err(_) => return Err(failed("results did not come back")),
    }
    let view = staging.slice(..readback.bytes).get_mapped_range().map_err(failed)?;
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
    receive(device, &staging, &Readback { submission, mapped: map(&staging, bytes), bytes }, read)
}

fn timestamps(device: &Device) -> Result<Stamps, BackendError> {
    let descriptor =
        wgpu::QuerySetDescriptor { label: Some("timestamps"), ty: wgpu::QueryType::Timestamp, count: MOST_STAMPS };
    let set = device.scoped("timestamps", || device.raw.create_query_set(&descriptor))?;
    let resolved = device.buffer("timestamps", STAMP_BYTES, Usage::QUERY_RESOLVE | Usage::COPY_SRC)?;
    let of_copies = device.raw.features().contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);
    Ok(Stamps { set, resolved, of_copies })
}
