//! Tables of numbers by column: text whose cells or heads may carry units, or Parquet.

use super::error::{InputError, Problem, table_error};
use super::text_table::{Head, TextTable, read_table_text};
use super::units::{Dimension, LARGEST};
use crate::table::{self, TableError, Values};
use std::collections::HashSet;
use std::path::Path;

/// Numbers that a Parquet file may give: with the samples made of them they take less than 1 GB.
const MOST_NUMBERS: u64 = 50_000_000;

/// Columns by name, SI. An empty cell is NaN in the column `optional`, and a mistake elsewhere.
pub(crate) fn read_number_table(
    file: &Path,
    unit: &dyn Fn(&str) -> Dimension,
    optional: &str,
) -> Result<Vec<(String, Vec<f64>)>, InputError> {
    if is_parquet(file) {
        return read_parquet(file);
    }
    let text = read_table_text(file)?;
    let Some(table) = TextTable::new(file, &text, "x")? else { return Ok(Vec::new()) };
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    let mut names = HashSet::new();
    for Head { name, .. } in &table.heads {
        if !names.insert(*name) {
            let problem = Problem::Conflict { with: (*name).into(), remedy: "drop one of the two columns".into() };
            return Err(table_error(file, Some(table.line), name, problem));
        }
        columns.push(((*name).to_owned(), Vec::new()));
    }
    for row in table.rows(file) {
        let (line, cells) = row?;
        for ((cell, head), (name, values)) in cells.into_iter().zip(&table.heads).zip(&mut columns) {
            if cell.is_empty() && name == optional {
                values.push(f64::NAN);
                continue;
            }
            let value = table.quantity(head, cell, unit(name));
            values.push(value.map_err(|problem| table_error(file, Some(line), name, Problem::Quantity(problem)))?);
        }
    }
    Ok(columns)
}

pub(crate) fn is_parquet(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"))
}

/// Columns by name, NaN for what is missing. Every column must hold numbers.
pub(crate) fn read_parquet(file: &Path) -> Result<Vec<(String, Vec<f64>)>, InputError> {
    let wrong_kind =
        |name: &str, found| table_error(file, None, name, Problem::Type { expected: "numbers".into(), found });
    let table = table::parquet::read_numbers(file, MOST_NUMBERS).map_err(|problem| match problem {
        TableError::Kind { column, found, .. } => wrong_kind(&column, found),
        TableError::Io(problem) => table_error(file, None, "", Problem::Unreadable(problem.to_string())),
        problem => table_error(file, None, "", Problem::Table(problem.to_string())),
    })?;
    let numbers = |column: table::Column| {
        let values = match column.values {
            Values::Double(values) => values,
            values => values.numbers(),
        };
        match values.iter().position(|x| x.abs() > LARGEST) {
            Some(row) => {
                let (value, expected) = (format!("{:e} in row {row}", values[row]), "at most 1e60 in size".into());
                Err(table_error(file, None, &column.name, Problem::Range { value, expected }))
            }
            None => Ok((column.name, values)),
        }
    };
    table.columns.into_iter().map(numbers).collect()
}

/// Lines of a CSV file, neither empty nor comments, with their numbers from 1.
pub(crate) fn csv_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

pub(crate) fn cells(line: &str) -> impl Iterator<Item = &str> {
    line.split(',').map(|cell| cell.trim().trim_matches('"'))
}
