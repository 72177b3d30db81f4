//! What `rodsweep control` writes: a table, figures, JSON, a summary.

use super::args::{ControlArguments, TableFormat};
use super::control::{Driven, median_step};
use super::rod_motion::{centreline, motion};
use super::{CommandError, say};
use rodsweep::model::{Parameter, SegmentParameter, Vector};
use rodsweep::report::{self, AxisLabel, Curves, Panel, Series, Sheet, TipPath, count, engineering};
use rodsweep::study::{Controlled, Outcome, Redundancy};
use rodsweep::sweep::{SweepError, write_table};
use rodsweep::table::{Column, Table, Values};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

const XYZ: [&str; 3] = ["x", "y", "z"];
/// Rods that are drawn.
const RODS: usize = 12;
/// More targets than this are drawn as a choice.
const MOST_DRAWN: usize = 4000;
const FIGURES: [&str; 4] = ["trajectory.png", "inputs.png", "rods.png", "motion.svg"];

/// Where results go.
pub struct Outputs {
    pub dir: PathBuf,
    pub table: PathBuf,
}

impl Outputs {
    /// Refuses to overwrite, before anything is solved: `results/NAME/TABLE.csv`, unless told otherwise.
    pub fn new(arguments: &ControlArguments, name: &str, table: &str) -> Result<Outputs, CommandError> {
        let default = || PathBuf::from("results").join(name);
        let dir = arguments.out.clone().unwrap_or_else(default);
        let table = dir.join(match arguments.format {
            TableFormat::Csv => format!("{table}.csv"),
            TableFormat::Parquet => format!("{table}.parquet"),
        });
        if table.exists() && !arguments.force {
            return Err(CommandError::Usage(format!(
                "{} is already there: overwrite it with `--force`, or choose another directory with `--out`",
                table.display()
            )));
        }
        Ok(Outputs { dir, table })
    }

    pub fn make_directory(&self) -> Result<(), SweepError> {
        let io = |error: std::io::Error| SweepError::Io {
            path: self.dir.clone(),
            action: "making the directory",
            reason: error.to_string(),
        };
        std::fs::create_dir_all(&self.dir).map_err(io)
    }

    pub fn write(&self, driven: &Driven) -> Result<(), CommandError> {
        self.make_directory()?;
        let metadata = [
            ("rodsweep.version", env!("CARGO_PKG_VERSION").to_owned()),
            ("rodsweep.scene", driven.scene.name.clone()),
            ("rodsweep.trajectory", driven.trajectory.name.clone()),
            ("rodsweep.engine", driven.engine.clone()),
        ];
        Ok(write_table(&self.table, &table(driven), &metadata)?)
    }
}

