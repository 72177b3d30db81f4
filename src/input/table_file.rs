//! Samples given as a table: text or Parquet whose columns are parameter names.

use super::error::{InputError, Problem, table_error};
use super::number_table::{is_parquet, read_parquet};
use super::text_table::{Head, TextTable, is_gap, read_table_text};
use super::units::Dimension;
use crate::model::{Parameter, ParameterNames, Scene, short_list, short_name};
use crate::spec::{InputTable, grouped};
use std::collections::HashSet;
use std::path::Path;

/// How a reader treats missing values and columns that are no parameters.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Habits {
    /// The table belongs to a sweep: a missing value is NaN, so that its row has no rod, and a note counts such rows.
    pub of_sweep: bool,
    /// Columns that are no parameters are passed over, and a note names them.
    pub ignores_others: bool,
}

/// Reads a table of values by parameter; a column `sample`, or one without a name, is ignored.
///
/// # Errors
///
/// A file that cannot be read, a column that is no parameter, a value that is no finite number, no rows.
pub fn read_input_table(file: &Path, scene: &Scene) -> Result<InputTable, InputError> {
    read_with(file, scene, Habits::default(), &mut Vec::new())
}

/// Reads a table of values by parameter from a file, with its `habits`.
pub(super) fn read_with(
    file: &Path,
    scene: &Scene,
    habits: Habits,
    notes: &mut Vec<String>,
) -> Result<InputTable, InputError> {
    let reading = Reading { file, scene, habits };
    let table = match is_parquet(file) {
        true => reading.parquet(notes)?,
        false => reading.text(&read_table_text(file)?, notes)?,
    };
    with_rows(file, table)
}

/// Parses a table of values by parameter from the text of a file, with its `habits`.
pub(super) fn parse_with(
    file: &Path,
    text: &str,
    scene: &Scene,
    habits: Habits,
    notes: &mut Vec<String>,
) -> Result<InputTable, InputError> {
    with_rows(file, Reading { file, scene, habits }.text(text, notes)?)
}

fn with_rows(file: &Path, table: InputTable) -> Result<InputTable, InputError> {
    if table.row_count() == 0 {
        return Err(table_error(
            file,
            None,
            "",
            Problem::Missing { remedy: "the table has no rows: give at least one".into() },
        ));
    }
    Ok(table)
}

/// A table that is being read.
struct Reading<'a> {
    file: &'a Path,
    scene: &'a Scene,
    habits: Habits,
}

impl Reading<'_> {
    /// The parameter of each column; `None` for those that are ignored.
    fn columns(
        &self,
        line: Option<usize>,
        names: &[&str],
        notes: &mut Vec<String>,
    ) -> Result<Vec<Option<Parameter>>, InputError> {
        let file = self.file;
        let known = ParameterNames::of(self.scene);
        let mut columns: Vec<Option<Parameter>> = Vec::new();
        let (mut seen, mut ignored) = (HashSet::new(), Vec::new());
        for name in names {
            if Head::is_index(name) {
                columns.push(None);
                continue;
            }
            if self.habits.ignores_others && known.find(name).is_none() {
                ignored.push(*name);
                columns.push(None);
                continue;
            }
            let parameters = known.parse(name).map_err(|problem| {
                let problem = match self.habits.of_sweep {
                    true => Problem::Column(problem),
                    false => Problem::Parameter(problem),
                };
                table_error(file, line, name, problem)
            })?;
            if parameters.len() > 1 {
                let expected = format!("one component, such as {name}.x");
                let value = format!("a group of {}", parameters.len());
                return Err(table_error(file, line, name, Problem::Range { value, expected }));
            }
            if !seen.insert(parameters[0]) {
                let problem = Problem::Conflict { with: (*name).into(), remedy: "drop one of the two columns".into() };
                return Err(table_error(file, line, name, problem));
            }
            columns.push(Some(parameters[0]));
        }
        if columns.iter().all(Option::is_none) {
            let remedy = "the first line must name parameters, such as coil.current.x".into();
            return Err(table_error(file, line, "", Problem::Missing { remedy }));
        }
        if !ignored.is_empty() {
            let names = short_list(ignored.iter().map(|name| format!("`{}`", short_name(name))));
            notes.push(format!("columns of {} that are ignored: {names}", file.display()));
        }
        Ok(columns)
    }

    fn text(&self, text: &str, notes: &mut Vec<String>) -> Result<InputTable, InputError> {
        let Some(table) = TextTable::new(self.file, text, "coil.current.x")? else {
            let remedy = "the first line must name parameters, such as coil.current.x".into();
            return Err(table_error(self.file, None, "", Problem::Missing { remedy }));
        };
        let names: Vec<&str> = table.heads.iter().map(|head| head.name).collect();
        let columns = self.columns(Some(table.line), &names, notes)?;
        let mut values = Vec::new();
        for row in table.rows(self.file) {
            let (line, cells) = row?;
            for ((cell, head), parameter) in cells.into_iter().zip(&table.heads).zip(&columns) {
                let Some(parameter) = parameter else { continue };
                if self.habits.of_sweep && is_gap(cell) {
                    values.push(f64::NAN);
                    continue;
                }
                let value = table.quantity(head, cell, Dimension::of(parameter.unit()));
                let wrong = |problem| table_error(self.file, Some(line), head.name, Problem::Quantity(problem));
                values.push(value.map_err(wrong)?);
            }
        }
        Ok(self.table(columns, values, notes))
    }

    fn parquet(&self, notes: &mut Vec<String>) -> Result<InputTable, InputError> {
        let named = read_parquet(self.file)?;
        let names: Vec<&str> = named.iter().map(|(name, _)| name.as_str()).collect();
        let columns = self.columns(None, &names, notes)?;
        let used: Vec<&(String, Vec<f64>)> =
            named.iter().zip(&columns).filter(|(_, column)| column.is_some()).map(|(named, _)| named).collect();
        let mut values = Vec::with_capacity(used[0].1.len() * used.len());
        for row in 0..used[0].1.len() {
            for (name, column) in &used {
                if !(column[row].is_finite() || self.habits.of_sweep && column[row].is_nan()) {
                    let problem = Problem::Range {
                        value: format!("{} in row {row}", column[row]),
                        expected: "a finite number".into(),
                    };
                    return Err(table_error(self.file, None, name, problem));
                }
                values.push(column[row]);
            }
        }
        Ok(self.table(columns, values, notes))
    }

    fn table(&self, columns: Vec<Option<Parameter>>, values: Vec<f64>, notes: &mut Vec<String>) -> InputTable {
        let table = InputTable::new(columns.into_iter().flatten().collect(), values);
        let gaps = (0..table.row_count()).filter(|row| table.row(*row).iter().any(|value| value.is_nan())).count();
        if gaps > 0 {
            let (gaps, all) = (grouped(gaps as u64), grouped(table.row_count() as u64));
            notes.push(format!("{gaps} of {all} rows of {} lack a value: they have no rod", self.file.display()));
        }
        table
    }
}
