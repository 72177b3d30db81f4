//! An open GPU whose errors and loss are noticed.

use super::adapter::{AdapterSummary, enumerate};
use crate::backend::BackendError;
use std::env;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Names the adapter to take: part of its name, driver or interface, in any case.
const ADAPTER_VARIABLE: &str = "RODSWEEP_ADAPTER";

/// Longest time that anything may keep the device busy.
const PATIENCE: Duration = Duration::from_secs(600);

/// The first thing that went wrong outside an error scope.
#[derive(Clone, Debug, Default)]
struct Health(Arc<Mutex<Option<String>>>);

impl Health {
    fn note(&self, trouble: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(trouble);
    }

    fn check(&self) -> Result<(), BackendError> {
        match &*self.0.lock().unwrap_or_else(PoisonError::into_inner) {
            None => Ok(()),
            Some(trouble) => Err(failed(trouble)),
        }
    }
}

/// An open GPU.
#[derive(Debug)]
pub struct Device {
    pub(super) raw: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    adapter: AdapterSummary,
    health: Health,
    /// Time to find and open the device [s].
    pub(super) open_seconds: f64,
}

pub(super) fn failed(reason: impl ToString) -> BackendError {
    BackendError::DeviceFailed { reason: reason.to_string() }
}

impl Device {
    /// Opens the best adapter: discrete, then integrated, virtual, software; or the one that the environment
    /// variable `RODSWEEP_ADAPTER` names.
    pub fn open() -> Result<Self, BackendError> {
        Self::open_named(env::var(ADAPTER_VARIABLE).ok().as_deref())
    }

    /// Opens the best adapter of those whose name, driver or interface contains `wanted`, in any case.
    pub fn open_named(wanted: Option<&str>) -> Result<Self, BackendError> {
        let start = Instant::now();
        let adapters = enumerate();
        if adapters.is_empty() {
            let reason = "no Vulkan, Metal or Direct3D 12 driver was found".into();
            return Err(BackendError::NoDevice { reason });
        }
        let describe = |adapter: &wgpu::Adapter| AdapterSummary::new(adapter).to_string();
        let matches = |adapter: &&wgpu::Adapter| {
            wanted.is_none_or(|wanted| describe(adapter).to_lowercase().contains(&wanted.to_lowercase()))
        };
        let Some(adapter) = adapters.iter().find(matches) else {
            let found: Vec<_> = adapters.iter().map(describe).collect();
            let reason = format!(
                "{ADAPTER_VARIABLE} is `{}`, which matches none of: {}",
                wanted.unwrap_or_default(),
                found.join("; ")
            );
            return Err(BackendError::NoDevice { reason });
        };
        let useful = wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::SHADER_F64;
        let request = adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("rodsweep"),
            required_features: adapter.features() & useful,
            required_limits: adapter.limits(),
            ..Default::default()
        });
        let summary = AdapterSummary::new(adapter);
        let (raw, queue) = pollster::block_on(request)
            .map_err(|error| BackendError::NoDevice { reason: format!("{summary} would not open: {error}") })?;
        let health = Health::default();
        let (lost, uncaptured) = (health.clone(), health.clone());
        raw.set_device_lost_callback(move |reason, message| {
            lost.note(format!("the device was lost ({reason:?}): {message}"));
        });
        raw.on_uncaptured_error(Arc::new(move |error: wgpu::Error| uncaptured.note(error.to_string())));
        Ok(Self { raw, queue, adapter: summary, health, open_seconds: start.elapsed().as_secs_f64() })
    }

    pub fn adapter(&self) -> &AdapterSummary {
        &self.adapter
    }

    /// Whether the device still works as far as is known.
    pub fn check(&self) -> Result<(), BackendError> {
        self.health.check()
    }

    /// Gives the device up at once, as a driver reset would; for tests of what follows.
    pub fn destroy(&self) {
        self.raw.destroy();
        // The loss is reported while polling.
        let _ = self.raw.poll(wgpu::PollType::Poll);
    }

    /// Runs `create` and returns what it made, or the error it raised; `what` names it.
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
            Some(error) => Err(failed(format!("{what}: {error}"))),
        }
    }

    /// A buffer, not yet filled.
    pub(super) fn buffer(
        &self,
        what: &str,
        size: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, BackendError> {
        let descriptor = wgpu::BufferDescriptor { label: Some(what), size, usage, mapped_at_creation: false };
        self.scoped(what, || self.raw.create_buffer(&descriptor))
    }

    /// Waits for one submission, or for all.
    pub(super) fn wait(&self, submission: Option<wgpu::SubmissionIndex>) -> Result<(), BackendError> {
        let poll = wgpu::PollType::Wait { submission_index: submission, timeout: Some(PATIENCE) };
        self.raw.poll(poll).map_err(|error| failed(format!("{}: {error}", self.adapter.name)))?;
        self.check()
    }
}
