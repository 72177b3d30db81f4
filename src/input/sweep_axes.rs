//! What varies by a sweep file: its axes and its uncertain numbers.

use super::error::{InputError, Problem};
use super::sweep_distribution::{KEYS, law};
use super::table_file::{Habits, parse_with, read_with};
use super::toml::Reader;
use super::units::LARGEST;
use super::words::{choice, parameters};
use crate::model::{Parameter, Scene, SegmentParameter, StiffnessAxis};
use crate::spec::{AxisSpec, Distribution, InputTable, Method};
use std::path::Path;
use std::sync::Arc;

/// The blocks that say what varies.
pub(super) const AXIS: &str = "axis";
pub(super) const UNCERTAIN: &str = "uncertain";

/// What varies, by the blocks `[[axis]]`.
pub(super) fn axes(
    root: &Reader,
    scene: &Scene,
    method: Method,
    notes: &mut Vec<String>,
) -> Result<Vec<AxisSpec>, InputError> {
    let readers = root.tables(AXIS)?;
    if readers.is_empty() {
        return Err(root.missing(AXIS, "add an [[axis]] block with parameter, from and to"));
    }
    let axis = |reader: &Reader| {
        let axis = varying(reader, scene, notes)?;
        check_method(reader, &axis, method)?;
        let listed = match &axis.distribution {
            Distribution::Values(values) => Some(values.len() as u64),
            _ => None,
        };
        let points = match (method, reader.count("points", 1)?, listed) {
            (Method::Grid, Some(points), Some(values)) if points != values => {
                let (value, expected) =
                    (points.to_string(), format!("the {values} values that are listed, or nothing"));
                return Err(reader.error("points", Problem::Range { value, expected }));
            }
            (Method::Grid, Some(points), _) | (Method::Grid, None, Some(points)) => points,
            (Method::Grid, None, None) => {
                return Err(reader.missing("points", "a grid needs the number of points of each axis"));
            }
            (_, None, _) => 0,
            (_, Some(_), _) => {
                let remedy = "points belong to a grid: give [sampling] samples instead".into();
                return Err(reader.error("points", Problem::Conflict { with: "sampling.method".into(), remedy }));
            }
        };
        Ok(AxisSpec { points, ..axis })
    };
    readers.iter().map(axis).collect()
}

/// What is not known well, by the blocks `[[uncertain]]`.
pub(super) fn uncertain(root: &Reader, scene: &Scene, notes: &mut Vec<String>) -> Result<Vec<AxisSpec>, InputError> {
    let number = |reader: &Reader| {
        if reader.has("points") {
            let remedy = "points belong to an axis of a grid: remove them".into();
            return Err(reader.error("points", Problem::Conflict { with: UNCERTAIN.into(), remedy }));
        }
        varying(reader, scene, notes)
    };
    root.tables(UNCERTAIN)?.iter().map(number).collect()
}

/// Refuses laws without ends where samples lie at the ends or between them.
fn check_method(reader: &Reader, axis: &AxisSpec, method: Method) -> Result<(), InputError> {
    use Distribution::{LogNormal, LogUniform, Normal, Uniform, Values};
    let remedy = match (method, &axis.distribution) {
        (Method::Grid, Uniform { .. } | LogUniform { .. } | Values(_)) => return Ok(()),
        (Method::Grid, _) => {
            "a grid needs ends: give from and to, or draw samples by method = \"sobol\"; or list `values`"
        }
        (Method::Skeleton, Values(_) | Normal { .. } | LogNormal { .. }) => "faces need ends: give from and to",
        _ => return Ok(()),
    };
    let key = if reader.has("values") { "values" } else { "distribution" };
    let with = format!("sampling.method = {}", method.name());
    Err(reader.error(key, Problem::Conflict { with, remedy: remedy.into() }))
}

/// What a block drives, and its law.
fn varying(reader: &Reader, scene: &Scene, notes: &mut Vec<String>) -> Result<AxisSpec, InputError> {
    reader.check_keys(&KEYS)?;
    if reader.has("parameter") && reader.has("parameters") {
        let remedy = "keep one of the two".into();
        return Err(reader.error("parameter", Problem::Conflict { with: "parameters".into(), remedy }));
    }
    let (driven, group) = match (reader.string("parameter")?, reader.strings("parameters")?) {
        (Some(name), _) => {
            let driven = parameters(reader, "parameter", scene, name)?;
            let group = (driven.len() > 1).then_some(name);
            (driven, group)
        }
        (None, Some(names)) => {
            let mut driven = Vec::new();
            for (index, name) in names.iter().enumerate() {
                driven.extend(parameters(reader, &format!("parameters[{index}]"), scene, name)?);
            }
            (driven, None)
        }
        (None, None) => return Err(reader.missing("parameter", "name what to sweep, such as \"coil.current.x\"")),
    };
    let Some(first) = driven.first() else {
        return Err(
            reader.error("parameters", Problem::Range { value: "empty".into(), expected: "at least one name".into() })
        );
    };
    let law = law(reader, scene, first, &driven)?;
    let mut numbers: Vec<f64> = law.distribution.numbers().into_iter().map(|(_, number)| number).collect();
    if let Distribution::Values(values) = &law.distribution {
        numbers.extend(values.iter());
    }
    if let Some(number) = numbers.into_iter().find(|number| number.is_nan() || number.abs() > LARGEST) {
        let (value, expected) = (format!("over values up to {number:e}"), "values of at most 1e60 in size".into());
        return Err(reader.error("", Problem::Range { value, expected }));
    }
    if let Some(name) = group.filter(|_| !law.scales) {
        notes.push(format!("the axis `{name}` gives all {} components the same value", driven.len()));
    }
    Ok(AxisSpec { parameters: driven, distribution: law.distribution, scales: law.scales, points: 0 })
}

