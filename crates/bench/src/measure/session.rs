//! What all measurements share: engines, effort, one thread to measure on, and the records.

use super::clock::Effort;
use super::engines::{Engine, engines};
use super::options::{Engines, MeasureOptions};
use crate::error::BenchError;
use crate::record::Record;
use rodsweep::gpu::AdapterSummary;
use std::time::Instant;

pub struct Session {
    pub engines: Vec<Engine>,
    pub adapter: Option<AdapterSummary>,
    pub quick: bool,
    pub effort: Effort,
    /// A pool of one thread, whose processor time is measured.
    pub one_thread: rayon::ThreadPool,
    pub records: Vec<Record>,
    /// What could not be measured, and why.
    pub notes: Vec<String>,
    start: Instant,
}

impl Session {
    pub fn new(options: &MeasureOptions) -> Result<Session, BenchError> {
        let quick = options.quick;
        let (mut engines, adapter) = engines();
        engines.retain(|engine| match options.engines {
            Engines::All => true,
            Engines::Cpu => !engine.is_gpu(),
            Engines::Gpu => engine.is_gpu(),
        });
        if engines.is_empty() {
            return Err(BenchError::NoGpu);
        }
        let one_thread = pool(1)?;
        let effort = if quick {
            Effort { least: 3, most: 5, seconds: 0.005 }
        } else {
            Effort { least: 5, most: 25, seconds: 0.04 }
        };
        let (records, notes) = (Vec::new(), Vec::new());
        Ok(Session { engines, adapter, quick, effort, one_thread, records, notes, start: Instant::now() })
    }

    /// Whether the CPU is measured.
    pub fn has_cpu(&self) -> bool {
        self.engines.iter().any(|engine| !engine.is_gpu())
    }

    /// Whether a GPU is measured that is none in software.
    pub fn has_hardware_gpu(&self) -> bool {
        self.engines.iter().any(|engine| engine.is_gpu() && !engine.is_software())
    }

    /// Since the session began.
    pub fn seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Notes something once.
    pub fn note(&mut self, text: String) {
        if !self.notes.contains(&text) {
            self.notes.push(text);
        }
    }
}

pub fn pool(threads: usize) -> Result<rayon::ThreadPool, BenchError> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(threads).build()?)
}
