//! What all measurements share: engines, effort, one thread to measure on, and the records.

use super::clock::Effort;
use super::engines::{Engine, engines};
use crate::cli::args::{BenchArguments, BenchBackend};
use crate::cli::{BenchError, say};
use rodsweep::gpu::AdapterSummary;
use crate::record::Record;
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
    pub fn new(arguments: &BenchArguments) -> Result<Session, BenchError> {
        let quick = arguments.quick;
        let (mut engines, adapter) = engines();
        engines.retain(|engine| match arguments.backend {
            BenchBackend::All => true,
            BenchBackend::Cpu => !engine.is_gpu(),
            BenchBackend::Gpu => engine.is_gpu(),
        });
        if engines.is_empty() {
            return Err(BenchError::Usage("this machine has no GPU to measure; see `rodsweep doctor`".into()));
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

    pub fn say(&self, what: &str) {
        say(&format!("{:6.1} s  {what}", self.seconds()));
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
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| BenchError::Usage(format!("no thread to time on: {error}")))
}
