//! The simulated experiment as text, as a page, as a figure.

use crate::model::Vector;
use crate::report::{
    AxisLabel, Canvas, Colour, Curves, Figure, Panel, PlaneCurves, ReportError, Series, Sheet, TextTable,
};
use crate::study::{ExperimentRun, PlayedTrajectory, Simulation, TRIALS};

const HEADERS: [&str; 9] = [
    "trajectory",
    "reached",
    "tips lost",
    "RMSE, simulated [mm]",
    "paper (a)",
    "paper (b)",
    "aligned, simulated [mm]",
    "paper",
    "repeatability, simulated [mm]",
];
const NOTES: [&str; 3] = [
    "simulated: median over the catheters, in brackets what 10 % and 90 % stay below",
    "measured by the paper with its own prototype and trajectories, whose sizes are not published: (a) and (b) are the two \
     lists that it gives (Table I, text on Fig. 5), which disagree; taken in the order of the rows",
    "empty cells: no number of the paper is at hand",
];

/// What was simulated, its table and what its columns mean, for the terminal.
pub fn experiment_text(found: &ExperimentRun) -> String {
    format!(
        "SIMULATION, no measurement: {} catheters (seeds from {}), {TRIALS} trials each, {}\n\n{}\n{}\n",
        found.seeds.len(),
        found.seeds[0],
        found.imperfection.in_words(),
        table(found),
        NOTES.map(|note| format!("{note}.")).join("\n")
    )
}

/// The same in Markdown.
pub fn experiment_page(found: &ExperimentRun) -> String {
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let mut marked = line(HEADERS.map(str::to_owned).to_vec()) + &line(vec!["---".into(); HEADERS.len()]);
    found.trajectories.iter().for_each(|played| marked += &line(cells(played)));
    let text = experiment_text(found).replace(&table(found).to_string(), &marked);
    text.replace(".\n", ".\n\n").trim_end().to_owned() + "\n"
}

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

fn table(found: &ExperimentRun) -> TextTable {
    let mut table = TextTable::new(HEADERS);
    for played in &found.trajectories {
        table.row(cells(played));
    }
    table
}

fn cells(played: &PlayedTrajectory) -> Vec<String> {
    let quantities: [fn(&Simulation) -> f64; 3] = [|s| s.rmse, |s| s.aligned_rmse, |s| s.repeatability];
    let [rmse, aligned, repeatability] = quantities.map(|of| {
        let [low, median, high] = played.quantiles_mm(of);
        format!("{median:.2} ({low:.2}-{high:.2})")
    });
    let [a, b] = played.measured.rmse.map(|x| format!("{x:.2}"));
    let aligned_paper = played.measured.aligned_rmse.map_or(String::new(), |x| format!("{x:.2}"));
    let reached = format!("{} of {}", played.reached(), played.run.results().len());
    let name = played.run.trajectory().name.clone();
    vec![name, reached, played.lost().to_string(), rmse, a, b, aligned, aligned_paper, repeatability]
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
