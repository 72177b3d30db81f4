//! Sample index to axis values, at random access: sample i depends only on (sweep, i).
//!
//! Grid (first axis fastest), uniform (counter-based), Sobol' (Joe and Kuo's directions, Owen scrambling by
//! hashing), Latin hypercube (a keyed permutation per axis), table.

use super::InputTable;
use super::sweep::{Method, SweepSpec};
use crate::model::{RecipeMethod, SampleRecipe};
use sobol::Sobol;
use sobol::params::JoeKuoD6;
use std::sync::Arc;

/// Axes for which direction numbers are at hand.
pub const MAX_SOBOL_DIMENSIONS: usize = 1000;
const SOBOL_BITS: usize = 32;
/// What the hashes of a method are told apart by.
const SOBOL_STREAM: u64 = 0x50b01;
const LATIN_STREAM: u64 = 0x1a71;
const JITTER_STREAM: u64 = 0x717e;
/// Rounds of a permutation.
const ROUNDS: usize = 6;
/// Values of all grid axes together that a recipe spells out.
const MAX_GRID_VALUES: u64 = 1 << 20;

/// Gives the axis values of any sample of a sweep.
#[derive(Clone, Debug)]
pub struct Sampler {
    kind: Kind,
    /// From and to of each axis, SI.
    ranges: Vec<(f64, f64)>,
    sample_count: u64,
    seed: u64,
}

#[derive(Clone, Debug)]
enum Kind {
    Grid(Vec<u64>),
    /// Direction numbers of each axis.
    Sobol(Arc<Vec<Vec<u32>>>),
    LatinHypercube,
    Uniform,
    Table(Arc<InputTable>),
}

impl SweepSpec {
    /// Gives the axis values of any of its samples.
    pub fn sampler(&self) -> Sampler {
        Sampler::new(self)
    }
}

impl Sampler {
    fn new(spec: &SweepSpec) -> Sampler {
        let kind = match (spec.method, &spec.table) {
            (Method::Grid, _) => Kind::Grid(spec.axes.iter().map(|axis| axis.points).collect()),
            (Method::Sobol, _) => Kind::Sobol(Arc::new(sobol_directions(spec.axes.len()))),
            (Method::LatinHypercube, _) => Kind::LatinHypercube,
            (Method::Table, Some(table)) => Kind::Table(table.clone()),
            (Method::Uniform | Method::Table, _) => Kind::Uniform,
        };
        let ranges = spec.axes.iter().map(|axis| (axis.from, axis.to)).collect();
        Sampler { kind, ranges, sample_count: spec.sample_count, seed: spec.seed }
    }

    /// Samples of the whole sweep.
    pub fn sample_count(&self) -> u64 {
        self.sample_count
    }

    /// Values of a sample.
    pub fn axis_count(&self) -> usize {
        self.ranges.len()
    }

    /// The same for engines that make samples themselves; `None` for a table, and for grids of very long axes.
    pub fn recipe(&self) -> Option<SampleRecipe> {
        let axes = 0..self.axis_count() as u64;
        let method = match &self.kind {
            Kind::Table(_) => return None,
            Kind::Grid(points) if points.iter().sum::<u64>() > MAX_GRID_VALUES => return None,
            Kind::Grid(points) => {
                let values = |(points, range): (&u64, &(f64, f64))| {
                    (0..*points).map(|at| grid_value(*range, at, *points)).collect()
                };
                RecipeMethod::Grid(points.iter().zip(&self.ranges).map(values).collect())
            }
            Kind::Sobol(directions) => RecipeMethod::Sobol {
                directions: directions.to_vec(),
                keys: axes.map(|axis| hash(self.seed, SOBOL_STREAM, axis) as u32).collect(),
            },
            Kind::LatinHypercube => {
                let keys: Vec<u64> = axes.map(|axis| hash(self.seed, LATIN_STREAM, axis)).collect();
                let rounds = |key: &u64| std::array::from_fn(|round| hash_key(*key, round as u64));
                RecipeMethod::LatinHypercube {
                    rounds: keys.iter().map(rounds).collect(),
                    jitter: keys.iter().map(|key| hash_key(*key, JITTER_STREAM)).collect(),
                }
            }
            Kind::Uniform => RecipeMethod::Uniform(axes.map(|axis| hash_key(self.seed, axis)).collect()),
        };
        Some(SampleRecipe { method, ranges: self.ranges.clone(), sample_count: self.sample_count })
    }

