//! Sobol' points with the direction numbers of Joe and Kuo, Owen scrambling by hashing.

use super::hash::hash;
use std::sync::Arc;

/// Dimensions for which direction numbers are at hand.
pub const MAX_SOBOL_DIMENSIONS: usize = 1000;
/// Most points of a net, as a power of two.
pub(super) const SOBOL_BITS: usize = 32;
/// What its hashes are told apart by.
const SOBOL_STREAM: u64 = 0x50b01;

/// A scrambled Sobol' net of up to 2³² points, at random access. Its first 2^k points are a net, too.
#[derive(Clone, Debug)]
pub struct SobolNet {
    /// Direction numbers of each dimension.
    directions: Arc<Vec<Vec<u32>>>,
    seed: u64,
}

impl SobolNet {
    /// The net of a seed; the same as that of a sweep with `method = "sobol"` and this seed.
    ///
    /// # Panics
    ///
    /// More than [`MAX_SOBOL_DIMENSIONS`] dimensions.
    pub fn new(dimensions: usize, seed: u64) -> SobolNet {
        SobolNet { directions: Arc::new(sobol_directions(dimensions)), seed }
    }

    /// Another scrambling of the same net.
    pub fn reseeded(&self, seed: u64) -> SobolNet {
        SobolNet { directions: self.directions.clone(), seed }
    }

    /// Numbers of a point.
    pub fn dimensions(&self) -> usize {
        self.directions.len()
    }

    /// Writes point `index` of the open unit cube, as many of its dimensions as `point` has room for.
    ///
    /// # Panics
    ///
    /// An index of 2³² or more.
    pub fn point(&self, index: u64, point: &mut [f64]) {
        let dimensions = 0..self.dimensions();
        point.iter_mut().zip(dimensions).for_each(|(value, dimension)| *value = self.value(index, dimension));
    }

    /// One number of a point: the middle of its cell, never exactly 0 or 1.
    pub(super) fn value(&self, index: u64, dimension: usize) -> f64 {
        let scrambled = owen_scramble(sobol_bits(&self.directions[dimension], index), self.key(dimension));
        (f64::from(scrambled) + 0.5) / 2f64.powi(SOBOL_BITS as i32)
    }

    pub(super) fn directions(&self) -> &[Vec<u32>] {
        &self.directions
    }

    /// Key of the scrambling of a dimension.
    pub(super) fn key(&self, dimension: usize) -> u32 {
        hash(self.seed, SOBOL_STREAM, dimension as u64) as u32
    }
}

/// Direction numbers of the first dimensions.
///
/// # Panics
///
/// More than [`MAX_SOBOL_DIMENSIONS`] dimensions.
fn sobol_directions(dimension_count: usize) -> Vec<Vec<u32>> {
    assert!(dimension_count <= MAX_SOBOL_DIMENSIONS, "{dimension_count} dimensions; {MAX_SOBOL_DIMENSIONS} are known");
    let first = (0..SOBOL_BITS).map(|bit| 1 << (31 - bit)).collect();
    let others = JoeKuo { rest: JOE_KUO }.map(|(polynomial, initial)| directions_of(polynomial, &initial));
    std::iter::once(first).chain(others).take(dimension_count).collect()
}

/// For each dimension from the second on, as 16-bit numbers: the degree s of its primitive polynomial, the polynomial's inner
/// coefficients, s initial numbers m. By S. Joe and F. Y. Kuo (2008), `new-joe-kuo-6`; their licence is in
/// `joe_kuo.LICENSE`.
const JOE_KUO: &[u8] = include_bytes!("joe_kuo.bin");

/// The dimensions of [`JOE_KUO`]: inner coefficients and initial numbers.
struct JoeKuo {
    rest: &'static [u8],
}

impl JoeKuo {
    fn word(&mut self) -> Option<u32> {
        let (word, rest) = self.rest.split_first_chunk::<2>()?;
        self.rest = rest;
        Some(u16::from_le_bytes(*word).into())
    }
}

