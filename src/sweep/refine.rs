//! Second attempts for samples that failed or are doubtful.

use crate::backend::BackendFactory;
use crate::backend::{Backend, BackendError};
use crate::model::{Batch, Plan, Quantity, Solutions, Status};
use crate::spec::Sampler;

/// Samples of one second attempt; bounds its memory.
const MAX_BATCH: usize = 1 << 16;

/// The backends of second attempts, made when first needed.
pub(crate) struct Refiners<'a> {
    stages: Vec<(BackendFactory<'a>, Option<Box<dyn Backend>>)>,
    pub attempts: u64,
    pub refined: u64,
}

impl<'a> Refiners<'a> {
    pub fn new(factories: &[BackendFactory<'a>]) -> Refiners<'a> {
        Refiners { stages: factories.iter().map(|factory| (*factory, None)).collect(), attempts: 0, refined: 0 }
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
        let tolerance = plan.options.tolerance;
        for (stage, (factory, backend)) in self.stages.iter_mut().enumerate() {
            let needs = |at: &usize| {
                let status = solutions.status(*at);
                let estimate = solutions.get(*at, Quantity::ErrorEstimate);
                let doubtful = stage == 0 && (estimate > tolerance || estimate.is_nan());
                !batch.bad[*at] && status != Status::BadParameter && (!status.is_success() || doubtful)
            };
            let doubtful: Vec<usize> = (0..batch.sample_count()).filter(needs).collect();
            for group in doubtful.chunks(MAX_BATCH) {
                if backend.is_none() {
                    *backend = Some(factory(plan)?);
                }
                let Some(backend) = backend else { continue };
                let gathered = plan.batch(group.len(), |at, row| {
                    if let Some(at) = group.get(at) {
                        sampler.values(index(*at), row);
                    }
                });
                let again = backend.solve(&gathered)?;
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
}
