//! The size of a workspace by change of variables: independent of growth, lattice and neighbours.
//!
//! For a family of inputs with as many free numbers m as the workspace has dimensions, the integral of
//! sqrt(det(JᵀJ)) over the family counts every point of the workspace as often as the family reaches it (area formula,
//! Federer 3.2.3). How often that is, is found out at points drawn in proportion to the integrand. The family is the
//! whole box where there are m inputs, else its faces with the other inputs at a limit.

use super::lattice::{Cell, CellMap};
use super::measures::Estimate;
use super::search::{Aim, End, Search, Source, run_searches};
use super::seeds::net_point;
use super::tip_map::{Branch, Inputs, MOST_INPUTS, Tip, TipMap, difference, distance, norm};
use crate::backend::BackendError;
use crate::model::Vector;
use crate::spec::{Skeleton, SobolNet, hash, unit_interval};
use crate::table::Lattice;
use rayon::prelude::*;
use std::sync::Arc;

/// Nets of different scrambling whose spread is the error.
const NETS: u64 = 16;
/// Samples over all faces, about. First so many of each net on each face; then more where the integrand varies more.
const SAMPLES: f64 = 49_152.0;
const PILOT: u64 = 128;
/// More faces are not taken: a point of the workspace then has too many sources for all to be found.
const MOST_FACES: u64 = 24;
/// Points whose sources are counted, and searches for further sources of one point.
const POINTS: usize = 1024;
const SEARCHES: usize = 8;
/// Inputs further apart than this over half their range, in some input, are two starts; than that, two sources.
const APART: f64 = 0.25;
const DISTINCT: f64 = 0.02;
/// So many of its errors below the size, an integral misses some of it.
const MISSING: f64 = 2.0;
/// What the hashes of nets and points are told apart by.
const STREAM: u64 = 0xc4ec;

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChangeOfVariables {
    /// Size of the workspace: m³, m² or m.
    pub value: f64,
    /// Of the value.
    pub standard_error: f64,
    /// The same with points counted as often as the family reaches them.
    pub with_multiplicity: f64,
    /// Standard error of that.
    pub error_with_multiplicity: f64,
    /// How often, on average over the workspace.
    pub multiplicity: f64,
    /// The largest term over the sum: above a hundredth the error is itself uncertain.
    pub largest_share: f64,
    /// Equilibria computed.
    pub samples: u64,
    /// Faces of the family.
    pub faces: u64,
}

impl ChangeOfVariables {
    /// Whether the family reaches less than a workspace whose points are each found: its samples then miss places where the
    /// tip moves far for little, and no error can be told from them. Points that count twice only add to it.
    pub(super) fn misses_some_of(&self, size: &Estimate) -> bool {
        self.with_multiplicity + MISSING * self.error_with_multiplicity < size.low
    }
}

/// A family of inputs with their tips.
pub(super) struct Family {
    skeleton: Skeleton,
    dimension: usize,
    inputs: Vec<Inputs>,
    pub tips: Vec<Tip>,
    /// Face of each.
    faces: Vec<u64>,
    /// Net of each.
    nets: Vec<u64>,
    /// Integrand times the part of the family that a sample stands for.
    weights: Vec<f64>,
}

impl Family {
    /// Solves the samples of a family, but for those that are known; `None` where there is none that can be counted.
    pub(super) fn solve(
        map: &mut dyn TipMap,
        dimension: usize,
        minimum_margin: f64,
        seed: u64,
        known: &dyn Fn(&Inputs) -> Option<Tip>,
    ) -> Result<Option<Family>, BackendError> {
        let count = map.input_count();
        let Ok(skeleton) = Skeleton::new(count, dimension) else { return Ok(None) };
        if skeleton.face_count() > MOST_FACES {
            return Ok(None);
        }
        let mut family = Family {
            skeleton,
            dimension,
            inputs: Vec::new(),
            tips: Vec::new(),
            faces: Vec::new(),
            nets: Vec::new(),
            weights: Vec::new(),
        };
        let mut per_net = vec![0; family.skeleton.face_count() as usize];
        family.extend(map, &mut per_net, &|_| PILOT, minimum_margin, seed, known)?;
        // Where the integrand varies most, most samples (Neyman 1934).
        let spread = family.spread();
        let all: f64 = spread.iter().sum();
        let share = |face: usize| SAMPLES / NETS as f64 * spread[face] / all;
        let wanted = |face: usize| if all > 0.0 { (share(face) as u64).max(PILOT).next_power_of_two() } else { PILOT };
        family.extend(map, &mut per_net, &wanted, minimum_margin, seed, known)?;
        // A face has the size 2^m in inputs over half their range.
        let size = |face: usize| 2f64.powi(dimension as i32) / (NETS * per_net[face]) as f64;
        let faces = &family.faces;
        family.weights.iter_mut().zip(faces).for_each(|(weight, face)| *weight *= size(*face as usize));
        Ok(Some(family))
    }

