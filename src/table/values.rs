//! Values of one column.

use crate::model::Status;

/// Values of one kind.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Values {
    /// Counts and indices; every row has one.
    Index(Vec<u64>),
    /// Numbers; NaN stands for "none".
    Double(Vec<f64>),
    /// Numbers in single precision; NaN stands for "none".
    Single(Vec<f32>),
    /// What became of each sample, written as a word.
    Status(Vec<Status>),
    /// Yes, no, or unknown.
    Flag(Vec<Option<bool>>),
    /// Names and other words.
    Text(Vec<String>),
}

/// The same for the vector of any kind.
macro_rules! of_any_kind {
    ($values:expr, $vector:ident => $what:expr) => {
        match $values {
            Values::Index($vector) => $what,
            Values::Double($vector) => $what,
            Values::Single($vector) => $what,
            Values::Status($vector) => $what,
            Values::Flag($vector) => $what,
            Values::Text($vector) => $what,
        }
    };
}

/// The same for two vectors of the same kind, something else for two kinds.
macro_rules! of_the_same_kind {
    ($one:expr, $two:expr, ($to:ident, $from:ident) => $what:expr, $otherwise:pat => $else:expr) => {
        match ($one, $two) {
            (Values::Index($to), Values::Index($from)) => $what,
            (Values::Double($to), Values::Double($from)) => $what,
            (Values::Single($to), Values::Single($from)) => $what,
            (Values::Status($to), Values::Status($from)) => $what,
            (Values::Flag($to), Values::Flag($from)) => $what,
            (Values::Text($to), Values::Text($from)) => $what,
            $otherwise => $else,
        }
    };
}

impl Values {
    /// Number of rows.
    pub fn len(&self) -> usize {
        of_any_kind!(self, values => values.len())
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Name of the kind: `u64`, `f64`, `f32`, `bool`, or `string` for words.
    pub fn kind(&self) -> &'static str {
        match self {
            Values::Index(_) => "u64",
            Values::Double(_) => "f64",
            Values::Single(_) => "f32",
            Values::Status(_) | Values::Text(_) => "string",
            Values::Flag(_) => "bool",
        }
    }

    /// Whether a row may have no value.
    pub fn is_nullable(&self) -> bool {
        matches!(self, Values::Double(_) | Values::Single(_) | Values::Flag(_))
    }

    /// As a number: NaN for none and for text, 1 and 0 for flags, the code for a status.
    pub fn number(&self, row: usize) -> f64 {
        match self {
            Values::Index(values) => values[row] as f64,
            Values::Double(values) => values[row],
            Values::Single(values) => f64::from(values[row]),
            Values::Status(values) => f64::from(values[row].code()),
            Values::Flag(values) => values[row].map_or(f64::NAN, f64::from),
            Values::Text(_) => f64::NAN,
        }
    }

    /// All rows as [numbers](Values::number).
    pub fn numbers(&self) -> Vec<f64> {
        match self {
            Values::Double(values) => values.clone(),
            values => (0..values.len()).map(|row| values.number(row)).collect(),
        }
    }

    /// The same kind, no rows.
    pub fn empty(&self) -> Values {
        match self {
            Values::Index(_) => Values::Index(Vec::new()),
            Values::Double(_) => Values::Double(Vec::new()),
            Values::Single(_) => Values::Single(Vec::new()),
            Values::Status(_) => Values::Status(Vec::new()),
            Values::Flag(_) => Values::Flag(Vec::new()),
            Values::Text(_) => Values::Text(Vec::new()),
        }
    }

    /// Adds all rows of another column. Those of another kind are taken over as numbers.
    pub fn append(&mut self, other: &Values) {
        of_the_same_kind!(self, other, (to, from) => to.extend_from_slice(from), (to, from) => {
            (0..from.len()).for_each(|row| to.push_number(from.number(row)));
        });
    }

    /// Adds some rows of another column. Those of another kind are taken over as numbers.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn append_rows(&mut self, other: &Values, rows: &[usize]) {
        of_the_same_kind!(self, other, (to, from) => push_rows(to, from, rows), (to, from) => {
            rows.iter().for_each(|row| to.push_number(from.number(*row)));
        });
    }

    /// Room for more rows.
    pub fn reserve(&mut self, rows: usize) {
        of_any_kind!(self, values => values.reserve(rows));
    }

    /// Forgets the rows and keeps their memory.
    pub fn clear(&mut self) {
        of_any_kind!(self, values => values.clear());
    }

    fn push_number(&mut self, number: f64) {
        match self {
            Values::Index(values) => values.push(number as u64),
            Values::Double(values) => values.push(number),
            Values::Single(values) => values.push(number as f32),
            Values::Status(values) => values.push(Status::from_code(number as u8).unwrap_or_default()),
            Values::Flag(values) => values.push((!number.is_nan()).then_some(number != 0.0)),
            Values::Text(values) => values.push(if number.is_nan() { String::new() } else { format!("{number:?}") }),
        }
    }
}

fn push_rows<T: Clone>(to: &mut Vec<T>, from: &[T], rows: &[usize]) {
    to.extend(rows.iter().map(|row| from[*row].clone()));
}

impl From<Vec<u64>> for Values {
    fn from(values: Vec<u64>) -> Self {
        Values::Index(values)
    }
}

impl From<Vec<f64>> for Values {
    fn from(values: Vec<f64>) -> Self {
        Values::Double(values)
    }
}

impl From<Vec<f32>> for Values {
    fn from(values: Vec<f32>) -> Self {
        Values::Single(values)
    }
}

impl From<Vec<Status>> for Values {
    fn from(values: Vec<Status>) -> Self {
        Values::Status(values)
    }
}

impl From<Vec<Option<bool>>> for Values {
    fn from(values: Vec<Option<bool>>) -> Self {
        Values::Flag(values)
    }
}

impl From<Vec<bool>> for Values {
    fn from(values: Vec<bool>) -> Self {
        Values::Flag(values.into_iter().map(Some).collect())
    }
}

impl From<Vec<String>> for Values {
    fn from(values: Vec<String>) -> Self {
        Values::Text(values)
    }
}
