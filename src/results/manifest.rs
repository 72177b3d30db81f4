//! `manifest.json`: what is known of a run once it has ended. Everything in it can be made again from the parts.

use super::error::ResultsError;
use super::outcome::{
    AnchorAccount, BranchCounts, PathCheck, PilotChoice, SampleOrigin, SpotCheck, Timings, number_or_null,
};
use super::store::{Store, store_at};
use super::verdict::Verdict;
use super::workers::WorkerReport;
use crate::backend::RungCount;
use crate::model::Status;
use crate::spec::{Shard, SolutionMethod};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

pub(crate) const MANIFEST_FILE: &str = "manifest.json";

/// The account of a run, or of shards put together.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Manifest {
    /// `rodsweep`
    pub program: String,
    /// Of the program.
    pub version: String,
    /// Of the program's source, where it is known.
    #[serde(default)]
    pub commit: Option<String>,
    /// That of `run.json` and of every part.
    pub run_id: String,
    /// What all its numbers were made by; runs of version 0.1 do not say.
    #[serde(default)]
    pub solved_by: Option<SolutionMethod>,
    /// Rows by the engine that made them, as each part says.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub engines: BTreeMap<String, u64>,
    /// Rows by the method they were solved by, where methods may differ.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub methods: BTreeMap<String, u64>,
    /// Samples of the sweep.
    pub sample_count: u64,
    /// Samples in a part.
    pub chunk: u64,
    /// Of the sampling.
    pub seed: u64,
    /// Arithmetic of the engine.
    pub precision: String,
    /// Which equilibria were asked for.
    pub branch: String,
    /// Whether every sample of the shard, or of the sweep where shards were put together, is there.
    pub complete: bool,
    /// Rows by status; a status without rows is left out.
    pub counts: BTreeMap<String, u64>,
    /// Rows that are no success; where every equilibrium was asked for, samples without any.
    pub failed: u64,
    /// Whether the rows can be trusted, and what speaks against them; runs before version 0.2 do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// Of a run; `None` where shards were put together.
    #[serde(flatten)]
    pub run: Option<RunAccount>,
    /// Manifests of the shards that were put together.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub merged_from: Vec<Manifest>,
    /// Who has worked on it, where workers shared the run out among themselves.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub workers: Vec<WorkerReport>,
}

/// What only the program that ran a sweep knows.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RunAccount {
    /// Kind of engine.
    pub backend: String,
    /// What it ran on.
    pub adapter: String,
    /// Driver and its version; empty for the CPU.
    pub driver: String,
    /// How samples were chosen.
    pub method: String,
    /// Which part of the sweep.
    pub shard: Shard,
    /// Samples of the shard.
    pub samples_of_shard: u64,
    /// Of these, solved by the last call.
    pub solved_now: u64,
    /// Of these, found in parts that were already there.
    pub found_done: u64,
    /// Rows of the shard.
    pub rows: u64,
    /// Where every equilibrium was asked for.
    pub branches: Option<BranchCounts>,
    /// Samples a second.
    #[serde(deserialize_with = "number_or_null")]
    pub rate: f64,
    /// Time by stage.
    pub timings: RunTimings,
    /// Where samples were made.
    pub samples_made: SampleOrigin,
    /// What the rows were held to.
    pub tolerance: f64,
    /// Method of integration.
    pub stepper: String,
    /// Steps over the whole rod.
    pub steps: usize,
    /// How both were chosen, unless the sweep file or a run before fixed them.
    pub pilot: Option<PilotChoice>,
    /// Equilibria that samples started from, where they did.
    #[serde(default)]
    pub anchors: Option<AnchorAccount>,
    /// Which methods took how many samples, in their order.
    #[serde(default)]
    pub rungs: Vec<RungAccount>,
    /// Samples that were solved again.
    pub second_attempts: SecondAttempts,
    /// Rows whose error estimate stays above the tolerance.
    pub above_tolerance: u64,
    /// In units of the plan's moment.
    #[serde(deserialize_with = "number_or_null")]
    pub worst_residual: f64,
    /// Over rod length, or (rad).
    #[serde(deserialize_with = "number_or_null")]
    pub worst_error_estimate: f64,
    /// Box around the tips (m).
    pub extents: Option<[[f64; 3]; 2]>,
    /// Samples solved again by the reference.
    pub spot_check: Option<SpotCheck>,
    /// Rows whose path was followed a second time.
    #[serde(default)]
    pub path_check: Option<PathCheck>,
    /// Damaged parts that were put aside.
    pub quarantined: Vec<PathBuf>,
    /// What happened on the way.
    pub notes: Vec<String>,
}