    /// Solves so many samples of each net on each face, beyond those that there are.
    fn extend(
        &mut self,
        map: &mut dyn TipMap,
        per_net: &mut [u64],
        wanted: &dyn Fn(usize) -> u64,
        minimum_margin: f64,
        seed: u64,
        known: &dyn Fn(&Inputs) -> Option<Tip>,
    ) -> Result<(), BackendError> {
        let (count, dimension, first) = (map.input_count(), self.dimension, self.inputs.len());
        let base = SobolNet::new(dimension, 0);
        for (face, solved) in per_net.iter_mut().enumerate() {
            let wanted = wanted(face).max(*solved);
            for number in 0..NETS {
                let net = scrambled(&base, seed, number, face as u64);
                for index in *solved..wanted {
                    let mut point = [0.0; 3];
                    net.point(index, &mut point[..dimension]);
                    let mut unit = [0.5; MOST_INPUTS];
                    self.skeleton.values(face as u64, &point[..dimension], &mut unit[..count]);
                    self.inputs.push(std::array::from_fn(|k| if k < count { 2.0 * unit[k] - 1.0 } else { 0.0 }));
                    self.faces.push(face as u64);
                    self.nets.push(number);
                }
            }
            *solved = wanted;
        }
        let known: Vec<Option<Tip>> = self.inputs[first..].iter().map(known).collect();
        let left = self.inputs[first..].iter().zip(&known).filter(|(_, tip)| tip.is_none()).map(|(at, _)| *at);
        let mut solved = map.solve_from_rest(&left.collect::<Vec<_>>())?.into_iter();
        let mut tips: Vec<Tip> =
            known.into_iter().map(|tip| tip.or_else(|| solved.next()).unwrap_or(Tip::NONE)).collect();
        let free: Vec<[bool; MOST_INPUTS]> =
            (0..self.skeleton.face_count()).map(|face| free_inputs(&self.skeleton, face)).collect();
        let weigh = |(tip, face): (&Tip, &u64)| match tip.counts(minimum_margin) {
            true => stretch(&held(tip, &free[*face as usize]), dimension),
            false => 0.0,
        };
        self.weights.extend(tips.iter().zip(&self.faces[first..]).map(weigh));
        self.tips.append(&mut tips);
        Ok(())
    }

    /// Standard deviation of the integrand on each face.
    fn spread(&self) -> Vec<f64> {
        let faces = self.skeleton.face_count() as usize;
        let mut sums = vec![[0.0; 3]; faces];
        for (weight, face) in self.weights.iter().zip(&self.faces) {
            let sum = &mut sums[*face as usize];
            *sum = [sum[0] + 1.0, sum[1] + weight, sum[2] + weight * weight];
        }
        sums.iter().map(|[n, sum, squares]| (squares / n - (sum / n).powi(2)).max(0.0).sqrt()).collect()
    }

    /// Every sample, for growth to begin from.
    pub(super) fn seeds(&self) -> impl Iterator<Item = (Inputs, &Tip)> {
        self.inputs.iter().copied().zip(&self.tips)
    }

