//! A run of control in words.

use super::{ControlRun, ControlSummary};
use crate::draw::{count, engineering};
use crate::spec::Redundancy;

impl ControlRun {
    /// What became of the targets and how long it took, a line each, for the terminal.
    pub fn text(&self) -> String {
        let summary = self.summary();
        let words: Vec<String> = summary
            .counts
            .iter()
            .map(|(outcome, number)| format!("{} {}", count(*number as u64), outcome.name()))
            .collect();
        let targets = count(self.results().len() as u64);
        let mut lines: Vec<String> = self.mark().map(str::to_owned).into_iter().collect();
        lines.extend([
            format!("{targets} targets on {}: {}", self.engine(), words.join(", ")),
            format!(
                "tip error where reached: at most {} m; of the integration about {} m; least stability margin {:.3}",
                engineering(summary.largest_error),
                engineering(summary.largest_integration_error),
                summary.least_margin
            ),
            self.check().sentence(),
        ]);
        if let Some(worst) = summary.largest_force_error {
            lines.push(format!("normal force where reached: at most {} N off", engineering(worst)));
        }
        if let Some(worst) = summary.farthest_missed {
            lines.push(format!(
                "where not reached the nearest permitted points are given; the farthest is off by {worst:.3e} m"
            ));
        }
        if summary.not_from_rest > 0 {
            lines.push(format!(
                "warning: {} equilibria are not those that the loads lead to from rest (column from_rest)",
                summary.not_from_rest
            ));
        }
        lines.push(times(self, &summary));
        lines.join("\n")
    }
}

/// A step is an equilibrium with its Jacobian and what becomes of the inputs.
fn times(run: &ControlRun, summary: &ControlSummary) -> String {
    let mut text = format!("time: {:.2} steps a target (equilibrium, Jacobian, update), ", summary.steps_a_target);
    if run.is_in_order() {
        let each = summary.median_seconds_a_step;
        let how = match run.options().redundancy {
            Redundancy::LeastChange => "several targets together where one follows from another",
            Redundancy::LeastCurrent => "one target after another",
        };
        text += &format!("each {:.1} us (median; one thread, {how})", 1e6 * each);
    } else {
        text += &format!("each {:.1} us (mean; in batches, all threads)", 1e6 * summary.mean_seconds_a_step);
    }
    if let Some(alone) = run.seconds_of_a_lone_step() {
        text += &format!("; {:.1} us where a target is known when the last is reached", 1e6 * alone);
    }
    text
}
