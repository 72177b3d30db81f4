//! An open GPU. It notices errors and its own loss.

use super::adapter::{AdapterSummary, choose, enumerate};
use super::compiled_kernels::CompiledKernels;
use super::faults::Faults;
use super::pipeline_cache::PipelineCache;
use crate::backend::BackendError;
use std::env;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Names the adapters to take, separated by commas: parts of name, driver or interface, in any case. Or `all`.
const ADAPTER_VARIABLE: &str = "RODSWEEP_ADAPTER";

/// Longest time that anything may keep the device busy.
const PATIENCE: Duration = Duration::from_secs(600);

/// What went wrong outside an error scope.
#[derive(Debug, Default)]
struct Troubles {
    loss: Option<String>,
    /// The first other one.
    other: Option<BackendError>,
}

#[derive(Clone, Debug, Default)]
struct Health(Arc<Mutex<Troubles>>);

impl Health {
    fn troubles(&self) -> MutexGuard<'_, Troubles> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A loss is the cause of whatever else went wrong.
    fn check(&self) -> Result<(), BackendError> {
        let troubles = self.troubles();
        match (&troubles.loss, &troubles.other) {
            (Some(loss), _) => Err(failed(loss)),
            (None, Some(other)) => Err(other.clone()),
            (None, None) => Ok(()),
        }
    }
}

/// An open GPU. Clones are the same device: they share its loss and the kernels that it has compiled.
#[derive(Clone, Debug)]
pub struct Device {
    pub(super) raw: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    adapter: AdapterSummary,
    health: Health,
    pub(super) faults: Faults,
    /// Pipelines of earlier runs.
    pub(super) cache: Option<Arc<PipelineCache>>,
    /// Pipelines of this run.
    pub(super) compiled: Arc<CompiledKernels>,
    /// Whether the self-test has passed.
    pub(super) computes_right: Arc<AtomicBool>,
    /// Time to find and open the device (s).
    pub(super) open_seconds: f64,
}

pub(super) fn failed(reason: impl ToString) -> BackendError {
    BackendError::DeviceFailed { reason: reason.to_string() }
}

/// Why a device failed, as a part of another message.
pub(super) fn reason(error: &BackendError) -> String {
    match error {
        BackendError::DeviceFailed { reason }
        | BackendError::NoDevice { reason }
        | BackendError::OutOfMemory { reason } => reason.clone(),
        BackendError::Unsupported { .. } => error.to_string(),
    }
}

/// What an error of wgpu is to the engine; `what` names what was being made.
fn named(what: &str, error: &wgpu::Error) -> BackendError {
    let reason = format!("{what}: {error}");
    match error {
        wgpu::Error::OutOfMemory { .. } => BackendError::OutOfMemory { reason },
        _ => failed(reason),
    }
}

/// The adapters that the environment variable `RODSWEEP_ADAPTER` names. Without it: the best one and those like it.
///
/// Empty where the machine has no GPU.
///
/// # Errors
///
/// `NoDevice`: the variable has a name that matches none.
pub fn chosen_adapters() -> Result<Vec<AdapterSummary>, BackendError> {
    Ok(chosen(wanted().as_deref())?.iter().map(AdapterSummary::new).collect())
}

fn wanted() -> Option<String> {
    env::var(ADAPTER_VARIABLE).ok().filter(|names| !names.trim().is_empty())
}

fn no_driver() -> BackendError {
    BackendError::NoDevice { reason: "no Vulkan, Metal or Direct3D 12 driver was found".into() }
}

fn chosen(wanted: Option<&str>) -> Result<Vec<wgpu::Adapter>, BackendError> {
    let found = enumerate();
    let summaries: Vec<_> = found.iter().map(AdapterSummary::new).collect();
    if found.is_empty() {
        return Ok(found);
    }
    let places = choose(&summaries, wanted).map_err(|name| {
        let all: Vec<_> = summaries.iter().map(AdapterSummary::to_string).collect();
        let reason = format!("{ADAPTER_VARIABLE} is `{name}`, which matches none of: {}", all.join("; "));
        BackendError::NoDevice { reason }
    })?;
    Ok(places.into_iter().map(|place| found[place].clone()).collect())
}

impl Device {
    /// Opens the first adapter that the environment variable `RODSWEEP_ADAPTER` names. Without it, the best one:
    /// discrete before integrated, virtual and software.
    ///
    /// # Errors
    ///
    /// `NoDevice`: there is none, the name matches none, or it does not open.
    pub fn open() -> Result<Self, BackendError> {
        Self::open_named(wanted().as_deref())
    }

    /// Opens the best adapter of those whose name, driver or interface contains `wanted`, in any case.
    ///
    /// # Errors
    ///
    /// Those of [`Device::open`].
    pub fn open_named(wanted: Option<&str>) -> Result<Self, BackendError> {
        Self::open_with_faults(wanted, Faults::default())
    }

    /// Opens every adapter of [`chosen_adapters`]. Those that do not open are left out.
    ///
    /// # Errors
    ///
    /// `NoDevice`: there is none, or none opens.
    pub fn open_all() -> Result<Vec<Self>, BackendError> {
        let adapters = chosen(wanted().as_deref())?;
        if adapters.is_empty() {
            return Err(no_driver());
        }
        let opened = adapters.iter().map(|adapter| Self::request(adapter, Faults::default()));
        let (devices, failures): (Vec<_>, Vec<_>) = opened.partition(Result::is_ok);
        match failures.into_iter().find_map(Result::err) {
            Some(error) if devices.is_empty() => Err(error),
            _ => Ok(devices.into_iter().flatten().collect()),
        }
    }

