//! Vectors in space.

use crate::model::Vector;
pub(super) use crate::model::vectors::{cross, dot, norm};
use std::f64::consts::TAU;

pub(super) fn plus(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] + b[k])
}

pub(super) fn minus(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] - b[k])
}

/// `a + by b`
pub(super) fn along(a: Vector, by: f64, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] + by * b[k])
}

pub(super) fn distance(a: Vector, b: Vector) -> f64 {
    norm(minus(a, b))
}

/// In this direction, so long; `v` is not zero.
pub(super) fn scaled(v: Vector, length: f64) -> Vector {
    let norm = norm(v);
    v.map(|x| length * x / norm)
}

/// Whether a vector has a direction.
pub(super) fn nonzero(v: Vector) -> bool {
    v.iter().all(|x| x.is_finite()) && norm(v) > 0.0
}

/// Two unit vectors across a third, upright where possible.
pub(super) fn across(axis: Vector) -> [Vector; 2] {
    let helper = if axis[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let side = cross(axis, helper);
    let side = scaled(side, 1.0);
    [side, cross(side, axis)]
}

/// So many points of a circle about a point, across an axis (m).
pub(super) fn circle(count: usize, centre: Vector, axis: Vector, radius: f64) -> Vec<Vector> {
    let [one, other] = across(axis);
    let at = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
        along(along(centre, radius * cos, one), radius * sin, other)
    };
    (0..count).map(at).collect()
}

/// Smallest and largest finite coordinates.
pub(super) fn bounds(points: impl IntoIterator<Item = Vector>) -> [[f64; 2]; 3] {
    points.into_iter().fold([[f64::INFINITY, f64::NEG_INFINITY]; 3], |bounds, point| {
        std::array::from_fn(|k| [bounds[k][0].min(point[k]), bounds[k][1].max(point[k])])
    })
}

/// The widest of three ranges.
pub(super) fn widest(limits: [[f64; 2]; 3]) -> f64 {
    limits.iter().map(|[low, high]| high - low).fold(0.0, f64::max)
}

/// The middle of three ranges.
pub(super) fn middle(limits: [[f64; 2]; 3]) -> Vector {
    limits.map(|[low, high]| 0.5 * (low + high))
}
