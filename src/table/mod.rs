//! Tables of results: named columns of one kind each.

pub(crate) mod csv;
pub(crate) mod npz;
pub(crate) mod parquet;
pub(crate) mod plain;

pub use plain::{PlainColumn, PlainValues, write_plain};

use crate::model::Status;

/// Values of one column; NaN stands for "none".
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    Index(Vec<u64>),
    Double(Vec<f64>),
    Single(Vec<f32>),
    Status(Vec<Status>),
    Flag(Vec<Option<bool>>),
}

#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    pub name: String,
    /// SI; empty for none.
    pub unit: String,
    pub values: Values,
}

/// Columns of equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    pub columns: Vec<Column>,
}

impl Values {
    pub fn len(&self) -> usize {
        match self {
            Values::Index(values) => values.len(),
            Values::Double(values) => values.len(),
            Values::Single(values) => values.len(),
            Values::Status(values) => values.len(),
            Values::Flag(values) => values.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// As a number: NaN for none, 1 and 0 for flags, the code for a status.
    pub fn number(&self, row: usize) -> f64 {
        match self {
            Values::Index(values) => values[row] as f64,
            Values::Double(values) => values[row],
            Values::Single(values) => f64::from(values[row]),
            Values::Status(values) => f64::from(values[row].code()),
            Values::Flag(values) => values[row].map_or(f64::NAN, f64::from),
        }
    }

    fn push(&mut self, value: f64) {
        match self {
            Values::Index(values) => values.push(value as u64),
            Values::Double(values) => values.push(value),
            Values::Single(values) => values.push(value as f32),
            Values::Status(values) => values.push(Status::from_code(value as u8).unwrap_or_default()),
            Values::Flag(values) => values.push((!value.is_nan()).then_some(value != 0.0)),
        }
    }

    /// Same kind, no rows.
    fn empty(&self) -> Values {
        match self {
            Values::Index(_) => Values::Index(Vec::new()),
            Values::Double(_) => Values::Double(Vec::new()),
            Values::Single(_) => Values::Single(Vec::new()),
            Values::Status(_) => Values::Status(Vec::new()),
            Values::Flag(_) => Values::Flag(Vec::new()),
        }
    }

    /// Adds some rows of another column.
    pub(crate) fn append_rows(&mut self, from: &Values, rows: &[usize]) {
        match (self, from) {
            (Values::Index(to), Values::Index(from)) => to.extend(rows.iter().map(|row| from[*row])),
            (Values::Double(to), Values::Double(from)) => to.extend(rows.iter().map(|row| from[*row])),
            (Values::Single(to), Values::Single(from)) => to.extend(rows.iter().map(|row| from[*row])),
            (Values::Status(to), Values::Status(from)) => to.extend(rows.iter().map(|row| from[*row])),
            (Values::Flag(to), Values::Flag(from)) => to.extend(rows.iter().map(|row| from[*row])),
            (to, from) => rows.iter().for_each(|row| to.push(from.number(*row))),
        }
    }

    /// Room for more rows.
    fn reserve(&mut self, rows: usize) {
        match self {
            Values::Index(values) => values.reserve(rows),
            Values::Double(values) => values.reserve(rows),
            Values::Single(values) => values.reserve(rows),
            Values::Status(values) => values.reserve(rows),
            Values::Flag(values) => values.reserve(rows),
        }
    }

    fn clear(&mut self) {
        match self {
            Values::Index(values) => values.clear(),
            Values::Double(values) => values.clear(),
            Values::Single(values) => values.clear(),
            Values::Status(values) => values.clear(),
            Values::Flag(values) => values.clear(),
        }
    }

    fn append(&mut self, other: &Values) {
        match (self, other) {
            (Values::Index(to), Values::Index(from)) => to.extend(from),
            (Values::Double(to), Values::Double(from)) => to.extend(from),
            (Values::Single(to), Values::Single(from)) => to.extend(from),
            (Values::Status(to), Values::Status(from)) => to.extend(from),
            (Values::Flag(to), Values::Flag(from)) => to.extend(from),
            (to, from) => (0..from.len()).for_each(|row| to.push(from.number(row))),
        }
    }
}

impl Table {
    pub fn row_count(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// One column as numbers, NaN for none.
    pub fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        let values = &self.column(name)?.values;
        Some((0..values.len()).map(|row| values.number(row)).collect())
    }

    pub fn samples(&self) -> &[u64] {
        match self.columns.iter().find_map(|column| match &column.values {
            Values::Index(values) if column.name == "sample" => Some(values),
            _ => None,
        }) {
            Some(values) => values,
            None => &[],
        }
    }

    /// Distinct samples; rows of one stand together.
    pub fn sample_count(&self) -> u64 {
        let samples = self.samples();
        samples.len().min(1) as u64 + samples.windows(2).filter(|pair| pair[0] != pair[1]).count() as u64
    }

    pub fn statuses(&self) -> &[Status] {
        match self.columns.iter().find_map(|column| match &column.values {
            Values::Status(values) => Some(values),
            _ => None,
        }) {
            Some(values) => values,
            None => &[],
        }
    }

    /// Three columns `name.x`, `name.y`, `name.z`.
    pub fn vector_columns(&self, name: &str) -> Option<[&Values; 3]> {
        let of = |axis: &str| self.column(&format!("{name}.{axis}")).map(|column| &column.values);
        Some([of("x")?, of("y")?, of("z")?])
    }

    /// The same columns without rows.
    pub fn empty(&self) -> Table {
        let empty = |column: &Column| Column {
            name: column.name.clone(),
            unit: column.unit.clone(),
            values: column.values.empty(),
        };
        Table { columns: self.columns.iter().map(empty).collect() }
    }

    /// Room for more rows.
    pub(crate) fn reserve(&mut self, rows: usize) {
        self.columns.iter_mut().for_each(|column| column.values.reserve(rows));
    }

    /// Forgets the rows and keeps their memory.
    pub(crate) fn clear(&mut self) {
        self.columns.iter_mut().for_each(|column| column.values.clear());
    }

    /// Adds the rows of a table of the same columns.
    pub fn append(&mut self, other: &Table) {
        if self.columns.is_empty() {
            *self = other.clone();
            return;
        }
        for (to, from) in self.columns.iter_mut().zip(&other.columns) {
            to.values.append(&from.values);
        }
    }
}
