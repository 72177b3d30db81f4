//! Which GPUs this machine has, and which of them to take.

use std::fmt;
use std::path::PathBuf;
use std::sync::OnceLock;

/// What an adapter is, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum AdapterKind {
    /// A card with memory of its own.
    Discrete,
    /// Shares the processor's memory.
    Integrated,
    /// Of a virtual machine.
    Virtual,
    /// Its driver does not say.
    Other,
    /// Runs on the CPU; slower than the CPU engine.
    Software,
}

/// What a GPU is and how much it can do.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct AdapterSummary {
    /// As the driver gives it.
    pub name: String,
    /// Hardware or software.
    pub kind: AdapterKind,
    /// The graphics interface, for example `vulkan`.
    pub api: String,
    /// Driver and its version.
    pub driver: String,
    /// Its place on the PCI bus, where known.
    pub bus: String,
    /// Vendor and model on the PCI bus; zeros where unknown.
    pub model: (u32, u32),
    /// The compiler of its kernels where there is a choice: `DXC` or `FXC` of Direct3D 12. Empty: the driver itself.
    pub compiler: String,
    /// Largest buffer (bytes)
    pub max_buffer_size: u64,
    /// Largest part of a buffer that a kernel can see (bytes)
    pub max_storage_binding_size: u64,
    /// Workgroups in one dimension of a dispatch at most.
    pub max_workgroups: u32,
    /// Invocations of a workgroup at most.
    pub max_workgroup_size: u32,
    /// Memory that a workgroup shares at most (bytes)
    pub max_workgroup_storage: u32,
    /// Fewest invocations that run in step.
    pub min_subgroup_size: u32,
    /// Most invocations that run in step.
    pub max_subgroup_size: u32,
    /// Whether the device tells the time.
    pub has_timestamps: bool,
    /// Whether kernels may compute in f64.
    pub has_f64: bool,
    /// Whether the driver hands out compiled kernels, to keep on disk.
    pub has_pipeline_cache: bool,
}

impl AdapterSummary {
    /// Whether it is a program on the processor.
    pub fn is_software(&self) -> bool {
        self.kind == AdapterKind::Software
    }

