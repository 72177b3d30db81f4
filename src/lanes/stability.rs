//! Elastic stability: the index of the second variation, by conjugate points over the steps of a pass.
//!
//! With the canonical columns (w, mu), mu = dm - w x m / 2, an interval contributes the negative eigenvalues of
//! Q = -b^-1 (a + b S); its congruent form w_Y2^T b^-T w_Y1 needs only the w of six columns at its ends.

use super::algebra::{Mat3, columns_cross_sub, inverse, select_matrix, transpose};
use super::column::Columns;
use super::lane::Lane;
use super::rod::Terms;
use super::shoot::{Tip, tip_moment_columns};
use crate::model::path::SHORTEST_INTERVAL;

/// The end of a step.
#[derive(Clone, Copy, Debug)]
pub struct Station<L> {
    /// w of the first two threes.
    pub by_moment: Mat3<L>,
    pub by_rotation: Mat3<L>,
    /// How much of the rod lies before it, rigid segments not counted.
    pub s: L,
}

/// Number of negative eigenvalues of the second variation; `columns` are those by moment and by rotation.
#[inline(always)]
pub fn stability_index<L: Lane, T: Terms>(stations: &[Station<L>], tip: &Tip<L>, columns: &[Columns<L>]) -> L {
    let by_moment = transpose(canonical::<L, T>(tip, &columns[0]));
    let by_rotation = transpose(canonical::<L, T>(tip, &columns[1]));
    let zero = tip.m.x.constant(0.0);
    let shortest = stations[stations.len() - 1].s * zero.constant(SHORTEST_INTERVAL);
    let mut index = zero;
    let mut before = stations[0];
    let mut proximal = free(&before, by_moment, by_rotation);
    for station in &stations[1..] {
        let distal = free(station, by_moment, by_rotation);
        let b = station.by_moment * transpose(before.by_rotation) - station.by_rotation * transpose(before.by_moment);
        let q = transpose(distal) * (transpose(inverse(b)) * proximal);
        // Of an interval of no length, b is round-off.
        let counts = shortest.lt(station.s - before.s);
        index = L::select(counts, index + negative_count(q), index);
        before = Station {
            by_moment: select_matrix::<L>(counts, station.by_moment, before.by_moment),
            by_rotation: select_matrix::<L>(counts, station.by_rotation, before.by_rotation),
            s: L::select(counts, station.s, before.s),
        };
        proximal = select_matrix::<L>(counts, distal, proximal);
    }
    index
}

/// mu = dm - w x m / 2 of three columns at the tip.
#[inline(always)]
fn canonical<L: Lane, T: Terms>(tip: &Tip<L>, columns: &Columns<L>) -> Mat3<L> {
    let half_m = tip.m * tip.m.x.constant(0.5);
    columns_cross_sub(columns.w, half_m, tip_moment_columns::<L, T>(tip, columns))
}

/// w of the columns that leave the tip free, at a station.
#[inline(always)]
fn free<L: Lane>(station: &Station<L>, by_moment: Mat3<L>, by_rotation: Mat3<L>) -> Mat3<L> {
    station.by_rotation * by_moment - station.by_moment * by_rotation
}

/// 1 where the mask holds, else 0.
#[inline(always)]
fn count<L: Lane>(mask: L::Mask, one: L) -> L {
    L::select(mask, one, one.constant(0.0))
}

/// Number of negative eigenvalues of the symmetric part, by the signs of its leading minors.
#[inline(always)]
fn negative_count<L: Lane>(q: Mat3<L>) -> L {
    let s = q + transpose(q);
    let largest = s.x.x.abs().max(s.y.y.abs()).max(s.z.z.abs()).max(s.y.x.abs()).max(s.z.x.abs()).max(s.z.y.abs());
    let (zero, one) = (largest.constant(0.0), largest.constant(1.0));
    let s = s * (one / largest);
    let first = s.x.x;
    let second = s.y.x.neg_mul_add(s.y.x, s.x.x * s.y.y);
    let third = super::algebra::dot(s.x, super::algebra::cross(s.y, s.z));
    count(first.lt(zero), one) + count((first * second).lt(zero), one) + count((second * third).lt(zero), one)
}
