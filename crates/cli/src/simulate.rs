//! `rodsweep control --simulate`: the computed currents on catheters that are not quite those of the model.

use super::args::ControlArguments;
use super::control::Driven;
use super::control_output::{closed, desired};
use super::engine::cpu_f64;
use super::{CommandError, say};
use rodsweep::model::{Parameter, Vector};
use rodsweep::report::{self, TipPath};
use rodsweep::study::{self, Imperfection, Played, Simulation};
use rodsweep::sweep::write_table;
use rodsweep::table::{Column, Table, Values};
use serde_json::{Value, json};
use std::path::Path;

pub const TRIALS: usize = 10;
/// Measured by the paper on its own prototype: root mean square error, and after alignment [m].
const PAPER: [f64; 2] = [4.34e-3, 1.81e-3];

/// Plays, prints, writes `simulation.csv` and `simulation.png`; what was found, as JSON.
pub fn simulate(driven: &Driven, arguments: &ControlArguments, dir: &Path) -> Result<Value, CommandError> {
    let imperfection = Imperfection::default();
    let found = play(driven, &imperfection, arguments.seed)?;
    write_table(&dir.join("simulation.csv"), &table(&found), &[])?;
    let Imperfection { rest_curvature, stiffness, winding, drift, noise } = imperfection;
    let [rmse, aligned, repeatability] = [found.rmse, found.aligned_rmse, found.repeatability].map(|x| 1e3 * x);
    say(&format!(
        "SIMULATION, no measurement: {TRIALS} trials with a catheter (seed {}) {}",
        arguments.seed,
        differences(&imperfection)
    ));
    say(&format!(
        "simulated: RMSE {rmse:.2} mm, {aligned:.2} mm after rigid alignment, repeatability {repeatability:.2} mm, {} tips lost; \
         the paper measured {:.2} and {:.2} mm on its own prototype",
        found.lost,
        1e3 * PAPER[0],
        1e3 * PAPER[1]
    ));
    if !arguments.no_figures {
        let gap = [[f64::NAN; 3]];
        let trial = |tips: &Vec<Option<Vector>>| {
            let tips = tips.iter().map(|tip| tip.unwrap_or(gap[0])).collect();
            closed(driven, tips).into_iter().chain(gap).collect::<Vec<_>>()
        };
        let figure = TipPath {
            title: format!("{}: {}, simulated trials", driven.scene.name, driven.trajectory.name),
            desired: closed(driven, driven.points.iter().map(|point| desired(driven, point)).collect()),
            achieved: found.trials.iter().flat_map(trial).collect(),
            names: ["desired", "ten trials (simulation)"],
            order: true,
            ..TipPath::default()
        };
        let path = dir.join("simulation.png");
        report::write(&figure, &path)?;
        say(&format!("figure: {}", path.display()));
    }
    Ok(json!({
        "trials": TRIALS,
        "seed": arguments.seed,
        "rmse": found.rmse,
        "aligned_rmse": found.aligned_rmse,
        "repeatability": found.repeatability,
        "lost": found.lost,
        "imperfection": {
            "rest_curvature": rest_curvature, "stiffness": stiffness, "winding": winding, "drift": drift, "noise": noise,
        },
    }))
}

/// Trials with one catheter.
pub fn play(driven: &Driven, imperfection: &Imperfection, seed: u64) -> Result<Simulation, CommandError> {
    let parameters: Vec<Parameter> = driven.inputs.iter().map(|input| input.parameter).collect();
    let commands: Vec<Vec<f64>> = driven.points.iter().map(|point| point.inputs.clone()).collect();
    let desired: Vec<Vector> = driven.points.iter().map(|point| desired(driven, point)).collect();
    let played = Played { scene: &driven.scene, parameters: &parameters, commands: &commands, desired: &desired };
    Ok(study::simulate(&played, imperfection, TRIALS, seed, &mut |plan| cpu_f64(plan))?)
}

/// By how much simulated catheters differ, in words that go on after "a catheter" or "catheters".
pub fn differences(imperfection: &Imperfection) -> String {
    let Imperfection { rest_curvature, stiffness, winding, drift, noise } = imperfection;
    format!(
        "whose rest curvature is off by {rest_curvature} 1/m, stiffness by {:.0} %, turns by {:.0} % (standard \
         deviations), drifting by {drift} 1/m a trial, seen with {:.1} mm of noise",
        100.0 * stiffness,
        100.0 * winding,
        1e3 * noise
    )
}

fn table(found: &Simulation) -> Table {
    let rows = || {
        found
            .trials
            .iter()
            .enumerate()
            .flat_map(|(trial, tips)| tips.iter().enumerate().map(move |(k, tip)| (trial, k, tip)))
    };
    let mut columns = vec![
        Column::new("trial", "", Values::Index(rows().map(|(trial, ..)| trial as u64).collect())),
        Column::new("point", "", Values::Index(rows().map(|(_, k, _)| k as u64).collect())),
    ];
    for (a, axis) in ["x", "y", "z"].iter().enumerate() {
        let values = rows().map(|(.., tip)| tip.map_or(f64::NAN, |tip| tip[a])).collect();
        columns.push(Column::new(format!("tip.position.{axis}"), "m", Values::Double(values)));
    }
    Table::new(columns)
}