type TableAxes = (Vec<AxisSpec>, Option<Arc<InputTable>>);

/// What varies, by the columns of a table, and the table.
pub(super) fn table_axes(
    root: &Reader,
    sampling: &Reader,
    scene: &Scene,
    file: &Path,
    built_in: &[(&str, &str)],
    notes: &mut Vec<String>,
) -> Result<TableAxes, InputError> {
    if root.has("axis") {
        let remedy = "the columns of the table are the axes: remove [[axis]]".into();
        return Err(root.error("axis", Problem::Conflict { with: "sampling.file".into(), remedy }));
    }
    let others =
        choice(sampling, "extra_columns", &[false, true], |ignored| if ignored { "ignore" } else { "refuse" })?;
    let habits = Habits { of_sweep: true, ignores_others: others == Some(true) };
    let name = sampling.string("file")?;
    let name =
        name.ok_or_else(|| sampling.missing("file", "name a CSV or Parquet file whose columns are parameters"))?;
    let path = file.parent().unwrap_or(Path::new("")).join(name);
    if let Some((_, text)) = built_in.iter().find(|(built_in, _)| *built_in == name) {
        let table = parse_with(&path, text, scene, habits, notes)?;
        return Ok((table.parameters().iter().map(row_axis).collect(), Some(Arc::new(table))));
    }
    if !path.is_file() {
        let reason = format!("{} is no file; the path starts from the folder of this file", path.display());
        return Err(sampling.error("file", Problem::Unreadable(reason)));
    }
    let table = read_with(&path, scene, habits, notes)?;
    Ok((table.parameters().iter().map(row_axis).collect(), Some(Arc::new(table))))
}

/// The axis of a column of a table.
pub(super) fn row_axis(parameter: &Parameter) -> AxisSpec {
    let distribution = Distribution::Uniform { from: 0.0, to: 0.0 };
    AxisSpec { parameters: vec![*parameter], distribution, scales: false, points: 0 }
}

/// Refuses two axes, or uncertain numbers, that drive the same number.
pub(super) fn check_overlaps(
    root: &Reader,
    scene: &Scene,
    axes: &[AxisSpec],
    uncertain: &[AxisSpec],
    method: Method,
) -> Result<(), InputError> {
    let mut seen: Vec<Parameter> = Vec::new();
    let axes = axes.iter().enumerate().map(|(index, axis)| (AXIS, index, axis));
    let uncertain = uncertain.iter().enumerate().map(|(index, number)| (UNCERTAIN, index, number));
    for (block, index, axis) in axes.chain(uncertain) {
        for parameter in &axis.parameters {
            if let Some(other) = seen.iter().find(|other| overlap(*parameter, **other)) {
                let remedy = format!("both set `{}`: drop one", parameter.name(scene));
                let key = match method {
                    Method::Table if block == AXIS => "sampling.file".to_owned(),
                    _ => axis_key(root, block, index),
                };
                return Err(root.error(&key, Problem::Conflict { with: other.name(scene), remedy }));
            }
            seen.push(*parameter);
        }
    }
    Ok(())
}

/// Whether both set the same number.
pub(super) fn overlap(a: Parameter, b: Parameter) -> bool {
    use Parameter::{Insertion, Segment};
    use SegmentParameter::{Length, Stiffness};
    match (a, b) {
        (Insertion, Segment(0, Length)) | (Segment(0, Length), Insertion) => true,
        (Segment(i, Stiffness(StiffnessAxis::Bending)), Segment(j, Stiffness(other)))
        | (Segment(j, Stiffness(other)), Segment(i, Stiffness(StiffnessAxis::Bending))) => {
            i == j && other != StiffnessAxis::Torsion
        }
        _ => a == b,
    }
}

/// The key that names what a block drives.
pub(super) fn axis_key(root: &Reader, block: &str, index: usize) -> String {
    let several = format!("{block}[{index}].parameters");
    if root.source().contains(&several) { several } else { format!("{block}[{index}].parameter") }
}
