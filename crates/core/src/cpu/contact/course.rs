//! The axis of the rod between two stations: a polynomial of degree 5 through place, slope and bend at both.

use crate::cpu::algebra::{Vec3, axpy};
use crate::cpu::simd::lane::Lane;

/// Places on a step of the rod where its gap is looked at.
pub const PLACES: usize = 8;
/// Places on a rigid segment.
pub const RIGID_PLACES: usize = 64;

/// The polynomial of degree 5 through a step of the rod: how much place, first and second derivative at its begin count, then those at
/// its end, by powers of the share of the step.
const POSITION: [[f64; 6]; 6] = [
    [1.0, 0.0, 0.0, -10.0, 15.0, -6.0],
    [0.0, 1.0, 0.0, -6.0, 8.0, -3.0],
    [0.0, 0.0, 0.5, -1.5, 1.5, -0.5],
    [0.0, 0.0, 0.0, 10.0, -15.0, 6.0],
    [0.0, 0.0, 0.0, -4.0, 7.0, -3.0],
    [0.0, 0.0, 0.0, 0.5, -1.0, 0.5],
];
/// Its derivative by that share.
const DIRECTION: [[f64; 6]; 6] = [
    [0.0, 0.0, -30.0, 60.0, -30.0, 0.0],
    [1.0, 0.0, -18.0, 32.0, -15.0, 0.0],
    [0.0, 1.0, -4.5, 6.0, -2.5, 0.0],
    [0.0, 0.0, 30.0, -60.0, 30.0, 0.0],
    [0.0, 0.0, -12.0, 28.0, -15.0, 0.0],
    [0.0, 0.0, 1.5, -4.0, 2.5, 0.0],
];

/// How the axis of the rod runs through a station: its place, and the first and second derivative by the length.
#[derive(Clone, Copy, Debug)]
pub struct Course<L> {
    pub p: Vec3<L>,
    pub v: Vec3<L>,
    pub bend: Vec3<L>,
}

/// The point at a share of a step of the rod, and its derivative by that share.
#[inline(always)]
pub fn along<L: Lane>(u: f64, before: &Course<L>, after: &Course<L>, span: L) -> (Vec3<L>, Vec3<L>) {
    let weighed = |by: [[f64; 6]; 6]| between(by.map(|powers| sum_of(powers, u)), before, after, span);
    (weighed(POSITION), weighed(DIRECTION))
}

/// A sum of what both ends are, by these weights.
#[inline(always)]
fn between<L: Lane>(weights: [f64; 6], before: &Course<L>, after: &Course<L>, span: L) -> Vec3<L> {
    let [p, v, a] = [0, 1, 2].map(|k| span.constant(weights[k]));
    let [to_p, to_v, to_a] = [3, 4, 5].map(|k| span.constant(weights[k]));
    let place = before.p * p + after.p * to_p;
    let way = axpy(v * span, before.v, axpy(to_v * span, after.v, place));
    let square = span * span;
    axpy(a * square, before.bend, axpy(to_a * square, after.bend, way))
}

/// A polynomial by its coefficients, the last of the highest power.
fn sum_of(powers: [f64; 6], u: f64) -> f64 {
    powers.iter().rev().fold(0.0, |sum, x| sum * u + x)
}