    /// Sums up, and counts the sources of some points. `edge` is that of the voxels (m).
    pub(super) fn measure(
        &self,
        map: &mut dyn TipMap,
        edge: f64,
        minimum_margin: f64,
        seed: u64,
    ) -> Result<ChangeOfVariables, BackendError> {
        let mut by_net = vec![0.0; NETS as usize];
        self.weights.iter().zip(&self.nets).for_each(|(weight, net)| by_net[*net as usize] += weight);
        let integral: f64 = by_net.iter().sum();
        let mean = integral / NETS as f64;
        let spread: f64 = by_net.iter().map(|sum| (sum - mean).powi(2)).sum::<f64>();
        let of_integral = (spread * NETS as f64 / (NETS - 1) as f64).sqrt();
        let largest = self.weights.iter().fold(0.0f64, |largest, weight| largest.max(*weight));
        let points = self.points(seed);
        let sources = self.sources(map, &points, edge, minimum_margin)?;
        let shares: Vec<f64> = sources.iter().map(|count| 1.0 / *count as f64).collect();
        let share = shares.iter().sum::<f64>() / shares.len().max(1) as f64;
        let variance = shares.iter().map(|x| (x - share).powi(2)).sum::<f64>();
        // One point more of two sources than was seen, where all had one.
        let count = shares.len().max(2) as f64;
        let of_share = (variance.max(0.25) / (count * (count - 1.0))).sqrt();
        let value = if shares.is_empty() { 0.0 } else { integral * share };
        Ok(ChangeOfVariables {
            value,
            standard_error: (of_integral * share).hypot(integral * of_share),
            with_multiplicity: integral,
            error_with_multiplicity: of_integral,
            multiplicity: if value > 0.0 { integral / value } else { f64::NAN },
            largest_share: if integral > 0.0 { largest / integral } else { 0.0 },
            samples: self.inputs.len() as u64,
            faces: self.skeleton.face_count(),
        })
    }

    /// Samples drawn in proportion to the integrand, at equal steps of its sum.
    fn points(&self, seed: u64) -> Vec<usize> {
        let all: f64 = self.weights.iter().sum();
        let shift = unit_interval(hash(seed, STREAM, 1));
        let (mut sum, mut next, mut points) = (0.0, shift, Vec::with_capacity(POINTS));
        for (at, weight) in self.weights.iter().enumerate() {
            sum += weight / all * POINTS as f64;
            while next < sum {
                points.push(at);
                next += 1.0;
            }
        }
        points
    }

    /// How many samples of the family, on whatever face, have the tip of each of some samples.
    fn sources(
        &self,
        map: &mut dyn TipMap,
        points: &[usize],
        edge: f64,
        minimum_margin: f64,
    ) -> Result<Vec<usize>, BackendError> {
        let near = Near::new(self, minimum_margin);
        let starts: Vec<Vec<usize>> = points.par_iter().map(|at| near.starts(self, *at)).collect();
        let free: Vec<_> = (0..self.skeleton.face_count()).map(|face| free_inputs(&self.skeleton, face)).collect();
        let aim = Aim::voxels(map, self.dimension, edge, Branch::FromRest, minimum_margin);
        let begin = |(number, start): (usize, usize)| {
            let source =
                Source { at: self.inputs[start], tip: held(&self.tips[start], &free[self.faces[start] as usize]) };
            let search = Search::new(&aim, [0; 3], self.tips[points[number]].position, &Arc::new(source));
            ((number, self.faces[start]), search)
        };
        let mut found: Vec<Vec<Inputs>> = points.iter().map(|at| vec![self.inputs[*at]]).collect();
        let active = starts
            .iter()
            .enumerate()
            .flat_map(|(number, starts)| starts.iter().map(move |start| (number, *start)))
            .map(begin)
            .collect();
        let hold_face = |(_, face): &(usize, u64), tip: &mut Tip| *tip = held(tip, &free[*face as usize]);
        for ((number, _), search) in run_searches(map, &aim, active, &hold_face)? {
            let place = self.tips[points[number]].position;
            let arrived = search.end == Some(End::Reached) && distance(search.tip.position, place) < 0.05 * edge;
            let known = |at: &Inputs| largest_difference(at, &search.at) < DISTINCT;
            if arrived && !found[number].iter().any(known) {
                found[number].push(search.at);
            }
        }
        Ok(found.into_iter().map(|sources| sources.len()).collect())
    }
}

/// Samples by where their tips are.
struct Near {
    lattice: Lattice,
    cells: CellMap<Vec<u32>>,
}

