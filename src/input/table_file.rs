//! Samples given as a table: CSV or Parquet whose columns are parameter names.

use super::error::{InputError, Problem};
use super::number_table::{cells, csv_lines, error, expect_width, is_parquet, read_parquet};
use super::scene_file::read_text;
use super::units::{Dimension, parse_quantity};
use crate::model::{Parameter, Scene};
use crate::spec::InputTable;
use std::collections::HashSet;
use std::path::Path;

/// Reads a table of values by parameter; a column `sample` is ignored.
///
/// # Errors
///
/// A file that cannot be read, a column that is no parameter, a value that is no finite number, no rows.
pub fn read_input_table(file: &Path, scene: &Scene) -> Result<InputTable, InputError> {
    let table = if is_parquet(file) { parse_parquet(file, scene)? } else { parse_csv(file, &read_text(file)?, scene)? };
    with_rows(file, table)
}

/// The same of the text of a CSV file.
///
/// # Errors
///
/// As [`read_input_table`].
pub fn parse_input_table(file: &Path, text: &str, scene: &Scene) -> Result<InputTable, InputError> {
    with_rows(file, parse_csv(file, text, scene)?)
}

fn with_rows(file: &Path, table: InputTable) -> Result<InputTable, InputError> {
    if table.row_count() == 0 {
        return Err(error(
            file,
            None,
            "",
            Problem::Missing { remedy: "the table has no rows: give at least one".into() },
        ));
    }
    Ok(table)
}

/// The parameter of each column, `None` for `sample`.
fn columns(
    file: &Path,
    line: Option<usize>,
    names: &[&str],
    scene: &Scene,
) -> Result<Vec<Option<Parameter>>, InputError> {
    let mut columns: Vec<Option<Parameter>> = Vec::new();
    let mut seen = HashSet::new();
    for name in names {
        if *name == "sample" {
            columns.push(None);
            continue;
        }
        let parameters =
            Parameter::parse(scene, name).map_err(|problem| error(file, line, name, Problem::Parameter(problem)))?;
        if parameters.len() > 1 {
            let expected = format!("one component, such as {}.x", name);
            let value = format!("a group of {}", parameters.len());
            return Err(error(file, line, name, Problem::Range { value, expected }));
        }
        if !seen.insert(parameters[0]) {
            let problem = Problem::Conflict { with: (*name).into(), remedy: "drop one of the two columns".into() };
            return Err(error(file, line, name, problem));
        }
        columns.push(Some(parameters[0]));
    }
    if columns.iter().all(Option::is_none) {
        let remedy = "the first line must name parameters, such as coil.current.x".into();
        return Err(error(file, line, "", Problem::Missing { remedy }));
    }
    Ok(columns)
}

fn parse_csv(file: &Path, text: &str, scene: &Scene) -> Result<InputTable, InputError> {
    let mut lines = csv_lines(text);
    let Some((header_line, header)) = lines.next() else {
        let remedy = "the first line must name parameters, such as coil.current.x".into();
        return Err(error(file, None, "", Problem::Missing { remedy }));
    };
    let names: Vec<&str> = cells(header).collect();
    let columns = columns(file, Some(header_line), &names, scene)?;
    let mut values = Vec::new();
    for (line, row) in lines {
        expect_width(file, line, row, names.len())?;
        for ((cell, name), parameter) in cells(row).zip(&names).zip(&columns) {
            let Some(parameter) = parameter else { continue };
            let value = parse_quantity(cell, Dimension::of(parameter.unit()));
            values.push(value.map_err(|problem| error(file, Some(line), name, Problem::Quantity(problem)))?);
        }
    }
    Ok(InputTable::new(columns.into_iter().flatten().collect(), values))
}

fn parse_parquet(file: &Path, scene: &Scene) -> Result<InputTable, InputError> {
    let named = read_parquet(file)?;
    let names: Vec<&str> = named.iter().map(|(name, _)| name.as_str()).collect();
    let columns = columns(file, None, &names, scene)?;
    let used: Vec<&(String, Vec<f64>)> =
        named.iter().zip(&columns).filter(|(_, column)| column.is_some()).map(|(named, _)| named).collect();
    let mut values = Vec::with_capacity(used[0].1.len() * used.len());
    for row in 0..used[0].1.len() {
        for (name, column) in &used {
            if !column[row].is_finite() {
                let problem = Problem::Range {
                    value: format!("{} in row {row}", column[row]),
                    expected: "a finite number".into(),
                };
                return Err(error(file, None, name, problem));
            }
            values.push(column[row]);
        }
    }
    Ok(InputTable::new(columns.into_iter().flatten().collect(), values))
}