impl Iterator for JoeKuo {
    type Item = (u32, Vec<u32>);

    fn next(&mut self) -> Option<(u32, Vec<u32>)> {
        let (degree, polynomial) = (self.word()?, self.word()?);
        Some((polynomial, (0..degree).map_while(|_| self.word()).collect()))
    }
}

/// Direction numbers of a primitive polynomial x^s + a1 x^(s-1) + ... + 1, of which a1 is the highest bit of `polynomial`:
/// v(i) = v(i-s) xor v(i-s) >> s xor the sum of ak v(i-k).
fn directions_of(polynomial: u32, initial: &[u32]) -> Vec<u32> {
    let degree = initial.len();
    let mut directions: Vec<u32> = initial.iter().enumerate().map(|(bit, m)| m << (31 - bit)).collect();
    for bit in degree..SOBOL_BITS {
        let oldest = directions[bit - degree];
        let inner = (1..degree).filter(|k| polynomial >> (degree - 1 - k) & 1 == 1).map(|k| directions[bit - k]);
        directions.push(inner.fold(oldest ^ oldest >> degree, |sum, direction| sum ^ direction));
    }
    directions
}

/// Point `index` of one dimension, by the bits of the index (not in Gray-code order).
fn sobol_bits(directions: &[u32], index: u64) -> u32 {
    let mut bits = index;
    let mut point = 0;
    while bits != 0 {
        point ^= directions[bits.trailing_zeros() as usize];
        bits &= bits - 1;
    }
    point
}

/// Owen's nested scrambling: each bit is flipped by a hash of the bits above it.
///
/// On reversed bits, adding a key and multiplying by even numbers let a bit depend on lower bits only (Laine and
/// Karras; constants of Burley's revision).
fn owen_scramble(point: u32, key: u32) -> u32 {
    let mut x = point.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(key);
    x = x.wrapping_mul((key >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unscrambled_sobol_points_are_the_known_ones() {
        let directions = sobol_directions(3);
        let point = |index| [0, 1, 2].map(|d: usize| f64::from(sobol_bits(&directions[d], index)) / 2f64.powi(32));
        // Joe and Kuo's first points in three dimensions; here in binary, not Gray-code, order.
        assert_eq!(point(0), [0.0, 0.0, 0.0]);
        assert_eq!(point(1), [0.5, 0.5, 0.5]);
        assert_eq!(point(3), [0.75, 0.25, 0.25]);
        assert_eq!(point(2), [0.25, 0.75, 0.75]);
        assert_eq!(point(6), [0.375, 0.375, 0.625]);
        assert_eq!(point(7), [0.875, 0.875, 0.125]);
    }

    #[test]
    fn scrambled_sobol_fills_every_elementary_interval() {
        for seed in [0, 1, 7, u64::MAX] {
            let (bits, net) = (10u32, SobolNet::new(2, seed));
            let mut row = [0.0; 2];
            for split in 0..=bits {
                let (nx, ny) = (1u64 << split, 1u64 << (bits - split));
                let mut hits = vec![0; 1 << bits];
                for index in 0..1 << bits {
                    net.point(index, &mut row);
                    hits[((row[0] * nx as f64) as u64 * ny + (row[1] * ny as f64) as u64) as usize] += 1;
                }
                assert!(hits.iter().all(|hits| *hits == 1), "seed {seed}, {nx} by {ny}");
            }
        }
    }

    #[test]
    fn each_sobol_axis_is_stratified_in_many_dimensions() {
        let net = SobolNet::new(120, 3);
        let mut row = vec![0.0; 120];
        let mut hits = vec![[0u8; 256]; 120];
        for index in 0..256 {
            net.point(index, &mut row);
            for (hits, value) in hits.iter_mut().zip(&row) {
                hits[(value * 256.0) as usize] += 1;
            }
        }
        assert!(hits.iter().flatten().all(|hits| *hits == 1));
    }
}
