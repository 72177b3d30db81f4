//! Observed shapes: a table with columns x, y, z, perhaps s (arc length; empty for the tip), normal_force, and known parameters. A
//! row without a place is a point that was not seen.

use super::error::{InputError, Problem, table_error};
use super::number_table::{Columns, read_number_table};
use super::text_table::Head;
use super::units::Dimension;
use crate::model::{Parameter, ParameterNames, Scene, Vector, short_number};
use crate::spec::{ObservedPoint, ObservedShape, ObservedShapes};
use std::collections::HashMap;
use std::path::Path;

const PLACES: [&str; 3] = ["x", "y", "z"];
/// The measured force of the wall on the tip.
const FORCE: &str = "normal_force";
/// Columns that are no known parameters.
const OBSERVED: [&str; 5] = ["s", "x", "y", "z", FORCE];
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

/// Reads shapes as [`read_shapes`]; notes tell what was left out, and what was supposed.
///
/// A table without `s` whose points run along the rod, from base to tip or back, gets its arc lengths from the points.
///
/// # Errors
///
/// As [`read_shapes`].
pub fn read_shapes_with(file: &Path, scene: &Scene, notes: &mut Vec<String>) -> Result<ObservedShapes, InputError> {
    let names = ParameterNames::of(scene);
    let parameter = |name: &str| names.find(name).filter(|found| found.len() == 1).map(|found| found[0]);
    let unit = |name: &str| match name {
        "s" | "x" | "y" | "z" => Dimension::of("m"),
        FORCE => Dimension::of("N"),
        name => parameter(name).map_or(Dimension::NUMBER, |parameter| Dimension::of(parameter.unit())),
    };
    let is_other = |name: &str| {
        let word = name.to_lowercase();
        parameter(name).is_none() && (Head::is_index(name) || OTHERS.contains(&word.as_str()))
    };
    let habits = Columns { dimension: &unit, optional: &OBSERVED, ignored: &is_other };
    let columns = read_number_table(file, &habits)?;
    let mut known: Vec<(Parameter, &Vec<f64>)> = Vec::new();
    for (name, values) in columns.iter().filter(|(name, _)| !OBSERVED.contains(&name.as_str())) {
        let parsed = names.parse(name).map_err(|problem| table_error(file, None, name, problem.into()))?;
        let [parameter] = parsed[..] else {
            let (value, expected) =
                (format!("a group of {}", parsed.len()), format!("one component, such as {name}.x"));
            return Err(table_error(file, None, name, Problem::Range { value, expected }));
        };
        known.push((parameter, values));
    }
    let column = |name: &str| columns.iter().find(|(other, _)| other == name).map(|(_, values)| values);
    let (places, at, forces) = (PLACES.map(column), column("s"), column(FORCE));
    let has_places = places.iter().all(Option::is_some);
    if !(has_places || forces.is_some() && places.iter().all(Option::is_none)) {
        let remedy = "the first line names columns x, y, z, perhaps s, and known parameters such as coil.current.x; beside a wall \
                      normal_force, with or without places";
        return Err(table_error(file, None, "x", Problem::Missing { remedy: remedy.into() }));
    }
    if forces.is_some() && scene.wall.is_none() {
        let remedy = "the scene has no wall that the tip could press on: add [wall] to it, or drop this column";
        return Err(table_error(file, None, FORCE, Problem::Missing { remedy: remedy.into() }));
    }
    let row_count = columns.first().map_or(0, |(_, values)| values.len());
    if row_count == 0 {
        return Err(table_error(
            file,
            None,
            "",
            Problem::Missing { remedy: "the table has no rows: give at least one".into() },
        ));
    }
    let mut by_known = ByKnown::default();
    let mut unseen = 0;
    for row in 0..row_count {
        let values: Vec<f64> = known.iter().map(|(_, values)| values[row]).collect();
        let position = places.map(|values| values.map_or(f64::NAN, |values| values[row]));
        let force = forces.map(|forces| forces[row]).filter(|force| !force.is_nan());
        let is_seen = !position.iter().all(|x| x.is_nan());
        if !is_seen && force.is_none() {
            unseen += 1;
            continue;
        }
        if !is_seen {
            if values.iter().chain(&force).any(|x| !x.is_finite()) {
                let problem =
                    Problem::Range { value: format!("not finite in row {row}"), expected: "finite numbers".into() };
                return Err(table_error(file, None, FORCE, problem));
            }
            by_known.shape(values).normal_forces.extend(force);
            continue;
        }
        if let Some(k) = position.iter().position(|x| x.is_nan()) {
            let remedy = format!("row {row} has no {}: give it, or leave out all of x, y and z", PLACES[k]);
            return Err(table_error(file, None, PLACES[k], Problem::Missing { remedy }));
        }
        if values.iter().chain(&position).chain(&force).any(|x| !x.is_finite()) {
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
            let value = format!("{} in row {row}", short_number(s));
            return Err(table_error(file, None, "s", Problem::Range { value, expected }));
        }
        for (k, name) in PLACES.into_iter().enumerate() {
            let off = (position[k] - own.base.position[k]).abs();
            if off > FAR * length {
                let [place, lengths] = [position[k], (off / length).round()].map(short_number);
                let value = format!("{place} m in row {row}, {lengths} lengths of the rod from its base");
                let expected = "points near the rod; a unit stands in the first line, as `x [mm]`".into();
                return Err(table_error(file, None, name, Problem::Range { value, expected }));
            }
        }
        let point = ObservedPoint { arc_length, position };
        let shape = by_known.shape(values);
        shape.points.push(point);
        shape.normal_forces.extend(force);
    }
    let mut shapes = by_known.shapes;
    if unseen > 0 {
        notes.push(format!("{unseen} of {row_count} points of {} have no place: they are left out", file.display()));
    }
    if shapes.is_empty() {
        let remedy = "no row has a place: give at least one point with x, y and z".into();
        return Err(table_error(file, None, "x", Problem::Missing { remedy }));
    }
    let known: Vec<Parameter> = known.into_iter().map(|(parameter, _)| parameter).collect();
    if at.is_none() && has_places {
        let mut found = 0;
        for shape in &mut shapes {
            let mut own = scene.clone();
            // These values were set above without an error.
            let _ = Parameter::set_all(&mut own, known.iter().copied().zip(shape.known.iter().copied()));
            found += usize::from(along_the_rod(shape, own.rod().base_position, own.total_length()));
        }
        if found > 0 {
            let of = if shapes.len() > 1 { format!(" of {found} shapes") } else { String::new() };
            notes.push(format!(
                "{} has no column `s`: the points{of} are taken as a centre line, with arc lengths from base and points",
                file.display()
            ));
        }
    }
    Ok(ObservedShapes { known, shapes })
}

