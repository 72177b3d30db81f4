//! Every engine of this machine against the reference, in a chain whose links each isolate one cause: reference and cpu
//! f64 (algebra), cpu f64 and cpu f32 (precision), cpu f32 and gpu (hardware). And every engine on the hard cases.
//!
//! ```no_run
//! use rodsweep_bench::verify::{VerifyOptions, verify};
//!
//! let options = VerifyOptions::new().samples(100).seed(7);
//! let found = verify(&options, &mut |line| eprintln!("{line}"))?;
//! println!("{}", found.text());
//! assert!(found.is_within_limits());
//! # Ok::<(), rodsweep_bench::BenchError>(())
//! ```

mod answer;
mod around;
mod cases;
mod compare;
mod disagreement_text;
mod disagreements;
mod engines;
mod estimates;
mod hard;
mod hard_text;
mod links;
mod replay;
mod search;
mod text;
mod time;
mod verdicts;

pub use disagreements::{Disagreements, search_disagreements};
pub use estimates::{Estimates, search_estimates};
pub use hard::{HardCases, verify_hard};
pub use search::SearchOptions;

use crate::error::BenchError;
use cases::Case;
use engines::{Run, Setup};
use links::{Link, Row};
use rodsweep::backend::{BackendKind, Precision};
use rodsweep::gpu::adapters;
use std::path::Path;

/// What is checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VerifyOptions {
    samples: usize,
    seed: u64,
    software: bool,
}

impl VerifyOptions {
    /// 200 random scenes beside the shipped ones.
    pub fn new() -> VerifyOptions {
        VerifyOptions { samples: 200, seed: 1, software: true }
    }

    /// Random scenes beside the shipped ones.
    pub fn samples(self, samples: usize) -> VerifyOptions {
        VerifyOptions { samples, ..self }
    }

    /// Seed of the random scenes.
    pub fn seed(self, seed: u64) -> VerifyOptions {
        VerifyOptions { seed, ..self }
    }

    /// Whether a GPU is checked that is software: minutes for a device that no run takes by itself.
    pub fn software(self, software: bool) -> VerifyOptions {
        VerifyOptions { software, ..self }
    }
}

impl Default for VerifyOptions {
    fn default() -> Self {
        VerifyOptions::new()
    }
}

/// What every engine made of the cases, and how far they are apart.
pub struct Verification {
    options: VerifyOptions,
    cases: Vec<Case>,
    runs: Vec<Run>,
    rows: Vec<Row>,
}

/// Solves the shipped scenes and random ones on every engine; `progress` is told what takes long.
///
/// # Errors
///
/// A case that makes no plan. An engine that cannot be had, or that breaks down, is a row of the result.
pub fn verify(options: &VerifyOptions, progress: &mut dyn FnMut(&str)) -> Result<Verification, BenchError> {
    let cases = cases::cases(options.samples, options.seed)?;
    let (cpu, gpu) = (Setup::single(BackendKind::Cpu), Setup::single(BackendKind::Gpu));
    let setups = [
        Setup::REFERENCE,
        Setup::FINE,
        Setup { precision: Precision::F64, ..cpu },
        cpu,
        Setup { kind: BackendKind::Cpu, ..gpu },
        gpu,
    ];
    let runs: Vec<Run> = setups
        .into_iter()
        .map(|setup| match software_gpu(options.software).filter(|_| setup.kind == BackendKind::Gpu) {
            Some(reason) => Run::skipped(setup, cases.len(), reason),
            None => engines::run(setup, &cases, progress),
        })
        .collect();
    let link = |run, against, cause| Link { run, against, cause };
    let links = [
        link(0, None, "the truth"),
        link(1, Some(0), "algebra"),
        link(3, Some(2), "precision"),
        link(5, Some(4), "hardware"),
        link(3, Some(0), "all of it"),
        link(5, Some(0), "all of it"),
    ];
    let rows: Vec<Row> = links.into_iter().map(|link| Row::new(link, &runs, &cases)).collect();
    Ok(Verification { options: *options, cases, runs, rows })
}

/// Why the GPU is passed over: it is software, and nobody asked for it.
fn software_gpu(is_wanted: bool) -> Option<String> {
    let adapter = if is_wanted { None } else { adapters().into_iter().next() };
    let adapter = adapter.filter(|adapter| adapter.is_software())?;
    Some(format!("the only GPU is software ({}), which takes minutes; `--software` checks it", adapter.name))
}

impl Verification {
    /// Whether every engine that could be had is within its limits.
    pub fn is_within_limits(&self) -> bool {
        self.rows.iter().all(|row| row.is_within(&self.runs))
    }

    /// Whether an engine could not be had, or could not take a case.
    pub fn is_any_skipped(&self) -> bool {
        self.runs.iter().any(|run| run.skipped.is_some())
    }

    /// Writes the worst sample of each row beyond its limit into a directory, as a scene that can be solved alone. The
    /// texts name these files.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn write_replays(&mut self, directory: &Path) -> Result<(), BenchError> {
        self.rows.iter_mut().try_for_each(|row| row.write_replay(&self.runs, &self.cases, directory))
    }
}
