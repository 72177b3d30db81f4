//! `rodsweep control --experiment`: the paper's experiment, simulated, beside what it measured.

use super::args::ControlArguments;
use super::control::{Driven, drive, say_notes};
use super::control_output::{Outputs, closed, desired};
use super::simulate::{TRIALS, differences, play};
use super::{CommandError, Exit, print, say};
use rodsweep::model::{Scene, Vector};
use rodsweep::report::{self, AxisLabel, Colour, Curves, Panel, PlaneCurves, Series, Sheet, Table};
use rodsweep::study::{Imperfection, Outcome, Simulation};
use rodsweep::sweep::{SweepError, parse_trajectory, write_table};
use rodsweep::table::{self, Column, Values};
use serde_json::{Value, json};
use std::path::Path;

/// The shipped trajectories.
const TRAJECTORIES: [(&str, &str); 4] = [
    ("circle.toml", include_str!("../../sweeps/trajectories/circle.toml")),
    ("lemniscate.toml", include_str!("../../sweeps/trajectories/lemniscate.toml")),
    ("rectangle.toml", include_str!("../../sweeps/trajectories/rectangle.toml")),
    ("butterfly.toml", include_str!("../../sweeps/trajectories/butterfly.toml")),
];
/// Measured by the paper, [mm]: the two lists of root mean square errors that it gives (Table I, text on Fig. 5), and
/// what is known of the errors after alignment.
const MEASURED: [[f64; 2]; 4] = [[4.34, 2.84], [6.49, 5.33], [4.60, 5.97], [3.66, 6.44]];
const MEASURED_ALIGNED: [Option<f64>; 4] = [Some(1.81), None, None, None];
const NOTES: [&str; 3] = [
    "simulated: median over the catheters, in brackets what 10 % and 90 % stay below",
    "measured by the paper with its own prototype and trajectories, whose sizes are not published: (a) and (b) are the two \
     lists that it gives (Table I, text on Fig. 5), which disagree; taken in the order of the rows",
    "empty cells: no number of the paper is at hand",
];

/// One trajectory and what the catheters made of it.
struct Played {
    driven: Driven,
    simulations: Vec<Simulation>,
}

pub fn experiment(scene: Scene, arguments: &ControlArguments) -> Result<Exit, CommandError> {
    let mut trajectories = Vec::new();
    for (file, text) in TRAJECTORIES {
        trajectories.push(parse_trajectory(Path::new(file), text, &scene)?);
    }
    let outputs = Outputs::new(arguments, "control-experiment", "experiment")?;
    say_notes(&scene);
    let imperfection = Imperfection::default();
    let seeds: Vec<u64> = (0..arguments.catheters as u64).map(|k| arguments.seed.wrapping_add(k)).collect();
    let mut played = Vec::new();
    for trajectory in trajectories {
        let driven = drive(scene.clone(), trajectory, arguments)?;
        let simulations = seeds.iter().map(|seed| play(&driven, &imperfection, *seed)).collect::<Result<_, _>>()?;
        say(&format!("{}: played", driven.trajectory.name));
        played.push(Played { driven, simulations });
    }
    outputs.make_directory()?;
    write_table(&outputs.table, &table::Table::new(columns(&played, &seeds)), &[])?;
    let text = format!(
        "SIMULATION, no measurement: {} catheters (seeds from {}), {TRIALS} trials each, {}\n\n{}\n{}\n",
        seeds.len(),
        arguments.seed,
        differences(&imperfection),
        table(&played),
        NOTES.map(|note| format!("{note}.")).join("\n")
    );
    let page = outputs.dir.join("experiment.md");
    let io =
        |error: std::io::Error| SweepError::Io { path: page.clone(), action: "writing", reason: error.to_string() };
    std::fs::write(&page, markdown(&text, &played)).map_err(io)?;
    if !arguments.json {
        print(&text)?;
    }
    say(&format!("results: {}, {}", outputs.table.display(), page.display()));
    if !arguments.no_figures {
        let path = outputs.dir.join("experiment.png");
        let shown = median_catheter(&played);
        let panels: Vec<PlaneCurves> =
            played.iter().enumerate().map(|(k, played)| panel(played, shown, k == 0)).collect();
        let panels = panels.iter().map(|panel| panel as &dyn Panel).collect();
        report::write(&Sheet { columns: 2, panels }, &path)?;
        say(&format!("figure: {}, the catheter of seed {}, the median by RMSE", path.display(), seeds[shown]));
    }
    if arguments.json {
        let answer = json!({ "simulation": true, "trials": TRIALS, "seeds": seeds, "trajectories": values(&played) });
        print(&(serde_json::to_string_pretty(&answer).unwrap_or_default() + "\n"))?;
    }
    Ok(Exit::Done)
}

impl Played {
    fn reached(&self) -> usize {
        self.driven.points.iter().filter(|point| point.outcome == Outcome::Reached).count()
    }

    fn lost(&self) -> usize {
        self.simulations.iter().map(|simulation| simulation.lost).sum()
    }

