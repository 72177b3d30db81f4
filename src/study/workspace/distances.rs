//! Signed distance of every voxel's centre to the boundary of the workspace: positive inside.

use super::growth::Grown;
use super::lattice::neighbours;
use super::search::End;
use super::tip_map::distance;
use crate::model::Vector;
use std::collections::VecDeque;

/// Distances (m) of the voxels of a body in their order; NaN where none is known.
///
/// Outside it is what the search for the centre left missing. Inside it is the distance to the nearest of the points
/// where such searches ended, handed on from neighbour to neighbour.
pub(super) fn boundary_distances(grown: &Grown) -> Vec<f64> {
    let lattice = &grown.lattice;
    let mut nearest: Vec<Option<Vector>> = vec![None; grown.voxels.len()];
    let mut queue = VecDeque::new();
    let to = |at: usize, point: Vector| distance(lattice.centre(grown.voxels[at].cell), point);
    for (at, voxel) in grown.voxels.iter().enumerate() {
        let ended = matches!(voxel.end, Some(End::AtLimit | End::Singular | End::OffBranch | End::Stuck));
        if !ended {
            continue;
        }
        let centre = lattice.centre(voxel.cell);
        let point: Vector = std::array::from_fn(|axis| centre[axis] + f64::from(voxel.offset[axis]));
        if point.iter().all(|x| x.is_finite()) {
            nearest[at] = Some(point);
            queue.push_back(at);
        }
    }
    while let Some(at) = queue.pop_front() {
        let Some(point) = nearest[at] else { continue };
        for cell in neighbours(grown.voxels[at].cell) {
            let Some(other) = grown.place(cell).filter(|other| grown.voxels[*other].is_reached()) else { continue };
            if nearest[other].is_none_or(|known| to(other, point) < to(other, known) - 1e-12) {
                nearest[other] = Some(point);
                queue.push_back(other);
            }
        }
    }
    let distance = |at: usize| match (grown.voxels[at].is_reached(), nearest[at]) {
        (true, Some(point)) => to(at, point),
        (false, Some(_)) => -grown.voxels[at].missing,
        (_, None) => f64::NAN,
    };
    (0..grown.voxels.len()).map(distance).collect()
}
