//! A kernel that takes samples one turn further as the device runs it.

use super::bindings::bind_group_layout;
use super::device::Device;
use super::pipelines::compile;
use super::shader::Kernel;
use crate::backend::BackendError;
use wgpu::BufferBindingType as Kind;

/// Such a kernel of one plan, ready to run.
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
