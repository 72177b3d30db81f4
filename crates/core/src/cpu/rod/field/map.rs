//! A field sampled on a grid: cubic B-splines of its potential, each lane in a cell of its own. F9
#![allow(clippy::needless_range_loop)]

use crate::cpu::algebra::{Mat3, Vec3};
use crate::cpu::simd::apart::apart;
use crate::cpu::simd::lane::{Lane, Scalar, WIDEST};
use crate::model::{MapGrid, Units};
use std::sync::Arc;

/// A point counts as inside up to this share of a step beyond the last node.
const EDGE: f64 = 1e-6;

/// A map in the plan's units.
#[derive(Clone, Debug)]
pub struct ProgramMap {
    grid: Arc<MapGrid>,
    origin: [f64; 3],
    steps: [f64; 3],
    /// Of a potential in SI.
    unit: f64,
}

/// A map of a group of samples.
#[derive(Clone, Debug)]
pub struct Map<L> {
    pub program: Arc<ProgramMap>,
    pub scale: L,
    /// Of the file's origin.
    pub X: Vec3<L>,
}

/// Derivatives of the potential, by their orders along x, y, z.
type Orders<L> = [[[L; 4]; 4]; 4];

/// The field of unit scale at a point, and its second derivatives.
#[derive(Clone, Copy, Debug)]
pub struct MapLocal<L> {
    pub B: Vec3<L>,
    pub G: Mat3<L>,
    orders: Orders<L>,
}

impl ProgramMap {
    pub fn new(grid: &Arc<MapGrid>, units: &Units) -> Self {
        Self {
            grid: Arc::clone(grid),
            origin: grid.origin.map(|x| x / units.length),
            steps: grid.steps.map(|x| x / units.length),
            unit: 1.0 / (units.field * units.length),
        }
    }
}

/// Weights of four neighbours for the value and three derivatives.
#[inline(always)]
fn weights<L: Lane>(s: L, per_step: f64) -> [[L; 4]; 4] {
    let one = s.constant(1.0);
    let r = one - s;
    let [sixth, half, two] = [1.0 / 6.0, 0.5, 2.0].map(|x| s.constant(x));
    let (three, high, low) = (s.constant(3.0), s.constant(2.0 / 3.0), s.constant(1.5));
    let mut all = [
        [r * r * r * sixth, high - s * s * (one - half * s), high - r * r * (one - half * r), s * s * s * sixth],
        [-(half * r * r), s * (low * s - two), r * (two - low * r), half * s * s],
        [r, three * s - two, three * r - two, s],
        [-one, three, -three, one],
    ];
    let mut by = one;
    for order in &mut all[1..] {
        by = by * one.constant(per_step);
        for x in order {
            *x = *x * by;
        }
    }
    all
}

impl<L: Lane> Map<L> {
    /// The field of unit scale at a point; derivatives of the potential up to an order.
    #[inline(always)]
    pub fn local(&self, x: Vec3<L>, most: usize) -> MapLocal<L> {
        L::apart(x.x.token(), LocalOfMap { map: self, x, most })
    }

    #[inline(always)]
    fn local_apart(&self, x: Vec3<L>, most: usize) -> MapLocal<L> {
        let ProgramMap { grid, origin, steps, unit } = &*self.program;
        let zero = x.x.constant(0.0);
        let token = zero.token();
        let mut lanes = [L::Scalar::default(); WIDEST];
        let mut first = [0_usize; WIDEST];
        let mut by = [[[zero; 4]; 4]; 3];
        let mut stride = 1;
        for axis in 0..3 {
            let per_step = 1.0 / steps[axis];
            let from = x[axis] - self.X[axis] - zero.constant(origin[axis]);
            (from * zero.constant(per_step)).store(&mut lanes);
            for lane in 0..L::COUNT {
                let u = lanes[lane].to_f64();
                let cell = (u.max(0.0) as usize).min(grid.counts[axis] - 2);
                lanes[lane] = L::Scalar::from_f64(u - cell as f64);
                first[lane] += cell * stride;
            }
            by[axis] = weights(L::load(token, &lanes), per_step);
            stride *= grid.counts[axis] + 2;
        }
        let row = grid.counts[0] + 2;
        let plane = row * (grid.counts[1] + 2);
        let mut orders: Orders<L> = [[[zero; 4]; 4]; 4];
        for k in 0..4 {
            let mut of_plane = [[zero; 4]; 4];
            for j in 0..4 {
                let mut along = [zero; 4];
                for i in 0..4 {
                    let at = k * plane + j * row + i;
                    for lane in 0..L::COUNT {
                        // In f32 a potential would lose the digits that its differences need.
                        let near = grid.coefficients[first[lane] + plane + row + 1];
                        let c = grid.coefficients[first[lane] + at] - near;
                        lanes[lane] = L::Scalar::from_f64(c * unit);
                    }
                    let c = L::load(token, &lanes);
                    for a in 0..=most {
                        along[a] = by[0][a][i].mul_add(c, along[a]);
                    }
                }
                for a in 0..=most {
                    for b in 0..=most - a {
                        of_plane[a][b] = by[1][b][j].mul_add(along[a], of_plane[a][b]);
                    }
                }
            }
            for a in 0..=most {
                for b in 0..=most - a {
                    for c in 0..=most - a - b {
                        orders[a][b][c] = by[2][c][k].mul_add(of_plane[a][b], orders[a][b][c]);
                    }
                }
            }
        }
        let o = &orders;
        let B = Vec3 { x: -o[1][0][0], y: -o[0][1][0], z: -o[0][0][1] };
        let G = symmetric([o[2][0][0], o[1][1][0], o[1][0][1], o[0][2][0], o[0][1][1], o[0][0][2]]);
        MapLocal { B, G, orders }
    }