impl Near {
    fn new(family: &Family, minimum_margin: f64) -> Near {
        let counting: Vec<usize> =
            (0..family.tips.len()).filter(|at| family.tips[*at].counts(minimum_margin)).collect();
        // About ten samples a cell, if they were spread evenly over the box around them.
        let mut box_of = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for at in &counting {
            for axis in 0..3 {
                let x = family.tips[*at].position[axis];
                box_of = [0, 1].map(|end| {
                    let mut corner = box_of[end];
                    corner[axis] = if end == 0 { corner[axis].min(x) } else { corner[axis].max(x) };
                    corner
                });
            }
        }
        let diagonal = norm(difference(box_of[1], box_of[0]));
        let edge = diagonal / (counting.len() as f64 / 10.0).powf(1.0 / family.dimension as f64).max(1.0);
        let lattice = Lattice { origin: [0.0; 3], spacing: edge.max(f64::MIN_POSITIVE) };
        let mut cells: CellMap<Vec<u32>> = CellMap::default();
        counting
            .into_iter()
            .for_each(|at| cells.entry(lattice.cell(family.tips[at].position)).or_default().push(at as u32));
        Near { lattice, cells }
    }

    /// Samples near the tip of one, of clearly different inputs or on another face; the nearest of each kind.
    fn starts(&self, family: &Family, at: usize) -> Vec<usize> {
        let place = family.tips[at].position;
        let cell = self.lattice.cell(place);
        let mut near: Vec<(f64, usize)> = Vec::new();
        for number in 0..27 {
            let other: Cell = [cell[0] + number % 3 - 1, cell[1] + number / 3 % 3 - 1, cell[2] + number / 9 - 1];
            for sample in self.cells.get(&other).into_iter().flatten() {
                let sample = *sample as usize;
                near.push((distance(family.tips[sample].position, place), sample));
            }
        }
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut starts: Vec<usize> = Vec::new();
        for (_, sample) in near {
            let is_like = |other: usize| {
                let same_face = family.faces[other] == family.faces[sample];
                same_face && largest_difference(&family.inputs[other], &family.inputs[sample]) < APART
            };
            if starts.len() < SEARCHES && !is_like(at) && !starts.iter().any(|other| is_like(*other)) {
                starts.push(sample);
            }
        }
        starts
    }
}

/// One of the nets of a family on one of its faces.
fn scrambled(base: &SobolNet, seed: u64, number: u64, face: u64) -> SobolNet {
    base.reseeded(hash(seed, STREAM + number, face))
}

/// The first points of the family that is the whole box of so many inputs: as many of each of its nets, `count` together.
pub(super) fn points_of_box(input_count: usize, count: u64, seed: u64) -> Vec<Inputs> {
    let base = SobolNet::new(input_count, 0);
    let nets = (0..NETS).map(|number| scrambled(&base, seed, number, 0));
    nets.flat_map(|net| (0..count / NETS).map(move |index| net_point(&net, input_count, index))).collect()
}

fn largest_difference(a: &Inputs, b: &Inputs) -> f64 {
    a.iter().zip(b).fold(0.0f64, |largest, (a, b)| largest.max((a - b).abs()))
}

fn free_inputs(skeleton: &Skeleton, face: u64) -> [bool; MOST_INPUTS] {
    let mut free = [false; MOST_INPUTS];
    skeleton.face(face).free.into_iter().for_each(|axis| free[axis] = true);
    free
}

/// Inputs at a limit stay there: the tip does not move with them.
fn held(tip: &Tip, free: &[bool; MOST_INPUTS]) -> Tip {
    let mut tip = *tip;
    tip.jacobian.iter_mut().zip(free).filter(|(_, free)| !**free).for_each(|(column, _)| *column = [0.0; 3]);
    tip
}

/// sqrt(det(JᵀJ)) over the free inputs: volume, area or length of the tip's travel for a unit of inputs.
fn stretch(tip: &Tip, dimension: usize) -> f64 {
    let columns: Vec<Vector> = tip.jacobian.iter().copied().filter(|column| *column != [0.0; 3]).collect();
    let cross = |a: Vector, b: Vector| -> Vector {
        std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
    };
    match (dimension, &columns[..]) {
        (1, [a]) => norm(*a),
        (2, [a, b]) => norm(cross(*a, *b)),
        (3, [a, b, c]) => super::tip_map::dot(cross(*a, *b), *c).abs(),
        _ => 0.0,
    }
}
