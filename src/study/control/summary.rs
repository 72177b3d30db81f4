//! The numbers that sum up a run of control.

use super::run::{ControlRun, Outcome, TargetResult, median_step};

/// The numbers that sum up a run of control.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ControlSummary {
    /// Targets by outcome, in the order of [`Outcome::ALL`]; outcomes without targets are left out.
    pub counts: Vec<(Outcome, usize)>,
    /// Largest distance from a target that is reached, in the controlled coordinates (m).
    pub largest_error: f64,
    /// Largest difference of a normal force from that of a target that is reached (N); `None` where no force is controlled.
    pub largest_force_error: Option<f64>,
    /// Largest error of the integration at a target that is reached (m).
    pub largest_integration_error: f64,
    /// Least stability margin of all results; infinite without results.
    pub least_margin: f64,
    /// Farthest distance from a target that is not reached (m); `None` where all are.
    pub farthest_missed: Option<f64>,
    /// Results whose equilibrium is not the one that the loads lead to from rest.
    pub not_from_rest: usize,
    /// Mean number of steps for a target. A step is an equilibrium with its Jacobian and what becomes of the inputs.
    pub steps_a_target: f64,
    /// Mean time of a step (s).
    pub mean_seconds_a_step: f64,
    /// Median time of a step (s); zero where none was taken.
    pub median_seconds_a_step: f64,
}

impl ControlRun {
    /// The numbers that sum a run up.
    pub fn summary(&self) -> ControlSummary {
        ControlSummary::of(self)
    }
}

impl ControlSummary {
    fn of(run: &ControlRun) -> ControlSummary {
        let results = run.results();
        let is_reached = |result: &&TargetResult| result.outcome == Outcome::Reached;
        let is_missed = |result: &&TargetResult| !is_reached(result);
        let largest = |of: &dyn Fn(&TargetResult) -> f64, which: &dyn Fn(&&TargetResult) -> bool| {
            results.iter().filter(which).map(of).fold(0.0, f64::max)
        };
        let length = run.scene().total_length();
        let steps: usize = results.iter().map(|result| result.iterations).sum();
        let seconds: f64 = results.iter().map(|result| result.seconds).sum();
        ControlSummary {
            counts: Outcome::ALL.map(|outcome| (outcome, run.count(outcome))).into_iter().filter(|c| c.1 > 0).collect(),
            largest_error: largest(&|result| run.tip_error(result), &is_reached),
            largest_force_error: results
                .iter()
                .filter(is_reached)
                .filter_map(|result| run.force_error(result))
                .reduce(f64::max),
            largest_integration_error: largest(&|result| result.error_estimate * length, &is_reached),
            least_margin: results.iter().map(|result| result.margin).fold(f64::INFINITY, f64::min),
            farthest_missed: (run.missed_count() > 0).then(|| largest(&|result| run.tip_error(result), &is_missed)),
            not_from_rest: results.iter().filter(|result| !result.from_rest).count(),
            steps_a_target: steps as f64 / results.len().max(1) as f64,
            mean_seconds_a_step: seconds / steps.max(1) as f64,
            median_seconds_a_step: median_step(results).unwrap_or(0.0),
        }
    }
}
