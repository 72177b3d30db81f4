//! Elastic stability: the index of the second variation, by conjugate points over the steps of a pass.
//!
//! With the canonical columns (w, mu), mu = dm - w x m / 2, elimination from the base leaves the negative eigenvalues of
//! A + b^-1 a at each station, A = mu w^-1 by base moment; congruent forms need only the w of six columns. S1 to S3
//!
//! Where there are columns by base moment alone, the negative eigenvalues of A itself are counted at each station: those
//! of the rod cut off there. None at all means none of the whole (S4); others mean nothing.

use super::base::{moment_columns, rotation_columns};
use super::columns::{By, Columns};
use super::problem::shoot;
use super::problem::{Problem, Record, Tip, Workspace};
use super::section::Flexible;
use super::segments::{Rigid, Rod, Segment};
use super::station::Station;
use super::terms::Terms;
use crate::cpu::algebra::{Mat3, Vec3, columns_cross_sub, cross, dot, inverse, length, select_matrix, transpose};
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::tolerances::{INDEX_NOISE, growth_noise};

/// Counts the interval from the last station to the end of a step, unless it is too short: its b is round-off.
#[inline(always)]
pub fn add_station<L: Lane>(
    terms: impl Terms,
    station: &mut Station<L>,
    shortest: L,
    s: L,
    end: &Tip<L>,
    columns: &[Columns<L>],
) {
    let Some(by_rotation) = by_rotation(columns) else {
        station.index = stability_index(terms, station, end, columns);
        return;
    };
    let (by_moment, by_rotation) = (columns[0].w, by_rotation.w);
    let b = by_moment * transpose(station.by_rotation) - by_rotation * transpose(station.by_moment);
    let q = transpose(station.by_moment) * (inverse(b) * by_moment);
    let counts = shortest.lt(s - station.s);
    station.index = L::select(counts, station.index + negative_count(q), station.index);
    station.by_moment = select_matrix::<L>(counts, by_moment, station.by_moment);
    station.by_rotation = select_matrix::<L>(counts, by_rotation, station.by_rotation);
    station.s = L::select(counts, s, station.s);
}

/// Counts one more where an interval of length `h` under a force up to `n` may buckle by itself: force times the square of the
/// length over stiffness is `most` or more. S1 and S4 count only what intervals do together.
#[inline(always)]
pub fn add_doubt<L: Lane>(
    terms: impl Terms,
    station: &mut Station<L>,
    rod: &Rod<L>,
    segment: &Flexible<L>,
    h: L,
    n: L,
    most: f64,
) {
    let mut softening = n;
    if terms.general() && segment.has_magnet {
        softening = softening + length(segment.mu) * length(rod.B);
    }
    let Vec3 { x, y, z } = segment.stiffness;
    let mut least = L::select(x.lt(y), x, y);
    least = L::select(z.lt(least), z, least);
    let doubtful = (least * h.constant(most)).lt(softening * h * h);
    station.index = station.index + count(doubtful, h.constant(1.0));
}

/// The columns by base rotation, which are the last.
#[inline(always)]
pub fn by_rotation<L>(columns: &[Columns<L>]) -> Option<&Columns<L>> {
    columns.last().filter(|last| last.by == By::BaseRotation)
}

/// Number of negative eigenvalues of the second variation; the first of the columns are those by base moment.
#[inline(always)]
pub fn stability_index<L: Lane>(terms: impl Terms, station: &Station<L>, tip: &Tip<L>, columns: &[Columns<L>]) -> L {
    station.index + negative_count(transpose(columns[0].w) * canonical(terms, tip, &columns[0]))
}

/// The stability index at a base moment, with columns by base rotation.
#[inline(always)]
pub fn whole_index<L: Lane>(problem: &Problem<'_, L>, m0: Vec3<L>, workspace: &mut Workspace<L>) -> L {
    let program = problem.program;
    let one = m0.x.constant(1.0);
    let columns = &mut [moment_columns(one), rotation_columns(m0)];
    let tip = shoot(problem, &program.fine, one, m0, columns, Record::Stability, workspace);
    stability_index(program.terms, &workspace.station, &tip, columns)
}

