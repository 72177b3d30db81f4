//! Reads a sweep file into a `SweepSpec`: every mistake names file, line, key and remedy.

use super::error::{InputError, Problem};
use super::scene_file::{parse_scene, read_scene, read_text, scene};
use super::table_file::read_input_table;
use super::toml::{Reader, Source};
use crate::model::{
    Parameter, ParameterError, PlanError, PlanOptions, Scene, SegmentParameter, StiffnessAxis, closest,
};
use crate::spec::MAX_SOBOL_DIMENSIONS;
use crate::spec::{
    AxisSpec, BranchChoice, Format, InputTable, MAX_ROWS, MAX_SAMPLES, Method, OutputQuantity, SweepSpec,
};
use std::path::Path;
use std::sync::Arc;

impl SweepSpec {
    /// Reads a sweep file and whatever it refers to.
    pub fn read(file: &Path) -> Result<SweepSpec, InputError> {
        Self::parse(file, &read_text(file)?)
    }

    /// Parses the text of a sweep file; relative paths in it start from the folder of `file`.
    pub fn parse(file: &Path, text: &str) -> Result<SweepSpec, InputError> {
        parse_sweep(file, text, &[])
    }

    /// The same; scenes that `built_in` lists, by the path that the sweep has for them, are not read from files.
    pub fn parse_with(file: &Path, text: &str, built_in: &[(&str, &str)]) -> Result<SweepSpec, InputError> {
        parse_sweep(file, text, built_in)
    }
}

/// Scene files that need not be read: path as a sweep names it, and text.
pub type BuiltIn<'a> = [(&'a str, &'a str)];

/// Parses the text of a sweep file.
fn parse_sweep(file: &Path, text: &str, built_in: &BuiltIn) -> Result<SweepSpec, InputError> {
    sweep_of(&Source::parse(file, text)?, file, built_in)
}

/// The sweep of a parsed file; what `bench` has to say in it is left alone.
pub fn sweep_of(source: &Source, file: &Path, built_in: &BuiltIn) -> Result<SweepSpec, InputError> {
    let root = source.root();
    root.check_keys(&["scene", "sampling", "axis", "solver", "output", "workspace", "bench"])?;
    let scene = sweep_scene(&root, file, built_in)?;
    let mut notes = super::scene_file::scene_notes(&scene);
    let sampling = root.table("sampling")?;
    let sampling = sampling.ok_or_else(|| root.missing("sampling", "add [sampling] with a method such as \"grid\""))?;
    sampling.check_keys(&["method", "samples", "seed", "file"])?;
    let method = choice(&sampling, "method", &Method::ALL, Method::name)?
        .ok_or_else(|| sampling.missing("method", "write method = \"grid\", \"sobol\" or another"))?;
    let (format, quantities, wrt) = output(&root, &scene)?;
    let (axes, table) = match method {
        Method::Table => table_axes(&root, &sampling, &scene, file)?,
        _ => (axes(&root, &scene, method, &mut notes)?, None),
    };
    check_overlaps(&root, &scene, &axes, method)?;
    let rows = table.as_ref().map(|table| table.row_count() as u64);
    let sample_count = sample_count(&root, &sampling, method, &axes, rows, format, &mut notes)?;
    let (tolerance, branch, steps) = solver(&root)?;
    let spec = SweepSpec {
        file: file.into(),
        scene,
        method,
        seed: sampling.count("seed", 0)?.unwrap_or(0),
        sample_count,
        axes,
        table,
        tolerance,
        branch,
        steps,
        quantities,
        wrt,
        format,
        voxel: voxel(&root)?,
        notes,
    };
    spec.plan(PlanOptions::default()).map_err(|error| plan_problem(&root, &spec, error))?;
    Ok(spec)
}

/// One word of a fixed list.
pub fn choice<T: Copy>(
    reader: &Reader,
    name: &str,
    all: &[T],
    word: fn(T) -> &'static str,
) -> Result<Option<T>, InputError> {
    let Some(text) = reader.string(name)? else { return Ok(None) };
    one_of(text, all, word).map(Some).map_err(|problem| reader.error(name, problem))
}

pub fn one_of<T: Copy>(text: &str, all: &[T], word: fn(T) -> &'static str) -> Result<T, Problem> {
    let words: Vec<&str> = all.iter().map(|item| word(*item)).collect();
    match all.iter().find(|item| word(**item) == text) {
        Some(item) => Ok(*item),
        None => Err(Problem::Choice {
            found: text.into(),
            suggestion: closest(text, words.iter().copied()),
            allowed: words.join(", "),
        }),
    }
}

fn sweep_scene(root: &Reader, file: &Path, built_in: &BuiltIn) -> Result<Scene, InputError> {
    if !root.has("scene") {
        return Err(root.missing("scene", "write scene = \"scenes/name.toml\", or a [scene] table"));
    }
    match root.string("scene") {
        Ok(Some(path)) => {
            if let Some((path, text)) = built_in.iter().find(|(built_in, _)| *built_in == path) {
                return parse_scene(Path::new(path), text);
            }
            let path = file.parent().unwrap_or(Path::new("")).join(path);
            if !path.is_file() {
                let reason = format!("{} is no file; the path starts from the folder of this file", path.display());
                return Err(root.error("scene", Problem::Unreadable(reason)));
            }
            read_scene(&path)
        }
        _ => match root.table("scene") {
            Ok(Some(table)) => scene(&table),
            _ => {
                let expected = "a path in quotes, or a [scene] table".into();
                Err(root.error("scene", Problem::Type { expected, found: "neither" }))
            }
        },
    }
}

