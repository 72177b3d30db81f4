//! The axes of a sweep file, and how many samples they make.

use super::error::{InputError, Problem};
use super::table_file::read_input_table;
use super::toml::Reader;
use super::words::parameters;
use crate::model::{Parameter, Scene, SegmentParameter, StiffnessAxis};
use crate::spec::{AxisSpec, Format, InputTable, MAX_ROWS, MAX_SAMPLES, MAX_SOBOL_DIMENSIONS, Method};
use std::path::Path;
use std::sync::Arc;

/// What varies, by the blocks `[[axis]]`.
pub(super) fn axes(
    root: &Reader,
    scene: &Scene,
    method: Method,
    notes: &mut Vec<String>,
) -> Result<Vec<AxisSpec>, InputError> {
    let readers = root.tables("axis")?;
    if readers.is_empty() {
        return Err(root.missing("axis", "add an [[axis]] block with parameter, from and to"));
    }
    readers.iter().map(|reader| axis(reader, scene, method, notes)).collect()
}

fn axis(reader: &Reader, scene: &Scene, method: Method, notes: &mut Vec<String>) -> Result<AxisSpec, InputError> {
    reader.check_keys(&["parameter", "parameters", "from", "to", "points"])?;
    if reader.has("parameter") && reader.has("parameters") {
        let remedy = "keep one of the two".into();
        return Err(reader.error("parameter", Problem::Conflict { with: "parameters".into(), remedy }));
    }
    let driven = match (reader.string("parameter")?, reader.strings("parameters")?) {
        (Some(name), _) => {
            let driven = parameters(reader, "parameter", scene, name)?;
            if driven.len() > 1 {
                notes.push(format!("the axis `{name}` gives all {} components the same value", driven.len()));
            }
            driven
        }
        (None, Some(names)) => {
            let mut driven = Vec::new();
            for (index, name) in names.iter().enumerate() {
                driven.extend(parameters(reader, &format!("parameters[{index}]"), scene, name)?);
            }
            driven
        }
        (None, None) => return Err(reader.missing("parameter", "name what to sweep, such as \"coil.current.x\"")),
    };
    let Some(first) = driven.first() else {
        return Err(
            reader.error("parameters", Problem::Range { value: "empty".into(), expected: "at least one name".into() })
        );
    };
    let unit = first.unit();
    if let Some(other) = driven.iter().find(|other| other.unit() != unit) {
        let remedy = format!("they are measured in {unit} and {}: give each its own axis", other.unit());
        let with = other.name(scene);
        return Err(reader.error("parameters", Problem::Conflict { with, remedy }));
    }
    let end = |name: &str| -> Result<f64, InputError> {
        let value = reader.quantity(name, unit)?;
        value.ok_or_else(|| reader.missing(name, "an axis runs from `from` to `to`"))
    };
    let (from, to) = (end("from")?, end("to")?);
    let points = match (method, reader.count("points", 1)?) {
        (Method::Grid, Some(points)) => points,
        (Method::Grid, None) => return Err(reader.missing("points", "a grid needs the number of points of each axis")),
        (_, None) => 0,
        (_, Some(_)) => {
            let remedy = "points belong to a grid: give [sampling] samples instead".into();
            return Err(reader.error("points", Problem::Conflict { with: "sampling.method".into(), remedy }));
        }
    };
    Ok(AxisSpec { parameters: driven, from, to, points })
}

type TableAxes = (Vec<AxisSpec>, Option<Arc<InputTable>>);

/// What varies, by the columns of a table, and the table.
pub(super) fn table_axes(
    root: &Reader,
    sampling: &Reader,
    scene: &Scene,
    file: &Path,
) -> Result<TableAxes, InputError> {
    if root.has("axis") {
        let remedy = "the columns of the table are the axes: remove [[axis]]".into();
        return Err(root.error("axis", Problem::Conflict { with: "sampling.file".into(), remedy }));
    }
    let name = sampling.string("file")?;
    let name =
        name.ok_or_else(|| sampling.missing("file", "name a CSV or Parquet file whose columns are parameters"))?;
    let path = file.parent().unwrap_or(Path::new("")).join(name);
    if !path.is_file() {
        let reason = format!("{} is no file; the path starts from the folder of this file", path.display());
        return Err(sampling.error("file", Problem::Unreadable(reason)));
    }
    let table = read_input_table(&path, scene)?;
    let axis = |parameter: &Parameter| AxisSpec { parameters: vec![*parameter], from: 0.0, to: 0.0, points: 0 };
    Ok((table.parameters().iter().map(axis).collect(), Some(Arc::new(table))))
}

