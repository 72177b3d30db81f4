//! Kernels and buffers of a sweep without rows, and whether it can be run that way.

use super::buffers::{Sizes, Slot, float_bytes, group_of, layout_of, read_back};
use super::device::{Device, failed};
use super::engine::Gpu;
use super::kernel::{Kernel, WORKGROUP_SIZE};
use super::recipe::Generator;
use super::solver::pipeline;
use super::tally::{HEADER, VoxelGrid};
use crate::backend::{Backend, BackendError, Precision, ReduceJob};
use crate::model::record::BASE_POSITION_AT;
use crate::model::{BLOCK, Blocks, Entry, Plan, Quantity};
use std::time::Instant;
use wgpu::{BufferBindingType as Kind, BufferUsages as Usage};

/// Samples that say where tips are, before the counts are laid out.
const PILOT: u64 = 4096;
/// Outputs of one dispatch at most [bytes]; the device also holds as much for what comes back.
const OUTPUT_BUDGET: u64 = 128 << 20;

/// What the dispatches of one run share.
pub(super) struct Counter {
    pub grid: VoxelGrid,
    pub cells: f64,
    pub base: [f64; 3],
    pub generate: wgpu::ComputePipeline,
    pub generate_layout: wgpu::BindGroupLayout,
    pub recipe: wgpu::Buffer,
    pub tables: wgpu::Buffer,
    pub reduce: wgpu::ComputePipeline,
    pub reduce_layout: wgpu::BindGroupLayout,
    pub voxels: wgpu::Buffer,
}

/// Buffers of one dispatch.
pub(super) struct Place {
    pub slot: Slot,
    pub range: wgpu::Buffer,
    pub request: wgpu::Buffer,
    pub tally: wgpu::Buffer,
    pub returned: wgpu::Buffer,
    pub generate: wgpu::BindGroup,
    pub reduce: wgpu::BindGroup,
}

/// The tables of the samples, or why they cannot be made on the device.
pub(super) fn generator(plan: &Plan, job: &ReduceJob) -> Result<Generator, String> {
    let recipe = job.recipe.ok_or("they come from a table, or from axes too long for one")?;
    if (0..3).any(|axis| matches!(plan.entries[BASE_POSITION_AT + axis], Entry::Varying(_))) {
        return Err("the base moves".into());
    }
    if plan.start.is_some() {
        return Err("they start from given moments".into());
    }
    Generator::new(plan, recipe)
}

/// Tips of samples all over the sweep, in voxels.
pub(super) fn pilot_tips(gpu: &mut Gpu, job: &ReduceJob) -> Result<Vec<[f64; 3]>, BackendError> {
    let total = job.ranges.iter().map(|range| range.end - range.start).sum::<u64>();
    let count = PILOT.min(total);
    let at = |number: usize| {
        let mut place = (u128::from(total) * number as u128 / u128::from(count.max(1))) as u64;
        for range in job.ranges {
            if place < range.end - range.start {
                return range.start + place;
            }
            place -= range.end - range.start;
        }
        0
    };
    let plan = gpu.plan.clone();
    let batch = plan.batch(count as usize, |number, row| {
        if (number as u64) < count {
            (job.values)(at(number), row);
        }
    });
    let solutions = gpu.solve(&batch)?;
    let solved = (0..count as usize).filter(|sample| solutions.status(*sample).is_success());
    Ok(solved.map(|sample| solutions.vector(sample, Quantity::TipPosition).map(|x| x / job.voxel)).collect())
}

/// Blocks of a dispatch that limits and budget allow.
pub(super) fn dispatch_limit(gpu: &Gpu) -> usize {
    let limits = gpu.device.adapter();
    let bytes = OUTPUT_BUDGET.min(limits.max_buffer_size / 2).min(limits.max_storage_binding_size);
    let columns = gpu.plan.output_count().max(gpu.plan.input_count);
    let by_size = bytes / (gpu.precision.size() * BLOCK * columns) as u64;
    let by_workgroups = u64::from(limits.max_workgroups) * u64::from(WORKGROUP_SIZE) / BLOCK as u64;
    by_size.min(by_workgroups).max(1) as usize
}

fn filled(device: &Device, what: &str, bytes: &[u8]) -> Result<wgpu::Buffer, BackendError> {
    let buffer = device.buffer(what, bytes.len().max(8) as u64, Usage::STORAGE | Usage::COPY_DST)?;
    device.queue.write_buffer(&buffer, 0, bytes);
    Ok(buffer)
}

