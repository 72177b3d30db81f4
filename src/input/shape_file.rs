//! Observed shapes: a table with columns x, y, z, perhaps s (arc length; empty for the tip), and known parameters. A row
//! without a place is a point that was not seen.

use super::error::{InputError, Problem, table_error};
use super::number_table::{Columns, read_number_table};
use super::text_table::Head;
use super::units::Dimension;
use crate::model::{Parameter, Scene};
use crate::spec::{ObservedPoint, ObservedShape, ObservedShapes};
use std::path::Path;

const PLACES: [&str; 3] = ["x", "y", "z"];
/// Columns of other programs that say nothing about the rod.
const OTHERS: [&str; 7] = ["marker", "marker_id", "id", "label", "frame", "time", "index"];
/// Lengths of the rod beyond which a point is taken for one in another unit.
const FAR: f64 = 100.0;

/// Reads shapes: rows that agree in every known parameter are one. Rows without a place are left out.
///
/// # Errors
///
/// A file that cannot be read, or a mistake in it.
pub fn read_shapes(file: &Path, scene: &Scene) -> Result<ObservedShapes, InputError> {
    read_shapes_with(file, scene, &mut Vec::new())
}

/// Reads shapes as [`read_shapes`]; notes tell what was left out.
///
/// # Errors
///
/// As [`read_shapes`].
pub fn read_shapes_with(file: &Path, scene: &Scene, notes: &mut Vec<String>) -> Result<ObservedShapes, InputError> {
    let parameter = |name: &str| Parameter::parse(scene, name).ok().filter(|parsed| parsed.len() == 1).map(|p| p[0]);
    let unit = |name: &str| match name {
        "s" | "x" | "y" | "z" => Dimension::of("m"),
        name => parameter(name).map_or(Dimension::NUMBER, |parameter| Dimension::of(parameter.unit())),
    };
    let is_other = |name: &str| {
        let word = name.to_lowercase();
        parameter(name).is_none() && (Head::is_index(name) || OTHERS.contains(&word.as_str()))
    };
    let habits = Columns { dimension: &unit, optional: &["s", "x", "y", "z"], ignored: &is_other };
    let columns = read_number_table(file, &habits)?;
    let mut known: Vec<(Parameter, &Vec<f64>)> = Vec::new();
    for (name, values) in columns.iter().filter(|(name, _)| !["s", "x", "y", "z"].contains(&name.as_str())) {
        let parsed = Parameter::parse(scene, name).map_err(|problem| table_error(file, None, name, problem.into()))?;
        let [parameter] = parsed[..] else {
            let (value, expected) =
                (format!("a group of {}", parsed.len()), format!("one component, such as {name}.x"));
            return Err(table_error(file, None, name, Problem::Range { value, expected }));
        };
        known.push((parameter, values));
    }
    let column = |name: &str| columns.iter().find(|(other, _)| other == name).map(|(_, values)| values);
    let ([Some(x), Some(y), Some(z)], at) = (PLACES.map(column), column("s")) else {
        let remedy = "the first line names columns x, y, z, perhaps s, and known parameters such as coil.current.x";
        return Err(table_error(file, None, "x", Problem::Missing { remedy: remedy.into() }));
    };
    if x.is_empty() {
        return Err(table_error(
            file,
            None,
            "",
            Problem::Missing { remedy: "the table has no rows: give at least one".into() },
        ));
    }
    let mut shapes: Vec<ObservedShape> = Vec::new();
    let mut unseen = 0;
    for row in 0..x.len() {
        let values: Vec<f64> = known.iter().map(|(_, values)| values[row]).collect();
        let position = [x[row], y[row], z[row]];
        if position.iter().any(|x| x.is_nan()) {
            unseen += 1;
            continue;
        }
        if values.iter().chain(&position).any(|x| !x.is_finite()) {
            let problem =
                Problem::Range { value: format!("not finite in row {row}"), expected: "finite numbers".into() };
            return Err(table_error(file, None, "x", problem));
        }
        let mut own = scene.clone();
        let pairs = known.iter().map(|(parameter, _)| *parameter).zip(values.iter().copied());
        Parameter::set_all(&mut own, pairs).map_err(|problem| table_error(file, None, "", problem.into()))?;
        let length = own.total_length();
        let arc_length = at.map(|at| at[row]).filter(|s| s.is_finite());
        if let Some(s) = arc_length.filter(|s| !(0.0..=length * (1.0 + 1e-9)).contains(s)) {
            let expected =
                format!("0 to {length} m, the length of the rod; a unit stands in the first line, as `s [mm]`");
            return Err(table_error(file, None, "s", Problem::Range { value: format!("{s} in row {row}"), expected }));
        }
        for (k, name) in PLACES.into_iter().enumerate() {
            let off = (position[k] - own.base.position[k]).abs();
            if off > FAR * length {
                let value =
                    format!("{} m in row {row}, {:.0} lengths of the rod from its base", position[k], off / length);
                let expected = "points near the rod; a unit stands in the first line, as `x [mm]`".into();
                return Err(table_error(file, None, name, Problem::Range { value, expected }));
            }
        }
        let point = ObservedPoint { arc_length, position };
        match shapes.iter_mut().find(|shape| shape.known == values) {
            Some(shape) => shape.points.push(point),
            None => shapes.push(ObservedShape { known: values, points: vec![point] }),
        }
    }
    if unseen > 0 {
        notes.push(format!("{unseen} of {} points of {} have no place: they are left out", x.len(), file.display()));
    }
    if shapes.is_empty() {
        let remedy = "no row has a place: give at least one point with x, y and z".into();
        return Err(table_error(file, None, "x", Problem::Missing { remedy }));
    }
    Ok(ObservedShapes { known: known.into_iter().map(|(parameter, _)| parameter).collect(), shapes })
}