    /// Writes the value of each axis for sample `index`, SI.
    pub fn values(&self, index: u64, row: &mut [f64]) {
        match &self.kind {
            Kind::Grid(points) => {
                let mut rest = index;
                for ((value, points), range) in row.iter_mut().zip(points).zip(&self.ranges) {
                    *value = grid_value(*range, rest % points, *points);
                    rest /= points;
                }
            }
            Kind::Table(table) => row.copy_from_slice(table.row(index as usize)),
            _ => {
                for (dimension, (value, (from, to))) in row.iter_mut().zip(&self.ranges).enumerate() {
                    let unit = self.unit_value(index, dimension);
                    *value = from + (to - from) * unit;
                }
            }
        }
    }

    /// A point of the unit cube, [0, 1).
    fn unit_value(&self, index: u64, dimension: usize) -> f64 {
        match &self.kind {
            Kind::Sobol(directions) => {
                let key = hash(self.seed, SOBOL_STREAM, dimension as u64) as u32;
                let scrambled = owen_scramble(sobol_bits(&directions[dimension], index), key);
                // The middle of the cell: never exactly an end of the range.
                (f64::from(scrambled) + 0.5) / 2f64.powi(SOBOL_BITS as i32)
            }
            Kind::LatinHypercube => {
                let key = hash(self.seed, LATIN_STREAM, dimension as u64);
                let stratum = permute(index, self.sample_count, key);
                let jitter = unit_interval(hash(key, JITTER_STREAM, index));
                (stratum as f64 + jitter) / self.sample_count as f64
            }
            _ => unit_interval(hash(self.seed, dimension as u64, index)),
        }
    }
}

/// Symmetric about the middle of the range, exact at both ends.
fn grid_value((from, to): (f64, f64), at: u64, points: u64) -> f64 {
    if points == 1 {
        return from;
    }
    let last = (points - 1) as f64;
    (from * (last - at as f64) + to * at as f64) / last
}