/// Shapes by their known values.
#[derive(Default)]
struct ByKnown {
    shapes: Vec<ObservedShape>,
    places: HashMap<Vec<u64>, usize>,
}

impl ByKnown {
    /// The shape of these values, a new one where there is none.
    fn shape(&mut self, values: Vec<f64>) -> &mut ObservedShape {
        // Adding zero turns -0 into 0.
        let bits = values.iter().map(|value| (value + 0.0).to_bits()).collect();
        let at = *self.places.entry(bits).or_insert(self.shapes.len());
        if at == self.shapes.len() {
            self.shapes.push(ObservedShape { known: values, ..ObservedShape::default() });
        }
        &mut self.shapes[at]
    }
}

/// Points of a centre line lie apart by this share of the rod's length, ...
const APART: f64 = 0.05;
/// ... none further from the one before than this, ...
const GAP: f64 = 0.5;
/// ... and they are together no longer than this: noise lengthens a line.
const LONGEST: f64 = 1.05;

/// Gives points that run along the rod their arc lengths: from base to tip or back, each step the arc through its neighbours.
/// `false`: they are tips.
fn along_the_rod(shape: &mut ObservedShape, base: Vector, length: f64) -> bool {
    let far = |a: &Vector, b: &Vector| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let count = shape.points.len();
    if count < 3 {
        return false;
    }
    let mut order: Vec<usize> = (0..count).collect();
    let from_base = |k: usize| far(&base, &shape.points[k].position);
    if from_base(count - 1) < 0.5 * from_base(0) {
        order.reverse();
    }
    let mut line = vec![base];
    line.extend(order.iter().map(|k| shape.points[*k].position));
    // Curvature of the circle through three points.
    let curvature = |k: usize| {
        let [Some(a), Some(b), Some(c)] = [k.checked_sub(1).and_then(|k| line.get(k)), line.get(k), line.get(k + 1)]
        else {
            return None;
        };
        let (ab, bc, ca) = (far(a, b), far(b, c), far(c, a));
        let half = 0.5 * (ab + bc + ca);
        let area = (half * (half - ab) * (half - bc) * (half - ca)).max(0.0).sqrt();
        (ab * bc * ca > 0.0).then(|| 4.0 * area / (ab * bc * ca))
    };
    let step = |k: usize| {
        let chord = far(&line[k], &line[k + 1]);
        let both: Vec<f64> = [curvature(k), curvature(k + 1)].into_iter().flatten().collect();
        let mean = both.iter().sum::<f64>() / both.len().max(1) as f64;
        let half = (0.5 * mean * chord).min(1.0);
        if half > 1e-6 { chord * half.asin() / half } else { chord }
    };
    let steps: Vec<f64> = (0..count).map(step).collect();
    let total: f64 = steps.iter().sum();
    let extent = line[1..].iter().flat_map(|a| line[1..].iter().map(|b| far(a, b))).fold(0.0, f64::max);
    let widest = steps.iter().fold(0.0f64, |widest, step| widest.max(*step));
    if extent < APART * length || widest > GAP * length || total > LONGEST * length {
        return false;
    }
    let scale = (length / total).min(1.0);
    let mut at = 0.0;
    for (k, step) in order.into_iter().zip(steps) {
        at += step;
        shape.points[k].arc_length = Some((at * scale).min(length));
    }
    true
}
