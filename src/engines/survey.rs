//! What this machine has, and which engine would be taken and why.

use super::{Engine, EngineRequest, F32_TOLERANCE};
#[cfg(feature = "gpu")]
use crate::backend::BackendKind;
use crate::backend::{Backend, BackendError, Precision};
use crate::cpu::Cpu;
#[cfg(feature = "gpu")]
use crate::gpu::{self, AdapterSummary, Device, SelfTest, self_test};
use crate::model::Plan;
#[cfg(feature = "gpu")]
use std::path::PathBuf;

/// What this machine has, and what would be used of it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Survey {
    /// Vector instructions and threads of the CPU engine.
    pub processor: String,
    /// Where the system tells.
    pub memory: Option<Memory>,
    /// What is taken for the plan's tolerance unless an engine is asked for.
    pub engine: Result<Engine, BackendError>,
    /// What is taken from a tolerance of [`F32_TOLERANCE`] on.
    pub coarse_engine: Result<Engine, BackendError>,
    /// Every adapter, best first.
    #[cfg(feature = "gpu")]
    pub adapters: Vec<AdapterSummary>,
    /// Where compiled kernels are kept; `None` where they are not.
    #[cfg(feature = "gpu")]
    pub cache_directory: Option<PathBuf>,
    /// The GPU that would be taken, opened and tried; an error where none can be used.
    #[cfg(feature = "gpu")]
    pub gpu: Result<GpuSurvey, BackendError>,
}

/// Memory of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Memory {
    /// In bytes
    pub total: u64,
    /// What programs can still have (bytes)
    pub available: u64,
}

/// The GPU that would be taken.
#[cfg(feature = "gpu")]
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct GpuSurvey {
    /// The adapter.
    pub adapter: AdapterSummary,
    /// Adapters that share every sweep with it.
    pub others: Vec<AdapterSummary>,
    /// Whether it computes as it should.
    pub self_test: Result<SelfTest, BackendError>,
    /// Whether the engine starts on it, in f32.
    pub start: Result<(), BackendError>,
}

/// Looks at the machine and tries its engines with a plan.
///
/// # Errors
///
/// A plan that the CPU engine does not model.
pub fn survey(plan: &Plan) -> Result<Survey, BackendError> {
    Ok(Survey {
        processor: Cpu::new(plan, Precision::F64)?.info().device,
        memory: memory(),
        engine: EngineRequest::any().choose_for(&plan.scene, plan.options.tolerance),
        coarse_engine: EngineRequest::any().choose_for(&plan.scene, F32_TOLERANCE),
        #[cfg(feature = "gpu")]
        adapters: gpu::adapters(),
        #[cfg(feature = "gpu")]
        cache_directory: gpu::cache_directory(),
        #[cfg(feature = "gpu")]
        gpu: survey_gpu(plan),
    })
}

#[cfg(feature = "gpu")]
fn survey_gpu(plan: &Plan) -> Result<GpuSurvey, BackendError> {
    let device = Device::open()?;
    let others = gpu::chosen_adapters().unwrap_or_default().into_iter().skip(1).collect();
    let engine = Engine::new(BackendKind::Gpu, Precision::F32, "tried");
    Ok(GpuSurvey {
        adapter: device.adapter().clone(),
        others,
        self_test: self_test(&device),
        start: engine.make(plan).map(|_| ()),
    })
}

/// As Linux tells it.
fn memory() -> Option<Memory> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let bytes = |name: &str| {
        let line = text.lines().find(|line| line.starts_with(name))?;
        Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
    };
    Some(Memory { total: bytes("MemTotal:")?, available: bytes("MemAvailable:")? })
}
