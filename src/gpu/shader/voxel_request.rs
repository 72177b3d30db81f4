//! What the counting kernel `shaders/reduce.wgsl` is asked, and the box of voxels that it counts.

use super::settings::float_bytes;
use crate::backend::Precision;

/// Words at the start of the kernel's tally: samples that come back, ramped samples that were counted, two spare words.
/// The samples that come back follow, then those that the host wants.
pub(crate) const HEADER: usize = 4;

/// What the host asks about one dispatch; numbers in the order of the shader.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Request {
    pub mark: f64,
    pub bounds: Bounds,
    /// Voxels to the plan's unit of length.
    pub cells: f64,
    /// The base among the voxels.
    pub base: [f64; 3],
    pub grid: VoxelGrid,
    pub sample_count: u32,
    pub wanted_count: u32,
    pub wanted_at: u32,
}

/// Members of `Request` in the shader that are numbers of the kernel's precision; they come first.
pub const REQUEST_FLOATS: [&str; 13] = [
    "mark", "estimate", "residual", "cells", "base_x", "base_y", "base_z", "low_x", "low_y", "low_z", "high_x",
    "high_y", "high_z",
];
/// Members of `Request` in the shader that are words of four bytes.
pub const REQUEST_WORDS: [&str; 9] =
    ["first_x", "first_y", "first_z", "size_x", "size_y", "size_z", "sample_count", "wanted_count", "wanted_at"];

/// Largest and smallest numbers among the rows that the host has, in the plan's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub low: [f64; 3],
    pub high: [f64; 3],
    pub residual: f64,
    /// At most the tolerance.
    pub estimate: f64,
}

/// The voxels that the device counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VoxelGrid {
    pub first: [i32; 3],
    pub size: [u32; 3],
}

impl Bounds {
    /// Of no rows: nothing lies within.
    pub fn none() -> Bounds {
        Bounds { low: [1.0; 3], high: [-1.0; 3], residual: -1.0, estimate: -1.0 }
    }

    /// Takes in a row, in the plan's units.
    pub fn widen(&mut self, tip: [f64; 3], residual: f64, estimate: f64) {
        let is_first = self.low[0] > self.high[0];
        for (axis, x) in tip.into_iter().enumerate() {
            self.low[axis] = if is_first { x } else { self.low[axis].min(x) };
            self.high[axis] = if is_first { x } else { self.high[axis].max(x) };
        }
        self.residual = self.residual.max(residual);
        self.estimate = self.estimate.max(estimate);
    }
}

impl VoxelGrid {
    /// Around some tips, in voxels, with room for those between and beyond them.
    pub fn around(tips: &[[f64; 3]]) -> VoxelGrid {
        let mut grid = VoxelGrid { first: [0; 3], size: [1; 3] };
        for axis in 0..3 {
            let low = tips.iter().map(|tip| tip[axis]).fold(f64::INFINITY, f64::min);
            let high = tips.iter().map(|tip| tip[axis]).fold(f64::NEG_INFINITY, f64::max);
            if low <= high {
                let room = 0.1 * (high - low) + 2.0;
                let (first, last) = ((low - room).floor() as i32, (high + room).ceil() as i32);
                grid.first[axis] = first;
                grid.size[axis] = last.saturating_sub(first).max(1) as u32;
            }
        }
        grid
    }

    pub fn cell_count(&self) -> u64 {
        self.size.iter().fold(1u64, |product, size| product.saturating_mul(u64::from(*size)))
    }

    /// The voxel at a place of the counts.
    pub fn voxel(&self, place: usize) -> [i32; 3] {
        let [nx, ny, _] = self.size.map(|size| size as usize);
        let at = [place % nx, place / nx % ny, place / nx / ny];
        std::array::from_fn(|axis| self.first[axis] + at[axis] as i32)
    }
}

impl Request {
    pub fn bytes(&self, precision: Precision) -> Vec<u8> {
        let Bounds { low, high, residual, estimate } = self.bounds;
        let floats = [&[self.mark, estimate, residual, self.cells], &self.base[..], &low, &high].concat();
        let mut bytes = float_bytes(&floats, precision);
        let counts = [self.sample_count, self.wanted_count, self.wanted_at];
        let words = self.grid.first.map(|first| first as u32).into_iter().chain(self.grid.size).chain(counts);
        bytes.extend(words.flat_map(u32::to_ne_bytes));
        bytes
    }
}

/// Relative distance to the side of a voxel within which round-off may decide: of the position, of its place among the
/// voxels, of the host's own rounding.
pub(super) fn voxel_margin(precision: Precision) -> f64 {
    8.0 * precision.epsilon()
}

#[cfg(test)]
mod tests {
    use super::{Bounds, VoxelGrid};

    #[test]
    fn a_grid_holds_its_tips_and_knows_its_voxels() {
        let grid = VoxelGrid::around(&[[-10.5, 3.0, 0.0], [4.2, 3.0, 80.0]]);
        for tip in [[-10.5, 3.0, 0.0], [4.2, 3.0, 80.0]] {
            let at: Vec<i32> = (0..3).map(|k| f64::floor(tip[k]) as i32 - grid.first[k]).collect();
            assert!((0..3).all(|k| at[k] >= 1 && (at[k] as u32) < grid.size[k] - 1), "{at:?} {grid:?}");
            let place =
                at[0] as usize + grid.size[0] as usize * (at[1] as usize + grid.size[1] as usize * at[2] as usize);
            assert_eq!(grid.voxel(place), [0, 1, 2].map(|k: usize| f64::floor(tip[k]) as i32));
        }
        assert_eq!(VoxelGrid::around(&[]).cell_count(), 1);
    }

    #[test]
    fn bounds_start_with_the_first_row() {
        let mut bounds = Bounds::none();
        bounds.widen([5.0, 6.0, 7.0], 1e-9, 0.0);
        bounds.widen([4.0, 6.5, 7.0], 0.0, 1e-7);
        assert_eq!(bounds, Bounds { low: [4.0, 6.0, 7.0], high: [5.0, 6.5, 7.0], residual: 1e-9, estimate: 1e-7 });
    }
}
