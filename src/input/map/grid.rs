//! The grid that points lie on, if they do.

use super::{MOST_NODES, wrong};
use crate::input::InputError;
use crate::input::units::LARGEST;
use crate::model::{LEAST_MAP_NODES, Vector, short_number};
use std::path::Path;

/// Coordinates may miss their nodes by this share of a step.
const ROUNDING: f64 = 1e-3;
/// Coordinates that differ by less than this share of the grid are one.
const SAME: f64 = 1e-6;
/// Measured or rounded coordinates may miss their nodes by this share of a step. B is corrected for it.
const JITTER: f64 = 0.05;
/// Coordinates nearer than this share of the widest distance between two are of one node.
const NEAR: f64 = 0.25;
const AXES: [&str; 3] = ["x", "y", "z"];

/// Nodes in equal steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    pub origin: Vector,
    pub steps: Vector,
    pub counts: [usize; 3],
}

/// Points on the nodes of a grid.
pub(super) struct Placed {
    pub lattice: Lattice,
    /// The node of each point, x the fastest.
    pub nodes: Vec<usize>,
    /// How far each point is from its node (m), where some miss theirs by more than rounding.
    pub strays: Option<[Vec<f64>; 3]>,
}

/// Refuses coordinates (m) that no scene has.
fn check_places(path: &Path, places: [&[f64]; 3]) -> Result<(), InputError> {
    for (name, places) in AXES.into_iter().zip(places) {
        if let Some(place) = places.iter().find(|place| place.is_nan() || place.abs() > LARGEST) {
            let words = format!("a node is at {name} = {place:e} m: give places of at most 1e60 in size");
            return Err(wrong(path, None, name, words));
        }
    }
    Ok(())
}

/// First coordinate, step and number of coordinates in rising order.
fn even(path: &Path, axis: usize, places: &[f64], tolerance: f64) -> Result<(f64, f64, usize), InputError> {
    let name = AXES[axis];
    let count = places.len();
    if count == 1 {
        let words = format!(
            "the samples lie in one plane, {name} = {} m, which does not tell how the field changes along {name}: give at least {LEAST_MAP_NODES} planes",
            short_number(places[0])
        );
        return Err(wrong(path, None, name, words));
    }
    if count < LEAST_MAP_NODES {
        let words = format!("the grid has {count} places along {name}: give at least {LEAST_MAP_NODES}");
        return Err(wrong(path, None, name, words));
    }
    let (first, last) = (places[0], places[count - 1]);
    let step = (last - first) / (count - 1) as f64;
    let strays = |(k, x): (usize, &f64)| (x - first - k as f64 * step).abs() > tolerance * step;
    let rises = step > 0.0;
    if !rises || places.iter().enumerate().any(strays) {
        let steps = places.windows(2).map(|pair| pair[1] - pair[0]);
        let (least, most) = steps.fold((f64::INFINITY, 0.0_f64), |(low, high), h| (low.min(h), high.max(h)));
        let [least, most] = [least, most].map(short_number);
        let words = format!(
            "the grid is irregular: steps along {name} go from {least} to {most} m; sample the field again in equal, rising steps"
        );
        return Err(wrong(path, None, name, words));
    }
    if step < 1.0 / LARGEST {
        let words = format!("its nodes are {step:e} m apart along {name}: give steps of at least 1e-60 m");
        return Err(wrong(path, None, name, words));
    }
    Ok((first, step, count))
}

/// Of the coordinates along each axis.
pub(super) fn of_axes(path: &Path, axes: [&[f64]; 3]) -> Result<Lattice, InputError> {
    check_places(path, axes)?;
    lattice(path, axes, ROUNDING)
}

fn lattice(path: &Path, axes: [&[f64]; 3], tolerance: f64) -> Result<Lattice, InputError> {
    let [x, y, z] = [0, 1, 2].map(|axis| even(path, axis, axes[axis], tolerance));
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

/// Means of coordinates in rising order that are near to each other.
fn clusters(places: &[f64]) -> Vec<f64> {
    let widest = places.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    places.chunk_by(|a, b| b - a <= NEAR * widest).map(|of| of.iter().sum::<f64>() / of.len() as f64).collect()
}

/// The grid of points in any order.
pub(super) fn of_points(path: &Path, points: [&[f64]; 3]) -> Result<Placed, InputError> {
    check_places(path, points)?;
    let places = points.map(|coordinates| {
        let mut sorted = coordinates.to_vec();
        sorted.sort_by(f64::total_cmp);
        let width = sorted.last().unwrap_or(&0.0) - sorted.first().unwrap_or(&0.0);
        sorted.dedup_by(|b, a| *b - *a <= SAME * width);
        sorted
    });
    let exact = lattice(path, [&places[0], &places[1], &places[2]], ROUNDING);
    let (lattice, is_exact) = match exact {
        Ok(lattice) => (lattice, true),
        Err(refused) => {
            let means = places.map(|places| clusters(&places));
            (lattice(path, [&means[0], &means[1], &means[2]], JITTER).map_err(|_| refused)?, false)
        }
    };
    let [nx, ny, nz] = lattice.counts;
    let rows = points[0].len();
    if rows != nx * ny * nz {
        let words = format!(
            "the grid is irregular: {rows} points do not fill its {nx} x {ny} x {nz} nodes; give each once, with NaN where there is no value"
        );
        return Err(wrong(path, None, "", words));
    }
    let mut is_taken = vec![false; rows];
    let mut nodes = Vec::with_capacity(rows);
    let mut strays = [0, 1, 2].map(|_| Vec::new());
    let [x, y, z] = points;
    for (row, ((x, y), z)) in x.iter().zip(y).zip(z).enumerate() {
        let at = [*x, *y, *z];
        let steps: [f64; 3] = std::array::from_fn(|axis| (at[axis] - lattice.origin[axis]) / lattice.steps[axis]);
        if !is_exact {
            for axis in 0..3 {
                let stray = steps[axis] - steps[axis].round();
                if stray.abs() > JITTER {
                    let words = format!(
                        "the grid is irregular: row {} is off an even grid along {} by {:.3} of its step, {} m; sample the field in equal steps",
                        row + 1,
                        AXES[axis],
                        stray.abs(),
                        short_number(lattice.steps[axis])
                    );
                    return Err(wrong(path, None, AXES[axis], words));
                }
                strays[axis].push(stray * lattice.steps[axis]);
            }
        }
        let [i, j, k] = steps.map(|step| step.round() as usize);
        let node = (k * ny + j) * nx + i;
        if std::mem::replace(&mut is_taken[node], true) {
            let [x, y, z] = at.map(short_number);
            let words = format!("the point ({x}, {y}, {z}) m is given twice, in row {} again: give each once", row + 1);
            return Err(wrong(path, None, "", words));
        }
        nodes.push(node);
    }
    Ok(Placed { lattice, nodes, strays: (!is_exact).then_some(strays) })
}
