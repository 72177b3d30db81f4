//! The figure of the simulated experiment: each trajectory on one catheter.

use crate::draw::{AxisLabel, Canvas, Colour, Curves, Figure, Panel, PlaneCurves, ReportError, Series, Sheet};
use crate::model::Vector;
use crate::study::{ExperimentRun, PlayedTrajectory};

/// Each trajectory of an experiment on the median catheter.
#[derive(Clone, Copy, Debug)]
pub struct ExperimentFigure<'a>(pub &'a ExperimentRun);

impl Figure for ExperimentFigure<'_> {
    fn draw(&self) -> Result<Canvas, ReportError> {
        let shown = self.0.median_catheter();
        let played = self.0.trajectories.iter().enumerate();
        let panels: Vec<PlaneCurves> = played.map(|(k, played)| panel(played, shown, k == 0)).collect();
        let panels = panels.iter().map(|panel| panel as &dyn Panel).collect();
        Sheet { columns: 2, panels }.draw()
    }
}

/// One catheter's trials in the controlled plane.
fn panel(played: &PlayedTrajectory, catheter: usize, named: bool) -> PlaneCurves {
    let PlayedTrajectory { run, simulations, .. } = played;
    let flat = |tip: Option<Vector>| tip.map_or([f64::NAN; 2], |tip| [1e3 * tip[0], 1e3 * tip[1]]);
    let line = |name: &str, tips: Vec<Option<Vector>>| {
        Series::line(if named { name } else { "" }, run.closed(tips.into_iter().map(flat).collect()))
    };
    let goal = run.results().iter().map(|point| Some(run.desired_tip(point))).collect();
    let mut series = vec![line("desired", goal).colour(Colour::ORANGE).width(2.6)];
    for (k, trial) in simulations[catheter].trials.iter().enumerate() {
        let name = if k == 0 { "ten trials" } else { "" };
        series.push(line(name, trial.clone()).colour(Colour::SKY).width(0.4));
    }
    series.push(line("mean", simulations[catheter].mean.clone()).colour(Colour::BLUE).width(1.1));
    let title = format!("{}, simulated", run.trajectory().name);
    PlaneCurves(Curves { title, x: AxisLabel::linear("x", "mm"), y: AxisLabel::linear("y", "mm"), series })
}
