//! Second attempts for samples that failed or are doubtful.

use crate::backend::BackendFactory;
use crate::backend::{Backend, BackendError};
use crate::model::{Batch, Plan, Quantity, Solutions, Status};
use crate::spec::Sampler;

/// Samples of one second attempt; bounds its memory.
const MAX_BATCH: usize = 1 << 16;

/// The backends of second attempts, made when first needed.
pub(crate) struct Refiners<'a> {
    settle: Option<Stage<'a>>,
    stages: Vec<Stage<'a>>,
    pub attempts: u64,
    pub refined: u64,
}

/// One of them.
struct Stage<'a> {
    factory: BackendFactory<'a>,
    backend: Option<Box<dyn Backend>>,
}

impl Stage<'_> {
    fn solve(&mut self, plan: &Plan, batch: &Batch) -> Result<Solutions, BackendError> {
        let made = match self.backend.take() {
            Some(made) => made,
            None => (self.factory)(plan)?,
        };
        self.backend.insert(made).solve(batch)
    }
}

/// The samples of a batch, as second attempts see them.
struct Samples<'a> {
    plan: &'a Plan,
    sampler: &'a Sampler,
    batch: &'a Batch,
    index: &'a (dyn Fn(usize) -> u64 + Sync),
}

impl Samples<'_> {
    /// Whether the error estimate of a row is above the tolerance.
    fn is_doubtful(&self, solutions: &Solutions, row: usize) -> bool {
        let estimate = solutions.get(row, Quantity::ErrorEstimate);
        estimate > self.plan.options.tolerance || estimate.is_nan()
    }

    /// Samples to which this applies, values that make no rod left out.
    fn those(&self, solutions: &Solutions, applies: impl Fn(usize) -> bool) -> Vec<usize> {
        let is_rod = |at: usize| !self.batch.bad[at] && solutions.status(at) != Status::BadParameter;
        (0..self.batch.sample_count()).filter(|at| is_rod(*at) && applies(*at)).collect()
    }

    fn gathered(&self, group: &[usize]) -> Batch {
        self.plan.batch(group.len(), |at, row| {
            if let Some(at) = group.get(at) {
                self.sampler.values((self.index)(*at), row);
            }
        })
    }
}

impl<'a> Refiners<'a> {
    pub fn new(settle: Option<BackendFactory<'a>>, factories: &[BackendFactory<'a>]) -> Refiners<'a> {
        let stage = |factory: BackendFactory<'a>| Stage { factory, backend: None };
        let stages = factories.iter().map(|factory| stage(*factory)).collect();
        Refiners { settle: settle.map(stage), stages, attempts: 0, refined: 0 }
    }

    /// Solves failed and doubtful samples again. A success becomes `Refined`; another verdict replaces the first one, but
    /// an equilibrium is not replaced by none. A doubtful success that a second attempt does not find is no success. The
    /// second stage sees what the first left failing.
    pub fn refine(
        &mut self,
        plan: &Plan,
        sampler: &Sampler,
        batch: &Batch,
        solutions: &mut Solutions,
        index: &(dyn Fn(usize) -> u64 + Sync),
    ) -> Result<(), BackendError> {
        let samples = Samples { plan, sampler, batch, index };
        self.settle(&samples, solutions)?;
        for (number, stage) in self.stages.iter_mut().enumerate() {
            let needs = |at| !solutions.status(at).is_success() || number == 0 && samples.is_doubtful(solutions, at);
            let left = samples.those(solutions, needs);
            for group in left.chunks(MAX_BATCH) {
                let again = stage.solve(plan, &samples.gathered(group))?;
                self.attempts += group.len() as u64;
                for (from, to) in group.iter().enumerate() {
                    let status = again.status(from);
                    if status.is_success() {
                        solutions.copy_row(*to, &again, from);
                        solutions.set_status(*to, Status::Refined);
                        self.refined += 1;
                    } else if again.is_equilibrium(from) || !solutions.is_equilibrium(*to) {
                        solutions.copy_row(*to, &again, from);
                    } else if solutions.status(*to).is_success() {
                        solutions.set_status(*to, Status::NotConverged);
                    }
                }
            }
        }
        Ok(())
    }

    /// Takes the doubt of samples that did not fail. What is doubtful still is left to the second attempts.
    fn settle(&mut self, samples: &Samples, solutions: &mut Solutions) -> Result<(), BackendError> {
        let Some(stage) = &mut self.settle else { return Ok(()) };
        let needs = |at| solutions.status(at).is_success() && samples.is_doubtful(solutions, at);
        let left = samples.those(solutions, needs);
        for group in left.chunks(MAX_BATCH) {
            let again = stage.solve(samples.plan, &samples.gathered(group))?;
            self.attempts += group.len() as u64;
            for (from, to) in group.iter().enumerate() {
                if again.status(from).is_success() && !samples.is_doubtful(&again, from) {
                    solutions.copy_row(*to, &again, from);
                    solutions.set_status(*to, Status::Refined);
                    self.refined += 1;
                }
            }
        }
        Ok(())
    }
}
