//! Chooses the number of integration steps by solving a few samples at increasing resolution.

use super::check::distribution;
use super::columns::ColumnScales;
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
/// The error of an answer is taken to be so many times the share of the grids' difference that the pilot has seen.
const RESERVE: f64 = 4.0;
/// At least that share, whatever the pilot has seen.
const LEAST_SHARE: f64 = 1.0 / 64.0;

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
            (true, true) => choice.stages < best.stages,
            (false, false) => choice.error < best.error,
            (reached, _) => reached,
        };
        if is_better {
            best = choice;
        }
    }
    Ok(best)
}

/// Picks the smallest number of steps whose answers meet the tolerances: tips that stay within half of it from those with
/// twice the steps, and derivatives that in 95 % of the samples do so within theirs.
///
/// Where none does, the differences have stopped falling (rounding) or 128 is too few: then the smallest number
/// within twice the least difference of tips is taken, and `reached` is false.
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
    let mut solved: Vec<(usize, Solutions)> = Vec::new();
    let mut trials: Vec<Trial> = Vec::new();
    for steps in STEPS {
        for steps in [steps, 2 * steps] {
            if !solved.iter().any(|(done, _)| *done == steps) {
                let options = PlanOptions { steps, error_share: 1.0, ..plan.options };
                solved.push((steps, factory(&plan.with_options(options))?.solve(batch)?));
            }
        }
        let of = |steps: usize| solved.iter().find(|(done, _)| *done == steps).map(|(_, solutions)| solutions);
        let (Some(coarse), Some(fine)) = (of(steps), of(2 * steps)) else { continue };
        trials.push(Trial::new(plan, batch, steps, coarse, fine));
        let last = &trials[trials.len() - 1];
        if last.meets(&plan.options) {
            return Ok(last.choice(plan, &trials, true));
        }
    }
    let least = trials.iter().map(|trial| trial.error).fold(f64::INFINITY, f64::min);
    let good = trials.iter().find(|trial| trial.compared > 0 && trial.error <= 2.0 * least);
    let unknown = Trial { steps: STEPS[STEPS.len() - 1], error: f64::NAN, ..Trial::default() };
    Ok(good.unwrap_or(&unknown).choice(plan, &trials, false))
}

/// What a number of steps is worth, by comparison with twice as many.
#[derive(Default)]
struct Trial {
    steps: usize,
    /// Samples that converged in both.
    compared: usize,
    /// Largest difference of tips.
    error: f64,
    /// The worst column of a sample: 95 % are below.
    derivative_error: f64,
    /// See [`PlanOptions::error_share`], with a reserve.
    error_share: f64,
    /// Largest error estimate with that share.
    estimate: f64,
}

impl Trial {
    fn new(plan: &Plan, batch: &Batch, steps: usize, a: &Solutions, b: &Solutions) -> Trial {
        let is_compared = |at: &usize| a.status(*at).is_success() && b.status(*at).is_success();
        let samples: Vec<usize> = (0..a.sample_count()).filter(is_compared).collect();
        let scales = ColumnScales::of(plan, b);
        let (mut error, mut share, mut estimate) = (0.0f64, LEAST_SHARE, 0.0f64);
        let mut columns = Vec::new();
        for &at in &samples {
            let length = plan.sample_rod(batch, at).total_length();
            let (p, q) = (a.vector(at, Quantity::TipPosition), b.vector(at, Quantity::TipPosition));
            let dp = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / length;
            let difference = dp.max(rotation_angle(&a.tip_rotation(at), &b.tip_rotation(at)));
            error = error.max(difference);
            columns.push(scales.worst_error((a, b), at, length).0);
            let of_grids = a.get(at, Quantity::ErrorEstimate);
            estimate = estimate.max(of_grids);
            if difference > 0.0 {
                share = share.max(RESERVE * difference / of_grids);
            }
        }
        let error_share = share.min(1.0);
        let derivative_error = distribution(columns).p95;
        Trial { steps, compared: samples.len(), error, derivative_error, error_share, estimate: error_share * estimate }
    }

    fn meets(&self, options: &PlanOptions) -> bool {
        let PlanOptions { tolerance, derivative_tolerance, .. } = *options;
        let is_small = self.error < 0.5 * tolerance && self.estimate < tolerance;
        self.compared > 0 && is_small && self.derivative_error <= derivative_tolerance
    }

    fn choice(&self, plan: &Plan, trials: &[Trial], reached: bool) -> PilotChoice {
        let Trial { steps, compared, error, derivative_error, error_share, .. } = *self;
        let PlanOptions { tolerance, derivative_tolerance, stepper, .. } = plan.options;
        let chosen = plan.with_options(PlanOptions { steps, ..plan.options });
        let all_steps: usize = chosen.segments.iter().map(|segment| segment.steps).sum();
        PilotChoice {
            stepper,
            steps,
            stages: stepper.stage_count() * all_steps,
            error,
            tolerance,
            derivative_error: if plan.derivatives.is_empty() { None } else { Some(derivative_error) },
            derivative_tolerance,
            error_share,
            reached,
            compared,
            tried: trials.iter().map(|trial| (trial.steps, trial.error)).collect(),
        }
    }
}
