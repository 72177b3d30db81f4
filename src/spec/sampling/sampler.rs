//! Sample index to axis values: grid (first axis fastest), uniform (counter-based), Sobol' net, Latin hypercube (a keyed
//! permutation an axis), Saltelli's design, faces of the box, table.

use super::hash::{hash, hash_key, permute, unit_interval};
use super::net::SobolNet;
use super::saltelli::SaltelliDesign;
use super::skeleton::Skeleton;
use crate::model::{RecipeMethod, SampleRecipe};
use crate::spec::InputTable;
use crate::spec::axis::AxisSpec;
use crate::spec::distribution::Distribution;
use crate::spec::sweep::{Method, SweepSpec};
use std::sync::Arc;

/// What the hashes of a method are told apart by.
const LATIN_STREAM: u64 = 0x1a71;
const JITTER_STREAM: u64 = 0x717e;
const SKELETON_STREAM: u64 = 0x5ce1;
/// Values of all grid axes together that a recipe spells out.
const MAX_GRID_VALUES: u64 = 1 << 20;

/// Gives the axis values of any sample of a sweep.
#[derive(Clone, Debug)]
pub struct Sampler {
    kind: Kind,
    axes: Vec<SampledAxis>,
    /// Values of a sample: more than axes, where some scale their parameters.
    value_count: usize,
    sample_count: u64,
    seed: u64,
}

#[derive(Clone, Debug)]
struct SampledAxis {
    distribution: Distribution,
    /// The values in the scene that its value multiplies, SI; empty where all parameters have the axis's value.
    scaled: Vec<f64>,
}