impl Counter {
    /// Makes the kernels for voxels of an edge [m].
    pub fn new(gpu: &mut Gpu, voxel: f64, generator: &Generator, grid: VoxelGrid) -> Result<Self, BackendError> {
        let start = Instant::now();
        let (device, plan, precision) = (&gpu.device, &gpu.plan, gpu.precision);
        let (read, write) = (Kind::Storage { read_only: true }, Kind::Storage { read_only: false });
        let generate_layout = layout_of(device, "generate", &[Kind::Uniform, read, read, write])?;
        let reduce_layout = layout_of(device, "reduce", &[Kind::Uniform, read, write, write, write])?;
        let generate = Kernel::generate(plan, generator, precision).map_err(failed)?;
        let reduce = Kernel::reduce(plan, precision).map_err(failed)?;
        let base = |axis: usize| match plan.entries[BASE_POSITION_AT + axis] {
            Entry::Constant(base) => base / voxel,
            Entry::Varying(_) => 0.0,
        };
        let counter = Self {
            grid,
            cells: plan.units.length / voxel,
            base: std::array::from_fn(base),
            generate: pipeline(device, &generate_layout, &generate)?,
            generate_layout,
            recipe: filled(device, "recipe", bytemuck::cast_slice(&generator.words))?,
            tables: filled(device, "tables", &float_bytes(&generator.tables, precision))?,
            reduce: pipeline(device, &reduce_layout, &reduce)?,
            reduce_layout,
            voxels: device.buffer(
                "voxels",
                4 * grid.cell_count(),
                Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST,
            )?,
        };
        gpu.timings.compile += start.elapsed().as_secs_f64();
        Ok(counter)
    }

    /// Buffers of a dispatch of so many blocks.
    pub fn place(&self, gpu: &Gpu, block_count: usize) -> Result<Place, BackendError> {
        let device = &gpu.device;
        let sizes = gpu.sizes(block_count);
        let listed = 4 * (HEADER as u64 + sizes.samples);
        let slot = Slot::new(device, &gpu.solver, Sizes { staging: listed + sizes.outputs, ..sizes })?;
        let uniform = |what: &str, bytes: usize| device.buffer(what, bytes as u64, Usage::UNIFORM | Usage::COPY_DST);
        let range = uniform("range", 16)?;
        let request = uniform("request", 256)?;
        let kept = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST;
        let tally = device.buffer("tally", listed + 4 * sizes.samples, kept)?;
        let returned = device.buffer("returned", sizes.outputs, Usage::STORAGE | Usage::COPY_SRC)?;
        let generate = group_of(device, &self.generate_layout, &[&range, &self.recipe, &self.tables, &slot.inputs])?;
        let buffers = [&request, &slot.outputs, &tally, &returned, &self.voxels];
        let reduce = group_of(device, &self.reduce_layout, &buffers)?;
        Ok(Place { slot, range, request, tally, returned, generate, reduce })
    }
}

impl Place {
    /// Says which samples are made.
    pub fn set_range(&self, device: &Device, first: u64, sample_count: usize) {
        let words = [first as u32, (first >> 32) as u32, sample_count as u32, 0];
        device.queue.write_buffer(&self.range, 0, bytemuck::bytes_of(&words));
    }
}

/// Inputs of some samples as the device makes them, in the plan's units, block by block; for tests of the recipe.
pub fn generate_inputs(
    gpu: &mut Gpu,
    generator: &Generator,
    first: u64,
    sample_count: usize,
) -> Result<Blocks<f64>, BackendError> {
    let grid = VoxelGrid::around(&[]);
    let counter = Counter::new(gpu, 1.0, generator, grid)?;
    let mut made = Blocks::new(gpu.plan.input_count, sample_count);
    let place = counter.place(gpu, sample_count.div_ceil(BLOCK))?;
    place.set_range(&gpu.device, first, sample_count);
    let mut encoder = gpu.device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(&counter.generate);
    pass.set_bind_group(0, &place.generate, &[]);
    pass.dispatch_workgroups((sample_count as u32).div_ceil(WORKGROUP_SIZE), 1, 1);
    drop(pass);
    gpu.device.queue.submit([encoder.finish()]);
    let bytes = (gpu.precision.size() * made.data().len()) as u64;
    read_back(&gpu.device, &place.slot.inputs, 0..bytes, |bytes| match gpu.precision {
        Precision::F32 => {
            let values: &[f32] = bytemuck::cast_slice(bytes);
            made.data_mut().iter_mut().zip(values).for_each(|(to, from)| *to = f64::from(*from));
        }
        Precision::F64 => made.data_mut().copy_from_slice(bytemuck::cast_slice(bytes)),
    })?;
    Ok(made)
}
