//! What a run leaves beside its parts: manifest, workspace and tips of a run without rows, the worst sample.

use super::directory::{MANIFEST_FILE, RunRecord};
use super::error::SweepError;
use super::run::{RunOptions, Summary};
use super::scene_text::write_scene;
use super::sink::{self, FileMetadata};
use super::spec::{Format, SweepSpec};
use crate::model::{Plan, Status};
use serde_json::{Map, Value, json};

/// Scene of the sample with the largest spot-check error, for `solve`.
pub const WORST_FILE: &str = "spot-check-worst.toml";
pub const WORKSPACE_FILE: &str = "workspace.parquet";
pub const TIPS_FILE: &str = "tips.parquet";

pub(super) fn write(
    spec: &SweepSpec,
    plan: &Plan,
    record: &RunRecord,
    options: &RunOptions,
    summary: &Summary,
    metadata: &FileMetadata,
) -> Result<(), SweepError> {
    let out = &options.out;
    if spec.format == Format::None && !summary.interrupted {
        sink::write_run_table(&out.join(WORKSPACE_FILE), &summary.reduction.voxel_table(), metadata)?;
        sink::write_run_table(&out.join(TIPS_FILE), &summary.reduction.tips, metadata)?;
    }
    if let Some(index) = summary.spot_check.as_ref().and_then(|check| check.worst_sample) {
        let scene = write_scene(&spec.sample_scene(index));
        sink::write_atomically(&out.join(WORST_FILE), scene.as_bytes(), true)?;
    }
    let counts: Map<String, Value> = Status::ALL
        .into_iter()
        .filter(|status| summary.count(*status) > 0)
        .map(|status| (status.name().to_owned(), summary.count(status).into()))
        .collect();
    let backend = &summary.backend;
    let mut timings = json!(summary.timings);
    if !summary.engine_timings.is_empty() {
        let of_engine = summary.engine_timings.iter().map(|(name, seconds)| ((*name).to_owned(), json!(seconds)));
        timings[backend.kind.to_string()] = Value::Object(of_engine.collect());
    }
    let manifest = json!({
        "program": "rodsweep",
        "version": env!("CARGO_PKG_VERSION"),
        "commit": option_env!("RODSWEEP_COMMIT"),
        "run_id": record.run_id,
        "backend": backend.kind.to_string(),
        "precision": backend.precision.to_string(),
        "adapter": backend.device,
        "driver": backend.driver,
        "seed": spec.seed,
        "method": spec.method.name(),
        "sample_count": record.sample_count,
        "chunk": record.chunk,
        "shard": options.shard,
        "samples_of_shard": summary.total,
        "solved_now": summary.solved,
        "found_done": summary.resumed,
        "complete": !summary.interrupted,
        "branch": spec.branch.name(),
        "rows": summary.reduction.row_count(),
        "counts": counts,
        "failed": summary.failed(),
        "branches": summary.reduction.branches,
        "rate": summary.rate,
        "timings": timings,
        "samples_made": summary.origin,
        "tolerance": spec.tolerance,
        "stepper": plan.options.stepper.name(),
        "steps": plan.options.steps,
        "pilot": options.pilot,
        "second_attempts": { "made": summary.attempts, "won": summary.refined },
        "above_tolerance": summary.above_tolerance,
        "worst_residual": summary.worst_residual,
        "worst_error_estimate": summary.worst_error_estimate,
        "extents": summary.reduction.extents,
        "spot_check": summary.spot_check,
        "quarantined": summary.quarantined,
        "notes": spec.notes.iter().chain(&summary.notes).collect::<Vec<_>>(),
    });
    let text = serde_json::to_string_pretty(&manifest).unwrap_or_default() + "\n";
    sink::write_atomically(&out.join(MANIFEST_FILE), text.as_bytes(), true).map(|_| ())
}
