//! The account that a run gives of itself.

use super::options::RunOptions;
use super::summary::Summary;
use crate::model::Plan;
use crate::results::manifest::named_counts;
use crate::results::{AnchorAccount, Manifest, RunAccount, RunRecord, RunTimings, RungAccount, SecondAttempts};
use crate::spec::SweepSpec;
use std::collections::BTreeMap;

pub(crate) fn manifest(
    spec: &SweepSpec,
    plan: &Plan,
    record: &RunRecord,
    options: &RunOptions,
    summary: &Summary,
) -> Manifest {
    let Summary { backend, reduction, .. } = summary;
    let mut of_engine = BTreeMap::new();
    if !summary.engine_timings.is_empty() {
        let stages = summary.engine_timings.iter().map(|(name, seconds)| ((*name).to_owned(), *seconds));
        of_engine.insert(backend.kind.to_string(), stages.collect());
    }
    let run = RunAccount {
        backend: backend.kind.to_string(),
        adapter: backend.device.clone(),
        driver: backend.driver.clone(),
        method: spec.method.name().into(),
        shard: options.shard,
        samples_of_shard: summary.total,
        solved_now: summary.solved,
        found_done: summary.resumed,
        rows: reduction.row_count(),
        branches: reduction.branches,
        rate: summary.rate,
        timings: RunTimings { stages: summary.timings, processor: summary.processor, of_engine },
        samples_made: summary.origin.clone(),
        tolerance: spec.tolerance,
        stepper: plan.options.stepper.name().into(),
        steps: plan.options.steps,
        pilot: options.pilot.clone(),
        anchors: AnchorAccount::of(plan),
        rungs: summary.rungs.iter().map(RungAccount::from).collect(),
        second_attempts: SecondAttempts { made: summary.attempts, won: summary.refined },
        above_tolerance: summary.above_tolerance,
        worst_residual: summary.worst_residual,
        worst_error_estimate: summary.worst_error_estimate,
        extents: reduction.extents,
        spot_check: summary.spot_check.clone(),
        path_check: summary.path_check.clone(),
        quarantined: summary.quarantined.clone(),
        notes: spec.notes.iter().chain(&summary.notes).cloned().collect(),
    };
    Manifest {
        program: "rodsweep".into(),
        version: crate::VERSION.into(),
        commit: crate::commit().map(str::to_owned),
        run_id: record.run_id.clone(),
        solved_by: record.method,
        engines: BTreeMap::from([(backend.to_string(), reduction.row_count())]),
        methods: BTreeMap::new(),
        sample_count: record.sample_count,
        chunk: record.chunk,
        seed: spec.seed,
        precision: backend.precision.to_string(),
        branch: spec.branch.name().into(),
        complete: !summary.interrupted,
        counts: named_counts(&reduction.counts),
        failed: summary.failed(),
        verdict: Some(summary.verdict.clone()),
        run: Some(run),
        merged_from: Vec::new(),
        workers: Vec::new(),
    }
}
