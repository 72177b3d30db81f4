//! Observations of a rod: points along it, tips, and normal forces on a wall.

use crate::model::{Parameter, Vector};

/// A point of a rod that was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservedPoint {
    /// Arc length from the base (m); `None` for the tip.
    pub arc_length: Option<f64>,
    /// World frame (m).
    pub position: Vector,
}

/// Points of one equilibrium.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObservedShape {
    /// Values of [`ObservedShapes::known`], in its order, SI.
    pub known: Vec<f64>,
    /// In any order.
    pub points: Vec<ObservedPoint>,
    /// Measured forces of the scene's wall on the tip, along the wall's normal (N).
    pub normal_forces: Vec<f64>,
}

/// Shapes, and what is known to differ from one to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObservedShapes {
    /// Parameters whose values are known for each shape.
    pub known: Vec<Parameter>,
    /// One an equilibrium.
    pub shapes: Vec<ObservedShape>,
}

impl ObservedShapes {
    /// Observed coordinates: three for each point of each shape.
    pub fn coordinate_count(&self) -> usize {
        3 * self.shapes.iter().map(|shape| shape.points.len()).sum::<usize>()
    }

    /// Measured forces of all shapes.
    pub fn force_count(&self) -> usize {
        self.shapes.iter().map(|shape| shape.normal_forces.len()).sum()
    }
}

/// A tip that was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservedTip {
    /// Row of the command that it belongs to, from 0.
    pub command: usize,
    /// World frame (m).
    pub position: Vector,
}