/// 53 bits of a hash as a number in [0, 1).
fn unit_interval(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// The finaliser of splitmix64: a bijection in which every input bit moves every output bit.
fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Three numbers hashed in order.
pub(crate) fn hash(a: u64, b: u64, c: u64) -> u64 {
    mix(hash_key(a, b) ^ c.wrapping_add(GOLDEN).wrapping_mul(0xaef1_7502_108e_f2d9))
}

/// The first two of them.
fn hash_key(a: u64, b: u64) -> u64 {
    let first = mix(a.wrapping_add(GOLDEN));
    mix(first ^ b.wrapping_add(GOLDEN).wrapping_mul(0xd1b5_4a32_d192_ed03))
}

fn sobol_directions(dimension_count: usize) -> Vec<Vec<u32>> {
    if dimension_count <= 100 {
        Sobol::<u32>::init_direction_vals::<u32>(dimension_count, SOBOL_BITS, &JoeKuoD6::minimal())
    } else {
        Sobol::<u32>::init_direction_vals::<u32>(dimension_count, SOBOL_BITS, &JoeKuoD6::standard())
    }
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

/// A keyed permutation of 0..count: Feistel rounds on the enclosing power of four, walked until inside.
fn permute(index: u64, count: u64, key: u64) -> u64 {
    let bits = (64 - (count - 1).leading_zeros()).max(2);
    let half = bits.div_ceil(2);
    let mask = (1u64 << half) - 1;
    let mut at = index;
    loop {
        let (mut left, mut right) = (at >> half, at & mask);
        for round in 0..ROUNDS as u64 {
            (left, right) = (right, left ^ (hash(key, round, right) & mask));
        }
        at = (left << half) | right;
        if at < count {
            return at;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampler(kind: Kind, sample_count: u64, dimension_count: usize, seed: u64) -> Sampler {
        Sampler { kind, ranges: vec![(0.0, 1.0); dimension_count], sample_count, seed }
    }

    fn sobol(sample_count: u64, dimension_count: usize, seed: u64) -> Sampler {
        sampler(Kind::Sobol(Arc::new(sobol_directions(dimension_count))), sample_count, dimension_count, seed)
    }

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
            let (bits, sampler) = (10u32, sobol(1 << 10, 2, seed));
            let mut row = [0.0; 2];
            for split in 0..=bits {
                let (nx, ny) = (1u64 << split, 1u64 << (bits - split));
                let mut hits = vec![0; 1 << bits];
                for index in 0..1 << bits {
                    sampler.values(index, &mut row);
                    hits[((row[0] * nx as f64) as u64 * ny + (row[1] * ny as f64) as u64) as usize] += 1;
                }
                assert!(hits.iter().all(|hits| *hits == 1), "seed {seed}, {nx} by {ny}");
            }
        }
    }

    #[test]
    fn each_sobol_axis_is_stratified_in_many_dimensions() {
        let sampler = sobol(256, 120, 3);
        let mut row = vec![0.0; 120];
        let mut hits = vec![[0u8; 256]; 120];
        for index in 0..256 {
            sampler.values(index, &mut row);
            for (hits, value) in hits.iter_mut().zip(&row) {
                hits[(value * 256.0) as usize] += 1;
            }
        }
        assert!(hits.iter().flatten().all(|hits| *hits == 1));
    }

    #[test]
    fn latin_hypercube_hits_every_stratum_once() {
        for (count, seed) in [(1, 0), (2, 0), (7, 0), (64, 1), (1000, 5), (4097, 9)] {
            let sampler = sampler(Kind::LatinHypercube, count, 3, seed);
            let mut hits = vec![[0u8; 3]; count as usize];
            let mut row = [0.0; 3];
            for index in 0..count {
                sampler.values(index, &mut row);
                for (dimension, value) in row.iter().enumerate() {
                    hits[(value * count as f64) as usize][dimension] += 1;
                }
            }
            assert!(hits.iter().flatten().all(|hits| *hits == 1), "{count}");
        }
    }

    #[test]
    fn seeds_differ_and_zero_is_one_of_them() {
        for kind in [Kind::Uniform, Kind::LatinHypercube, Kind::Sobol(Arc::new(sobol_directions(2)))] {
            let draw = |seed| {
                let sampler = sampler(kind.clone(), 64, 2, seed);
                let mut row = [0.0; 2];
                (0..64)
                    .flat_map(|index| {
                        sampler.values(index, &mut row);
                        row
                    })
                    .collect::<Vec<_>>()
            };
            let (zero, one) = (draw(0), draw(1));
            assert_ne!(zero, one);
            assert_eq!(zero, draw(0));
            assert!(zero.iter().all(|x| (0.0..1.0).contains(x)));
            let mean = zero.iter().sum::<f64>() / 128.0;
            assert!((mean - 0.5).abs() < 0.1, "{mean}");
        }
    }

    #[test]
    fn uniform_samples_are_uniform_and_uncorrelated() {
        let (count, sampler) = (100_000, sampler(Kind::Uniform, 100_000, 2, 0));
        let (mut sums, mut product, mut row) = ([0.0; 4], 0.0, [0.0; 2]);
        for index in 0..count {
            sampler.values(index, &mut row);
            let [x, y] = row.map(|x| x - 0.5);
            sums = [sums[0] + x, sums[1] + y, sums[2] + x * x, sums[3] + y * y];
            product += x * y;
        }
        let n = count as f64;
        assert!(sums[0].abs() / n < 4e-3 && sums[1].abs() / n < 4e-3);
        assert!((sums[2] / n - 1.0 / 12.0).abs() < 1e-3 && (sums[3] / n - 1.0 / 12.0).abs() < 1e-3);
        assert!((product / n).abs() < 1.2e-3, "{product}");
    }

    #[test]
    fn grids_are_symmetric_and_first_axis_fastest() {
        let ranges = vec![(-0.3, 0.3), (1.0, 2.0)];
        let sampler = Sampler { kind: Kind::Grid(vec![61, 2]), ranges, sample_count: 122, seed: 0 };
        let value = |index| {
            let mut row = [0.0; 2];
            sampler.values(index, &mut row);
            row
        };
        assert_eq!(value(0), [-0.3, 1.0]);
        assert_eq!(value(30), [0.0, 1.0]);
        assert_eq!(value(60), [0.3, 1.0]);
        assert_eq!(value(61), [-0.3, 2.0]);
        assert_eq!((0..30).filter(|i| value(*i)[0] != -value(60 - i)[0]).count(), 0);
    }
}
