//! Kernels and buffers that make the samples of a sweep and count their tips in voxels.

use super::bindings::{bind_group, bind_group_layout};
use super::device::{Device, failed};
use super::dispatch_buffers::{Capacity, DispatchBuffers};
use super::dispatcher::Dispatcher;
use super::pipelines::compile;
use super::shader::{Generator, HEADER, Kernel, VoxelGrid, float_bytes};
use crate::backend::BackendError;
use crate::model::Entry;
use crate::model::record::BASE_POSITION_AT;
use std::time::Instant;
use wgpu::{BufferBindingType as Kind, BufferUsages as Usage};

/// What the dispatches of one sweep share.
pub(super) struct VoxelKernels {
    pub grid: VoxelGrid,
    /// Voxels to the plan's unit of length.
    pub cells: f64,
    /// The base among the voxels.
    pub base: [f64; 3],
    pub generate: wgpu::ComputePipeline,
    pub generate_layout: wgpu::BindGroupLayout,
    /// Keys and tables from which samples follow.
    pub recipe: wgpu::Buffer,
    pub tables: wgpu::Buffer,
    pub reduce: wgpu::ComputePipeline,
    pub reduce_layout: wgpu::BindGroupLayout,
    /// Count of each voxel.
    pub voxels: wgpu::Buffer,
}

/// The buffers of one dispatch.
pub(super) struct VoxelBuffers {
    pub solve: DispatchBuffers,
    /// Which samples are made.
    pub range: wgpu::Buffer,
    /// What the counting kernel is asked.
    pub request: wgpu::Buffer,
    /// Counts of samples, the samples that come back, the samples that the host wants.
    pub tally: wgpu::Buffer,
    /// Rows of the samples that come back.
    pub returned: wgpu::Buffer,
    pub generate: wgpu::BindGroup,
    pub reduce: wgpu::BindGroup,
}

fn filled(device: &Device, what: &str, bytes: &[u8]) -> Result<wgpu::Buffer, BackendError> {
    let buffer = device.buffer(what, bytes.len().max(8) as u64, Usage::STORAGE | Usage::COPY_DST)?;
    device.queue.write_buffer(&buffer, 0, bytes);
    Ok(buffer)
}

impl VoxelKernels {
    /// Makes the kernels for voxels of an edge (m).
    pub fn new(
        dispatcher: &mut Dispatcher,
        voxel: f64,
        generator: &Generator,
        grid: VoxelGrid,
    ) -> Result<Self, BackendError> {
        let start = Instant::now();
        let (device, plan, precision) = (&dispatcher.device, &dispatcher.plan, dispatcher.precision);
        let (read, write) = (Kind::Storage { read_only: true }, Kind::Storage { read_only: false });
        let generate_layout = bind_group_layout(device, "generate", &[Kind::Uniform, read, read, write])?;
        let reduce_layout = bind_group_layout(device, "reduce", &[Kind::Uniform, read, write, write, write])?;
        let generate = Kernel::generate(plan, generator, precision).map_err(failed)?;
        let reduce = Kernel::reduce(plan, precision).map_err(failed)?;
        let base = |axis: usize| match plan.entries[BASE_POSITION_AT + axis] {
            Entry::Constant(base) => base / voxel,
            Entry::Varying(_) => 0.0,
        };
        let kernels = Self {
            grid,
            cells: plan.units.length / voxel,
            base: std::array::from_fn(base),
            generate: compile(device, &generate_layout, &generate)?,
            generate_layout,
            recipe: filled(device, "recipe", bytemuck::cast_slice(&generator.words))?,
            tables: filled(device, "tables", &float_bytes(&generator.tables, precision))?,
            reduce: compile(device, &reduce_layout, &reduce)?,
            reduce_layout,
            voxels: device.buffer(
                "voxels",
                4 * grid.cell_count(),
                Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST,
            )?,
        };
        dispatcher.timings.compile += start.elapsed().as_secs_f64();
        Ok(kernels)
    }

    /// Buffers of a dispatch of so many blocks.
    pub fn buffers(&self, dispatcher: &Dispatcher, block_count: usize) -> Result<VoxelBuffers, BackendError> {
        let device = &dispatcher.device;
        let capacity = dispatcher.capacity(block_count);
        let listed = 4 * (HEADER as u64 + capacity.samples);
        let solve = DispatchBuffers::new(
            device,
            &dispatcher.solver,
            Capacity { staging: listed + capacity.outputs, ..capacity },
        )?;
        let uniform = |what: &str, bytes: usize| device.buffer(what, bytes as u64, Usage::UNIFORM | Usage::COPY_DST);
        let range = uniform("range", 16)?;
        let request = uniform("request", 256)?;
        let usage = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST;
        let tally = device.buffer("tally", listed + 4 * capacity.samples, usage)?;
        let returned = device.buffer("returned", capacity.outputs, Usage::STORAGE | Usage::COPY_SRC)?;
        let generate = bind_group(device, &self.generate_layout, &[&range, &self.recipe, &self.tables, &solve.inputs])?;
        let buffers = [&request, &solve.outputs, &tally, &returned, &self.voxels];
        let reduce = bind_group(device, &self.reduce_layout, &buffers)?;
        Ok(VoxelBuffers { solve, range, request, tally, returned, generate, reduce })
    }
}

impl VoxelBuffers {
    /// Says which samples are made.
    pub fn set_range(&self, device: &Device, first: u64, sample_count: usize) {
        let words = [first as u32, (first >> 32) as u32, sample_count as u32, 0];
        device.queue.write_buffer(&self.range, 0, bytemuck::bytes_of(&words));
    }
}
