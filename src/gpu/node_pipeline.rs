//! The kernel by nodes as the device runs it.

use super::bindings::bind_group_layout;
use super::device::{Device, failed};
use super::pipelines::compile;
use super::shader::Kernel;
use crate::backend::BackendError;
use crate::model::Plan;
use wgpu::BufferBindingType as Kind;

/// The kernel by nodes of one plan, ready to run.
pub(super) struct NodePipeline {
    pub layout: wgpu::BindGroupLayout,
    pub pipeline: wgpu::ComputePipeline,
}

impl NodePipeline {
    /// Compiles it.
    pub fn new(device: &Device, plan: &Plan) -> Result<Self, BackendError> {
        let (read, write) = (Kind::Storage { read_only: true }, Kind::Storage { read_only: false });
        let layout =
            bind_group_layout(device, "nodes", &[Kind::Uniform, read, read, write, Kind::Uniform, write, write])?;
        let kernel = Kernel::nodes(plan, device.adapter().is_software()).map_err(failed)?;
        let pipeline = compile(device, &layout, &kernel)?;
        Ok(Self { layout, pipeline })
    }
}