    /// Places along a line from `p` by `arm`, and their shares of it: those of the rule on each stretch within one cell, where the
    /// field is a polynomial. A rule of one place is not cut. F9
    pub fn places(&self, p: Vec3<L>, arm: Vec3<L>, rule: &[(f64, f64)]) -> Vec<(L, L)> {
        let zero = p.x.constant(0.0);
        let token = zero.token();
        let mut cuts: [Vec<f64>; WIDEST] = std::array::from_fn(|_| Vec::new());
        let (mut begin, mut by) = ([L::Scalar::default(); WIDEST], [L::Scalar::default(); WIDEST]);
        for axis in 0..if rule.len() > 1 { 3 } else { 0 } {
            let ProgramMap { grid, origin, steps, .. } = &*self.program;
            let per_step = zero.constant(1.0 / steps[axis]);
            ((p[axis] - self.X[axis] - zero.constant(origin[axis])) * per_step).store(&mut begin);
            (arm[axis] * per_step).store(&mut by);
            // Beyond the first and the last cell their polynomials go on.
            let most = (grid.counts[axis] - 2) as f64;
            for lane in 0..L::COUNT {
                let (u, du) = (begin[lane].to_f64(), by[lane].to_f64());
                let last = u.max(u + du).min(most);
                let mut face = u.min(u + du).ceil().max(1.0);
                while face <= last {
                    let at = (face - u) / du;
                    if 0.0 < at && at < 1.0 {
                        cuts[lane].push(at);
                    }
                    face += 1.0;
                }
            }
        }
        cuts.iter_mut().for_each(|cuts| cuts.sort_by(f64::total_cmp));
        let stretches = 1 + cuts.iter().map(Vec::len).max().unwrap_or(0);
        let mut places = Vec::with_capacity(stretches * rule.len());
        let mut from = zero;
        let mut ends = [L::Scalar::default(); WIDEST];
        for k in 0..stretches {
            for (end, cuts) in ends.iter_mut().zip(&cuts) {
                *end = L::Scalar::from_f64(cuts.get(k).copied().unwrap_or(1.0));
            }
            let to = L::load(token, &ends);
            for (at, share) in rule {
                places.push(((to - from).mul_add(zero.constant(*at), from), (to - from) * zero.constant(*share)));
            }
            from = to;
        }
        places
    }

    /// How far a point is inside; negative outside.
    #[inline(always)]
    pub fn inside(&self, x: Vec3<L>, least: L) -> L {
        let ProgramMap { grid, origin, steps, .. } = &*self.program;
        let mut least = least;
        for axis in 0..3 {
            let margin = least.constant(EDGE * steps[axis]);
            let end = least.constant((grid.counts[axis] - 1) as f64 * steps[axis]);
            let along = x[axis] - self.X[axis] - least.constant(origin[axis]);
            least = least.min(along + margin).min(end + margin - along);
        }
        least
    }
}

apart!(LocalOfMap<'a, L: Lane>(map: &'a Map<L>, x: Vec3<L>, most: usize) -> MapLocal<L>, map.local_apart(x, most));

/// Minus the matrix of xx, xy, xz, yy, yz, zz.
#[inline(always)]
fn symmetric<L: Lane>([xx, xy, xz, yy, yz, zz]: [L; 6]) -> Mat3<L> {
    Mat3 { x: Vec3 { x: -xx, y: -xy, z: -xz }, y: Vec3 { x: -xy, y: -yy, z: -yz }, z: Vec3 { x: -xz, y: -yz, z: -zz } }
}

impl<L: Lane> MapLocal<L> {
    /// Second derivatives of mu . B; the third order must have been asked for.
    #[inline(always)]
    pub fn T3(&self, mu: Vec3<L>) -> Mat3<L> {
        let o = &self.orders;
        let along = |a: L, b: L, c: L| a.mul_add(mu.x, b.mul_add(mu.y, c * mu.z));
        symmetric([
            along(o[3][0][0], o[2][1][0], o[2][0][1]),
            along(o[2][1][0], o[1][2][0], o[1][1][1]),
            along(o[2][0][1], o[1][1][1], o[1][0][2]),
            along(o[1][2][0], o[0][3][0], o[0][2][1]),
            along(o[1][1][1], o[0][2][1], o[0][1][2]),
            along(o[1][0][2], o[0][1][2], o[0][0][3]),
        ])
    }
}
