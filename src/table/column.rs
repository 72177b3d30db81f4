//! One column of a table.

use super::Values;

/// Values under a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Such as `tip.position.x` or `d(tip.position.x)/d(coil.current.x)`.
    pub name: String,
    /// SI, such as `m` or `1/m`; empty for none.
    pub unit: String,
    /// One a row.
    pub values: Values,
}

impl Column {
    /// A column of any kind of values: `Column::new("time", "s", vec![0.0, 0.5])`.
    pub fn new(name: impl Into<String>, unit: &str, values: impl Into<Values>) -> Self {
        Self { name: name.into(), unit: unit.into(), values: values.into() }
    }

    /// Other values under the same name and unit.
    pub fn with_values(&self, values: Values) -> Self {
        Self { name: self.name.clone(), unit: self.unit.clone(), values }
    }
}
