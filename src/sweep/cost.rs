//! What a sweep costs on this machine, by solving a few of its samples.

use super::check::SpotCheckOptions;
use super::error::SweepError;
use super::job::PreparedSweep;
use crate::backend::Backend;
use crate::engines::witness;
use crate::spec::Selection;
use std::time::Instant;

/// Samples that are solved first, once to warm up and once to be timed.
const FEW: u64 = 64;
/// Samples that are solved next where they take little time.
const MANY: u64 = 4096;
/// Time that may go into those (s).
const PATIENCE: f64 = 0.5;
/// Samples that the reference solves, to be timed.
const CHECKED: u64 = 3;
/// Seed of the choice.
const SEED: u64 = 0xc057;

/// What a few samples of a sweep took.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Cost {
    /// Samples that were timed, evenly spread over the sweep.
    pub tried: u64,
    /// How many of them have an equilibrium from rest.
    pub solved: u64,
    /// Time of one (s), on all threads together.
    pub seconds_each: f64,
    /// How many samples a run solves again by the reference.
    pub checked: u64,
    /// Time of one of these (s), on one thread.
    pub check_seconds_each: f64,
}

impl PreparedSweep<'_> {
    /// Solves some samples and takes the time. Second attempts, second paths and files come on top of it.
    ///
    /// # Errors
    ///
    /// An engine that cannot be used, or fails.
    pub fn measure_cost(&mut self) -> Result<Cost, SweepError> {
        let mut backend = self.open()?;
        let checked = SpotCheckOptions::of(&self.spec().scene).samples_of(self.spec().sample_count);
        let check_seconds_each = self.timed(witness(self.plan()).as_mut(), CHECKED)?.seconds_each;
        let of_check = |cost: Cost| Cost { checked, check_seconds_each, ..cost };
        self.timed(backend.as_mut(), FEW)?;
        let few = self.timed(backend.as_mut(), FEW)?;
        let affordable = (PATIENCE / few.seconds_each.max(1e-9)) as u64;
        match affordable.min(MANY) {
            more if more > 2 * FEW && self.spec().sample_count > FEW => {
                self.timed(backend.as_mut(), more).map(of_check)
            }
            _ => Ok(of_check(few)),
        }
    }

    fn timed(&self, backend: &mut dyn Backend, samples: u64) -> Result<Cost, SweepError> {
        let sampler = self.spec().sampler();
        let selection = Selection::new(self.spec().sample_count, samples, SEED);
        let tried = selection.len();
        let batch = self.plan().batch(tried as usize, |at, row| {
            if (at as u64) < tried {
                sampler.values(selection.get(at as u64), row);
            }
        });
        let start = Instant::now();
        let solutions = backend.solve(&batch)?;
        let seconds = start.elapsed().as_secs_f64();
        let solved = (0..tried as usize).filter(|sample| solutions.status(*sample).is_success()).count() as u64;
        Ok(Cost { tried, solved, seconds_each: seconds / tried.max(1) as f64, checked: 0, check_seconds_each: 0.0 })
    }
}
