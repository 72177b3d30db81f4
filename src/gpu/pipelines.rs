//! Kernels as the device runs them: checked, compiled, and with the constants that all samples share.

use super::bindings::bind_group_layout;
use super::device::{Device, failed};
use super::shader::{Kernel, anchor_numbers, check, constants, float_bytes};
use crate::backend::{BackendError, Precision};
use crate::model::Plan;
use wgpu::{BufferBindingType as Kind, BufferUsages as Usage};

/// The solving kernels of one plan, ready to run.
pub(super) struct SolvePipeline {
    pub precision: Precision,
    pub layout: wgpu::BindGroupLayout,
    pub solver: Solver,
    pub constants: wgpu::Buffer,
    /// Numbers of the plan's anchors; without any a buffer that no kernel reads.
    pub anchors: wgpu::Buffer,
}

/// How samples are solved.
pub(super) enum Solver {
    /// Each by one kernel. Where the plan has anchors another comes first, and leaves to it what they do not certify.
    Whole { anchored: Option<wgpu::ComputePipeline>, whole: wgpu::ComputePipeline },
    /// By short kernels, one after the other.
    Stages(Box<StagePipelines>),
    /// All of them one turn further at a time.
    Turns(wgpu::ComputePipeline),
}

/// See [`Solver::Stages`].
pub(super) struct StagePipelines {
    pub anchored: Option<wgpu::ComputePipeline>,
    pub path: wgpu::ComputePipeline,
    pub guarded: wgpu::ComputePipeline,
    /// Whether `guarded` takes several invocations a sample.
    pub is_on_lanes: bool,
    pub check: wgpu::ComputePipeline,
    pub columns: wgpu::ComputePipeline,
    pub columns_again: wgpu::ComputePipeline,
}

impl SolvePipeline {
    /// Compiles a kernel: in stages where it has any and the device is hardware. On a processor of few threads a dispatch of
    /// few samples leaves some of them idle.
    pub fn new(device: &Device, plan: &Plan, kernel: &Kernel) -> Result<Self, BackendError> {
        let precision = kernel.precision;
        let numbers = |what: &str, values: &[f64]| {
            let values = float_bytes(values, precision);
            // A binding may not be empty.
            let buffer = device.buffer(what, values.len().max(16) as u64, Usage::STORAGE | Usage::COPY_DST)?;
            device.queue.write_buffer(&buffer, 0, &values);
            Ok::<_, BackendError>(buffer)
        };
        let constants = numbers("constants", &constants(plan))?;
        let anchors = numbers("anchors", &anchor_numbers(plan))?;
        if kernel.takes_turns() {
            let TurnPipeline { layout, pipeline } = TurnPipeline::new(device, kernel)?;
            return Ok(Self { precision, layout, solver: Solver::Turns(pipeline), constants, anchors });
        }
        let (read, write) = (Kind::Storage { read_only: true }, Kind::Storage { read_only: false });
        let kinds = [Kind::Uniform, read, read, write, read, read, write, write];
        let layout = bind_group_layout(device, "batch", &kinds)?;
        let solver = Solver::new(device, &layout, kernel, !device.adapter().is_software())?;
        Ok(Self { precision, layout, solver, constants, anchors })
    }

    /// Solves by short kernels where there are any, or by one.
    pub fn set_stages(&mut self, device: &Device, kernel: &Kernel, in_stages: bool) -> Result<(), BackendError> {
        if !kernel.takes_turns() {
            self.solver = Solver::new(device, &self.layout, kernel, in_stages)?;
        }
        Ok(())
    }

    /// Whether samples are solved by short kernels.
    pub fn is_in_stages(&self) -> bool {
        matches!(self.solver, Solver::Stages(_))
    }
}

impl Solver {
    fn new(
        device: &Device,
        layout: &wgpu::BindGroupLayout,
        kernel: &Kernel,
        in_stages: bool,
    ) -> Result<Self, BackendError> {
        let make = |kernel: &Kernel| compile(device, layout, kernel);
        match &kernel.stages {
            Some(stages) if in_stages => Ok(Self::Stages(Box::new(StagePipelines {
                anchored: stages.anchored.as_ref().map(make).transpose()?,
                path: make(&stages.path)?,
                guarded: make(&stages.guarded)?,
                is_on_lanes: stages.is_on_lanes(),
                check: make(&stages.check)?,
                columns: make(&stages.columns)?,
                columns_again: make(&stages.columns_again)?,
            }))),
            _ => {
                let anchored = kernel.anchored.as_deref().map(make).transpose()?;
                Ok(Self::Whole { anchored, whole: make(kernel)? })
            }
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
