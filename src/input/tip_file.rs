//! Observed tips: a table with columns x, y, z, perhaps `point`, the row of the commands that each belongs to.

use super::error::{InputError, Problem, table_error};
use super::number_table::{Columns, read_number_table};
use super::units::Dimension;
use crate::model::closest;
use crate::spec::ObservedTip;
use std::path::Path;

const COLUMNS: [&str; 4] = ["point", "x", "y", "z"];

/// Reads tips, each with its row of `command_count` commands; without a column `point` they follow the rows.
///
/// # Errors
///
/// A file that cannot be read, or a mistake in it.
pub fn read_observed_tips(file: &Path, command_count: usize) -> Result<Vec<ObservedTip>, InputError> {
    let dimension = |name: &str| if name == "point" { Dimension::NUMBER } else { Dimension::of("m") };
    let columns = read_number_table(file, &Columns { dimension: &dimension, optional: &[], ignored: &|_| false })?;
    if let Some((name, _)) = columns.iter().find(|(name, _)| !COLUMNS.contains(&name.as_str())) {
        let suggestion = closest(name, COLUMNS.into_iter());
        let problem = Problem::Choice { found: name.clone(), suggestion, allowed: COLUMNS.join(", ") };
        return Err(table_error(file, None, name, problem));
    }
    let column = |name: &str| columns.iter().find(|(other, _)| other == name).map(|(_, values)| values);
    let [Some(x), Some(y), Some(z)] = ["x", "y", "z"].map(column) else {
        let remedy = "the first line names columns x, y, z and perhaps point, the row of the commands from 0".into();
        return Err(table_error(file, None, "x", Problem::Missing { remedy }));
    };
    if x.is_empty() {
        let remedy = "the table has no rows: give at least one".into();
        return Err(table_error(file, None, "", Problem::Missing { remedy }));
    }
    let tip = |row: usize| {
        let point = column("point").map_or(row as f64, |point| point[row]);
        if point.fract() != 0.0 || !(0.0..command_count as f64).contains(&point) {
            let expected = format!("a row of the commands, 0 to {}", command_count.saturating_sub(1));
            return Err(table_error(
                file,
                None,
                "point",
                Problem::Range { value: format!("{point} in row {row}"), expected },
            ));
        }
        let position = [x[row], y[row], z[row]];
        if position.iter().any(|x| !x.is_finite()) {
            let problem =
                Problem::Range { value: format!("not finite in row {row}"), expected: "finite numbers".into() };
            return Err(table_error(file, None, "x", problem));
        }
        Ok(ObservedTip { command: point as usize, position })
    };
    (0..x.len()).map(tip).collect()
}