/// Refuses two axes that drive the same number.
pub(super) fn check_overlaps(
    root: &Reader,
    scene: &Scene,
    axes: &[AxisSpec],
    method: Method,
) -> Result<(), InputError> {
    let mut seen: Vec<Parameter> = Vec::new();
    for (index, axis) in axes.iter().enumerate() {
        for parameter in &axis.parameters {
            if let Some(other) = seen.iter().find(|other| overlap(*parameter, **other)) {
                let remedy = format!("both set `{}`: drop one", parameter.name(scene));
                let key = match method {
                    Method::Table => "sampling.file".to_owned(),
                    _ => axis_key(root, index),
                };
                return Err(root.error(&key, Problem::Conflict { with: other.name(scene), remedy }));
            }
            seen.push(*parameter);
        }
    }
    Ok(())
}

fn overlap(a: Parameter, b: Parameter) -> bool {
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

/// How many samples there are; those of Sobol' are rounded up to a power of two.
pub(super) fn sample_count(
    root: &Reader,
    sampling: &Reader,
    method: Method,
    axes: &[AxisSpec],
    table_rows: Option<u64>,
    format: Format,
    notes: &mut Vec<String>,
) -> Result<u64, InputError> {
    let samples = sampling.count("samples", 1)?;
    if samples.is_some() && matches!(method, Method::Grid | Method::Table) {
        let remedy = "the axes' points or the table's rows give the number: remove it".into();
        return Err(sampling.error("samples", Problem::Conflict { with: "method".into(), remedy }));
    }
    if sampling.has("file") && method != Method::Table {
        let remedy = "only method = \"table\" reads a file: remove it".into();
        return Err(sampling.error("file", Problem::Conflict { with: "method".into(), remedy }));
    }
    let too_many = |key: &str, count: String, limit: u64, remedy| {
        let limit = grouped(limit);
        root.error(key, Problem::TooMany { what: "asks for", count: format!("{count} samples"), limit, remedy })
    };
    let key = if method == Method::Grid { "axis" } else { "sampling.samples" };
    let mut count = match method {
        Method::Grid => {
            let product = axes.iter().try_fold(1u64, |product, axis| product.checked_mul(axis.points));
            product.ok_or_else(|| too_many(key, "more than 2^64".into(), MAX_ROWS, "lower `points`"))?
        }
        Method::Table => table_rows.unwrap_or(0),
        _ => samples.ok_or_else(|| sampling.missing("samples", "say how many samples to draw"))?,
    };
    let (limit, remedy) = match format {
        Format::None => (MAX_SAMPLES, "lower the number of samples"),
        _ => (MAX_ROWS, "lower the number of samples, or write no rows with [output] format = \"none\""),
    };
    if count > limit {
        return Err(too_many(key, grouped(count), limit, remedy));
    }
    if method == Method::Sobol {
        if axes.len() > MAX_SOBOL_DIMENSIONS {
            let (count, limit) = (format!("{} axes", axes.len()), MAX_SOBOL_DIMENSIONS.to_string());
            let remedy = "use latin_hypercube or uniform";
            return Err(root.error("axis", Problem::TooMany { what: "has", count, limit, remedy }));
        }
        if count > 1 << 32 {
            return Err(too_many(key, grouped(count), 1 << 32, "use uniform"));
        }
        let rounded = count.next_power_of_two();
        if rounded != count {
            notes.push(format!(
                "{} samples rounded up to {} (a power of two, for Sobol')",
                grouped(count),
                grouped(rounded)
            ));
            count = rounded;
        }
        if count > limit {
            return Err(too_many(key, grouped(count), limit, remedy));
        }
    }
    Ok(count)
}

/// 1234567 as `1,234,567`.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// The key that names what an axis drives.
pub(super) fn axis_key(root: &Reader, index: usize) -> String {
    let several = format!("axis[{index}].parameters");
    if root.source().contains(&several) { several } else { format!("axis[{index}].parameter") }
}
