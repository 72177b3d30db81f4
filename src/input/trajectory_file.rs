//! Trajectories: TOML that names a curve, or a table of points (CSV or Parquet) with columns x, y, z, tx, ty, tz, normal_force.

use super::error::{InputError, Problem, table_error};
use super::limits::{LimitsError, check_limits};
use super::number_table::{Columns, read_number_table};
use super::scene_file::read_text;
use super::toml::{Reader, Source};
use super::units::Dimension;
use crate::model::{Axis, Parameter, Scene, TipOnWall, Vector, closest, short_number};
use crate::spec::{ControlInput, Coordinates, Redundancy, Target, Trajectory, grouped};
use std::f64::consts::TAU;
use std::path::Path;

const KEYS: [&str; 14] = [
    "name",
    "shape",
    "size",
    "plane",
    "centre",
    "points",
    "duration",
    "file",
    "tangent",
    "normal_force",
    "coordinates",
    "input",
    "control",
    "start",
];
/// Points of a curve that is made: some kilobytes each by the time that they are solved.
const MOST_POINTS: u64 = 1_000_000;
/// Every coordinate.
const ALLOWED: &str = "x, y, z, normal_force";
const NO_WALL: &str = "the scene has no wall that the tip could press on: add [wall] to it, or leave out normal_force";
const CONTROL_KEYS: [&str; 4] = ["tolerance", "iterations", "tangent_weight", "redundancy"];
const INPUT_KEYS: [&str; 3] = ["parameter", "from", "to"];
const SHAPES: [&str; 5] = ["circle", "lemniscate", "rectangle", "butterfly", "table"];
const PLANES: [(&str, [usize; 2]); 6] =
    [("xy", [0, 1]), ("yz", [1, 2]), ("xz", [0, 2]), ("yx", [1, 0]), ("zy", [2, 1]), ("zx", [2, 0])];
const COLUMNS: [&str; 7] = ["x", "y", "z", "tx", "ty", "tz", FORCE];
/// The force of the wall on the tip, as a key, a column and a coordinate.
const FORCE: &str = "normal_force";

/// Reads a trajectory (TOML) or a table of targets (CSV, Parquet).
///
/// # Errors
///
/// A file that cannot be read, or a mistake in it.
pub fn read_trajectory(file: &Path, scene: &Scene) -> Result<Trajectory, InputError> {
    let extension = file.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("csv" | "parquet") => {
            let (targets, coordinates) = read_targets(file, scene)?;
            Ok(Trajectory { coordinates, ..Trajectory::new(stem(file), targets) })
        }
        _ => parse_trajectory(file, &read_text(file)?, scene),
    }
}

/// Reads the text of a trajectory file; `file` is what errors name.
///
/// # Errors
///
/// A mistake in the text.
pub fn parse_trajectory(file: &Path, text: &str, scene: &Scene) -> Result<Trajectory, InputError> {
    trajectory(file, &Source::parse(file, text)?.root(), scene)
}

fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn trajectory(file: &Path, reader: &Reader, scene: &Scene) -> Result<Trajectory, InputError> {
    reader.check_keys(&KEYS)?;
    let shape =
        reader.string("shape")?.ok_or_else(|| reader.missing("shape", format!("use one of: {}", SHAPES.join(", "))))?;
    let shape = choice(reader, "shape", shape, &SHAPES)?;
    let (mut targets, mut coordinates) = if shape == "table" {
        for name in ["size", "plane", "centre", "points", "start"] {
            if reader.has(name) {
                let remedy = format!("the table has its own points; drop `{name}`");
                return Err(reader.error(name, Problem::Conflict { with: "shape = \"table\"".into(), remedy }));
            }
        }
        let table = reader
            .string("file")?
            .ok_or_else(|| reader.missing("file", "name a CSV or Parquet file with columns x, y, z"))?;
        read_targets(&file.parent().unwrap_or(Path::new("")).join(table), scene)?
    } else {
        if reader.has("file") {
            let remedy = "write shape = \"table\", or drop the file".into();
            return Err(reader.error("file", Problem::Conflict { with: "shape".into(), remedy }));
        }
        (curve(reader, shape)?, [true; 3])
    };
    if let Some(tangent) = reader.vector("tangent", "")? {
        let tangent = unit(tangent).ok_or_else(|| reader.error("tangent", no_direction()))?;
        targets.iter_mut().for_each(|target| target.tangent = Some(tangent));
    }
    if let Some(force) = reader.quantity(FORCE, "N")? {
        check_force(scene, force).map_err(|problem| reader.error(FORCE, problem))?;
        targets.iter_mut().for_each(|target| target.normal_force = Some(force));
    }
    if let Some(names) = reader.strings("coordinates")? {
        let chosen = parse_coordinates(&names).map_err(|problem| reader.error("coordinates", problem))?;
        choose_force(reader, scene, chosen, &mut targets)?;
        coordinates = chosen.position;
    }
    let mut trajectory = Trajectory {
        closed: shape != "table",
        coordinates,
        duration: positive(reader, "duration", "s")?,
        ..Trajectory::new(reader.string("name")?.map_or_else(|| stem(file), str::to_owned), targets)
    };
    for block in reader.tables("input")? {
        input(&block, scene, &mut trajectory.inputs)?;
    }
    if let Some(control) = reader.table("control")? {
        control.check_keys(&CONTROL_KEYS)?;
        trajectory.tolerance = positive(&control, "tolerance", "m")?;
        trajectory.most_iterations = control.count("iterations", 1)?.map(|count| count as usize);
        trajectory.tangent_weight = positive(&control, "tangent_weight", "m")?;
        if let Some(word) = control.string("redundancy")? {
            let word = choice(&control, "redundancy", word, &Redundancy::ALL.map(Redundancy::name))?;
            trajectory.redundancy = Redundancy::ALL.into_iter().find(|redundancy| redundancy.name() == word);
        }
    }
    Ok(trajectory)
}

/// Leaves the force free unless the coordinates name it.
fn choose_force(
    reader: &Reader,
    scene: &Scene,
    coordinates: Coordinates,
    targets: &mut [Target],
) -> Result<(), InputError> {
    if coordinates.normal_force {
        check_wall(scene).map_err(|problem| reader.error("coordinates", problem))?;
        if targets.iter().any(|target| target.normal_force.is_none()) {
            let remedy = "say how hard the tip should press, such as normal_force = \"2 mN\", or give the table a column \
                          normal_force";
            return Err(reader.missing(FORCE, remedy));
        }
    } else if reader.has(FORCE) {
        let remedy = "add \"normal_force\" to the coordinates, or drop this key".into();
        return Err(reader.error(FORCE, Problem::Conflict { with: "coordinates".into(), remedy }));
    }
    if !coordinates.normal_force {
        targets.iter_mut().for_each(|target| target.normal_force = None);
    }
    Ok(())
}

/// Refuses a force where nothing can give it.
fn check_wall(scene: &Scene) -> Result<(), Problem> {
    match scene.wall {
        Some(_) => Ok(()),
        None => Err(Problem::Missing { remedy: NO_WALL.into() }),
    }
}

/// Refuses a force that the wall of a scene cannot have.
fn check_force(scene: &Scene, force: f64) -> Result<(), Problem> {
    check_wall(scene)?;
    let slides = scene.wall.is_some_and(|wall| wall.tip == TipOnWall::Slides);
    if force < 0.0 && slides {
        let expected = "a force from 0 on: a wall on which the tip slides does not pull".into();
        return Err(Problem::Range { value: format!("{} N", short_number(force)), expected });
    }
    Ok(())
}

fn input(block: &Reader, scene: &Scene, inputs: &mut Vec<ControlInput>) -> Result<(), InputError> {
    block.check_keys(&INPUT_KEYS)?;
    let name = block
        .string("parameter")?
        .ok_or_else(|| block.missing("parameter", "name what is commanded, such as coil.current"))?;
    let parameters =
        Parameter::parse(scene, name).map_err(|error| block.error("parameter", Problem::Parameter(error)))?;
    for parameter in parameters {
        let limit = |key: &str| -> Result<f64, InputError> {
            block
                .quantity(key, parameter.unit())?
                .ok_or_else(|| block.missing(key, "give the lower limit in `from`, the upper in `to`"))
        };
        let (low, high) = (limit("from")?, limit("to")?);
        if low >= high {
            let expected = format!("more than `from`, which is {}", short_number(low));
            let problem = Problem::Range { value: short_number(high), expected };
            return Err(block.error("to", problem));
        }
        check_limits(scene, parameter, [low, high]).map_err(|error| {
            let is_lower = matches!(error, LimitsError::Negative { .. } | LimitsError::Scene { is_upper: false, .. });
            let key = if is_lower { "from" } else { "to" };
            block.error(key, Problem::Table(error.to_string()))
        })?;
        if inputs.iter().any(|other| other.parameter == parameter) {
            let problem =
                Problem::Conflict { with: parameter.name(scene), remedy: "it is an input already; drop one".into() };
            return Err(block.error("parameter", problem));
        }
        inputs.push(ControlInput::new(parameter, low, high));
    }
    Ok(())
}