    /// The same as [`Device::open_named`] with a device that fails as planned, for tests.
    #[doc(hidden)]
    pub fn open_with_faults(wanted: Option<&str>, faults: Faults) -> Result<Self, BackendError> {
        let adapters = chosen(wanted)?;
        Self::request(adapters.first().ok_or_else(no_driver)?, faults)
    }

    fn request(adapter: &wgpu::Adapter, faults: Faults) -> Result<Self, BackendError> {
        let start = Instant::now();
        let useful = wgpu::Features::TIMESTAMP_QUERY
            | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS
            | wgpu::Features::PIPELINE_CACHE
            | wgpu::Features::SHADER_F64;
        let mut limits = adapter.limits();
        if let Some(most) = faults.largest_buffer {
            limits.max_buffer_size = limits.max_buffer_size.min(most);
            limits.max_storage_buffer_binding_size = limits.max_storage_buffer_binding_size.min(most);
        }
        if let Some(most) = faults.most_workgroups {
            limits.max_compute_workgroups_per_dimension = limits.max_compute_workgroups_per_dimension.min(most);
        }
        let summary = AdapterSummary::new(adapter).limited(&limits);
        let request = adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("rodsweep"),
            required_features: adapter.features() & useful,
            required_limits: limits,
            ..Default::default()
        });
        let (raw, queue) = pollster::block_on(request)
            .map_err(|error| BackendError::NoDevice { reason: format!("{summary} would not open: {error}") })?;
        let health = Health::default();
        let (lost, uncaptured) = (health.clone(), health.clone());
        raw.set_device_lost_callback(move |reason, message| {
            let loss = format!("the device was lost ({reason:?}) {message}").trim_end().to_owned();
            lost.troubles().loss.get_or_insert(loss);
        });
        raw.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            uncaptured.troubles().other.get_or_insert_with(|| named("device", &error));
        }));
        let cache = PipelineCache::open(&raw, &adapter.get_info()).map(Arc::new);
        let open_seconds = start.elapsed().as_secs_f64();
        let (compiled, computes_right) = Default::default();
        Ok(Self { raw, queue, adapter: summary, health, faults, cache, compiled, computes_right, open_seconds })
    }

    /// Opens the adapter of a lost device again.
    pub(super) fn reopen(&self) -> Result<Self, BackendError> {
        let is_same = |adapter: &&wgpu::Adapter| self.adapter.is_same(&AdapterSummary::new(adapter));
        match enumerate().iter().find(is_same) {
            Some(adapter) => Self::request(adapter, self.faults.clone()),
            None => Err(BackendError::NoDevice { reason: format!("{} is gone", self.adapter) }),
        }
    }

    /// What was opened; limits are those that hold for this device.
    pub fn adapter(&self) -> &AdapterSummary {
        &self.adapter
    }

    /// Whether the device still works, as far as is known.
    ///
    /// # Errors
    ///
    /// `DeviceFailed`, `OutOfMemory`: what went wrong first; a loss before all else.
    pub fn check(&self) -> Result<(), BackendError> {
        self.health.check()
    }

    /// Gives the device up at once, as a driver reset would, for tests.
    #[doc(hidden)]
    pub fn destroy(&self) {
        self.raw.destroy();
        self.is_lost();
    }

    /// Whether the device is gone. What fails on a lost device may look like anything.
    pub(super) fn is_lost(&self) -> bool {
        // The loss is reported while polling.
        let _ = self.raw.poll(wgpu::PollType::Poll);
        self.health.troubles().loss.is_some()
    }

    /// Runs `create` and returns what it made, or the error that it raised. `what` names the thing made.
    pub(super) fn scoped<T>(&self, what: &str, create: impl FnOnce() -> T) -> Result<T, BackendError> {
        let memory = self.raw.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.raw.push_error_scope(wgpu::ErrorFilter::Validation);
        let internal = self.raw.push_error_scope(wgpu::ErrorFilter::Internal);
        let made = create();
        let internal = pollster::block_on(internal.pop());
        let validation = pollster::block_on(validation.pop());
        let memory = pollster::block_on(memory.pop());
        match internal.or(validation).or(memory) {
            None => Ok(made),
            Some(error) => Err(named(what, &error)),
        }
    }

    /// A buffer, not yet filled.
    pub(super) fn buffer(
        &self,
        what: &str,
        size: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, BackendError> {
        if self.faults.refuses(size) {
            return Err(BackendError::OutOfMemory { reason: format!("{what}: no room for {size} bytes") });
        }
        let descriptor = wgpu::BufferDescriptor { label: Some(what), size, usage, mapped_at_creation: false };
        self.scoped(what, || self.raw.create_buffer(&descriptor))
    }

    /// Waits for one submission, or for all.
    pub(super) fn wait(&self, submission: Option<wgpu::SubmissionIndex>) -> Result<(), BackendError> {
        let poll = wgpu::PollType::Wait { submission_index: submission, timeout: Some(PATIENCE) };
        let polled = self.raw.poll(poll);
        // What went wrong first says more than that nothing came back.
        self.check()?;
        polled.map(|_| ()).map_err(|error| failed(format!("{}: {error}", self.adapter.name)))
    }
}
