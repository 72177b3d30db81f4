//! Registers and occupancy of kernels, by a driver's own compiler: `rodsweep-registers FOLDER` compiles each `.wgsl` of the
//! folder for the first Vulkan device and prints what the driver says of it, a line of a table each.
//!
//! No hardware is needed: Mesa's RADV compiles for AMD's chips without one, see `benches/gpu/compile`.

use ash::vk;
use naga::back::spv;
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, Module, ShaderStage, front};
use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::ffi::{CStr, CString};
use std::path::{Path, PathBuf};
use std::{env, fs};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// The statistics of RADV that are printed. Other drivers' statistics are printed in full.
const COLUMNS: [&str; 6] =
    ["VGPRs", "SGPRs", "Spilled VGPRs", "Scratch size", "Code size", "Subgroups per SIMD"];

fn main() -> Result<()> {
    let folder = env::args().nth(1).ok_or("name a folder of .wgsl files")?;
    let mut files: Vec<PathBuf> =
        fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    files.retain(|file| file.extension().is_some_and(|ending| ending == "wgsl"));
    files.sort();
    if files.is_empty() {
        return Err("there is no .wgsl file".into());
    }
    let device = Device::open()?;
    let compiled = |file: &PathBuf| device.compile(file).map_err(|error| format!("{}: {error}", file.display()));
    let kernels = files.iter().map(compiled).collect::<std::result::Result<Vec<_>, _>>()?;
    let mut columns: BTreeSet<&str> = kernels.iter().flatten().map(|(name, _)| name.as_str()).collect();
    if COLUMNS.iter().any(|name| columns.contains(name)) {
        columns = COLUMNS.into();
    }
    println!("{}\n", device.name);
    println!("| kernel | {} |", Vec::from_iter(columns.iter().copied()).join(" | "));
    println!("|---|{}", "---|".repeat(columns.len()));
    for (file, found) in files.iter().zip(&kernels) {
        let cell = |name: &&str| found.get(*name).map_or("?".into(), u64::to_string);
        let cells: Vec<String> = columns.iter().map(cell).collect();
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        println!("| {name} | {} |", cells.join(" | "));
    }
    Ok(())
}

/// A Vulkan device that tells what its compiler made of a pipeline. It lives as long as the program.
struct Device {
    name: String,
    device: ash::Device,
    executables: ash::khr::pipeline_executable_properties::Device,
    _entry: ash::Entry,
}

impl Device {
    fn open() -> Result<Device> {
        // Safety: the loader is the system's, and every handle below belongs to the instance that made it.
        unsafe {
            let entry = ash::Entry::load()?;
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_2);
            let instance =
                entry.create_instance(&vk::InstanceCreateInfo::default().application_info(&application), None)?;
            let physical = *instance.enumerate_physical_devices()?.first().ok_or("no Vulkan device")?;
            let name = instance.get_physical_device_properties(physical);
            let name = name.device_name_as_c_str()?.to_string_lossy().into_owned();
            let queues =
                [vk::DeviceQueueCreateInfo::default().queue_family_index(0).queue_priorities(&[1.0])];
            let extensions = [vk::KHR_PIPELINE_EXECUTABLE_PROPERTIES_NAME.as_ptr()];
            let mut tells =
                vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
            let features = vk::PhysicalDeviceFeatures::default().shader_float64(true).shader_int64(true);
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&extensions)
                .enabled_features(&features)
                .push_next(&mut tells);
            let device = instance.create_device(physical, &info, None)?;
            let executables = ash::khr::pipeline_executable_properties::Device::new(&instance, &device);
            Ok(Device { name, device, executables, _entry: entry })
        }
    }

    /// What the driver says of a kernel's only entry point.
    fn compile(&self, file: &Path) -> Result<BTreeMap<String, u64>> {
        let module = front::wgsl::parse_str(&fs::read_to_string(file)?)?;
        let entry = module.entry_points.iter().find(|entry| entry.stage == ShaderStage::Compute);
        let name = CString::new(entry.ok_or("no entry point")?.name.as_str())?;
        let code = spirv(&module)?;
        // Safety: everything belongs to this device, and what the structures point to outlives the calls.
        unsafe {
            let shader = self.device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&code), None)?;
            let sets = self.set_layouts(&module)?;
            let layout =
                self.device.create_pipeline_layout(&vk::PipelineLayoutCreateInfo::default().set_layouts(&sets), None)?;
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(shader)
                .name(&name);
            let info = vk::ComputePipelineCreateInfo::default()
                .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
                .stage(stage)
                .layout(layout);
            let pipelines = self.device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
            let pipeline = pipelines.map_err(|(_, error)| error)?[0];
            let executable = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline);
            let statistics = self.executables.get_pipeline_executable_statistics(&executable)?;
            let found = statistics.iter().map(|statistic| {
                let name = CStr::from_ptr(statistic.name.as_ptr()).to_string_lossy().into_owned();
                (name, statistic.value.u64)
            });
            let found = found.collect();
            self.device.destroy_pipeline(pipeline, None);
            self.device.destroy_pipeline_layout(layout, None);
            sets.iter().for_each(|set| self.device.destroy_descriptor_set_layout(*set, None));
            self.device.destroy_shader_module(shader, None);
            Ok(found)
        }
    }

    /// As the kernel's own variables ask for them.
    fn set_layouts(&self, module: &Module) -> Result<Vec<vk::DescriptorSetLayout>> {
        let mut sets: Vec<Vec<vk::DescriptorSetLayoutBinding>> = Vec::new();
        for (_, variable) in module.global_variables.iter() {
            let Some(binding) = &variable.binding else { continue };
            let kind = match variable.space {
                AddressSpace::Uniform => vk::DescriptorType::UNIFORM_BUFFER,
                _ => vk::DescriptorType::STORAGE_BUFFER,
            };
            let group = binding.group as usize;
            sets.resize(sets.len().max(group + 1), Vec::new());
            sets[group].push(
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding.binding)
                    .descriptor_type(kind)
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE),
            );
        }
        let made = sets.iter().map(|bindings| {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(bindings);
            // Safety: the layout belongs to this device.
            Ok(unsafe { self.device.create_descriptor_set_layout(&info, None)? })
        });
        made.collect()
    }
}

/// As wgpu hands it to a driver that checks accesses to buffers itself.
fn spirv(module: &Module) -> Result<Vec<u32>> {
    let info = Validator::new(ValidationFlags::all(), Capabilities::all()).validate(module)?;
    let options = spv::Options {
        lang_version: (1, 3),
        bounds_check_policies: BoundsCheckPolicies {
            index: BoundsCheckPolicy::Restrict,
            buffer: BoundsCheckPolicy::Unchecked,
            ..BoundsCheckPolicies::default()
        },
        ..spv::Options::default()
    };
    Ok(spv::write_vec(module, &info, &options, None)?)
}
