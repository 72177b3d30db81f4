//! What tests need: a GPU or a visible skip, faults on demand, samples as the device makes them.

use super::device::Device;
use super::dispatch_buffers::read_back;
use super::engine::Gpu;
use super::shader::{Generator, VoxelGrid, WORKGROUP_SIZE};
use super::voxel_kernels::VoxelKernels;
use crate::backend::{BackendError, Precision};
use crate::model::{BLOCK, Blocks};

use std::sync::{Arc, Mutex, PoisonError};

pub use super::faults::{FaultCounts, Faults, Flip};

/// Devices that tests of one process share, so that most kernels are compiled once. Software drivers compile the kernels
/// of a device one after the other, so there are two.
static SHARED: Mutex<Vec<Device>> = Mutex::new(Vec::new());
const SHARED_DEVICES: usize = 2;

/// Opens a GPU for a test, or takes the one that another test of this process has opened.
///
/// Without one: prints that `test` is skipped and returns `None`, or panics where the environment variable
/// `RODSWEEP_GPU` is `require`. A test that gives its device up needs one of its own, see [`Device::open`].
pub fn device_or_skip(test: &str) -> Option<Device> {
    match shared() {
        Ok(device) => Some(device),
        Err(error) if std::env::var("RODSWEEP_GPU").is_ok_and(|value| value == "require") => {
            panic!("{test} requires a GPU (RODSWEEP_GPU=require): {error}")
        }
        Err(error) => {
            eprintln!("SKIPPED {test}: {error}");
            None
        }
    }
}

/// The shared device that fewest tests hold. A device that has shown any trouble is left to the tests that hold it.
fn shared() -> Result<Device, BackendError> {
    let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    shared.retain(|device| !device.is_lost() && device.check().is_ok());
    let holders = |device: &Device| Arc::strong_count(&device.compiled);
    let idle = 1;
    match shared.iter().min_by_key(|device| holders(device)) {
        Some(device) if holders(device) == idle || shared.len() == SHARED_DEVICES => Ok(device.clone()),
        _ => {
            let device = Device::open()?;
            shared.push(device.clone());
            Ok(device)
        }
    }
}

/// Inputs of some samples as the device makes them, in the plan's units, block by block.
pub fn generate_inputs(
    gpu: &mut Gpu,
    generator: &Generator,
    first: u64,
    sample_count: usize,
) -> Result<Blocks<f64>, BackendError> {
    let dispatcher = &mut gpu.dispatcher;
    let kernels = VoxelKernels::new(dispatcher, 1.0, generator, VoxelGrid::around(&[]))?;
    let mut made = Blocks::new(dispatcher.plan.input_count, sample_count);
    let buffers = kernels.buffers(dispatcher, sample_count.div_ceil(BLOCK))?;
    buffers.set_range(&dispatcher.device, first, sample_count);
    let mut encoder = dispatcher.device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(&kernels.generate);
    pass.set_bind_group(0, &buffers.generate, &[]);
    pass.dispatch_workgroups((sample_count as u32).div_ceil(WORKGROUP_SIZE), 1, 1);
    drop(pass);
    dispatcher.device.queue.submit([encoder.finish()]);
    let bytes = (dispatcher.precision.size() * made.data().len()) as u64;
    read_back(&dispatcher.device, &buffers.solve.inputs, 0..bytes, |bytes| match dispatcher.precision {
        Precision::F32 => {
            let values: &[f32] = bytemuck::cast_slice(bytes);
            made.data_mut().iter_mut().zip(values).for_each(|(to, from)| *to = f64::from(*from));
        }
        Precision::F64 => made.data_mut().copy_from_slice(bytemuck::cast_slice(bytes)),
    })?;
    Ok(made)
}
