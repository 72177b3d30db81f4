//! Lattices shifted at random, neighbours of a cell, maps by cells.

use crate::spec::{hash, unit_interval};
use crate::table::Lattice;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// A voxel of a lattice by its three numbers.
pub type Cell = [i32; 3];

/// What the hashes of the origin are told apart by.
const ORIGIN_STREAM: u64 = 0x1a77_1ce5;

/// A lattice whose origin is shifted at random by the seed, so that counting its centres has no bias.
pub fn shifted_lattice(spacing: f64, seed: u64) -> Lattice {
    let share = |axis: u64| unit_interval(hash(seed, ORIGIN_STREAM, axis));
    Lattice { origin: std::array::from_fn(|axis| spacing * share(axis as u64)), spacing }
}

/// The six cells that share a face with a cell.
pub fn neighbours(cell: Cell) -> [Cell; 6] {
    std::array::from_fn(|face| {
        let mut other = cell;
        other[face / 2] += if face % 2 == 0 { -1 } else { 1 };
        other
    })
}

/// A map by cells; where it matters, it is gone through in the order of something else.
pub type CellMap<T> = HashMap<Cell, T, BuildHasherDefault<CellHasher>>;

/// Mixes three small numbers.
#[derive(Clone, Copy, Debug, Default)]
pub struct CellHasher(u64);

impl Hasher for CellHasher {
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 32)
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(4) {
            let mut word = [0; 4];
            word[..chunk.len()].copy_from_slice(chunk);
            self.0 = (self.0.rotate_left(21) ^ u64::from(u32::from_le_bytes(word))).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
    }

    // The length of an array is always the same.
    fn write_usize(&mut self, _: usize) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centres_lie_in_their_cells() {
        for seed in 0..20 {
            let lattice = shifted_lattice(1e-3, seed);
            for cell in [[0, 0, 0], [-1, 5, -300], [40, -7, 2]] {
                assert_eq!(lattice.cell(lattice.centre(cell)), cell);
            }
            assert!(lattice.origin.iter().all(|x| (0.0..1e-3).contains(x)));
        }
    }

    #[test]
    fn six_neighbours_share_a_face() {
        let all = neighbours([1, 2, 3]);
        let apart = |cell: &Cell| cell.iter().zip([1, 2, 3]).map(|(a, b)| (a - b).abs()).sum::<i32>();
        assert!(all.iter().all(|cell| apart(cell) == 1));
    }
}
