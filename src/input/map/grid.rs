//! The grid that points lie on, if they do.

use super::{MOST_NODES, wrong};
use crate::input::InputError;
use crate::model::{LEAST_MAP_NODES, Vector};
use std::path::Path;

/// Coordinates may miss their nodes by this share of a step.
const ROUNDING: f64 = 1e-3;
/// Coordinates that differ by less than this share of the grid are one.
const SAME: f64 = 1e-6;
const AXES: [&str; 3] = ["x", "y", "z"];

/// Nodes in equal steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    pub origin: Vector,
    pub steps: Vector,
    pub counts: [usize; 3],
}

/// First coordinate, step and number of coordinates in rising order.
fn even(path: &Path, axis: usize, places: &[f64]) -> Result<(f64, f64, usize), InputError> {
    let name = AXES[axis];
    let count = places.len();
    if count < LEAST_MAP_NODES {
        let words = format!("the grid has {count} places along {name}: give at least {LEAST_MAP_NODES}");
        return Err(wrong(path, None, name, words));
    }
    let (first, last) = (places[0], places[count - 1]);
    let step = (last - first) / (count - 1) as f64;
    let strays = |(k, x): (usize, &f64)| (x - first - k as f64 * step).abs() > ROUNDING * step;
    let rises = step > 0.0;
    if !rises || places.iter().enumerate().any(strays) {
        let steps = places.windows(2).map(|pair| pair[1] - pair[0]);
        let (least, most) = steps.fold((f64::INFINITY, 0.0_f64), |(low, high), h| (low.min(h), high.max(h)));
        let words = format!(
            "the grid is irregular: steps along {name} go from {least} to {most} m; sample the field again in equal, rising steps"
        );
        return Err(wrong(path, None, name, words));
    }
    Ok((first, step, count))
}

/// Of the coordinates along each axis.
pub(super) fn of_axes(path: &Path, axes: [&[f64]; 3]) -> Result<Lattice, InputError> {
    let [x, y, z] = [0, 1, 2].map(|axis| even(path, axis, axes[axis]));
    let (x, y, z) = (x?, y?, z?);
    let counts = [x.2, y.2, z.2];
    let nodes = counts.iter().try_fold(1_usize, |product, n| product.checked_mul(*n));
    if nodes.is_none_or(|nodes| nodes > MOST_NODES) {
        let [x, y, z] = counts;
        let words = format!("the grid has {x} x {y} x {z} nodes: at most {MOST_NODES} are read; take fewer");
        return Err(wrong(path, None, "", words));
    }
    Ok(Lattice { origin: [x.0, y.0, z.0], steps: [x.1, y.1, z.1], counts })
}

/// The grid of points in any order, and the node of each, x the fastest.
pub(super) fn of_points(path: &Path, points: [&[f64]; 3]) -> Result<(Lattice, Vec<usize>), InputError> {
    let places = points.map(|coordinates| {
        let mut sorted = coordinates.to_vec();
        sorted.sort_by(f64::total_cmp);
        let width = sorted.last().unwrap_or(&0.0) - sorted.first().unwrap_or(&0.0);
        sorted.dedup_by(|b, a| *b - *a <= SAME * width);
        sorted
    });
    let lattice = of_axes(path, [&places[0], &places[1], &places[2]])?;
    let [nx, ny, nz] = lattice.counts;
    let rows = points[0].len();
    if rows != nx * ny * nz {
        let words =
            format!("the grid is irregular: {rows} points do not fill its {nx} x {ny} x {nz} nodes; give each once");
        return Err(wrong(path, None, "", words));
    }
    let mut is_taken = vec![false; rows];
    let mut nodes = Vec::with_capacity(rows);
    let [x, y, z] = points;
    for (row, ((x, y), z)) in x.iter().zip(y).zip(z).enumerate() {
        let place = |x: f64, axis: usize| ((x - lattice.origin[axis]) / lattice.steps[axis]).round() as usize;
        let node = (place(*z, 2) * ny + place(*y, 1)) * nx + place(*x, 0);
        if std::mem::replace(&mut is_taken[node], true) {
            let words = format!("the point ({x}, {y}, {z}) m is given twice, in row {} again: give each once", row + 1);
            return Err(wrong(path, None, "", words));
        }
        nodes.push(node);
    }
    Ok((lattice, nodes))
}
