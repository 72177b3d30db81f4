//! Bind groups of storage and uniform buffers, numbered from 0 in the order in which they are given.

use super::device::Device;
use crate::backend::BackendError;

/// The layout with one buffer of each kind.
pub(super) fn bind_group_layout(
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

/// These buffers in a layout.
pub(super) fn bind_group(
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