    pub(super) fn new(adapter: &wgpu::Adapter) -> Self {
        let (info, limits, features) = (adapter.get_info(), adapter.limits(), adapter.features());
        Self {
            kind: kind_of(&info),
            api: info.backend.to_string(),
            driver: [info.driver.trim(), info.driver_info.trim()].join(" ").trim().to_owned(),
            compiler: if info.backend == wgpu::Backend::Dx12 { direct_compiler().into() } else { String::new() },
            name: info.name,
            bus: info.device_pci_bus_id,
            model: (info.vendor, info.device),
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

    /// The same with what a device was opened with.
    pub(super) fn limited(self, limits: &wgpu::Limits) -> Self {
        Self {
            max_buffer_size: limits.max_buffer_size,
            max_storage_binding_size: limits.max_storage_buffer_binding_size,
            max_workgroups: limits.max_compute_workgroups_per_dimension,
            ..self
        }
    }

    /// Whether rows of one are those of the other, bit for bit, as far as can be known.
    pub fn is_like(&self, other: &AdapterSummary) -> bool {
        let what = |a: &AdapterSummary| (a.name.clone(), a.kind, a.api.clone(), a.driver.clone(), a.compiler.clone());
        what(self) == what(other)
    }

    /// Whether another interface drives a card of this model as well.
    fn is_twin_of(&self, other: &AdapterSummary) -> bool {
        let is_same_model = if self.model.1 == 0 { self.name == other.name } else { self.model == other.model };
        is_same_model && self.kind == other.kind && self.api != other.api
    }

    /// Whether it is the same adapter, as far as can be known.
    pub(super) fn is_same(&self, other: &AdapterSummary) -> bool {
        self.is_like(other) && self.bus == other.bus
    }
}

/// Which of the adapters found to take, by their places; they are sorted, best first.
///
/// Without a wish: the first, and those like it unless they are software. An error is a name that matches none.
/// A card that two interfaces drive is taken once, by the first; by its name and the interface's the other is had.
pub(super) fn choose(found: &[AdapterSummary], wanted: Option<&str>) -> Result<Vec<usize>, String> {
    let all = || 0..found.len();
    let is_once = |place: usize| !found[..place].iter().any(|earlier| found[place].is_twin_of(earlier));
    match wanted {
        None => {
            let shares = |place: &usize| *place == 0 || !found[0].is_software() && found[*place].is_like(&found[0]);
            Ok(all().filter(shares).collect())
        }
        Some(wish) if wish.trim().eq_ignore_ascii_case("all") => {
            let is_taken = |place: &usize| *place == 0 || !found[*place].is_software() && is_once(*place);
            Ok(all().filter(is_taken).collect())
        }
        Some(names) => {
            let mut taken = Vec::new();
            for name in names.split(',').map(|name| name.trim().to_lowercase()) {
                let matches = |place: &usize| found[*place].to_string().to_lowercase().contains(&name);
                let place = all().filter(matches).find(|place| !taken.contains(place)).or_else(|| all().find(matches));
                taken.push(place.ok_or(name)?);
            }
            Ok(taken)
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

/// The compiler that the Direct3D backend takes: DXC where its library can be loaded, which takes a hundredth of the time of FXC,
/// the one that comes with Windows.
fn direct_compiler() -> &'static str {
    let beside = std::env::current_exe().ok().and_then(|program| Some(program.parent()?.to_owned()));
    let paths = std::env::var_os("PATH").unwrap_or_default();
    compiler_among(beside.into_iter().chain(std::env::split_paths(&paths)))
}

fn compiler_among(mut folders: impl Iterator<Item = PathBuf>) -> &'static str {
    if folders.any(|folder| folder.join("dxcompiler.dll").is_file()) { "DXC" } else { "FXC" }
}

/// Direct3D comes last: its kernels pass through one more compiler, and its rows are no better.
fn place_of(info: &wgpu::AdapterInfo) -> (AdapterKind, bool) {
    (kind_of(info), info.backend == wgpu::Backend::Dx12)
}

/// Adapters, best kind first, then those of Vulkan and Metal before Direct3D; else the system's own order.
pub(super) fn enumerate() -> Vec<wgpu::Adapter> {
    // One for the process: a driver that is loaded anew for each fails after some thirty times (NVIDIA 580).
    static INSTANCE: OnceLock<wgpu::Instance> = OnceLock::new();
    let instance = INSTANCE.get_or_init(|| {
        wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::PRIMARY,
            // Lists of samples on the device are never longer than their dispatch.
            flags: wgpu::InstanceFlags::default() - wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        })
    });
    let mut found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    found.sort_by_key(|adapter| place_of(&adapter.get_info()));
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

#[cfg(test)]
mod tests {
    use super::{AdapterKind, AdapterSummary, choose, compiler_among};

    fn adapter(name: &str, kind: AdapterKind, driver: &str) -> AdapterSummary {
        AdapterSummary {
            name: name.into(),
            kind,
            api: "vulkan".into(),
            driver: driver.into(),
            bus: String::new(),
            model: (0, 0),
            compiler: String::new(),
            max_buffer_size: 1 << 30,
            max_storage_binding_size: 1 << 30,
            max_workgroups: 65_535,
            max_workgroup_size: 1024,
            max_workgroup_storage: 32_768,
            min_subgroup_size: 32,
            max_subgroup_size: 32,
            has_timestamps: true,
            has_f64: true,
            has_pipeline_cache: true,
        }
    }

    #[test]
    fn adapters_share_where_their_rows_are_the_same() {
        let (discrete, software) = (AdapterKind::Discrete, AdapterKind::Software);
        let found = [
            adapter("Big", discrete, "550"),
            adapter("Small", discrete, "550"),
            adapter("Big", discrete, "550"),
            adapter("Big", discrete, "535"),
            adapter("pipe", software, "22"),
        ];
        assert_eq!(choose(&found, None), Ok(vec![0, 2]));
        assert_eq!(choose(&found, Some("ALL")), Ok(vec![0, 1, 2, 3]));
        assert_eq!(choose(&found, Some("small")), Ok(vec![1]));
        assert_eq!(choose(&found, Some("big, pipe,big,big,big")), Ok(vec![0, 4, 2, 3, 0]));
        assert_eq!(choose(&found, Some("big,huge")), Err("huge".into()));
        assert_eq!(choose(&[found[4].clone(), found[4].clone()], None), Ok(vec![0]));
        assert_eq!(choose(&found[4..], Some("all")), Ok(vec![0]));
    }

    #[test]
    fn a_card_of_two_interfaces_is_taken_once() {
        let card = |name: &str, api: &str, model: (u32, u32)| AdapterSummary {
            api: api.into(),
            model,
            ..adapter(name, AdapterKind::Discrete, "550")
        };
        let (big, small) = ((0x10de, 0x2684), (0x10de, 0x2204));
        let found = [
            card("Big", "vulkan", big),
            card("Small", "vulkan", small),
            card("Big (Direct3D)", "dx12", big),
            card("Small", "dx12", small),
            card("Other", "dx12", (0x1002, 0x744c)),
        ];
        assert_eq!(choose(&found, Some("all")), Ok(vec![0, 1, 4]));
        assert_eq!(choose(&found, None), Ok(vec![0]));
        assert_eq!(choose(&found, Some("dx12")), Ok(vec![2]));
        assert_eq!(choose(&found[2..], Some("all")), Ok(vec![0, 1, 2]));
        // Two cards of one model are two.
        assert_eq!(choose(&[found[0].clone(), found[0].clone(), found[2].clone()], Some("all")), Ok(vec![0, 1]));
    }

    #[test]
    fn the_faster_compiler_is_found_by_its_library() {
        let folder = tempfile::tempdir().unwrap();
        let folders = || [std::path::PathBuf::from("/nowhere"), folder.path().to_owned()].into_iter();
        assert_eq!(compiler_among(folders()), "FXC");
        std::fs::write(folder.path().join("dxcompiler.dll"), "").unwrap();
        assert_eq!(compiler_among(folders()), "DXC");
    }
}
