//! Reads a sweep file into a `SweepSpec`: every mistake names file, line, key and remedy.

use super::error::{InputError, Problem};
use super::scene_file::{parse_scene, read_scene, read_text, scene};
use super::sweep_axes::{AXIS, UNCERTAIN, axes, axis_key, check_overlaps, table_axes, uncertain};
use super::sweep_samples::samples;
use super::toml::{Reader, Source};
use super::words::{choice, one_of, parameters};
use crate::model::{Parameter, ParameterError, Plan, PlanError, PlanOptions, Scene, WallParameter, short_number};
use crate::spec::{
    AxisSpec, BranchChoice, Format, MIXED, MIXED_NOTE, Method, OutputQuantity, PrecisionChoice, SweepSpec,
    WorkspaceOptions,
};
use std::path::Path;

impl SweepSpec {
    /// Reads a sweep file and whatever it refers to.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, or any mistake in it or in what it refers to.
    pub fn read(file: &Path) -> Result<SweepSpec, InputError> {
        Self::parse(file, &read_text(file)?)
    }

    /// Parses the text of a sweep file; relative paths in it start from the folder of `file`.
    ///
    /// # Errors
    ///
    /// Any mistake in the text or in what it refers to.
    pub fn parse(file: &Path, text: &str) -> Result<SweepSpec, InputError> {
        parse_sweep(file, text, &[])
    }

    /// The same; scenes and tables (CSV) that `built_in` lists, by the path that the sweep has for them, are not read from
    /// files.
    ///
    /// # Errors
    ///
    /// As [`SweepSpec::parse`].
    pub fn parse_with(file: &Path, text: &str, built_in: &[(&str, &str)]) -> Result<SweepSpec, InputError> {
        parse_sweep(file, text, built_in)
    }
}

/// Files that need not be read: path as a sweep names it, or from the folder of the sweep on, and text.
pub type BuiltIn<'a> = [(&'a str, &'a str)];

/// Parses the text of a sweep file.
pub(super) fn parse_sweep(file: &Path, text: &str, built_in: &BuiltIn) -> Result<SweepSpec, InputError> {
    sweep_of(&Source::parse(file, text)?, file, built_in)
}

