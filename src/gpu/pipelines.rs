//! Kernels as the device runs them: checked, compiled, and with the constants that all samples share.

use super::bindings::bind_group_layout;
use super::device::{Device, failed};
use super::shader::{Kernel, Paths, QUICK_PATHS, anchor_numbers, check, constants, float_bytes};
use crate::backend::{BackendError, Precision};
use crate::model::Plan;
use wgpu::{BufferBindingType as Kind, BufferUsages as Usage};

/// The solving kernel of one plan, ready to run.
pub(super) struct SolvePipeline {
    pub precision: Precision,
    pub layout: wgpu::BindGroupLayout,
    pub pipeline: wgpu::ComputePipeline,
    /// Where samples that need the guarded ramp are left for dispatches of their own: what solves the others.
    pub quick: Option<wgpu::ComputePipeline>,
    /// Where the plan has anchors: what runs first, and their numbers.
    pub anchored: Option<(wgpu::ComputePipeline, wgpu::Buffer)>,
    pub constants: wgpu::Buffer,
}

impl SolvePipeline {
    pub fn new(device: &Device, plan: &Plan, kernel: &Kernel) -> Result<Self, BackendError> {
        let precision = kernel.precision;
        let numbers = |what: &str, values: &[f64]| {
            let values = float_bytes(values, precision);
            let buffer = device.buffer(what, values.len() as u64, Usage::STORAGE | Usage::COPY_DST)?;
            device.queue.write_buffer(&buffer, 0, &values);
            Ok::<_, BackendError>(buffer)
        };
        let constants = numbers("constants", &constants(plan))?;
        if kernel.takes_turns() {
            let TurnPipeline { layout, pipeline } = TurnPipeline::new(device, kernel)?;
            return Ok(Self { precision, layout, pipeline, quick: None, anchored: None, constants });
        }
        let (read, write) = (Kind::Storage { read_only: true }, Kind::Storage { read_only: false });
        let kinds = [Kind::Uniform, read, read, write, read, write];
        let kinds = if kernel.anchored.is_some() { &kinds[..] } else { &kinds[..4] };
        let layout = bind_group_layout(device, "batch", kinds)?;
        let pipeline = compile(device, &layout, kernel)?;
        let anchored = match &kernel.anchored {
            Some(anchored) => Some((compile(device, &layout, anchored)?, numbers("anchors", &anchor_numbers(plan))?)),
            None => None,
        };
        let mut solver = Self { precision, layout, pipeline, quick: None, anchored, constants };
        // On a processor of few threads a dispatch of few samples leaves some of them idle.
        solver.set_stages(device, kernel, !device.adapter().is_software())?;
        Ok(solver)
    }

    /// Leaves samples that need the guarded ramp for dispatches of their own, or not.
    pub fn set_stages(&mut self, device: &Device, kernel: &Kernel, in_stages: bool) -> Result<(), BackendError> {
        self.quick = match &kernel.quick {
            Some(quick) if in_stages => Some(compile(device, &self.layout, quick)?),
            _ => None,
        };
        Ok(())
    }

    /// Whether samples that need the guarded ramp are left for dispatches of their own.
    pub fn is_in_stages(&self) -> bool {
        self.quick.is_some()
    }

    /// What solves by these paths.
    pub fn pipeline(&self, paths: Paths) -> &wgpu::ComputePipeline {
        match &self.quick {
            Some(quick) if paths == QUICK_PATHS => quick,
            _ => &self.pipeline,
        }
    }
}

/// A kernel that takes samples one turn further, ready to run.
#[derive(Clone)]
pub(super) struct TurnPipeline {
    pub layout: wgpu::BindGroupLayout,
    pub pipeline: wgpu::ComputePipeline,
}

impl TurnPipeline {
    /// Compiles it.
    pub fn new(device: &Device, kernel: &Kernel) -> Result<Self, BackendError> {
        let (read, write) = (Kind::Storage { read_only: true }, Kind::Storage { read_only: false });
        let layout =
            bind_group_layout(device, "turns", &[Kind::Uniform, read, read, write, Kind::Uniform, write, write])?;
        let pipeline = compile(device, &layout, kernel)?;
        Ok(Self { layout, pipeline })
    }
}

/// Checks a kernel and hands it to the driver, unless this device has compiled it before.
pub(super) fn compile(
    device: &Device,
    layout: &wgpu::BindGroupLayout,
    kernel: &Kernel,
) -> Result<wgpu::ComputePipeline, BackendError> {
    if let Some(pipeline) = device.compiled.get(kernel) {
        return Ok(pipeline);
    }
    check(&kernel.source).map_err(failed)?;
    let source = wgpu::ShaderSource::Wgsl(kernel.source.text.as_str().into());
    let descriptor = wgpu::ShaderModuleDescriptor { label: Some(kernel.entry_point), source };
    let module = device.scoped("shader module", || device.raw.create_shader_module(descriptor))?;
    let layouts = [Some(layout)];
    let descriptor = wgpu::PipelineLayoutDescriptor {
        label: Some(kernel.entry_point),
        bind_group_layouts: &layouts,
        immediate_size: 0,
    };
    let layout = device.scoped("pipeline layout", || device.raw.create_pipeline_layout(&descriptor))?;
    let descriptor = wgpu::ComputePipelineDescriptor {
        label: Some(kernel.entry_point),
        layout: Some(&layout),
        module: &module,
        entry_point: Some(kernel.entry_point),
        compilation_options: Default::default(),
        cache: device.cache.as_ref().map(|cache| &cache.raw),
    };
    let pipeline = device.scoped("compute pipeline", || device.raw.create_compute_pipeline(&descriptor))?;
    device.compiled.add(kernel, &pipeline);
    Ok(pipeline)
}