/// Squared Frobenius norm.
#[inline(always)]
pub fn squared_norm<L: Lane>(a: &Mat3<L>) -> L {
    dot(a.x, a.x) + dot(a.y, a.y) + dot(a.z, a.z)
}

/// The stability margin that belongs to (dr/dm0)^-1.
#[inline(always)]
pub fn margin<L: Lane>(w_inverse: &Mat3<L>) -> L {
    (w_inverse.x.x.constant(3.0) / squared_norm(w_inverse)).sqrt()
}

/// Whether the margin that belongs to (dr/dm0)^-1 of this squared norm is above a bound.
#[inline(always)]
pub fn is_above<L: Lane>(square: L, bound: f64) -> L::Mask {
    (square * square.constant(bound * bound)).lt(square.constant(3.0))
}

/// Where a dead moment acts, or a load that turns with the rod: its work depends on the way, and no energy tells stability. S6
#[inline(always)]
pub fn has_no_energy<L: Lane>(rod: &Rod<L>) -> L::Mask {
    let largest = |v: Vec3<L>| v.x.abs().max(v.y.abs()).max(v.z.abs());
    let mut load = largest(rod.l_tip);
    for segment in &rod.segments {
        if let Segment::Rigid(Rigid { w, c, has_couple, follows, .. }) = segment {
            load = if *has_couple { load.max(largest(*c)) } else { load };
            load = if *follows { load.max(largest(*w)) } else { load };
        }
    }
    load.constant(0.0).lt(load)
}

/// By how much dr/dm0 differs from an earlier one with the inverse `before`, relative to it: below 1 its determinant has the
/// same sign. S6
#[inline(always)]
pub fn departure<L: Lane>(before: &Mat3<L>, w: &Mat3<L>) -> L {
    let one = w.x.x.constant(1.0);
    squared_norm(&(*before * *w - Mat3::identity(one))).sqrt()
}

/// Whether an index other than 0 means anything, where dr/dm0 is `w`: its round-off is small.
#[inline(always)]
pub fn is_sharp<L: Lane>(w: &Mat3<L>) -> L::Mask {
    let noise = w.x.x.constant(L::Scalar::EPSILON) * squared_norm(w);
    noise.lt(noise.constant(INDEX_NOISE))
}

/// mu = dm - w x m / 2 of three columns at the tip.
#[inline(always)]
pub fn canonical<L: Lane>(terms: impl Terms, tip: &Tip<L>, columns: &Columns<L>) -> Mat3<L> {
    let half_m = tip.m * tip.m.x.constant(0.5);
    columns_cross_sub(columns.w, half_m, columns.moment(terms, tip.p, tip.n))
}

/// 1 where the mask holds, else 0.
#[inline(always)]
fn count<L: Lane>(mask: L::Mask, one: L) -> L {
    L::select(mask, one, one.constant(0.0))
}

/// Number of negative eigenvalues of the symmetric part, by the signs of its leading minors.
#[inline(always)]
pub fn negative_count<L: Lane>(q: Mat3<L>) -> L {
    let s = q + transpose(q);
    let largest = s.x.x.abs().max(s.y.y.abs()).max(s.z.z.abs()).max(s.y.x.abs()).max(s.z.x.abs()).max(s.z.y.abs());
    let (zero, one) = (largest.constant(0.0), largest.constant(1.0));
    // Nothing is left to eliminate next to the base.
    let s = s * (one / largest.max(zero.constant(f64::from(f32::MIN_POSITIVE))));
    let first = s.x.x;
    let second = s.y.x.neg_mul_add(s.y.x, s.x.x * s.y.y);
    let third = dot(s.x, cross(s.y, s.z));
    count(first.lt(zero), one) + count((first * second).lt(zero), one) + count((second * third).lt(zero), one)
}

/// Whether errors grow so much along the rod, where dr/dm0 is `w`, that the columns of a single pass are not to be
/// trusted: what a pass multiplies by `w` and divides by it again is rounded.
#[inline(always)]
pub fn is_grown<L: Lane>(w: &Mat3<L>) -> L::Mask {
    let noise = squared_norm(w) * w.x.x.constant(L::Scalar::EPSILON);
    !noise.lt(noise.constant(growth_noise(L::Scalar::EPSILON)))
}
