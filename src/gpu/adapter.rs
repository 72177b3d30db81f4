//! Which GPUs this machine has, and which of them to take.

use std::fmt;

/// What an adapter is, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum AdapterKind {
    Discrete,
    Integrated,
    Virtual,
    Other,
    /// Runs on the CPU; slower than the CPU engine.
    Software,
}

/// Facts about an adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterSummary {
    pub name: String,
    pub kind: AdapterKind,
    /// The graphics interface, for example `vulkan`.
    pub api: String,
    /// Driver and its version.
    pub driver: String,
    /// [bytes]
    pub max_buffer_size: u64,
    /// [bytes]
    pub max_storage_binding_size: u64,
    /// In one dimension of a dispatch.
    pub max_workgroups: u32,
    pub max_workgroup_size: u32,
    /// [bytes]
    pub max_workgroup_storage: u32,
    pub min_subgroup_size: u32,
    pub max_subgroup_size: u32,
    pub has_timestamps: bool,
    pub has_f64: bool,
    pub has_pipeline_cache: bool,
}

impl AdapterSummary {
    pub fn is_software(&self) -> bool {
        self.kind == AdapterKind::Software
    }

    pub(super) fn new(adapter: &wgpu::Adapter) -> Self {
        let (info, limits, features) = (adapter.get_info(), adapter.limits(), adapter.features());
        Self {
            kind: kind_of(&info),
            api: info.backend.to_string(),
            driver: [info.driver.trim(), info.driver_info.trim()].join(" ").trim().to_owned(),
            name: info.name,
            max_buffer_size: limits.max_buffer_size,
            max_storage_binding_size: limits.max_storage_buffer_binding_size,
            max_workgroups: limits.max_compute_workgroups_per_dimension,
            max_workgroup_size: limits.max_compute_invocations_per_workgroup,
            max_workgroup_storage: limits.max_compute_workgroup_storage_size,
            min_subgroup_size: info.subgroup_min_size,
            max_subgroup_size: info.subgroup_max_size,
            has_timestamps: features.contains(wgpu::Features::TIMESTAMP_QUERY),
            has_f64: features.contains(wgpu::Features::SHADER_F64),
            has_pipeline_cache: features.contains(wgpu::Features::PIPELINE_CACHE),
        }
    }
}

fn kind_of(info: &wgpu::AdapterInfo) -> AdapterKind {
    match info.device_type {
        wgpu::DeviceType::DiscreteGpu => AdapterKind::Discrete,
        wgpu::DeviceType::IntegratedGpu => AdapterKind::Integrated,
        wgpu::DeviceType::VirtualGpu => AdapterKind::Virtual,
        wgpu::DeviceType::Cpu => AdapterKind::Software,
        wgpu::DeviceType::Other => AdapterKind::Other,
    }
}

/// Every adapter of this machine, best first.
pub fn adapters() -> Vec<AdapterSummary> {
    enumerate().iter().map(AdapterSummary::new).collect()
}

/// Adapters, best kind first; the system's own order within a kind.
pub(super) fn enumerate() -> Vec<wgpu::Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::PRIMARY,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let mut found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    found.sort_by_key(|adapter| kind_of(&adapter.get_info()));
    found
}

impl fmt::Display for AdapterKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            AdapterKind::Discrete => "discrete",
            AdapterKind::Integrated => "integrated",
            AdapterKind::Virtual => "virtual",
            AdapterKind::Other => "other",
            AdapterKind::Software => "software",
        })
    }
}

impl fmt::Display for AdapterSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} GPU, {}, {})", self.name, self.kind, self.api, self.driver)
    }
}
