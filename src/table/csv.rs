//! CSV: one header line, shortest digits that round-trip, nothing where there is no number.

use super::{Column, Table, TableError, Values};
use crate::model::{Status, short_name};
use std::borrow::Cow;
use std::fmt::Write;
use std::path::Path;

/// The text of a table, names in the first line. Cells with a comma, a quote or a line's end are quoted.
pub fn encode(table: &Table) -> Vec<u8> {
    let mut text = String::new();
    for (index, column) in table.columns.iter().enumerate() {
        push_separator(&mut text, index);
        push_word(&mut text, &column.name);
    }
    text.push('\n');
    for row in 0..table.row_count() {
        for (index, column) in table.columns.iter().enumerate() {
            push_separator(&mut text, index);
            push_cell(&mut text, &column.values, row);
        }
        text.push('\n');
    }
    text.into_bytes()
}

fn push_separator(text: &mut String, index: usize) {
    if index > 0 {
        text.push(',');
    }
}

fn push_cell(text: &mut String, values: &Values, row: usize) {
    // Writing to a String cannot fail.
    let _ = match values {
        Values::Index(values) => write!(text, "{}", values[row]),
        Values::Double(values) if values[row].is_finite() => write!(text, "{:?}", values[row]),
        Values::Single(values) if values[row].is_finite() => write!(text, "{:?}", values[row]),
        Values::Double(_) | Values::Single(_) => Ok(()),
        Values::Status(values) => write!(text, "{}", values[row].name()),
        Values::Flag(values) => values[row].map_or(Ok(()), |flag| write!(text, "{flag}")),
        Values::Text(values) => {
            push_word(text, &values[row]);
            Ok(())
        }
    };
}

fn push_word(text: &mut String, word: &str) {
    if word.contains([',', '"', '\n', '\r']) {
        text.push('"');
        text.push_str(&word.replace('"', "\"\""));
        text.push('"');
    } else {
        text.push_str(word);
    }
}

/// Reads the columns of `like` that are named (all, if none are), in the file's order, with its kinds and units.
///
/// The text itself tells neither; columns that `like` lacks are passed over.
///
/// # Errors
///
/// A file that cannot be read, or cells that are not of their column's kind.
pub fn read(path: &Path, names: &[&str], like: &Table) -> Result<Table, TableError> {
    decode(&crate::files::read_text(path)?, names, like)
}

/// As [`read`], of a text.
///
/// # Errors
///
/// Cells that are not of their column's kind.
pub fn decode(text: &str, names: &[&str], like: &Table) -> Result<Table, TableError> {
    let mut rest = text;
    let header = next_row(&mut rest).unwrap_or_default();
    let mut table = Table::default();
    let mut places = Vec::new();
    for (place, name) in header.iter().enumerate() {
        if let Some(column) = like.column(name).filter(|_| names.is_empty() || names.contains(&name.as_ref())) {
            table.columns.push(column.with_values(column.values.empty()));
            places.push(place);
        }
    }
    while let Some(cells) = next_row(&mut rest) {
        for (column, place) in table.columns.iter_mut().zip(&places) {
            let cell = cells.get(*place).map_or("", Cow::as_ref);
            parse_cell(column, cell).ok_or_else(|| {
                let row = 1 + column.values.len();
                TableError::Damaged {
                    format: "CSV",
                    reason: format!("`{}` is `{}` in row {row}", column.name, short_name(cell)),
                }
            })?;
        }
    }
    Ok(table)
}

/// Adds a cell to a column; `None` if it is of another kind.
fn parse_cell(column: &mut Column, cell: &str) -> Option<()> {
    match &mut column.values {
        Values::Index(values) => values.push(cell.parse().ok()?),
        Values::Double(values) => values.push(if cell.is_empty() { f64::NAN } else { cell.parse().ok()? }),
        Values::Single(values) => values.push(if cell.is_empty() { f32::NAN } else { cell.parse().ok()? }),
        Values::Flag(values) if cell.is_empty() => values.push(None),
        Values::Flag(values) => values.push(Some(cell.parse().ok()?)),
        Values::Status(values) => values.push(Status::ALL.into_iter().find(|status| status.name() == cell)?),
        Values::Text(values) => values.push(cell.into()),
    }
    Some(())
}

/// Cells of the first row; `text` goes on behind it.
fn next_row<'a>(text: &mut &'a str) -> Option<Vec<Cow<'a, str>>> {
    if text.is_empty() {
        return None;
    }
    let mut cells = Vec::new();
    loop {
        cells.push(next_cell(text));
        let mut rest = text.chars();
        let separator = rest.next();
        *text = rest.as_str();
        if separator != Some(',') {
            return Some(cells);
        }
    }
}

/// The first cell; `text` goes on at the comma or line's end behind it.
fn next_cell<'a>(text: &mut &'a str) -> Cow<'a, str> {
    let Some(quoted) = text.strip_prefix('"') else {
        let end = text.find([',', '\n']).unwrap_or(text.len());
        let cell = &text[..end];
        *text = &text[end..];
        return cell.strip_suffix('\r').unwrap_or(cell).into();
    };
    let mut cell = String::new();
    let mut rest = quoted;
    loop {
        let end = rest.find('"').unwrap_or(rest.len());
        cell.push_str(&rest[..end]);
        rest = rest.get(end + 1..).unwrap_or_default();
        match rest.strip_prefix('"') {
            Some(after) => (rest, _) = (after, cell.push('"')),
            None => break,
        }
    }
    *text = &rest[rest.find([',', '\n']).unwrap_or(rest.len())..];
    cell.into()
}
