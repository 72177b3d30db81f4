//! A run without rows on an engine that makes, solves and counts its samples itself.

use super::error::SweepError;
use super::missing::Missing;
use super::pipeline::{Finisher, join, spawn};
use crate::backend::{Backend, ReduceJob, Reduced, Returned};
use crate::results::{RunRecord, SampleOrigin};
use std::ops::Range;
use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

/// The samples of some chunks, neighbours joined.
fn ranges(record: &RunRecord, chunks: impl Iterator<Item = u64>) -> Vec<Range<u64>> {
    let mut ranges: Vec<Range<u64>> = Vec::new();
    for chunk in chunks {
        let (start, len) = record.chunk_range(chunk);
        match ranges.last_mut() {
            Some(last) if last.end == start => last.end += len,
            _ => ranges.push(start..start + len),
        }
    }
    ranges
}

/// Runs some chunks; says where samples can be made.
pub(crate) fn run(
    backend: &mut dyn Backend,
    finisher: &mut Finisher,
    record: &RunRecord,
    missing: Missing<'_>,
) -> Result<SampleOrigin, SweepError> {
    let (sampler, options, solve) = (finisher.sampler, finisher.options, &finisher.times.solve);
    let recipe = sampler.recipe();
    let ranges = ranges(record, missing.chunks());
    let selections = [
        Some(finisher.reduction.selection()),
        finisher.spot_samples.as_ref().map(|chosen| chosen.selection()),
        finisher.second_paths.as_ref().map(|paths| paths.selection()),
    ];
    let wanted = |range: Range<u64>| {
        let chosen = selections.iter().flatten().flat_map(|selection| selection.within(range.clone()));
        let mut chosen: Vec<u64> = chosen.collect();
        chosen.sort_unstable();
        chosen.dedup();
        chosen
    };
    let job = ReduceJob {
        recipe: recipe.as_ref(),
        ranges: &ranges,
        voxel: finisher.spec.workspace.voxel,
        tolerance: finisher.plan.options.tolerance.min(finisher.spec.tolerance),
        wanted: &wanted,
        values: &|index, row| sampler.values(index, row),
    };
    let begin = Instant::now();
    let mut blocked = Duration::ZERO;
    let (sender, receiver) = sync_channel::<Returned>(1);
    let reduced = std::thread::scope(|scope| {
        let finishing =
            spawn(scope, || receiver.into_iter().try_for_each(|returned| finisher.finish_returned(returned)))?;
        let solving = solve.processor.enter();
        let reduced = backend.reduce(&job, &mut |returned| {
            let begin = Instant::now();
            let goes_on = !options.is_interrupted() && sender.send(returned).is_ok();
            blocked += begin.elapsed();
            goes_on
        });
        drop((sender, solving));
        join(finishing.join())?;
        Ok::<_, SweepError>(reduced?)
    })?;
    match reduced {
        None => Ok(SampleOrigin::Host),
        Some(Reduced::Declined(reason)) => Ok(SampleOrigin::HostBecause(reason)),
        Some(Reduced::Voxels(voxels)) => {
            finisher.reduction.add_voxels(voxels);
            finisher.reduction.sort_tips();
            solve.add_wall(begin.elapsed().saturating_sub(blocked));
            Ok(SampleOrigin::Device)
        }
    }
}
