//! The figure of simulated trials with one catheter.

use crate::model::Vector;
use crate::report::{self, ReportError, TipPath};
use crate::study::{ControlRun, Simulation, TRIALS};
use std::path::Path;

const GAP: [Vector; 1] = [[f64::NAN; 3]];

impl Simulation {
    /// Draws every trial (.png or .svg) of the run that was played.
    ///
    /// # Errors
    ///
    /// Nothing to draw, a name that is neither, or a file that cannot be written.
    pub fn figure(&self, run: &ControlRun, path: &Path) -> Result<(), ReportError> {
        let trial = |tips: &Vec<Option<Vector>>| {
            let tips = tips.iter().map(|tip| tip.unwrap_or(GAP[0])).collect();
            run.closed(tips).into_iter().chain(GAP).collect::<Vec<_>>()
        };
        let figure = TipPath {
            title: format!("{}: {}, simulated trials", run.scene().name, run.trajectory().name),
            desired: run.closed(run.results().iter().map(|point| run.desired_tip(point)).collect()),
            achieved: self.trials.iter().flat_map(trial).collect(),
            names: [
                "desired",
                if self.trials.len() == TRIALS { "ten trials (simulation)" } else { "simulated trials" },
            ],
            order: true,
            ..TipPath::default()
        };
        report::write(&figure, path)
    }
}
