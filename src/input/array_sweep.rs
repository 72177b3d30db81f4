//! A sweep over a table of values that a program holds, without a file.

use super::error::{InputError, Problem};
use super::sweep_axes::{overlap, row_axis};
use crate::model::{ParameterError, PlanError, PlanOptions, Scene};
use crate::spec::{
    BranchChoice, Format, InputTable, MAX_ROWS, Method, OutputQuantity, PrecisionChoice, SweepSpec, WorkspaceOptions,
    grouped,
};
use std::path::PathBuf;
use std::sync::Arc;

/// The sweep whose samples are the rows of a table, as `method = "table"` reads it from a file. What else a sweep
/// file may say is as usual; set the fields of the answer.
///
/// # Errors
///
/// Columns that set the same number, values that are not finite, too many rows, or a parameter that cannot be swept.
/// The key is the parameter's name.
pub fn sweep_of_table(scene: Scene, table: InputTable) -> Result<SweepSpec, InputError> {
    for (row, at) in (0..table.row_count()).flat_map(|row| (0..table.parameters().len()).map(move |at| (row, at))) {
        let value = table.row(row)[at];
        if !value.is_finite() {
            let name = table.parameters()[at].name(&scene);
            let problem = Problem::Range { value: format!("{value} in row {row}"), expected: "a finite number".into() };
            return Err(error(&name, problem));
        }
    }
    let spec = sweep_of_rows(scene, table)?;
    spec.plan(PlanOptions::default()).map_err(plan_error)?;
    Ok(spec)
}

/// The same for a table that may hold numbers that are not finite: these rows get the status `bad-parameter`. Whether
/// its parameters can be swept is told by [`SweepSpec::plan`].
///
/// # Errors
///
/// Columns that set the same number, or too many rows.
pub fn sweep_of_rows(scene: Scene, table: InputTable) -> Result<SweepSpec, InputError> {
    let parameters = table.parameters();
    for (at, parameter) in parameters.iter().enumerate() {
        if let Some(other) = parameters[..at].iter().find(|other| overlap(*parameter, **other)) {
            let (name, with) = (parameter.name(&scene), other.name(&scene));
            let remedy = format!("both set `{name}`: drop one");
            return Err(error(&name, Problem::Conflict { with, remedy }));
        }
    }
    let rows = table.row_count() as u64;
    if rows > MAX_ROWS {
        let (count, limit) = (format!("{} rows", grouped(rows)), grouped(MAX_ROWS));
        return Err(error("", Problem::TooMany { what: "asks for", count, limit, remedy: "solve fewer at once" }));
    }
    let axes: Vec<_> = parameters.iter().map(row_axis).collect();
    let quantities = OutputQuantity::usual(&scene, &[]);
    Ok(SweepSpec {
        file: PathBuf::new(),
        scene,
        method: Method::Table,
        seed: 0,
        sample_count: rows,
        axes,
        uncertain: Vec::new(),
        skeleton: None,
        table: Some(Arc::new(table)),
        tolerance: PlanOptions::default().tolerance,
        derivative_tolerance: PlanOptions::default().derivative_tolerance,
        branch: BranchChoice::FromRest,
        precision: PrecisionChoice::Usual,
        anchors: true,
        allow_failures: None,
        steps: None,
        quantities,
        wrt: Vec::new(),
        single_derivatives: false,
        format: Format::Parquet,
        rows_in_folder: false,
        workspace: WorkspaceOptions::default(),
        notes: Vec::new(),
    })
}

fn plan_error(problem: PlanError) -> InputError {
    let key = match &problem {
        PlanError::InsertionIntoRigid(_) => "insertion".to_owned(),
        PlanError::Parameter(ParameterError::Derived { name } | ParameterError::Unknown { name, .. }) => name.clone(),
        PlanError::FrictionChangesNothing => "wall.friction".to_owned(),
        PlanError::RigidWall => "wall.stiffness".to_owned(),
        PlanError::Scene(_) | PlanError::NoReciprocity | PlanError::WallWithTipMoment => String::new(),
    };
    match problem {
        PlanError::Parameter(problem) => error(&key, Problem::Parameter(problem)),
        problem => error(&key, Problem::Plan(problem)),
    }
}

fn error(key: &str, problem: Problem) -> InputError {
    InputError { file: PathBuf::new(), line: None, key: key.into(), problem: problem.into() }
}