/// Time by stage, and the engine's own account of its time (s); stages overlap.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RunTimings {
    /// Of the run.
    #[serde(flatten)]
    pub stages: Timings,
    /// Of processors; the total is that of the whole process. `None`: the system does not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub processor: Option<Timings>,
    /// By engine and stage.
    #[serde(flatten)]
    pub of_engine: BTreeMap<String, BTreeMap<String, f64>>,
}

/// What one method did for the samples that those before had left.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RungAccount {
    /// Its name, such as `load steps` or `second attempt`.
    pub rung: String,
    /// Samples that it was given.
    pub samples: u64,
    /// Those that it left to the next; of an attempt after the engine's own, those without success.
    pub left: u64,
    /// Seconds; those of the CPU engine are summed over threads.
    pub seconds: f64,
}

impl From<&RungCount> for RungAccount {
    fn from(count: &RungCount) -> RungAccount {
        let RungCount { rung, samples, left, seconds } = count.clone();
        RungAccount { rung, samples, left, seconds }
    }
}

/// Samples that failed or were doubtful.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SecondAttempts {
    /// Solved again.
    pub made: u64,
    /// With success.
    pub won: u64,
}

impl Manifest {
    /// Rows with a status.
    pub fn count(&self, status: Status) -> u64 {
        self.counts.get(status.name()).copied().unwrap_or(0)
    }

    /// Whether the rows can be trusted: as it says, or as the spot check of an older run does.
    pub fn verdict(&self) -> Verdict {
        if let Some(verdict) = &self.verdict {
            return verdict.clone();
        }
        if !self.merged_from.is_empty() {
            let parts: Vec<Verdict> = self.merged_from.iter().map(Manifest::verdict).collect();
            return Verdict::sum(&parts);
        }
        let check = self.run.as_ref().and_then(|run| run.spot_check.as_ref());
        match check {
            Some(check) => Verdict::of_spot_check(check, self.sample_count, self.failed),
            None => Verdict::default(),
        }
    }

    /// Reads the manifest of a result directory.
    ///
    /// # Errors
    ///
    /// A manifest that is missing or cannot be understood.
    pub fn read(dir: &Path) -> Result<Manifest, ResultsError> {
        Manifest::find(store_at(dir)?.as_ref())?
            .ok_or_else(|| ResultsError::io(&dir.join(MANIFEST_FILE), "reading")(std::io::ErrorKind::NotFound.into()))
    }

    /// `None`: the run has none yet.
    pub(crate) fn find(store: &dyn Store) -> Result<Option<Manifest>, ResultsError> {
        let Some(bytes) = store.get(MANIFEST_FILE)? else { return Ok(None) };
        let path = store.path(MANIFEST_FILE);
        let damaged = |error: serde_json::Error| ResultsError::Damaged { path, reason: error.to_string() };
        serde_json::from_slice(&bytes).map(Some).map_err(damaged)
    }

    pub(crate) fn write(&self, store: &dyn Store) -> Result<(), ResultsError> {
        let text = serde_json::to_string_pretty(self).unwrap_or_default() + "\n";
        store.put(MANIFEST_FILE, text.as_bytes())
    }
}

/// Rows by the name of their status, those without rows left out.
pub(crate) fn named_counts(counts: &[u64; Status::ALL.len()]) -> BTreeMap<String, u64> {
    let of = |status: Status| (status.name().to_owned(), counts[status.code() as usize]);
    Status::ALL.into_iter().map(of).filter(|(_, count)| *count > 0).collect()
}
