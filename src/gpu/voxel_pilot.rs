//! Whether a sweep without rows can be run on the device, and where its tips are, by a few samples solved before.

use super::dispatcher::Dispatcher;
use super::shader::Generator;
use super::solve_batch;
use crate::backend::{BackendError, ReduceJob};
use crate::model::record::BASE_POSITION_AT;
use crate::model::{Entry, Plan, Quantity};

/// Samples that say where tips are, before the counts are laid out.
const PILOT: u64 = 4096;

/// The tables of the samples, or why they cannot be made on the device.
pub(super) fn generator(plan: &Plan, job: &ReduceJob) -> Result<Generator, String> {
    let recipe = job.recipe.ok_or(
        "they come from a table, from axes too long for one, or from a method or a law that only the host knows",
    )?;
    if (0..3).any(|axis| matches!(plan.entries[BASE_POSITION_AT + axis], Entry::Varying(_))) {
        return Err("the base moves".into());
    }
    if plan.start.is_some() {
        return Err("they start from given moments".into());
    }
    Generator::new(plan, recipe)
}

/// Tips of samples all over the sweep, in voxels.
pub(super) fn pilot_tips(dispatcher: &mut Dispatcher, job: &ReduceJob) -> Result<Vec<[f64; 3]>, BackendError> {
    let total = job.ranges.iter().map(|range| range.end - range.start).sum::<u64>();
    let count = PILOT.min(total);
    let at = |number: usize| {
        let mut place = (u128::from(total) * number as u128 / u128::from(count.max(1))) as u64;
        for range in job.ranges {
            if place < range.end - range.start {
                return range.start + place;
            }
            place -= range.end - range.start;
        }
        0
    };
    let plan = dispatcher.plan.clone();
    let batch = plan.batch(count as usize, |number, row| {
        if (number as u64) < count {
            (job.values)(at(number), row);
        }
    });
    let solutions = solve_batch::solve(dispatcher, &batch)?;
    let solved = (0..count as usize).filter(|sample| solutions.status(*sample).is_success());
    Ok(solved.map(|sample| solutions.vector(sample, Quantity::TipPosition).map(|x| x / job.voxel)).collect())
}
