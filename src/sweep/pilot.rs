//! Chooses the number of integration steps by solving a few samples at increasing resolution.

use crate::backend::BackendError;
use crate::backend::BackendFactory;
use crate::model::rotation_angle;
use crate::model::{Batch, Plan, PlanOptions, Quantity, Solutions, Stepper};
use crate::results::PilotChoice;
use crate::spec::Sampler;
use crate::spec::Selection;

/// Resolutions that are tried.
pub const STEPS: [usize; 13] = [2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128];
const SAMPLES: u64 = 64;

/// Picks, of the plan's method and others, the one that meets the tolerance with the fewest stages; if none does, the
/// most accurate.
///
/// # Errors
///
/// As [`choose_steps`].
pub fn choose_method(
    plan: &Plan,
    sampler: &Sampler,
    others: &[Stepper],
    factory: BackendFactory,
) -> Result<PilotChoice, BackendError> {
    let mut best = choose_steps(plan, sampler, factory)?;
    for stepper in others {
        let plan = plan.with_options(PlanOptions { stepper: *stepper, ..plan.options });
        let choice = choose_steps(&plan, sampler, factory)?;
        let is_better = match (choice.reached, best.reached) {
            (true, true) => choice.cost() < best.cost(),
            (false, false) => choice.error < best.error,
            (reached, _) => reached,
        };
        if is_better {
            best = choice;
        }
    }
    Ok(best)
}

/// Picks the smallest number of steps whose tips stay within half the tolerance of those with twice the steps.
///
/// Where none does, the differences have stopped falling (rounding) or 128 is too few: then the smallest number
/// within twice the least difference is taken, and `reached` is false.
///
/// # Errors
///
/// An engine that cannot be used, or fails.
pub fn choose_steps(plan: &Plan, sampler: &Sampler, factory: BackendFactory) -> Result<PilotChoice, BackendError> {
    let selection = Selection::new(sampler.sample_count(), SAMPLES, 0x9170);
    let batch = plan.batch(selection.len() as usize, |at, row| {
        if (at as u64) < selection.len() {
            sampler.values(selection.get(at as u64), row);
        }
    });
    choose_steps_for(plan, &batch, factory)
}

/// The same for given samples.
///
/// # Errors
///
/// As [`choose_steps`].
pub fn choose_steps_for(plan: &Plan, batch: &Batch, factory: BackendFactory) -> Result<PilotChoice, BackendError> {
    let PlanOptions { tolerance, stepper, .. } = plan.options;
    let mut solved: Vec<(usize, Solutions)> = Vec::new();
    let mut tried = Vec::new();
    let mut compared = 0;
    for steps in STEPS {
        for steps in [steps, 2 * steps] {
            if !solved.iter().any(|(done, _)| *done == steps) {
                let mut backend = factory(&plan.with_options(PlanOptions { steps, ..plan.options }))?;
                solved.push((steps, backend.solve(batch)?));
            }
        }
        let of = |steps: usize| solved.iter().find(|(done, _)| *done == steps).map(|(_, solutions)| solutions);
        let (Some(coarse), Some(fine)) = (of(steps), of(2 * steps)) else { continue };
        let (error, count) = difference(plan, batch, coarse, fine);
        compared = count;
        tried.push((steps, error));
        if count > 0 && error < 0.5 * tolerance {
            return Ok(PilotChoice { stepper, steps, error, tolerance, reached: true, compared, tried });
        }
    }
    let least = tried.iter().map(|(_, error)| *error).fold(f64::INFINITY, f64::min);
    let good = tried.iter().find(|(_, error)| compared > 0 && *error <= 2.0 * least);
    let (steps, error) = good.copied().unwrap_or((STEPS[STEPS.len() - 1], f64::NAN));
    Ok(PilotChoice { stepper, steps, error, tolerance, reached: false, compared, tried })
}

/// Largest difference over the samples that converged in both, and their number.
fn difference(plan: &Plan, batch: &Batch, a: &Solutions, b: &Solutions) -> (f64, usize) {
    let (mut largest, mut count) = (0.0f64, 0);
    for at in 0..a.sample_count() {
        if !(a.status(at).is_success() && b.status(at).is_success()) {
            continue;
        }
        count += 1;
        let (p, q) = (a.vector(at, Quantity::TipPosition), b.vector(at, Quantity::TipPosition));
        let dp = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / plan.sample_rod(batch, at).total_length();
        largest = largest.max(dp).max(rotation_angle(&a.tip_rotation(at), &b.tip_rotation(at)));
    }
    (largest, count)
}
