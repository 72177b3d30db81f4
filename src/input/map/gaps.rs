//! Nodes without a value, and samples that were taken beside their nodes.

use super::data::Values;
use super::grid::Lattice;
use crate::model::{MapGrid, Vector};

/// Passes that extrapolate by parabolas, and those that do by lines: farther from the samples noise would grow.
const CURVED: usize = 2;
const STRAIGHT: usize = 8;

/// Passes in which the gaps follow the fit, at most, and nodes of all passes together.
const MOST_PASSES: usize = 30;
const MOST_FITTED: usize = 3_000_000;
/// A change of B in the gaps, of the largest, that is none.
pub(super) const SETTLED: f64 = 1e-6;

/// How many times the gaps of a grid follow the fit.
pub(super) fn passes(nodes: usize) -> usize {
    (MOST_FITTED / nodes.max(1)).clamp(2, MOST_PASSES)
}

/// Gives nodes without a value one that continues the field of their neighbours, layer by layer. No rod sees it: cells
/// beside such nodes are closed. The splines and the potential of the other cells depend on it.
pub(super) fn fill(values: &mut Values, gaps: &[bool], counts: [usize; 3]) {
    match values {
        Values::FluxDensity(b) => b.iter_mut().for_each(|values| fill_one(values, gaps, counts)),
        Values::Potential(potential) => fill_one(potential, gaps, counts),
    }
}

fn fill_one(values: &mut [f64], gaps: &[bool], counts: [usize; 3]) {
    let strides = [1, counts[0], counts[0] * counts[1]];
    let mut is_known: Vec<bool> = gaps.iter().map(|is_gap| !is_gap).collect();
    let mut open: Vec<usize> = (0..values.len()).filter(|node| gaps[*node]).collect();
    let mut pass = 0;
    while !open.is_empty() {
        let order = if pass < CURVED {
            3
        } else if pass < CURVED + STRAIGHT {
            2
        } else {
            1
        };
        let mut found = Vec::new();
        for node in &open {
            let mut best = (0, 0.0, 0.0);
            for axis in 0..3 {
                let place = node / strides[axis] % counts[axis];
                // Known neighbours on one side, the nearest first.
                let side = |is_up: bool| -> Vec<f64> {
                    let room = if is_up { counts[axis] - 1 - place } else { place };
                    let at = |k: usize| if is_up { node + k * strides[axis] } else { node - k * strides[axis] };
                    (1..=room.min(3)).map(at).take_while(|at| is_known[*at]).map(|at| values[at]).collect()
                };
                for (score, value) in estimates(&side(false), &side(true), order) {
                    match score.cmp(&best.0) {
                        std::cmp::Ordering::Greater => best = (score, value, 1.0),
                        std::cmp::Ordering::Equal => best = (score, best.1 + value, best.2 + 1.0),
                        std::cmp::Ordering::Less => {}
                    }
                }
            }
            if best.0 > 0 {
                found.push((*node, best.1 / best.2));
            }
        }
        for (node, value) in found {
            values[node] = value;
            is_known[node] = true;
        }
        open.retain(|node| !is_known[*node]);
        pass += 1;
    }
}

/// Values between or beyond known neighbours, the nearest first on either side, each with a score.
fn estimates(low: &[f64], high: &[f64], order: usize) -> Vec<(usize, f64)> {
    let beyond = |side: &[f64]| match side[..side.len().min(order)] {
        [a, b, c] => Some((3, 3.0 * (a - b) + c)),
        [a, b] => Some((2, 2.0 * a - b)),
        [a] => Some((1, a)),
        _ => None,
    };
    match (low, high) {
        ([a, b, ..], [c, d, ..]) => vec![(5, (4.0 * (a + c) - b - d) / 6.0)],
        ([a, ..], [c, ..]) => vec![(4, 0.5 * (a + c))],
        _ => [low, high].into_iter().filter_map(beyond).collect(),
    }
}

/// Place of a node (m)
fn place_of(node: usize, lattice: &Lattice) -> Vector {
    let [nx, ny, _] = lattice.counts;
    let index = [node % nx, node / nx % ny, node / (nx * ny)];
    std::array::from_fn(|k| lattice.origin[k] + index[k] as f64 * lattice.steps[k])
}

/// Gives B in the gaps the value of a fit, so that the next is not drawn to what no potential has. Returns the largest
/// change, over the largest B.
pub(super) fn follow(b: &mut [Vec<f64>; 3], gaps: &[bool], lattice: &Lattice, grid: &MapGrid) -> f64 {
    let largest = b.iter().flatten().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    let mut change = 0.0_f64;
    for node in (0..gaps.len()).filter(|node| gaps[*node]) {
        let found = grid.local(place_of(node, lattice)).flux_density;
        for (values, found) in b.iter_mut().zip(found) {
            change = change.max((values[node] - found).abs());
            values[node] = found;
        }
    }
    if largest > 0.0 { change / largest } else { 0.0 }
}

/// The largest difference of the fit from samples beside cells that are open, over the largest B.
pub(super) fn misfit(b: &[Vec<f64>; 3], gaps: &[bool], lattice: &Lattice, grid: &MapGrid) -> f64 {
    let (mut most, mut largest) = (0.0_f64, 0.0_f64);
    for node in (0..gaps.len()).filter(|node| !gaps[*node]) {
        let at = place_of(node, lattice);
        let beside = |corner: usize| -> Vector {
            let side = |k: usize| if corner >> k & 1 == 0 { -0.5 } else { 0.5 };
            std::array::from_fn(|k| at[k] + side(k) * lattice.steps[k])
        };
        if (0..8).all(|corner| grid.is_gap(beside(corner))) {
            continue;
        }
        let found = grid.local(at).flux_density;
        for (values, found) in b.iter().zip(found) {
            most = most.max((values[node] - found).abs());
            largest = largest.max(values[node].abs());
        }
    }
    if largest > 0.0 { most / largest } else { 0.0 }
}

/// Moves B from where each sample was taken to its node, along the field of a first fit.
pub(super) fn onto_nodes(b: &mut [Vec<f64>; 3], strays: &[Vec<f64>; 3], lattice: &Lattice, grid: &MapGrid) {
    for node in 0..b[0].len() {
        let gradient = grid.local(place_of(node, lattice)).gradient;
        for (row, values) in gradient.iter().zip(b.iter_mut()) {
            values[node] -= (0..3).map(|k| row[k] * strays[k][node]).sum::<f64>();
        }
    }
}
