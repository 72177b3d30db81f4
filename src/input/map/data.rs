//! What a file of samples holds.

use super::grid::Lattice;

/// The name of a potential's column or array.
pub(super) const POTENTIAL: &str = "potential";

/// What bare numbers are worth: unit and factor to SI.
pub(super) struct Factors {
    pub length: Option<(String, f64)>,
    pub field: Option<(String, f64)>,
}

/// Numbers at the nodes of a grid, x the fastest.
pub(super) struct Samples {
    pub lattice: Lattice,
    /// NaN at nodes without a value.
    pub values: Values,
    /// How far each sample was taken from its node (m), where the file's grid is not quite even.
    pub strays: Option<[Vec<f64>; 3]>,
    /// Assumptions, for notes.
    pub notes: Vec<String>,
}

/// In T, or T·m.
pub(super) enum Values {
    FluxDensity([Vec<f64>; 3]),
    Potential(Vec<f64>),
}

impl Values {
    /// Each component.
    pub(super) fn all(&self) -> Vec<&Vec<f64>> {
        match self {
            Values::FluxDensity(b) => b.iter().collect(),
            Values::Potential(potential) => vec![potential],
        }
    }

    /// Whether each node lacks a value.
    pub(super) fn gaps(&self) -> Vec<bool> {
        let all = self.all();
        (0..all[0].len()).map(|node| all.iter().any(|values| values[node].is_nan())).collect()
    }
}

impl Factors {
    /// As they were given.
    pub(super) fn words(&self) -> [Option<String>; 2] {
        [&self.length, &self.field].map(|unit| unit.as_ref().map(|(word, _)| word.clone()))
    }

    pub(super) fn length(&self) -> f64 {
        self.length.as_ref().map_or(1.0, |(_, factor)| *factor)
    }

    pub(super) fn field(&self) -> f64 {
        self.field.as_ref().map_or(1.0, |(_, factor)| *factor)
    }

    /// Of a column by its name.
    pub(super) fn of(&self, name: &str) -> f64 {
        match name {
            "x" | "y" | "z" => self.length(),
            POTENTIAL => self.length() * self.field(),
            _ => self.field(),
        }
    }
}
