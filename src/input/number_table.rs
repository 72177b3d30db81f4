//! Tables of numbers by column: text whose cells or heads may carry units, or Parquet.

use super::error::{InputError, Problem, table_error};
use super::text_table::{Head, TextTable, is_gap, read_table_text};
use super::units::{Dimension, LARGEST};
use crate::table::{self, TableError, Values};
use std::collections::HashSet;
use std::path::Path;

/// Numbers that a Parquet file may give: with the samples made of them they take less than 1 GB.
const MOST_NUMBERS: u64 = 50_000_000;

/// How a reader takes the columns of a table.
pub(crate) struct Columns<'a> {
    /// Dimension of a column's numbers.
    pub dimension: &'a dyn Fn(&str) -> Dimension,
    /// Columns whose cells may have no value, which is NaN; elsewhere that is a mistake.
    pub optional: &'a [&'a str],
    /// Whether a column is passed over.
    pub ignored: &'a dyn Fn(&str) -> bool,
}

/// Columns by name, SI.
pub(crate) fn read_number_table(file: &Path, habits: &Columns) -> Result<Vec<(String, Vec<f64>)>, InputError> {
    if is_parquet(file) {
        let columns = read_parquet(file)?;
        return Ok(columns.into_iter().filter(|(name, _)| !(habits.ignored)(name)).collect());
    }
    let text = read_table_text(file)?;
    let Some(table) = TextTable::new(file, &text, "x")? else { return Ok(Vec::new()) };
    let is_used: Vec<bool> = table.heads.iter().map(|head| !(habits.ignored)(head.name)).collect();
    let used = || table.heads.iter().zip(&is_used).filter(|(_, is_used)| **is_used).map(|(head, _)| head);
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    let mut names = HashSet::new();
    for Head { name, .. } in used() {
        if !names.insert(*name) {
            let problem = Problem::Conflict { with: (*name).into(), remedy: "drop one of the two columns".into() };
            return Err(table_error(file, Some(table.line), name, problem));
        }
        columns.push(((*name).to_owned(), Vec::new()));
    }
    for row in table.rows(file) {
        let (line, cells) = row?;
        let cells = cells.into_iter().zip(&is_used).filter(|(_, is_used)| **is_used).map(|(cell, _)| cell);
        for ((cell, head), (name, values)) in cells.zip(used()).zip(&mut columns) {
            if is_gap(cell) && habits.optional.contains(&name.as_str()) {
                values.push(f64::NAN);
                continue;
            }
            let value = table.quantity(head, cell, (habits.dimension)(name));
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
