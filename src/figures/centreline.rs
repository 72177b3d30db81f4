//! Points along a rod at a known equilibrium, integrated by the reference.

use crate::model::{Scene, Vector};
use crate::reference::shape_with_derivatives;
use crate::results::{Contact, pressed};

/// Points along a centreline.
const POINTS: usize = 81;

/// Evenly from base to tip (m); `None` where the rod cannot be integrated.
pub(crate) fn centreline(scene: &Scene, base_moment: Vector, contact: Option<&Contact>) -> Option<Vec<Vector>> {
    let length = scene.rod().total_length();
    let at: Vec<f64> = (0..POINTS).map(|k| length * k as f64 / (POINTS - 1) as f64).collect();
    positions(scene, base_moment, contact, &at)
}

/// At arc lengths (m).
pub(crate) fn positions(
    scene: &Scene,
    base_moment: Vector,
    contact: Option<&Contact>,
    at: &[f64],
) -> Option<Vec<Vector>> {
    let poses = shape_with_derivatives(&pressed(scene.rod(), scene, contact), base_moment, at, &[])?;
    Some(poses.into_iter().map(|pose| pose.position).collect())
}
