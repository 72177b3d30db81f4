//! Tables: named columns of one kind each, and the formats they are kept in.
//!
//! Knows the model and nothing of sweeps. Only this room names the crates of Parquet, flatbuffers and zip.

mod arrow_schema;
mod column;
pub mod csv;
mod error;
mod lattice;
pub mod mat;
pub mod npy;
pub mod npz;
pub mod parquet;
pub mod ply;
mod triangles;
mod values;
pub mod vtk;

pub use column::Column;
pub use error::TableError;
pub use lattice::Lattice;
pub use triangles::Triangles;
pub use values::Values;

use crate::model::Status;

/// Columns of equal length; row k of every column belongs to the same sample, point or cell.
///
/// ```
/// use rodsweep::table::{Column, Table};
///
/// let table = Table::new(vec![
///     Column::new("sample", "", vec![0_u64, 1]),
///     Column::new("tip.position.x", "m", vec![0.1, f64::NAN]),
/// ]);
/// assert_eq!(table.row_count(), 2);
/// assert_eq!(table.column("tip.position.x").unwrap().unit, "m");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// In the order of a file's columns.
    pub columns: Vec<Column>,
}

impl Table {
    /// A table of these columns.
    ///
    /// # Panics
    /// If they differ in length.
    pub fn new(columns: Vec<Column>) -> Self {
        let table = Self { columns };
        let rows = table.row_count();
        assert!(
            table.columns.iter().all(|column| column.values.len() == rows),
            "columns of one table differ in length"
        );
        table
    }

    /// Rows of each column; 0 without columns.
    pub fn row_count(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// One column as numbers; see [`Values::number`].
    pub fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        self.column(name).map(|column| column.values.numbers())
    }

    /// Three columns `name.x`, `name.y`, `name.z`.
    pub fn vector_columns(&self, name: &str) -> Option<[&Values; 3]> {
        let of = |axis: &str| self.column(&format!("{name}.{axis}")).map(|column| &column.values);
        Some([of("x")?, of("y")?, of("z")?])
    }

    /// The column `sample`; empty where there is none.
    pub fn samples(&self) -> &[u64] {
        match self.column("sample").map(|column| &column.values) {
            Some(Values::Index(samples)) => samples,
            _ => &[],
        }
    }

    /// Distinct samples; rows of one stand together.
    pub fn sample_count(&self) -> u64 {
        let samples = self.samples();
        samples.len().min(1) as u64 + samples.windows(2).filter(|pair| pair[0] != pair[1]).count() as u64
    }

    /// The first column of statuses; empty where there is none.
    pub fn statuses(&self) -> &[Status] {
        let statuses = self.columns.iter().find_map(|column| match &column.values {
            Values::Status(statuses) => Some(statuses.as_slice()),
            _ => None,
        });
        statuses.unwrap_or_default()
    }

    /// The same columns without rows.
    pub fn empty(&self) -> Table {
        self.map(Values::empty)
    }

    /// These rows, in this order.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn select(&self, rows: &[usize]) -> Table {
        self.map(|values| {
            let mut selected = values.empty();
            selected.append_rows(values, rows);
            selected
        })
    }

    /// Adds the rows of a table of the same columns; a table without columns takes those of the other.
    pub fn append(&mut self, other: &Table) {
        if self.columns.is_empty() {
            *self = other.clone();
            return;
        }
        for (to, from) in self.columns.iter_mut().zip(&other.columns) {
            to.values.append(&from.values);
        }
    }

    /// Room for more rows.
    pub fn reserve(&mut self, rows: usize) {
        self.columns.iter_mut().for_each(|column| column.values.reserve(rows));
    }

    /// Forgets the rows and keeps their memory.
    pub fn clear(&mut self) {
        self.columns.iter_mut().for_each(|column| column.values.clear());
    }

    fn map(&self, of: impl Fn(&Values) -> Values) -> Table {
        Table { columns: self.columns.iter().map(|column| column.with_values(of(&column.values))).collect() }
    }
}
