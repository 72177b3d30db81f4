//! Tables of studies: the one place that names what they are made of and how they are written.

use crate::model::Vector;
use crate::results::ResultsError;
use crate::table::{PlainColumn, PlainValues, write_plain};
use std::path::Path;

/// A study's table.
pub(crate) type Table = Vec<PlainColumn>;

/// Columns that are added one after the other, each as long as the first.
#[derive(Default)]
pub(super) struct Columns(Table);

impl Columns {
    fn add(&mut self, name: impl Into<String>, unit: &str, values: PlainValues) {
        self.0.push(PlainColumn::new(name, unit, values));
    }

    pub(crate) fn counts(&mut self, name: impl Into<String>, values: impl IntoIterator<Item = u64>) {
        self.add(name, "", PlainValues::Count(values.into_iter().collect()));
    }

    /// NaN stands for "none".
    pub(crate) fn numbers(&mut self, name: impl Into<String>, unit: &str, values: impl IntoIterator<Item = f64>) {
        self.add(name, unit, PlainValues::Number(values.into_iter().collect()));
    }

    /// Three columns `name.x`, `name.y`, `name.z`.
    pub(crate) fn vectors(&mut self, name: &str, unit: &str, values: &[Vector]) {
        for (a, axis) in ["x", "y", "z"].iter().enumerate() {
            self.numbers(format!("{name}.{axis}"), unit, values.iter().map(|value| value[a]));
        }
    }

    pub(crate) fn flags(&mut self, name: impl Into<String>, values: impl IntoIterator<Item = bool>) {
        self.add(name, "", PlainValues::Flag(values.into_iter().collect()));
    }

    pub(crate) fn words(&mut self, name: impl Into<String>, values: impl IntoIterator<Item = String>) {
        self.add(name, "", PlainValues::Word(values.into_iter().collect()));
    }

    pub(crate) fn finish(self) -> Table {
        self.0
    }
}

/// Writes a table; CSV unless the name ends in `.parquet`. What is there is replaced.
pub(super) fn write(table: &Table, path: &Path, metadata: &[(&str, String)]) -> Result<(), ResultsError> {
    write_plain(path, table, metadata)
}