#[derive(Clone, Debug)]
enum Kind {
    Grid(Vec<u64>),
    Sobol(SobolNet),
    LatinHypercube,
    Uniform,
    /// The net has twice as many dimensions as there are axes.
    Saltelli(SaltelliDesign, SobolNet),
    /// The net has the dimension of a face; each face has 2^bits samples.
    Skeleton {
        skeleton: Skeleton,
        net: SobolNet,
        bits: u32,
    },
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
        let axis_count = spec.axes.len();
        let kind = match (spec.method, &spec.table) {
            (Method::Grid, _) => Kind::Grid(spec.axes.iter().map(|axis| axis.points).collect()),
            (Method::Sobol, _) => Kind::Sobol(SobolNet::new(axis_count, spec.seed)),
            (Method::LatinHypercube, _) => Kind::LatinHypercube,
            (Method::Table, Some(table)) => Kind::Table(table.clone()),
            (Method::Saltelli, _) => {
                Kind::Saltelli(SaltelliDesign { axis_count }, SobolNet::new(2 * axis_count, spec.seed))
            }
            (Method::Skeleton, _) => match spec.skeleton_faces() {
                Some(skeleton) => Kind::Skeleton {
                    skeleton,
                    net: SobolNet::new(skeleton.dimension(), spec.seed),
                    bits: skeleton.bits_for(spec.sample_count),
                },
                None => Kind::Uniform,
            },
            (Method::Uniform | Method::Table, _) => Kind::Uniform,
        };
        let sampled = |axis: &AxisSpec| SampledAxis {
            distribution: axis.distribution.clone(),
            scaled: if axis.scales { axis.rates(&spec.scene) } else { Vec::new() },
        };
        let axes: Vec<SampledAxis> = spec.axes.iter().map(sampled).collect();
        let value_count = axes.iter().map(SampledAxis::value_count).sum();
        Sampler { kind, axes, value_count, sample_count: spec.sample_count, seed: spec.seed }
    }

    /// Samples of the whole sweep.
    pub fn sample_count(&self) -> u64 {
        self.sample_count
    }

    /// Axes of the sweep.
    pub fn axis_count(&self) -> usize {
        self.axes.len()
    }

    /// Values of a sample, one for each of [`SweepSpec::axis_parameters`]: an axis that scales has one a parameter.
    pub fn value_count(&self) -> usize {
        self.value_count
    }

    /// The same for engines that make samples themselves; `None` for what they cannot make: a table, a grid of very long
    /// axes, Saltelli's design, faces of the box, axes that are not uniform or that scale their parameters.
    pub fn recipe(&self) -> Option<SampleRecipe> {
        let plain = |axis: &SampledAxis| match axis.distribution {
            Distribution::Uniform { from, to } if axis.scaled.is_empty() => Some((from, to)),
            _ => None,
        };
        let ranges = self.axes.iter().map(plain).collect::<Option<Vec<(f64, f64)>>>()?;
        let axes = 0..self.axis_count() as u64;
        let method = match &self.kind {
            Kind::Table(_) | Kind::Saltelli(..) | Kind::Skeleton { .. } => return None,
            Kind::Grid(points) if points.iter().sum::<u64>() > MAX_GRID_VALUES => return None,
            Kind::Grid(points) => {
                let values = |(points, axis): (&u64, &SampledAxis)| {
                    (0..*points).map(|at| axis.distribution.grid_value(at, *points)).collect()
                };
                RecipeMethod::Grid(points.iter().zip(&self.axes).map(values).collect())
            }
            Kind::Sobol(net) => RecipeMethod::Sobol {
                directions: net.directions().to_vec(),
                keys: (0..self.axis_count()).map(|axis| net.key(axis)).collect(),
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
        Some(SampleRecipe { method, ranges, sample_count: self.sample_count })
    }

    /// Writes what sample `index` gives the parameters, SI: [`Sampler::value_count`] values, in the order of
    /// [`SweepSpec::axis_parameters`].
    ///
    /// # Panics
    ///
    /// A row that is too short.
    pub fn values(&self, index: u64, row: &mut [f64]) {
        self.axis_values(index, row);
        if self.axes.iter().all(|axis| axis.scaled.is_empty()) {
            return;
        }
        // From the last axis on, for the values of an axis take no less room than the axis itself.
        let mut end = self.value_count;
        for (number, axis) in self.axes.iter().enumerate().rev() {
            let value = row[number];
            let start = end - axis.value_count();
            axis.write(value, &mut row[start..end]);
            end = start;
        }
    }

    /// Writes what values of the axes give the parameters: [`Sampler::axis_count`] numbers in, [`Sampler::value_count`]
    /// out.
    pub fn expand(&self, axis_values: &[f64], row: &mut [f64]) {
        let mut rest = row;
        for (axis, value) in self.axes.iter().zip(axis_values) {
            let (these, others) = rest.split_at_mut(axis.value_count().min(rest.len()));
            axis.write(*value, these);
            rest = others;
        }
    }

    /// Writes the value of each axis for sample `index`: SI, or the factor of an axis that scales.
    pub fn axis_values(&self, index: u64, row: &mut [f64]) {
        match &self.kind {
            Kind::Grid(points) => {
                let mut rest = index;
                for ((value, points), axis) in row.iter_mut().zip(points).zip(&self.axes) {
                    *value = axis.distribution.grid_value(rest % points, *points);
                    rest /= points;
                }
            }
            Kind::Table(table) => table.row(index as usize).iter().zip(row).for_each(|(from, to)| *to = *from),
            Kind::Skeleton { skeleton, net, bits } => {
                let face = index >> bits;
                let net = net.reseeded(hash(self.seed, SKELETON_STREAM, face));
                let index = index & ((1 << bits) - 1);
                skeleton.fill(face, row, |free| net.value(index, free));
                for (value, axis) in row.iter_mut().zip(&self.axes) {
                    *value = match axis.distribution.limits() {
                        Some((_, to)) if *value == 1.0 => to,
                        _ => axis.distribution.value(*value),
                    };
                }
            }
            Kind::Saltelli(design, net) => {
                let (base, kind) = design.kind(index);
                for (number, (value, axis)) in row.iter_mut().zip(&self.axes).enumerate() {
                    *value = axis.distribution.value(net.value(base, design.dimension(kind, number)));
                }
            }
            _ => {
                for (dimension, (value, axis)) in row.iter_mut().zip(&self.axes).enumerate() {
                    *value = axis.distribution.value(self.unit_value(index, dimension));
                }
            }
        }
    }

    /// A point of the unit cube, [0, 1).
    fn unit_value(&self, index: u64, dimension: usize) -> f64 {
        match &self.kind {
            Kind::Sobol(net) => net.value(index, dimension),
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

impl SampledAxis {
    fn value_count(&self) -> usize {
        self.scaled.len().max(1)
    }

    /// What a value of the axis gives its parameters.
    fn write(&self, value: f64, to: &mut [f64]) {
        match self.scaled.is_empty() {
            true => to.fill(value),
            false => to.iter_mut().zip(&self.scaled).for_each(|(to, scene)| *to = value * scene),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(from: f64, to: f64) -> SampledAxis {
        SampledAxis { distribution: Distribution::Uniform { from, to }, scaled: Vec::new() }
    }

    fn sampler(kind: Kind, sample_count: u64, axis_count: usize, seed: u64) -> Sampler {
        let axes = vec![axis(0.0, 1.0); axis_count];
        Sampler { kind, axes, value_count: axis_count, sample_count, seed }
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
        let kinds = [|_| Kind::Uniform, |_| Kind::LatinHypercube, |seed| Kind::Sobol(SobolNet::new(2, seed))];
        for kind in kinds {
            let draw = |seed| {
                let sampler = sampler(kind(seed), 64, 2, seed);
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
        let axes = vec![axis(-0.3, 0.3), axis(1.0, 2.0)];
        let sampler = Sampler { axes, ..sampler(Kind::Grid(vec![61, 2]), 122, 2, 0) };
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