/// The sweep of a parsed file; what `bench` has to say in it is left alone.
///
/// # Errors
///
/// Any mistake in the file or in what it refers to.
pub fn sweep_of(source: &Source, file: &Path, built_in: &BuiltIn) -> Result<SweepSpec, InputError> {
    let root = source.root();
    root.check_keys(&["scene", "sampling", "axis", "uncertain", "solver", "output", "workspace", "bench"])?;
    let scene = sweep_scene(&root, file, built_in)?;
    let mut notes = super::scene_file::scene_notes(&scene);
    let sampling = root.table("sampling")?;
    let sampling = sampling.ok_or_else(|| root.missing("sampling", "add [sampling] with a method such as \"grid\""))?;
    sampling.check_keys(&["method", "samples", "dimension", "seed", "file", "extra_columns"])?;
    let method = choice(&sampling, "method", &Method::ALL, Method::name)?
        .ok_or_else(|| sampling.missing("method", "write method = \"grid\", \"sobol\" or another"))?;
    let Output { format, rows_in_folder, quantities, wrt, single_derivatives } = output(&root, &scene)?;
    let (axes, table) = match method {
        Method::Table => table_axes(&root, &sampling, &scene, file, built_in, &mut notes)?,
        _ => (axes(&root, &scene, method, &mut notes)?, None),
    };
    let uncertain = uncertain(&root, &scene, &mut notes)?;
    check_overlaps(&root, &scene, &axes, &uncertain, method)?;
    let rows = table.as_ref().map(|table| table.row_count() as u64);
    let (sample_count, skeleton) = samples(&root, &sampling, method, &axes, rows, format, &mut notes)?;
    let Solver { tolerance, derivative_tolerance, branch, precision, steps, anchors, allow_failures } =
        solver(&root, &mut notes)?;
    if branch == BranchChoice::All && scene.wall.is_some() {
        let remedy =
            "every equilibrium is not searched with a wall yet: take \"from_rest\", or leave out `[wall]`".into();
        return Err(root.error("solver.branch", Problem::Conflict { with: "[wall]".into(), remedy }));
    }
    let spec = SweepSpec {
        file: file.into(),
        scene,
        method,
        seed: sampling.count("seed", 0)?.unwrap_or(0),
        sample_count,
        axes,
        uncertain,
        skeleton,
        table,
        tolerance,
        derivative_tolerance,
        branch,
        precision,
        steps,
        anchors,
        allow_failures,
        quantities,
        single_derivatives,
        wrt,
        format,
        rows_in_folder,
        workspace: workspace(&root)?,
        notes,
    };
    spec.plan(PlanOptions::default()).map_err(|error| plan_problem(&root, &spec, error))?;
    let uncertain: Vec<Vec<Parameter>> = spec.uncertain.iter().map(|number| number.parameters.clone()).collect();
    Plan::new(&spec.scene, &uncertain, &[], PlanOptions::default())
        .map_err(|error| plan_problem(&root, &spec, error))?;
    Ok(spec)
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
            if let Some((_, text)) = built_in.iter().find(|(built_in, _)| Path::new(built_in) == path) {
                return parse_scene(&path, text);
            }
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

/// `[solver]`
struct Solver {
    tolerance: f64,
    derivative_tolerance: f64,
    branch: BranchChoice,
    precision: PrecisionChoice,
    steps: Option<usize>,
    anchors: bool,
    allow_failures: Option<f64>,
}

fn solver(root: &Reader, notes: &mut Vec<String>) -> Result<Solver, InputError> {
    let PlanOptions { tolerance, derivative_tolerance, .. } = PlanOptions::default();
    let Some(solver) = root.table("solver")? else {
        let branch = BranchChoice::FromRest;
        let precision = PrecisionChoice::Usual;
        return Ok(Solver {
            tolerance,
            derivative_tolerance,
            branch,
            precision,
            steps: None,
            anchors: true,
            allow_failures: None,
        });
    };
    solver.check_keys(&[
        "tolerance",
        "derivative_tolerance",
        "branch",
        "precision",
        "steps",
        "anchors",
        "allow_failures",
    ])?;
    let tolerance = share(&solver, "tolerance", "1e-6")?.unwrap_or(tolerance);
    let derivative_tolerance = share(&solver, "derivative_tolerance", "1e-3")?.unwrap_or(derivative_tolerance);
    let branch = choice(&solver, "branch", &BranchChoice::ALL, BranchChoice::name)?.unwrap_or_default();
    let precision = if solver.string("precision")? == Some(MIXED) {
        notes.push(format!("`solver.precision`: {MIXED_NOTE}"));
        PrecisionChoice::IN_PLACE_OF_MIXED
    } else {
        choice(&solver, "precision", &PrecisionChoice::WORDS, PrecisionChoice::name)?.unwrap_or_default()
    };
    let anchors = choice(&solver, "anchors", &[true, false], |on| if on { "auto" } else { "off" })?.unwrap_or(true);
    let allow_failures = match solver.quantity("allow_failures", "")? {
        Some(value) if !(0.0..=1.0).contains(&value) => {
            let expected = "a share of the samples from 0 to 1, such as 0.01".into();
            return Err(solver.error("allow_failures", Problem::Range { value: short_number(value), expected }));
        }
        share => share,
    };
    let steps = solver.count("steps", 1)?;
    match steps {
        Some(steps) if steps > 4096 => {
            let expected = "at most 4096, or leave it out to have it chosen".into();
            Err(solver.error("steps", Problem::Range { value: steps.to_string(), expected }))
        }
        steps => {
            let steps = steps.map(|steps| steps as usize);
            Ok(Solver { tolerance, derivative_tolerance, branch, precision, steps, anchors, allow_failures })
        }
    }
}

/// A number between 0 and 1.
fn share(solver: &Reader, key: &str, example: &str) -> Result<Option<f64>, InputError> {
    let value = solver.quantity(key, "")?;
    match value {
        Some(value) if !(value > 0.0 && value < 1.0) => {
            let expected = format!("a number between 0 and 1, such as {example}");
            Err(solver.error(key, Problem::Range { value: short_number(value), expected }))
        }
        value => Ok(value),
    }
}

/// `[output]`
struct Output {
    format: Format,
    rows_in_folder: bool,
    quantities: Vec<OutputQuantity>,
    wrt: Vec<Parameter>,
    single_derivatives: bool,
}

fn output(root: &Reader, scene: &Scene) -> Result<Output, InputError> {
    let Some(output) = root.table("output")? else {
        let quantities = OutputQuantity::usual(scene, &[]);
        return Ok(Output {
            format: Format::Parquet,
            rows_in_folder: false,
            quantities,
            wrt: Vec::new(),
            single_derivatives: false,
        });
    };
    output.check_keys(&["quantities", "derivatives", "derivative_precision", "format", "rows_in_folder"])?;
    let format = choice(&output, "format", &Format::ALL, Format::name)?.unwrap_or(Format::Parquet);
    let rows_in_folder = output.boolean("rows_in_folder")?.unwrap_or(false);
    if rows_in_folder && format == Format::None {
        let expected = "false, or another `format`: with \"none\" no rows are written".into();
        return Err(output.error("rows_in_folder", Problem::Range { value: "true".into(), expected }));
    }
    let mut wrt = Vec::new();
    for (index, name) in output.strings("derivatives")?.unwrap_or_default().iter().enumerate() {
        for parameter in parameters(&output, &format!("derivatives[{index}]"), scene, name)? {
            if !wrt.contains(&parameter) {
                wrt.push(parameter);
            }
        }
    }
    let quantities = match output.strings("quantities")? {
        None => OutputQuantity::usual(scene, &wrt),
        Some(names) => {
            let mut quantities = Vec::new();
            for (index, name) in names.iter().enumerate() {
                let quantity = one_of(name, &OutputQuantity::ALL, OutputQuantity::name)
                    .map_err(|problem| output.error(&format!("quantities[{index}]"), problem))?;
                if !quantity.is_told_by(scene) {
                    let (value, expected) = (format!("\"{name}\""), NO_WALL.into());
                    return Err(output.error(&format!("quantities[{index}]"), Problem::Range { value, expected }));
                }
                if !quantities.contains(&quantity) {
                    quantities.push(quantity);
                }
            }
            quantities
        }
    };
    let name = |single: bool| if single { "f32" } else { "f64" };
    let single_derivatives = choice(&output, "derivative_precision", &[true, false], name)?.unwrap_or(false);
    Ok(Output { format, rows_in_folder, quantities, wrt, single_derivatives })
}

/// What to do about a contact that no scene without a wall tells.
const NO_WALL: &str = "other quantities, or add `[wall]` to the scene: without a wall there is no contact";

fn workspace(root: &Reader) -> Result<WorkspaceOptions, InputError> {
    let usual = WorkspaceOptions::default();
    let Some(workspace) = root.table("workspace")? else { return Ok(usual) };
    workspace.check_keys(&["voxel", "minimum_margin", "seed", "length"])?;
    let length = |key: &str, example: &str| match workspace.quantity(key, "m")? {
        Some(length) if length <= 0.0 => {
            let expected = format!("a length greater than zero, such as \"{example}\"");
            Err(workspace.error(key, Problem::Range { value: short_number(length), expected }))
        }
        length => Ok(length),
    };
    let minimum_margin = workspace.quantity("minimum_margin", "")?.unwrap_or(usual.minimum_margin);
    if !(0.0..=1.0).contains(&minimum_margin) {
        let expected = "a number from 0 to 1, such as 0.1".into();
        return Err(workspace.error("minimum_margin", Problem::Range { value: short_number(minimum_margin), expected }));
    }
    Ok(WorkspaceOptions {
        voxel: length("voxel", "1 mm")?.unwrap_or(usual.voxel),
        minimum_margin,
        seed: workspace.count("seed", 0)?.unwrap_or(usual.seed),
        length: length("length", "20 mm")?,
    })
}

/// Finds the key that a plan error is about.
fn plan_problem(root: &Reader, spec: &SweepSpec, error: PlanError) -> InputError {
    let is_meant = |parameter: &Parameter| match &error {
        PlanError::InsertionIntoRigid(_) => *parameter == Parameter::Insertion,
        PlanError::Parameter(ParameterError::Derived { name } | ParameterError::Unknown { name, .. }) => {
            parameter.name(&spec.scene) == *name
        }
        PlanError::WallWithTipMoment => matches!(parameter, Parameter::TipMoment(_)),
        PlanError::RigidWall => *parameter == Parameter::Wall(WallParameter::Stiffness),
        PlanError::Scene(_) | PlanError::NoReciprocity | PlanError::FrictionChangesNothing => false,
    };
    let place = |axes: &[AxisSpec]| axes.iter().position(|axis| axis.parameters.iter().any(is_meant));
    let key = match (place(&spec.axes), place(&spec.uncertain)) {
        (Some(_), _) if spec.method == Method::Table => "sampling.file".to_owned(),
        (Some(index), _) => axis_key(root, AXIS, index),
        (None, Some(index)) => axis_key(root, UNCERTAIN, index),
        (None, None) => "output.derivatives".to_owned(),
    };
    let problem = match error {
        PlanError::Parameter(error) => Problem::Parameter(error),
        error => Problem::Plan(error),
    };
    root.error(&key, problem)
}
