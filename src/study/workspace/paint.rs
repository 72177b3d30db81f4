//! The quick way: every row paints the centres within its first-order image. No centre is proven.

use super::growth::Grown;
use super::search::End;
use super::step::bounded_step;
use super::tip_map::{Branch, Inputs, MOST_INPUTS, Tip, distance, norm};
use crate::model::Vector;
use crate::table::Lattice;

/// A row paints no further than so many voxels: at folds first order overshoots without limit.
const CAP: f64 = 4.0;
/// What first order may leave of the way to a centre, over the edge of a voxel.
const LEFT: f64 = 1e-6;

/// The centres that rows paint: with J, within half the distance of two rows, within the limits.
pub(super) fn paint(
    lattice: Lattice,
    input_count: usize,
    minimum_margin: f64,
    rows: &[(Inputs, Tip)],
    samples: usize,
) -> Grown {
    let mut grown = Grown::new(lattice, 3, input_count, Branch::FromRest, minimum_margin);
    // Rows that fill the box evenly have a cube each; inputs are scaled to edges of length 2.
    let half = (samples.max(1) as f64).powf(-1.0 / input_count as f64);
    let edge = lattice.spacing;
    for (at, tip) in rows.iter().filter(|(_, tip)| tip.counts(minimum_margin)) {
        let reach: Vector = std::array::from_fn(|axis| {
            let sum: f64 = tip.jacobian[..input_count].iter().map(|column| half * column[axis].abs()).sum();
            sum.min(CAP * edge)
        });
        let corner = |sign: f64| lattice.cell(std::array::from_fn(|axis| tip.position[axis] + sign * reach[axis]));
        let (low, high) = (corner(-1.0), corner(1.0));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let cell = [x, y, z];
                    let centre = lattice.centre(cell);
                    if distance(centre, tip.position) > CAP * edge
                        || grown.voxel(cell).is_some_and(|voxel| voxel.is_reached())
                    {
                        continue;
                    }
                    if let Some(change) = within(tip, at, input_count, centre, half, edge) {
                        let there = std::array::from_fn(|k| at[k] + change[k]);
                        grown.put(cell, &there, tip, End::Reached);
                    }
                }
            }
        }
    }
    grown
}

/// The change within a row's cube of inputs and the limits that takes the tip to a centre, to first order.
fn within(tip: &Tip, at: &Inputs, count: usize, centre: Vector, half: f64, edge: f64) -> Option<Inputs> {
    // The cube, cut off at the limits, as a box from -1 to 1 about its middle.
    let (mut middle, mut size) = ([0.0; MOST_INPUTS], [0.0; MOST_INPUTS]);
    for k in 0..count {
        let (low, high) = ((at[k] - half).max(-1.0), (at[k] + half).min(1.0));
        (middle[k], size[k]) = (0.5 * (low + high), 0.5 * (high - low));
    }
    let mut scaled = *tip;
    scaled.jacobian.iter_mut().zip(size).for_each(|(column, size)| *column = column.map(|x| x * size));
    let to_middle: Inputs = std::array::from_fn(|k| middle[k] - at[k]);
    let from = tip.position_after(&to_middle);
    let missing = std::array::from_fn(|axis| centre[axis] - from[axis]);
    let step = bounded_step(&scaled, &[0.0; MOST_INPUTS], count, missing, 3);
    let change = || std::array::from_fn(|k| to_middle[k] + size[k] * step.change[k]);
    (norm(step.left) < LEFT * edge).then(change)
}