    /// What 10, 50 and 90 % of the catheters stay below [mm].
    fn quantiles(&self, of: fn(&Simulation) -> f64) -> [f64; 3] {
        let mut values: Vec<f64> = self.simulations.iter().map(|simulation| 1e3 * of(simulation)).collect();
        values.sort_by(f64::total_cmp);
        [0.1, 0.5, 0.9].map(|share| {
            let at = share * (values.len() - 1) as f64;
            let (below, above) = (values[at.floor() as usize], values[at.ceil() as usize]);
            below + at.fract() * (above - below)
        })
    }
}

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
const QUANTITIES: [fn(&Simulation) -> f64; 3] = [|s| s.rmse, |s| s.aligned_rmse, |s| s.repeatability];

fn rows(played: &[Played]) -> Vec<Vec<String>> {
    let row = |(k, played): (usize, &Played)| {
        let [rmse, aligned, repeatability] = QUANTITIES.map(|of| {
            let [low, median, high] = played.quantiles(of);
            format!("{median:.2} ({low:.2}-{high:.2})")
        });
        let [a, b] = MEASURED[k].map(|x| format!("{x:.2}"));
        let aligned_paper = MEASURED_ALIGNED[k].map_or(String::new(), |x| format!("{x:.2}"));
        let reached = format!("{} of {}", played.reached(), played.driven.points.len());
        let name = played.driven.trajectory.name.clone();
        vec![name, reached, played.lost().to_string(), rmse, a, b, aligned, aligned_paper, repeatability]
    };
    played.iter().enumerate().map(row).collect()
}

fn table(played: &[Played]) -> Table {
    let mut table = Table::new(HEADERS);
    for row in rows(played) {
        table.row(row);
    }
    table
}

/// The same text with its table as Markdown.
fn markdown(text: &str, played: &[Played]) -> String {
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let mut marked = line(HEADERS.map(str::to_owned).to_vec()) + &line(vec!["---".into(); HEADERS.len()]);
    rows(played).into_iter().for_each(|row| marked += &line(row));
    text.replace(&table(played).to_string(), &marked).replace(".\n", ".\n\n").trim_end().to_owned() + "\n"
}

/// One row a trajectory and catheter.
fn columns(played: &[Played], seeds: &[u64]) -> Vec<Column> {
    let mut rows: Vec<(&str, u64, &Simulation)> = Vec::new();
    for played in played {
        let name = played.driven.trajectory.name.as_str();
        rows.extend(seeds.iter().zip(&played.simulations).map(|(seed, simulation)| (name, *seed, simulation)));
    }
    let number = |of: fn(&Simulation) -> f64| Values::Double(rows.iter().map(|row| of(row.2)).collect());
    let names = rows.iter().map(|row| row.0.to_owned()).collect();
    vec![
        Column::new("trajectory", "", Values::Text(names)),
        Column::new("seed", "", Values::Index(rows.iter().map(|row| row.1).collect())),
        Column::new("rmse", "m", number(QUANTITIES[0])),
        Column::new("aligned_rmse", "m", number(QUANTITIES[1])),
        Column::new("repeatability", "m", number(QUANTITIES[2])),
        Column::new("lost", "", Values::Index(rows.iter().map(|row| row.2.lost as u64).collect())),
    ]
}

fn values(played: &[Played]) -> Vec<Value> {
    let value = |(k, played): (usize, &Played)| {
        let [rmse, aligned, repeatability] = QUANTITIES.map(|of| played.quantiles(of).map(|x| 1e-3 * x));
        json!({
            "name": played.driven.trajectory.name,
            "points": played.driven.points.len(),
            "reached": played.reached(),
            "lost": played.lost(),
            "rmse": rmse,
            "aligned_rmse": aligned,
            "repeatability": repeatability,
            "measured_rmse": MEASURED[k].map(|x| 1e-3 * x),
            "measured_aligned_rmse": MEASURED_ALIGNED[k].map(|x| 1e-3 * x),
        })
    };
    played.iter().enumerate().map(value).collect()
}

/// The catheter in the middle by the sum of its mean square errors.
fn median_catheter(played: &[Played]) -> usize {
    let square = |k: usize| played.iter().map(|played| played.simulations[k].rmse.powi(2)).sum::<f64>();
    let mut order: Vec<usize> = (0..played[0].simulations.len()).collect();
    order.sort_by(|a, b| square(*a).total_cmp(&square(*b)));
    order[(order.len() - 1) / 2]
}

/// One catheter's trials in the controlled plane.
fn panel(played: &Played, catheter: usize, named: bool) -> PlaneCurves {
    let Played { driven, simulations } = played;
    let flat = |tip: Option<Vector>| tip.map_or([f64::NAN; 2], |tip| [1e3 * tip[0], 1e3 * tip[1]]);
    let line = |name: &str, tips: Vec<Option<Vector>>| {
        Series::line(if named { name } else { "" }, closed(driven, tips.into_iter().map(flat).collect()))
    };
    let goal = driven.points.iter().map(|point| Some(desired(driven, point))).collect();
    let mut series = vec![line("desired", goal).colour(Colour::ORANGE).width(2.6)];
    for (k, trial) in simulations[catheter].trials.iter().enumerate() {
        let name = if k == 0 { "ten trials" } else { "" };
        series.push(line(name, trial.clone()).colour(Colour::SKY).width(0.4));
    }
    series.push(line("mean", simulations[catheter].mean.clone()).colour(Colour::BLUE).width(1.1));
    let title = format!("{}, simulated", driven.trajectory.name);
    PlaneCurves(Curves { title, x: AxisLabel::linear("x", "mm"), y: AxisLabel::linear("y", "mm"), series })
}
