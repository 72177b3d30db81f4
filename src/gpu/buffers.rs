//! The buffers of one dispatch in flight: settings, inputs and outputs on the device, a copy for the host.

use super::device::{Device, failed};
use crate::backend::{BackendError, Precision};
use std::mem::offset_of;
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
    pub sample_count: u32,
    /// Always zero.
    pub zero: u32,
}

impl Settings<f64> {
    /// As the kernels of a precision read them.
    pub fn bytes(&self, precision: Precision) -> Vec<u8> {
        let floats = [self.mark, self.tolerance];
        let mut bytes = float_bytes(&floats, precision);
        bytes.extend_from_slice(bytemuck::bytes_of(&[self.sample_count, self.zero]));
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
            ("sample_count", offset_of!(Settings<$float>, sample_count)),
            ("zero", offset_of!(Settings<$float>, zero)),
        ]
    };
}

/// Members of `Settings` and their offsets, to compare with the shaders.
pub fn settings_members(precision: Precision) -> [(&'static str, usize); 4] {
    match precision {
        Precision::F32 => offsets!(f32),
        Precision::F64 => offsets!(f64),
    }
}

/// Bytes of the two timestamps behind the outputs in the staging buffer.
const STAMP_BYTES: u64 = 16;

/// Bytes of inputs and outputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sizes {
    pub inputs: u64,
    pub outputs: u64,
}

/// One dispatch's buffers.
pub(super) struct Slot {
    settings: wgpu::Buffer,
    inputs: wgpu::Buffer,
    outputs: wgpu::Buffer,
    staging: wgpu::Buffer,
    stamps: Option<(wgpu::QuerySet, wgpu::Buffer)>,
    bind_group: wgpu::BindGroup,
    pub capacity: Sizes,
}

/// Work given to the device.
pub(super) struct Flight {
    submission: wgpu::SubmissionIndex,
    mapped: Receiver<Result<(), wgpu::BufferAsyncError>>,
    output_bytes: u64,
}

/// The resources of every kernel: settings, constants, inputs, outputs.
pub(super) fn bind_group_layout(device: &Device) -> Result<wgpu::BindGroupLayout, BackendError> {
    let kinds = [
        wgpu::BufferBindingType::Uniform,
        wgpu::BufferBindingType::Storage { read_only: true },
        wgpu::BufferBindingType::Storage { read_only: true },
        wgpu::BufferBindingType::Storage { read_only: false },
    ];
    let entries: Vec<_> = (0..)
        .zip(kinds)
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        })
        .collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("batch"), entries: &entries };
    device.scoped("bind group layout", || device.raw.create_bind_group_layout(&descriptor))
}

impl Slot {
    pub fn new(
        device: &Device,
        layout: &wgpu::BindGroupLayout,
        constants: &wgpu::Buffer,
        capacity: Sizes,
    ) -> Result<Self, BackendError> {
        let inputs_usage = Usage::STORAGE | Usage::COPY_DST;
        let settings =
            device.buffer("settings", size_of::<Settings<f64>>() as u64, Usage::UNIFORM | Usage::COPY_DST)?;
        // A binding may not be empty.
        let inputs = device.buffer("inputs", capacity.inputs.max(8), inputs_usage)?;
        let outputs = device.buffer("outputs", capacity.outputs, Usage::STORAGE | Usage::COPY_SRC)?;
        let staging = device.buffer("staging", capacity.outputs + STAMP_BYTES, Usage::MAP_READ | Usage::COPY_DST)?;
        let entries: Vec<_> = (0..)
            .zip([&settings, constants, &inputs, &outputs])
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let descriptor = wgpu::BindGroupDescriptor { label: Some("batch"), layout, entries: &entries };
        let bind_group = device.scoped("bind group", || device.raw.create_bind_group(&descriptor))?;
        let stamps = if device.adapter().has_timestamps { Some(timestamps(device)?) } else { None };
        Ok(Self { settings, inputs, outputs, staging, stamps, bind_group, capacity })
    }

    /// Submits one dispatch; the outputs' first `output_bytes` come back.
    pub fn submit(
        &self,
        device: &Device,
        pipeline: &wgpu::ComputePipeline,
        settings: &[u8],
        inputs: &[u8],
        workgroups: u32,
        output_bytes: u64,
    ) -> Flight {
        device.queue.write_buffer(&self.settings, 0, settings);
        if !inputs.is_empty() {
            device.queue.write_buffer(&self.inputs, 0, inputs);
        }
        let mut encoder = device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let timestamp_writes = self.stamps.as_ref().map(|(query_set, _)| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        });
        let mut pass =
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("solve"), timestamp_writes });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.bind_group, &[]);
        pass.dispatch_workgroups(workgroups, 1, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&self.outputs, 0, &self.staging, STAMP_BYTES, output_bytes);
        if let Some((query_set, resolved)) = &self.stamps {
            encoder.resolve_query_set(query_set, 0..2, resolved, 0);
            encoder.copy_buffer_to_buffer(resolved, 0, &self.staging, 0, STAMP_BYTES);
        }
        let submission = device.queue.submit([encoder.finish()]);
        let (sender, mapped) = channel();
        self.staging.slice(..STAMP_BYTES + output_bytes).map_async(wgpu::MapMode::Read, move |result| {
            // Nobody listens once the batch has failed.
            let _ = sender.send(result);
        });
        Flight { submission, mapped, output_bytes }
    }

    /// Waits for a dispatch, hands its outputs to `read` and returns the seconds the kernel took, if known.
    pub fn finish(
        &self,
        device: &Device,
        flight: Flight,
        read: impl FnOnce(&[u8]),
    ) -> Result<Option<f64>, BackendError> {
        device.wait(Some(flight.submission))?;
        match flight.mapped.try_recv() {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(failed(format!("results could not be read back: {error}"))),
            Err(_) => return Err(failed("results did not come back")),
        }
        let view = self.staging.slice(..STAMP_BYTES + flight.output_bytes).get_mapped_range().map_err(failed)?;
        let (stamps, outputs) = view.split_at(STAMP_BYTES as usize);
        let seconds = self.stamps.is_some().then(|| {
            let stamp = |at: usize| u64::from_le_bytes(std::array::from_fn(|byte| stamps[at + byte]));
            stamp(8).saturating_sub(stamp(0)) as f64 * f64::from(device.queue.get_timestamp_period()) * 1e-9
        });
        read(outputs);
        drop(view);
        self.staging.unmap();
        device.check()?;
        Ok(seconds)
    }
}

fn timestamps(device: &Device) -> Result<(wgpu::QuerySet, wgpu::Buffer), BackendError> {
    let descriptor = wgpu::QuerySetDescriptor { label: Some("timestamps"), ty: wgpu::QueryType::Timestamp, count: 2 };
    let set = device.scoped("timestamps", || device.raw.create_query_set(&descriptor))?;
    let resolved = device.buffer("timestamps", STAMP_BYTES, Usage::QUERY_RESOLVE | Usage::COPY_SRC)?;
    Ok((set, resolved))
}
