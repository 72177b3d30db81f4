//! How targets are looked for.

use crate::model::Vector;
use crate::spec::{Redundancy, Trajectory};

/// How a controller looks for the inputs of one target.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ControlOptions {
    /// Which of x, y and z of the tip are controlled; the others are free.
    pub coordinates: [bool; 3],
    /// A unit vector along which the tip is free, world frame: each target stands for a line, such as that below a pixel
    /// of a picture. `None` for none.
    pub free_direction: Option<Vector>,
    /// Length by which a tangent's error counts (m).
    pub tangent_weight: f64,
    /// A target is reached where so much is left of it (m).
    pub tolerance: f64,
    /// Equilibria for one target, at most.
    pub most_iterations: usize,
    /// What becomes of inputs that the tip does not need.
    pub redundancy: Redundancy,
}

impl Default for ControlOptions {
    fn default() -> Self {
        Self {
            coordinates: [true; 3],
            free_direction: None,
            tangent_weight: 0.01,
            tolerance: 1e-8,
            most_iterations: 200,
            redundancy: Redundancy::LeastChange,
        }
    }
}

impl ControlOptions {
    /// Those of a trajectory, the others by default.
    pub fn of(trajectory: &Trajectory) -> ControlOptions {
        let default = ControlOptions::default();
        ControlOptions {
            coordinates: trajectory.coordinates,
            free_direction: default.free_direction,
            tangent_weight: trajectory.tangent_weight.unwrap_or(default.tangent_weight),
            tolerance: trajectory.tolerance.unwrap_or(default.tolerance),
            most_iterations: trajectory.most_iterations.unwrap_or(default.most_iterations),
            redundancy: trajectory.redundancy.unwrap_or_default(),
        }
    }

    /// With other controlled coordinates.
    pub fn with_coordinates(self, coordinates: [bool; 3]) -> ControlOptions {
        ControlOptions { coordinates, ..self }
    }

    /// With a direction, a unit vector, along which the tip is free.
    pub fn with_free_direction(self, free_direction: Option<Vector>) -> ControlOptions {
        ControlOptions { free_direction, ..self }
    }

    /// What of a vector is controlled: coordinates, without the free direction.
    pub(super) fn controlled(&self, vector: Vector) -> Vector {
        let of_coordinates: Vector = std::array::from_fn(|a| if self.coordinates[a] { vector[a] } else { 0.0 });
        match self.free_direction {
            None => of_coordinates,
            Some(free) => {
                let along: f64 = of_coordinates.iter().zip(free).map(|(x, d)| x * d).sum();
                std::array::from_fn(|a| of_coordinates[a] - along * free[a])
            }
        }
    }

    /// With another weight of the tangent (m).
    pub fn with_tangent_weight(self, tangent_weight: f64) -> ControlOptions {
        ControlOptions { tangent_weight, ..self }
    }

    /// With another tolerance (m).
    pub fn with_tolerance(self, tolerance: f64) -> ControlOptions {
        ControlOptions { tolerance, ..self }
    }

    /// With another limit of equilibria for one target.
    pub fn with_most_iterations(self, most_iterations: usize) -> ControlOptions {
        ControlOptions { most_iterations, ..self }
    }

    /// With another use of inputs that the tip does not need.
    pub fn with_redundancy(self, redundancy: Redundancy) -> ControlOptions {
        ControlOptions { redundancy, ..self }
    }
}

/// Where the searches for many targets begin.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TargetOptions {
    /// Inputs whose tips are tabled.
    pub table: usize,
    /// Starts that are tried for one target.
    pub attempts: usize,
    /// Starts, farther apart, that are tried besides where little is missing.
    pub further: usize,
}

impl Default for TargetOptions {
    fn default() -> Self {
        Self { table: 2048, attempts: 3, further: 6 }
    }
}

impl TargetOptions {
    /// With a table of another size.
    pub fn with_table(self, table: usize) -> TargetOptions {
        TargetOptions { table, ..self }
    }

    /// With another number of starts for one target.
    pub fn with_attempts(self, attempts: usize) -> TargetOptions {
        TargetOptions { attempts, ..self }
    }

    /// With another number of starts, farther apart, where little is missing.
    pub fn with_further(self, further: usize) -> TargetOptions {
        TargetOptions { further, ..self }
    }
}