fn norm(v: impl IntoIterator<Item = f64>) -> f64 {
    v.into_iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Distance of the tip from its target in the controlled coordinates [m].
pub fn tip_error(driven: &Driven, point: &Controlled) -> f64 {
    let controlled = (0..3).filter(|a| driven.options.coordinates[*a]);
    norm(controlled.map(|a| point.tip[a] - point.target.position[a]))
}

/// Angle between tangent and target [rad].
fn tangent_error(point: &Controlled) -> Option<f64> {
    let target = point.target.tangent?;
    let half = 0.5 * norm((0..3).map(|a| point.tangent[a] - target[a]));
    Some(2.0 * half.min(1.0).asin())
}

fn table(driven: &Driven) -> Table {
    let points = &driven.points;
    let number = |of: &dyn Fn(&Controlled) -> f64| Values::Double(points.iter().map(of).collect());
    let mut columns = vec![Column::new("point", "", Values::Index((0..points.len() as u64).collect()))];
    let mut add = |name: String, unit: &str, values| columns.push(Column::new(name, unit, values));
    if let Some(duration) = driven.trajectory.duration {
        let step = duration / points.len() as f64;
        add("time".into(), "s", Values::Double((0..points.len()).map(|k| step * k as f64).collect()));
    }
    for (a, axis) in XYZ.iter().enumerate().filter(|(a, _)| driven.options.coordinates[*a]) {
        add(format!("target.position.{axis}"), "m", number(&|point| point.target.position[a]));
    }
    let has_tangent = points.iter().any(|point| point.target.tangent.is_some());
    for (a, axis) in XYZ.iter().enumerate().filter(|_| has_tangent) {
        let tangent = number(&|point| point.target.tangent.map_or(f64::NAN, |tangent| tangent[a]));
        add(format!("target.tangent.{axis}"), "", tangent);
    }
    for (k, input) in driven.inputs.iter().enumerate() {
        add(input.parameter.name(&driven.scene), input.parameter.unit(), number(&|point| point.inputs[k]));
    }
    let words = points.iter().map(|point| point.outcome.name().to_owned()).collect();
    add("status".into(), "", Values::Text(words));
    for (a, axis) in XYZ.iter().enumerate() {
        add(format!("tip.position.{axis}"), "m", number(&|point| point.tip[a]));
    }
    for (a, axis) in XYZ.iter().enumerate() {
        add(format!("tip.tangent.{axis}"), "", number(&|point| point.tangent[a]));
    }
    add("tip_error".into(), "m", number(&|point| tip_error(driven, point)));
    if has_tangent {
        add("tangent_error".into(), "rad", number(&|point| tangent_error(point).unwrap_or(f64::NAN)));
    }
    add("residual".into(), "m", number(&|point| point.residual));
    add("iterations".into(), "", Values::Index(points.iter().map(|point| point.iterations as u64).collect()));
    add("stability.margin".into(), "", number(&|point| point.margin));
    add("error_estimate".into(), "", number(&|point| point.error_estimate));
    add("from_rest".into(), "", Values::Flag(points.iter().map(|point| Some(point.from_rest)).collect()));
    add("seconds".into(), "s", number(&|point| point.seconds));
    Table::new(columns)
}

/// The same as JSON.
pub fn value(driven: &Driven) -> Value {
    let point = |point: &Controlled| {
        json!({
            "target": { "position": point.target.position, "tangent": point.target.tangent },
            "inputs": point.inputs,
            "status": point.outcome.name(),
            "tip": { "position": point.tip, "tangent": point.tangent },
            "tip_error": tip_error(driven, point),
            "tangent_error": tangent_error(point),
            "residual": point.residual,
            "iterations": point.iterations,
            "stability_margin": point.margin,
            "error_estimate": point.error_estimate,
            "from_rest": point.from_rest,
            "seconds": point.seconds,
        })
    };
    json!({
        "inputs": driven.inputs.iter().map(|input| json!({
            "parameter": input.parameter.name(&driven.scene), "low": input.low, "high": input.high,
        })).collect::<Vec<_>>(),
        "coordinates": XYZ.iter().zip(driven.options.coordinates).filter(|(_, on)| *on).map(|(name, _)| name).collect::<Vec<_>>(),
        "tolerance": driven.options.tolerance,
        "engine": driven.engine,
        "seconds_of_a_step_alone": driven.step_alone,
        "counts": Outcome::ALL.map(|outcome| (outcome.name(), number_of(driven, outcome))).into_iter().collect::<std::collections::BTreeMap<_, _>>(),
        "points": driven.points.iter().map(point).collect::<Vec<_>>(),
    })
}

fn number_of(driven: &Driven, outcome: Outcome) -> usize {
    driven.points.iter().filter(|point| point.outcome == outcome).count()
}

pub fn print_summary(driven: &Driven) {
    let points = &driven.points;
    let words: Vec<String> = Outcome::ALL
        .into_iter()
        .filter(|outcome| number_of(driven, *outcome) > 0)
        .map(|outcome| format!("{} {}", count(number_of(driven, outcome) as u64), outcome.name()))
        .collect();
    say(&format!("{} targets on {}: {}", count(points.len() as u64), driven.engine, words.join(", ")));
    let largest = |of: &dyn Fn(&Controlled) -> f64, which: &dyn Fn(&&Controlled) -> bool| {
        points.iter().filter(which).map(of).fold(0.0, f64::max)
    };
    let reached = |point: &&Controlled| point.outcome == Outcome::Reached;
    let missed = |point: &&Controlled| point.outcome != Outcome::Reached;
    let length = driven.scene.total_length();
    say(&format!(
        "tip error where reached: at most {} m; of the integration about {} m; least stability margin {:.3}",
        engineering(largest(&|point| tip_error(driven, point), &reached)),
        engineering(largest(&|point| point.error_estimate * length, &reached)),
        points.iter().map(|point| point.margin).fold(f64::INFINITY, f64::min)
    ));
    if points.iter().any(|point| missed(&point)) {
        let worst = largest(&|point| tip_error(driven, point), &missed);
        say(&format!("where not reached the nearest permitted points are given; the farthest is off by {worst:.3e} m"));
    }
    let others = points.iter().filter(|point| !point.from_rest).count();
    if others > 0 {
        say(&format!("warning: {others} equilibria are not those that the loads lead to from rest (column from_rest)"));
    }
    print_times(driven);
}

/// A step is an equilibrium with its Jacobian and what becomes of the inputs.
fn print_times(driven: &Driven) {
    let points = &driven.points;
    let iterations: usize = points.iter().map(|point| point.iterations).sum();
    let seconds: f64 = points.iter().map(|point| point.seconds).sum();
    let (count, steps) = (points.len().max(1) as f64, iterations.max(1) as f64);
    let mut text = format!("time: {:.2} steps a target (equilibrium, Jacobian, update), ", iterations as f64 / count);
    if driven.batch {
        text += &format!("each {:.1} us (mean; in batches, all threads)", 1e6 * seconds / steps);
    } else {
        let each = median_step(points).unwrap_or(0.0);
        let how = match driven.options.redundancy {
            Redundancy::LeastChange => "several targets together where one follows from another",
            Redundancy::LeastCurrent => "one target after another",
        };
        text += &format!("each {:.1} us (median; one thread, {how})", 1e6 * each);
    }
    if let Some(alone) = driven.step_alone {
        text += &format!("; {:.1} us where a target is known when the last is reached", 1e6 * alone);
    }
    say(&text);
}

/// Where the tip should be; where a coordinate is free, the target goes along with the tip [m].
pub fn desired(driven: &Driven, point: &Controlled) -> Vector {
    std::array::from_fn(|a| if driven.options.coordinates[a] { point.target.position[a] } else { point.tip[a] })
}

/// The way back to the first point, where the trajectory is closed.
pub fn closed<T: Copy>(driven: &Driven, mut points: Vec<T>) -> Vec<T> {
    if driven.trajectory.closed && !driven.batch {
        points.extend(points.first().copied());
    }
    points
}

/// Draws the figures into a directory; returns their files.
pub fn draw(driven: &Driven, dir: &Path) -> Result<Vec<PathBuf>, CommandError> {
    let every = driven.points.len().div_ceil(MOST_DRAWN).max(1);
    let points: Vec<&Controlled> = driven.points.iter().step_by(every).collect();
    let desired = |point: &&Controlled| desired(driven, point);
    let missed = |point: &&&Controlled| point.outcome != Outcome::Reached;
    let path = TipPath {
        title: format!("{}: {}", driven.scene.name, driven.trajectory.name),
        desired: closed(driven, points.iter().map(desired).collect()),
        achieved: closed(driven, points.iter().map(|point| point.tip).collect()),
        flagged: points.iter().filter(missed).map(desired).collect(),
        rods: Vec::new(),
        names: ["desired", "achieved by the model"],
        order: !driven.batch,
    };
    let mut files = Vec::new();
    let mut write = |figure: &dyn report::Figure, name: &str| -> Result<(), CommandError> {
        report::write(figure, &dir.join(name))?;
        files.push(dir.join(name));
        Ok(())
    };
    write(&path, FIGURES[0])?;
    if driven.batch {
        return Ok(files);
    }
    let panels = input_panels(driven);
    write(
        &Sheet { columns: panels.len().min(2), panels: panels.iter().map(|panel| panel as &dyn Panel).collect() },
        FIGURES[1],
    )?;
    let frames = driven.points.iter().step_by(driven.points.len().div_ceil(RODS).max(1));
    let rods = frames.filter_map(|point| centreline(driven, point)).collect();
    write(&TipPath { rods, flagged: Vec::new(), ..path }, FIGURES[2])?;
    if let Some(motion) = motion(driven) {
        write(&motion, FIGURES[3])?;
    }
    Ok(files)
}

/// Currents over time; other inputs and the error below.
fn input_panels(driven: &Driven) -> Vec<Curves> {
    let step = driven.trajectory.duration.map(|duration| duration / driven.points.len() as f64);
    let x = if step.is_some() { AxisLabel::linear("time", "s") } else { AxisLabel::linear("point", "") };
    let at = |k: usize| step.unwrap_or(1.0) * k as f64;
    let series = |name: String, of: &dyn Fn(&Controlled) -> f64| {
        Series::line(name, driven.points.iter().enumerate().map(|(k, point)| [at(k), of(point)]).collect())
    };
    let is_current =
        |k: &usize| matches!(driven.inputs[*k].parameter, Parameter::Segment(_, SegmentParameter::Current(_)));
    let mut panels = Vec::new();
    let currents: Vec<usize> = (0..driven.inputs.len()).filter(is_current).collect();
    if !currents.is_empty() {
        let of = |k: &usize| series(driven.inputs[*k].parameter.name(&driven.scene), &|point| 1e3 * point.inputs[*k]);
        panels.push(Curves {
            title: "Currents".into(),
            x: x.clone(),
            y: AxisLabel::linear("current", "mA"),
            series: currents.iter().map(of).collect(),
        });
    }
    for k in (0..driven.inputs.len()).filter(|k| !is_current(k)) {
        let (name, unit) = (driven.inputs[k].parameter.name(&driven.scene), driven.inputs[k].parameter.unit());
        let (factor, unit) = if unit == "m" { (1e3, "mm") } else { (1.0, unit) };
        panels.push(Curves {
            title: name.clone(),
            x: x.clone(),
            y: AxisLabel::linear(name, unit),
            series: vec![series(String::new(), &|point| factor * point.inputs[k])],
        });
    }
    panels.push(Curves {
        title: "Tip error of the model".into(),
        x,
        y: AxisLabel::logarithmic("tip error", "m"),
        series: vec![series(String::new(), &|point| tip_error(driven, point).max(1e-16))],
    });
    panels
}
