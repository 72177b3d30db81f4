//! Samples of much growth, which a single pass does not solve, by nodes: dispatch after dispatch takes each a pass further.
//!
//! What the device has no room for stays as it is, for the CPU.

use super::device::failed;
use super::dispatcher::Dispatcher;
use super::growth::grown_samples;
use super::pipelines::TurnPipeline;
use super::shader::{KERNELS, Kernel, Settings, most_intervals, most_turns, node_bytes};
use super::turns::{ALIGNMENT, Turns, most_samples, run};
use crate::backend::{BackendError, Precision};
use crate::model::tolerances::{NODE_PACES, NodePace, are_two_equilibria};
use crate::model::{Batch, Quantity, Solutions, Status};
use std::time::Instant;

/// Intervals of a rod at most: more leave no digits in f32.
const MOST_INTERVALS: usize = 1 << 14;

/// Solves by nodes what a single pass has not solved, or whose columns it does not tell, where errors grow much.
pub(super) fn solve_grown(
    dispatcher: &mut Dispatcher,
    batch: &Batch,
    solutions: &mut Solutions,
) -> Result<(), BackendError> {
    let has_kernel = dispatcher.entry_point() == KERNELS[0].entry_point && dispatcher.plan.start.is_none();
    if !has_kernel || dispatcher.refuses_nodes || dispatcher.precision != Precision::F32 {
        return Ok(());
    }
    let mut grown = grown_samples(&dispatcher.plan, batch, solutions, dispatcher.precision);
    if grown.is_empty() {
        return Ok(());
    }
    // A loss is told when what is in flight has ended.
    dispatcher.device.wait(None)?;
    if !has_pipeline(dispatcher)? {
        return Ok(());
    }
    // Those of as many intervals share their loops.
    grown.sort_by(|a, b| a.growth.total_cmp(&b.growth));
    let mut folds = vec![true; grown.len()];
    let mut left: Vec<usize> = (0..grown.len()).collect();
    let mut most = usize::MAX;
    for pace in NODE_PACES {
        let bound = |at: &usize| grown[*at].interval_bound(&dispatcher.plan, pace.spacing);
        let bounds: Vec<usize> = left.iter().map(bound).collect();
        let (mut unsolved, mut first) = (Vec::new(), 0);
        while first < left.len() {
            let group = &left[first..first + group_size(dispatcher, &bounds[first..], most)];
            let samples: Vec<usize> = group.iter().map(|at| grown[*at].sample).collect();
            let found = match group.len() {
                0 => None,
                count => solve_group(dispatcher, &batch.gathered(&samples), bounds[first + count - 1], pace)?,
            };
            let Some(found) = found else {
                if group.len() > ALIGNMENT {
                    most = group.len() / 2;
                    continue;
                }
                // The others are no shorter.
                dispatcher.note_too_long(left.len() - first);
                left[first..].iter().for_each(|at| folds[*at] = false);
                break;
            };
            for (from, at) in group.iter().enumerate() {
                folds[*at] &= pace.is_quick() || found.status(from) == Status::Fold;
                if found.status(from) == Status::Ramped {
                    take(dispatcher.plan.scene.total_length(), solutions, grown[*at].sample, &found, from);
                } else {
                    unsolved.push(*at);
                }
            }
            first += group.len();
        }
        left = unsolved;
    }
    for at in left {
        let sample = grown[at].sample;
        // A fold that is none on some mesh is taken back.
        if solutions.status(sample) == Status::Fold && !folds[at] {
            solutions.set_status(sample, Status::NotConverged);
        }
    }
    Ok(())
}

/// Makes the kernel when it is first needed; false where the device does not take it.
fn has_pipeline(dispatcher: &mut Dispatcher) -> Result<bool, BackendError> {
    if dispatcher.nodes.is_none() {
        let start = Instant::now();
        let is_software = dispatcher.device.adapter().is_software();
        let kernel = Kernel::nodes(&dispatcher.plan, is_software).map_err(failed)?;
        match TurnPipeline::new(&dispatcher.device, &kernel) {
            Ok(pipeline) => dispatcher.nodes = Some(pipeline),
            Err(error) if dispatcher.device.is_lost() => return Err(error),
            Err(error) => dispatcher.refuse_nodes(&error),
        }
        dispatcher.timings.compile += start.elapsed().as_secs_f64();
    }
    Ok(dispatcher.nodes.is_some())
}

/// Replaces a row by what nodes have found, unless that is another equilibrium.
fn take(length: f64, solutions: &mut Solutions, to: usize, found: &Solutions, from: usize) {
    let (before, after) = (solutions.vector(to, Quantity::TipPosition), found.vector(from, Quantity::TipPosition));
    let apart = (0..3).map(|k| (before[k] - after[k]).powi(2)).sum::<f64>().sqrt() / length;
    let estimate = solutions.get(to, Quantity::ErrorEstimate);
    if solutions.status(to).is_success() && are_two_equilibria(apart, estimate) {
        solutions.set_status(to, Status::NotConverged);
    } else {
        solutions.copy_row(to, found, from);
    }
}

/// How many of the samples with these bounds, in rising order, fit into one dispatch.
fn group_size(dispatcher: &Dispatcher, bounds: &[usize], most_here: usize) -> usize {
    let is_software = dispatcher.device.adapter().is_software();
    let most = if is_software { most_intervals(&dispatcher.plan) } else { MOST_INTERVALS };
    let fits = |count: usize| {
        let intervals = bounds[count - 1];
        intervals <= most && count <= most_samples(dispatcher, node_bytes(&dispatcher.plan, intervals))
    };
    (1..=bounds.len().min(most_here)).take_while(|count| fits(*count)).last().unwrap_or(0)
}

/// Solves some samples with room for so many intervals each; `None` where the device has not the memory.
fn solve_group(
    dispatcher: &mut Dispatcher,
    batch: &Batch,
    intervals: usize,
    pace: NodePace,
) -> Result<Option<Solutions>, BackendError> {
    let Some(pipeline) = dispatcher.nodes.take() else { return Ok(None) };
    let start = Instant::now();
    let turns = Turns {
        pipeline: &pipeline,
        settings: Settings::default(),
        memory_settings: [
            intervals as u32,
            (pace.spacing as f32).to_bits(),
            pace.steps as u32,
            (pace.tolerance as f32).to_bits(),
            (pace.least_pivot as f32).to_bits(),
        ],
        sample_bytes: node_bytes(&dispatcher.plan, intervals),
        most: most_turns(&dispatcher.plan),
    };
    let solved = run(dispatcher, &turns, batch);
    dispatcher.nodes = Some(pipeline);
    dispatcher.timings.wait += start.elapsed().as_secs_f64();
    match solved {
        Err(BackendError::OutOfMemory { .. }) => Ok(None),
        solved => solved.map(Some),
    }
}