pub fn parameters(reader: &Reader, key: &str, scene: &Scene, name: &str) -> Result<Vec<Parameter>, InputError> {
    Parameter::parse(scene, name).map_err(|error| reader.error(key, error))
}

fn axes(root: &Reader, scene: &Scene, method: Method, notes: &mut Vec<String>) -> Result<Vec<AxisSpec>, InputError> {
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

fn table_axes(root: &Reader, sampling: &Reader, scene: &Scene, file: &Path) -> Result<TableAxes, InputError> {
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
fn check_overlaps(root: &Reader, scene: &Scene, axes: &[AxisSpec], method: Method) -> Result<(), InputError> {
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

fn sample_count(
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

fn solver(root: &Reader) -> Result<(f64, BranchChoice, Option<usize>), InputError> {
    let usual = PlanOptions::default().tolerance;
    let Some(solver) = root.table("solver")? else { return Ok((usual, BranchChoice::FromRest, None)) };
    solver.check_keys(&["tolerance", "branch", "steps"])?;
    let tolerance = solver.quantity("tolerance", "")?.unwrap_or(usual);
    if !(tolerance > 0.0 && tolerance < 1.0) {
        let expected = "a number between 0 and 1, such as 1e-6".into();
        return Err(solver.error("tolerance", Problem::Range { value: tolerance.to_string(), expected }));
    }
    let branch = choice(&solver, "branch", &BranchChoice::ALL, BranchChoice::name)?.unwrap_or_default();
    let steps = solver.count("steps", 1)?;
    match steps {
        Some(steps) if steps > 4096 => {
            let expected = "at most 4096, or leave it out to have it chosen".into();
            Err(solver.error("steps", Problem::Range { value: steps.to_string(), expected }))
        }
        steps => Ok((tolerance, branch, steps.map(|steps| steps as usize))),
    }
}

fn output(root: &Reader, scene: &Scene) -> Result<(Format, Vec<OutputQuantity>, Vec<Parameter>), InputError> {
    let usual = OutputQuantity::ALL[..5].to_vec();
    let Some(output) = root.table("output")? else { return Ok((Format::Parquet, usual, Vec::new())) };
    output.check_keys(&["quantities", "derivatives", "format"])?;
    let format = choice(&output, "format", &Format::ALL, Format::name)?.unwrap_or(Format::Parquet);
    let quantities = match output.strings("quantities")? {
        None => usual,
        Some(names) => {
            let mut quantities = Vec::new();
            for (index, name) in names.iter().enumerate() {
                let quantity = one_of(name, &OutputQuantity::ALL, OutputQuantity::name)
                    .map_err(|problem| output.error(&format!("quantities[{index}]"), problem))?;
                if !quantities.contains(&quantity) {
                    quantities.push(quantity);
                }
            }
            quantities
        }
    };
    let mut wrt = Vec::new();
    for (index, name) in output.strings("derivatives")?.unwrap_or_default().iter().enumerate() {
        for parameter in parameters(&output, &format!("derivatives[{index}]"), scene, name)? {
            if !wrt.contains(&parameter) {
                wrt.push(parameter);
            }
        }
    }
    Ok((format, quantities, wrt))
}

fn voxel(root: &Reader) -> Result<f64, InputError> {
    let Some(workspace) = root.table("workspace")? else { return Ok(1e-3) };
    workspace.check_keys(&["voxel"])?;
    let voxel = workspace.quantity("voxel", "m")?.unwrap_or(1e-3);
    if voxel > 0.0 {
        return Ok(voxel);
    }
    let expected = "a length greater than zero, such as \"1 mm\"".into();
    Err(workspace.error("voxel", Problem::Range { value: voxel.to_string(), expected }))
}

/// The key that names what an axis drives.
fn axis_key(root: &Reader, index: usize) -> String {
    let several = format!("axis[{index}].parameters");
    if root.source().contains(&several) { several } else { format!("axis[{index}].parameter") }
}

/// Finds the key that a plan error is about.
fn plan_problem(root: &Reader, spec: &SweepSpec, error: PlanError) -> InputError {
    let is_meant = |parameter: &Parameter| match &error {
        PlanError::InsertionIntoRigid(_) => *parameter == Parameter::Insertion,
        PlanError::Parameter(ParameterError::Derived { name } | ParameterError::Unknown { name, .. }) => {
            parameter.name(&spec.scene) == *name
        }
        PlanError::Scene(_) | PlanError::NoReciprocity => false,
    };
    let axis = spec.axes.iter().position(|axis| axis.parameters.iter().any(is_meant));
    let key = match axis {
        Some(_) if spec.method == Method::Table => "sampling.file".to_owned(),
        Some(index) => axis_key(root, index),
        None => "output.derivatives".to_owned(),
    };
    let problem = match error {
        PlanError::Parameter(error) => Problem::Parameter(error),
        error => Problem::Plan(error),
    };
    root.error(&key, problem)
}
