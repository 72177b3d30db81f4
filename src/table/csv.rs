//! CSV: one header line, shortest digits that round-trip, nothing where there is no number.

use super::{Column, Table, Values};
use crate::model::Status;
use crate::results::ResultsError;
use std::fmt::Write;
use std::path::Path;

pub fn encode(table: &Table) -> Vec<u8> {
    let mut text = table.columns.iter().map(|column| column.name.as_str()).collect::<Vec<_>>().join(",");
    text.push('\n');
    for row in 0..table.row_count() {
        for (index, column) in table.columns.iter().enumerate() {
            if index > 0 {
                text.push(',');
            }
            // Writing to a String cannot fail.
            let _ = match &column.values {
                Values::Index(values) => write!(text, "{}", values[row]),
                Values::Double(values) if values[row].is_finite() => write!(text, "{:?}", values[row]),
                Values::Single(values) if values[row].is_finite() => write!(text, "{:?}", values[row]),
                Values::Status(values) => write!(text, "{}", values[row].name()),
                Values::Flag(values) => values[row].map_or(Ok(()), |flag| write!(text, "{flag}")),
                Values::Double(_) | Values::Single(_) => Ok(()),
            };
        }
        text.push('\n');
    }
    text.into_bytes()
}

pub fn read(path: &Path, names: &[&str], like: &Table) -> Result<Table, ResultsError> {
    let text = std::fs::read_to_string(path).map_err(ResultsError::io(path, "reading"))?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let mut table = Table::default();
    let mut places = Vec::new();
    for (place, name) in header.iter().enumerate() {
        if let Some(column) = like.column(name).filter(|_| names.is_empty() || names.contains(name)) {
            table.columns.push(Column {
                name: column.name.clone(),
                unit: column.unit.clone(),
                values: column.values.clone(),
            });
            places.push(place);
        }
    }
    let mut table = table.empty();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        for (column, place) in table.columns.iter_mut().zip(&places) {
            let cell = cells.get(*place).copied().unwrap_or_default();
            match &mut column.values {
                Values::Index(values) => values.push(cell.parse().unwrap_or(u64::MAX)),
                Values::Double(values) => values.push(cell.parse().unwrap_or(f64::NAN)),
                Values::Single(values) => values.push(cell.parse().unwrap_or(f32::NAN)),
                Values::Flag(values) => values.push(cell.parse().ok()),
                Values::Status(values) => {
                    values.push(Status::ALL.into_iter().find(|status| status.name() == cell).unwrap_or_default());
                }
            }
        }
    }
    Ok(table)
}
