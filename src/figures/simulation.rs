//! The figure of simulated trials with one catheter.

use crate::draw::TipPath;
use crate::model::Vector;
use crate::study::{ControlRun, Simulation, TRIALS};

const GAP: [Vector; 1] = [[f64::NAN; 3]];

/// Every trial with one catheter, of the run that was played.
pub fn simulation(found: &Simulation, run: &ControlRun) -> TipPath {
    let trial = |tips: &Vec<Option<Vector>>| {
        let tips = tips.iter().map(|tip| tip.unwrap_or(GAP[0])).collect();
        run.closed(tips).into_iter().chain(GAP).collect::<Vec<_>>()
    };
    TipPath {
        title: format!("{}: {}, simulated trials", run.scene().name, run.trajectory().name),
        desired: run.closed(run.results().iter().map(|point| run.desired_tip(point)).collect()),
        achieved: found.trials.iter().flat_map(trial).collect(),
        names: ["desired", if found.trials.len() == TRIALS { "ten trials (simulation)" } else { "simulated trials" }],
        order: true,
        ..TipPath::default()
    }
}
