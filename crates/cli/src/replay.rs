//! `rodsweep control --replay`: recorded currents through the model, beside the tips that were observed.

use super::args::ControlArguments;
use super::control::say_notes;
use super::control_output::Outputs;
use super::engine::cpu_f64;
use super::{CommandError, Exit, print, say};
use rodsweep::model::{Scene, Vector};
use rodsweep::report::{self, TipPath};
use rodsweep::study::{self, Agreement, agreement};
use rodsweep::sweep::{InputTable, read_input_table, read_observed_tips, write_table};
use rodsweep::table::{Column, Table, Values};
use serde_json::{Value, json};
use std::path::Path;

const NOWHERE: Vector = [f64::NAN; 3];

pub fn replay(scene: &Scene, currents: &Path, arguments: &ControlArguments) -> Result<Exit, CommandError> {
    let table = read_input_table(currents, scene)?;
    let observed = arguments.observed.as_ref().map(|file| read_observed_tips(file, table.row_count())).transpose()?;
    let name = currents.file_stem().unwrap_or_default().to_string_lossy();
    let outputs = Outputs::new(arguments, &format!("replay-{name}"), "replay")?;
    say_notes(scene);
    let commands: Vec<Vec<f64>> = (0..table.row_count()).map(|row| table.row(row).to_vec()).collect();
    let tips = study::play(scene, table.parameters(), &commands, &mut |plan| cpu_f64(plan))?;
    let lost = tips.iter().filter(|tip| tip.is_none()).count();
    if lost == tips.len() {
        let text = "no row gives a rod with a stable equilibrium from rest; check the values and the scene";
        return Err(CommandError::Usage(format!("{}: {text}", currents.display())));
    }
    outputs.make_directory()?;
    write_table(&outputs.table, &tip_table(scene, &table, &tips), &[])?;
    say(&format!("{} states played, {lost} without a stable equilibrium from rest", tips.len()));
    say(&format!("results: {}", outputs.table.display()));
    let mut answer = json!({ "states": tips.len(), "lost": lost, "tips": tips });
    if let Some(observed) = &observed {
        let pairs = observed.iter().filter_map(|(point, seen)| Some((*seen, tips[*point]?)));
        let pairs: Vec<(Vector, Vector)> = pairs.collect();
        let Some(found) = agreement(&pairs) else {
            let text = "no observed tip belongs to a state with a stable equilibrium; check the scene and the currents";
            return Err(CommandError::Usage(text.into()));
        };
        let residuals = outputs.dir.join("residuals.csv");
        write_table(&residuals, &residual_table(observed, &tips, &found), &[])?;
        say(&format!("residuals: {}", residuals.display()));
        answer["observed"] = tell(&found, pairs.len(), observed.len());
        if !arguments.no_figures {
            let path = outputs.dir.join("replay.png");
            let title = format!("{}: {name}, replayed", scene.name);
            let achieved = tips.iter().map(|tip| tip.unwrap_or(NOWHERE)).collect();
            let desired = observed.iter().map(|(_, seen)| *seen).collect();
            let names = ["observed", "model"];
            report::write(&TipPath { title, desired, achieved, names, ..TipPath::default() }, &path)?;
            say(&format!("figure: {}", path.display()));
        }
    }
    if arguments.json {
        print(&(serde_json::to_string_pretty(&answer).unwrap_or_default() + "\n"))?;
    }
    Ok(Exit::Done)
}

/// Prints, and gives as JSON, how well some of the observed tips agree with the model.
fn tell(found: &Agreement, count: usize, observed: usize) -> Value {
    let Agreement { rmse, offset, centred_rmse, aligned_rmse } = *found;
    let [x, y, z] = offset.map(|x| 1e3 * x);
    say(&format!(
        "{count} of {observed} observed tips: RMSE {:.2} mm; {:.2} mm without their mean offset of ({x:.1}, {y:.1}, {z:.1}) mm; {:.2} mm \
         after rigid alignment",
        1e3 * rmse,
        1e3 * centred_rmse,
        1e3 * aligned_rmse
    ));
    json!({
        "count": count, "rmse": rmse, "offset": offset, "rmse_without_offset": centred_rmse, "aligned_rmse": aligned_rmse,
    })
}

fn tip_table(scene: &Scene, table: &InputTable, tips: &[Option<Vector>]) -> Table {
    let rows = 0..table.row_count();
    let mut columns = vec![Column::new("point", "", Values::Index(rows.clone().map(|k| k as u64).collect()))];
    for (k, parameter) in table.parameters().iter().enumerate() {
        let values = rows.clone().map(|row| table.row(row)[k]).collect();
        columns.push(Column::new(parameter.name(scene), parameter.unit(), Values::Double(values)));
    }
    let tips: Vec<Vector> = tips.iter().map(|tip| tip.unwrap_or(NOWHERE)).collect();
    add_vector(&mut columns, "tip.position", &tips);
    Table::new(columns)
}

/// Observed less played, as it is and without the mean offset.
fn residual_table(observed: &[(usize, Vector)], tips: &[Option<Vector>], found: &Agreement) -> Table {
    let points = observed.iter().map(|(point, _)| *point as u64).collect();
    let mut columns = vec![Column::new("point", "", Values::Index(points))];
    let apart = |(point, seen): &(usize, Vector)| {
        let tip = tips[*point].unwrap_or(NOWHERE);
        std::array::from_fn(|a| seen[a] - tip[a])
    };
    let residuals: Vec<Vector> = observed.iter().map(apart).collect();
    add_vector(&mut columns, "observed", &observed.iter().map(|(_, seen)| *seen).collect::<Vec<_>>());
    add_vector(&mut columns, "residual", &residuals);
    let norm = |v: Vector| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let without = |v: &Vector| norm(std::array::from_fn(|a| v[a] - found.offset[a]));
    let distances = residuals.iter().map(|v| norm(*v)).collect();
    columns.push(Column::new("distance", "m", Values::Double(distances)));
    let distances = residuals.iter().map(without).collect();
    columns.push(Column::new("distance_without_offset", "m", Values::Double(distances)));
    Table::new(columns)
}

fn add_vector(columns: &mut Vec<Column>, name: &str, values: &[Vector]) {
    for (a, axis) in ["x", "y", "z"].iter().enumerate() {
        let values = Values::Double(values.iter().map(|value| value[a]).collect());
        columns.push(Column::new(format!("{name}.{axis}"), "m", values));
    }
}
