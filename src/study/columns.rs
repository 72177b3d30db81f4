//! A study's table, column by column.

use crate::model::Vector;
use crate::table::{Column, Table, Values};

/// Columns that are added one after the other, each as long as the first.
#[derive(Default)]
pub(super) struct Columns(Vec<Column>);

impl Columns {
    fn add(&mut self, name: impl Into<String>, unit: &str, values: Values) {
        self.0.push(Column::new(name, unit, values));
    }

    pub(super) fn counts(&mut self, name: impl Into<String>, values: impl IntoIterator<Item = u64>) {
        self.add(name, "", Values::Index(values.into_iter().collect()));
    }

    /// NaN stands for "none".
    pub(super) fn numbers(&mut self, name: impl Into<String>, unit: &str, values: impl IntoIterator<Item = f64>) {
        self.add(name, unit, Values::Double(values.into_iter().collect()));
    }

    /// Three columns `name.x`, `name.y`, `name.z`.
    pub(super) fn vectors(&mut self, name: &str, unit: &str, values: &[Vector]) {
        for (a, axis) in ["x", "y", "z"].iter().enumerate() {
            self.numbers(format!("{name}.{axis}"), unit, values.iter().map(|value| value[a]));
        }
    }

    pub(super) fn flags(&mut self, name: impl Into<String>, values: impl IntoIterator<Item = bool>) {
        self.add(name, "", Values::Flag(values.into_iter().map(Some).collect()));
    }

    pub(super) fn words(&mut self, name: impl Into<String>, values: impl IntoIterator<Item = String>) {
        self.add(name, "", Values::Text(values.into_iter().collect()));
    }

    pub(super) fn finish(self) -> Table {
        Table::new(self.0)
    }
}
