//! Samples in a field that varies in space: turn by turn, as many at once as the device has memory for.

use super::device::failed;
use super::dispatcher::Dispatcher;
use super::pipelines::{Solver, TurnPipeline};
use super::shader::{Settings, most_varying_turns, varying_bytes};
use super::turns::{ALIGNMENT, Turns, most_samples, run};
use crate::backend::BackendError;
use crate::model::{Batch, Solutions};
use std::time::Instant;

/// Solves every sample of a batch.
pub(super) fn solve_varying(dispatcher: &mut Dispatcher, batch: &Batch) -> Result<Solutions, BackendError> {
    let start = Instant::now();
    let solver = &dispatcher.solver;
    let Solver::Turns(pipeline) = &solver.solver else { return Err(failed("a field that varies needs turns")) };
    let pipeline = TurnPipeline { layout: solver.layout.clone(), pipeline: pipeline.clone() };
    let turns = Turns {
        pipeline: &pipeline,
        settings: Settings::of(&dispatcher.plan, dispatcher.precision),
        memory_settings: [0; 5],
        sample_bytes: varying_bytes(&dispatcher.plan),
        most: most_varying_turns(&dispatcher.plan),
    };
    let mut solutions = Solutions::new(&dispatcher.plan, batch.sample_count());
    let (mut first, mut most) = (0, most_samples(dispatcher, turns.sample_bytes).max(1));
    while first < batch.sample_count() {
        let samples: Vec<usize> = (first..batch.sample_count().min(first + most)).collect();
        match run(dispatcher, &turns, &batch.gathered(&samples)) {
            Err(BackendError::OutOfMemory { .. }) if most > ALIGNMENT => most /= 2,
            Err(error) => return Err(error),
            Ok(found) => {
                samples.iter().enumerate().for_each(|(from, to)| solutions.copy_row(*to, &found, from));
                first += samples.len();
            }
        }
    }
    let (seconds, timings) = (start.elapsed().as_secs_f64(), &mut dispatcher.timings);
    timings.wait += seconds;
    timings.kernel += seconds;
    timings.sample_count += batch.sample_count() as u64;
    Ok(solutions)
}
