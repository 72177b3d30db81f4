//! Tables of numbers: CSV whose cells may carry units, or Parquet. The first line names the columns.

use super::error::{InputError, Problem};
use super::scene_file::read_text;
use super::sink;
use super::units::{Dimension, parse_quantity};
use std::path::Path;

/// Columns by name, SI. An empty cell is NaN in the column `optional`, and a mistake elsewhere.
pub(super) fn read_number_table(
    file: &Path,
    unit: &dyn Fn(&str) -> Dimension,
    optional: &str,
) -> Result<Vec<(String, Vec<f64>)>, InputError> {
    let is_parquet = file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"));
    if is_parquet {
        let columns = sink::read_numbers(file);
        return columns.map_err(|problem| error(file, None, "", Problem::Unreadable(problem.to_string())));
    }
    let text = read_text(file)?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let Some((header_line, header)) = lines.next() else { return Ok(Vec::new()) };
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    for name in cells(header) {
        if columns.iter().any(|(other, _)| other == name) {
            let problem = Problem::Conflict { with: name.into(), remedy: "drop one of the two columns".into() };
            return Err(error(file, Some(header_line), name, problem));
        }
        columns.push((name.to_owned(), Vec::new()));
    }
    for (line, row) in lines {
        let found = cells(row).count();
        if found != columns.len() {
            return Err(error(file, Some(line), "", Problem::Columns { found, expected: columns.len() }));
        }
        for (cell, (name, values)) in cells(row).zip(&mut columns) {
            if cell.is_empty() && name == optional {
                values.push(f64::NAN);
                continue;
            }
            let value = parse_quantity(cell, unit(name));
            values.push(value.map_err(|problem| error(file, Some(line), name, Problem::Quantity(problem)))?);
        }
    }
    Ok(columns)
}

fn cells(line: &str) -> impl Iterator<Item = &str> {
    line.split(',').map(|cell| cell.trim().trim_matches('"'))
}

pub(super) fn error(file: &Path, line: Option<usize>, key: &str, problem: Problem) -> InputError {
    InputError { file: file.into(), line, key: key.into(), problem: problem.into() }
}