fn positive(reader: &Reader, name: &str, unit: &str) -> Result<Option<f64>, InputError> {
    match reader.quantity(name, unit)? {
        Some(value) if value <= 0.0 => {
            let dimension = Dimension::of(unit);
            let expected = format!("{} above zero, such as {}", dimension.name(), dimension.example());
            Err(reader.error(name, Problem::Range { value: short_number(value), expected }))
        }
        value => Ok(value),
    }
}

fn choice(reader: &Reader, key: &str, word: &str, words: &[&'static str]) -> Result<&'static str, InputError> {
    words.iter().find(|other| **other == word).copied().ok_or_else(|| {
        let suggestion = closest(word, words.iter().copied());
        reader.error(key, Problem::Choice { found: word.into(), suggestion, allowed: words.join(", ") })
    })
}

/// Which of x, y, z and `normal_force` some names mean.
///
/// # Errors
///
/// A name that is none of them, or no name at all.
pub fn parse_coordinates(names: &[&str]) -> Result<Coordinates, Problem> {
    let mut coordinates = Coordinates::default();
    for name in names.iter().map(|name| name.trim()) {
        let axis = Axis::ALL.iter().find(|axis| axis.name() == name);
        let is_named = match axis {
            Some(axis) => &mut coordinates.position[axis.index()],
            None if name == FORCE => &mut coordinates.normal_force,
            None => {
                let (suggestion, allowed) = (closest(name, [FORCE].into_iter()), ALLOWED.into());
                return Err(Problem::Choice { found: name.into(), suggestion, allowed });
            }
        };
        if std::mem::replace(is_named, true) {
            let remedy = "it is named twice: drop one of them".into();
            return Err(Problem::Conflict { with: name.into(), remedy });
        }
    }
    match coordinates == Coordinates::default() {
        true => Err(Problem::Missing { remedy: format!("name at least one of {ALLOWED}") }),
        false => Ok(coordinates),
    }
}

fn no_direction() -> Problem {
    Problem::Range { value: "no direction".into(), expected: "three numbers that are not all zero".into() }
}

fn unit(v: Vector) -> Option<Vector> {
    let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    (norm > 0.0 && norm.is_finite()).then(|| v.map(|x| x / norm))
}

/// Points of a curve, evenly by its parameter (a rectangle: by its length), anticlockwise in its plane.
fn curve(reader: &Reader, shape: &str) -> Result<Vec<Target>, InputError> {
    let example = "such as \"10 mm\": radius, half the width, or [half width, half height]";
    let size = if reader.is_list("size") {
        reader.pair("size", "m")?
    } else {
        reader.quantity("size", "m")?.map(|size| [size; 2])
    };
    let [a, b] = size.ok_or_else(|| reader.missing("size", format!("give a length {example}")))?;
    if !(a > 0.0 && b > 0.0) {
        let problem = Problem::Range { value: format!("{a} by {b}"), expected: format!("a positive length {example}") };
        return Err(reader.error("size", problem));
    }
    let centre =
        reader.vector("centre", "m")?.ok_or_else(|| reader.missing("centre", "give three lengths along x, y, z"))?;
    let plane = reader.string("plane")?.unwrap_or("xy");
    let names: Vec<&'static str> = PLANES.iter().map(|(name, _)| *name).collect();
    let plane = choice(reader, "plane", plane, &names)?;
    let axes = PLANES.iter().find(|(name, _)| *name == plane).map_or([0, 1], |(_, axes)| *axes);
    let count = reader.count("points", 3)?.unwrap_or(200);
    if count > MOST_POINTS {
        let expected = format!("at most {} points", grouped(MOST_POINTS));
        return Err(reader.error("points", Problem::Range { value: grouped(count), expected }));
    }
    let count = count as usize;
    let start = reader.quantity("start", "rad")?.unwrap_or(0.0);
    let place = |k: usize| {
        let share = (k as f64 / count as f64 + start / TAU).rem_euclid(1.0);
        let [x, y] = on_curve(shape, share, b / a);
        let mut position = centre;
        position[axes[0]] += a * x;
        position[axes[1]] += b * y;
        Target::at(position)
    };
    Ok((0..count).map(place).collect())
}

/// A point of a curve of half width 1, at a share of its lap; `aspect` is height over width.
fn on_curve(shape: &str, share: f64, aspect: f64) -> [f64; 2] {
    let (sin, cos) = (TAU * share).sin_cos();
    match shape {
        // Bernoulli's.
        "lemniscate" => [cos / (1.0 + sin * sin), sin * cos / (1.0 + sin * sin)],
        // Fay's, without its slow term: r = exp(cos q) - 2 cos 4q with q from the upper axis; its half width is scaled to 1.
        "butterfly" => {
            let r = sin.exp() - 2.0 * (4.0 * TAU * share).cos();
            [r * cos / 2.906_310_812, r * sin / 2.906_310_812]
        }
        "rectangle" => {
            let mut left = share * 4.0 * (1.0 + aspect);
            let corners = [[1.0, 0.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 0.0]];
            for side in corners.windows(2) {
                let delta = [side[1][0] - side[0][0], side[1][1] - side[0][1]];
                let length = f64::hypot(delta[0], aspect * delta[1]);
                if left <= length {
                    return [0, 1].map(|k| side[0][k] + delta[k] * left / length);
                }
                left -= length;
            }
            [1.0, 0.0]
        }
        _ => [cos, sin],
    }
}

/// Targets of a table, and which coordinates of the tip it has.
fn read_targets(file: &Path, scene: &Scene) -> Result<(Vec<Target>, [bool; 3]), InputError> {
    let dimension = |name: &str| {
        Dimension::of(match name {
            "x" | "y" | "z" => "m",
            FORCE => "N",
            _ => "",
        })
    };
    let columns = read_number_table(file, &Columns { dimension: &dimension, optional: &[], ignored: &|_| false })?;
    for (name, _) in columns.iter().filter(|(name, _)| name != "point" && name != "sample") {
        if !COLUMNS.contains(&name.as_str()) {
            let suggestion = closest(name, COLUMNS.into_iter());
            let problem = Problem::Choice { found: name.clone(), suggestion, allowed: COLUMNS.join(", ") };
            return Err(table_error(file, None, name, problem));
        }
    }
    let column = |name: &str| columns.iter().find(|(other, _)| other == name).map(|(_, values)| values);
    let position = ["x", "y", "z"].map(column);
    let tangent = ["tx", "ty", "tz"].map(column);
    let force = column(FORCE);
    let coordinates = position.map(|column| column.is_some());
    let row_count = columns.first().map_or(0, |(_, values)| values.len());
    if row_count == 0 || !(coordinates.contains(&true) || force.is_some()) {
        let remedy = "the first line names columns among x, y, z, tx, ty, tz, normal_force; rows follow".into();
        return Err(table_error(file, None, "", Problem::Missing { remedy }));
    }
    if tangent.iter().any(Option::is_some) && tangent.iter().any(Option::is_none) {
        let remedy = "a tangent takes all of tx, ty, tz".into();
        return Err(table_error(file, None, "tx", Problem::Missing { remedy }));
    }
    let mut targets = Vec::with_capacity(row_count);
    for row in 0..row_count {
        let at = |columns: [Option<&Vec<f64>>; 3]| columns.map(|column| column.map_or(0.0, |values| values[row]));
        let (position, direction) = (at(position), at(tangent));
        if position.iter().chain(&direction).any(|x| !x.is_finite()) {
            let problem =
                Problem::Range { value: format!("not finite in row {row}"), expected: "finite numbers".into() };
            return Err(table_error(file, None, "x", problem));
        }
        let tangent = match tangent[0] {
            Some(_) => Some(unit(direction).ok_or_else(|| table_error(file, None, "tx", no_direction()))?),
            None => None,
        };
        let normal_force = force.map(|values| values[row]);
        if let Some(force) = normal_force {
            let is_finite = force.is_finite();
            let problem =
                Problem::Range { value: format!("not finite in row {row}"), expected: "finite numbers".into() };
            let checked = if is_finite { check_force(scene, force) } else { Err(problem) };
            checked.map_err(|problem| table_error(file, None, FORCE, problem))?;
        }
        targets.push(Target { position, tangent, normal_force });
    }
    Ok((targets, coordinates))
}
