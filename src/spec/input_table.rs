//! Samples given as a table of values by parameter.

use crate::model::{Parameter, Scene};

/// Values by row, one column a parameter, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct InputTable {
    parameters: Vec<Parameter>,
    values: Vec<f64>,
}

impl InputTable {
    /// Rows one after the other, `parameters.len()` values each, SI.
    pub fn new(parameters: Vec<Parameter>, values: Vec<f64>) -> InputTable {
        InputTable { parameters, values }
    }

    /// What each column is of.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Number of rows.
    pub fn row_count(&self) -> usize {
        self.values.len() / self.parameters.len().max(1)
    }

    /// The values of a row, SI, one a parameter.
    ///
    /// # Panics
    ///
    /// There is no such row.
    pub fn row(&self, index: usize) -> &[f64] {
        let width = self.parameters.len();
        &self.values[index * width..(index + 1) * width]
    }

    /// As CSV that reads back identically.
    pub fn to_csv(&self, scene: &Scene) -> String {
        let names: Vec<String> = self.parameters.iter().map(|parameter| parameter.name(scene)).collect();
        let mut text = names.join(",") + "\n";
        for row in 0..self.row_count() {
            let cells: Vec<String> = self.row(row).iter().map(|value| format!("{value:?}")).collect();
            text += &(cells.join(",") + "\n");
        }
        text
    }
}
