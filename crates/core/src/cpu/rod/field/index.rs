//! The index of the second variation by elimination of intervals from the tip. F7
//!
//! z = (dp, w) and y = (dn, dm - w x m / 2) of an interval's end follow from those of its start by (a, b; c, d). Held at
//! its start its end yields by C = b d^-1. Where what lies beyond answers with y = S z, its pivot C^-1 - S has as many
//! negative eigenvalues as J - B^T S B, where C = B J B^T and J is a diagonal of signs: an interval that cannot lengthen needs no
//! inverse of C. A piece that is soft in torsion may be unstable by itself (a sign of -1) and stable as a part of the rod.
#![allow(clippy::needless_range_loop)]

use super::matrix::Mat6;
use crate::cpu::algebra::inverse;
use crate::cpu::simd::apart::apart;
use crate::cpu::simd::lane::{Lane, Scalar};

/// What is known of a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interval {
    /// It does not bend: b is 0.
    Rigid,
    /// A displacement takes it along, and force is the same at both ends but for loads.
    Free,
    /// A flexible one with a magnet.
    Magnetised,
}

/// How the end of an interval follows its start.
#[derive(Clone, Copy, Debug)]
pub struct Transfer<L> {
    pub a: Mat6<L>,
    pub b: Mat6<L>,
    pub c: Mat6<L>,
    pub d: Mat6<L>,
    pub interval: Interval,
}

impl<L: Lane> Transfer<L> {
    /// How pose and load at its end follow what they follow at its start.
    #[inline(always)]
    pub fn beyond(&self, pose: &Mat6<L>, load: &Mat6<L>) -> (Mat6<L>, Mat6<L>) {
        let Self { a, b, c, d, interval } = self;
        let (mut new_pose, mut new_load) = (*pose, *load);
        match interval {
            Interval::Rigid => {
                new_pose.add_product(0, a, 3..6, pose);
                new_load.add_product(0, c, 0..6, pose);
                new_load.add_product(3, c, 0..6, pose);
                new_load.add_product(3, d, 0..3, load);
            }
            Interval::Free => {
                let none = Mat6::zero(a.0[0][0]);
                for row in 3..6 {
                    (new_pose.0[row], new_load.0[row]) = (none.0[row], none.0[row]);
                }
                new_pose.add_product(0, a, 3..6, pose);
                new_pose.add_product(0, b, 0..6, load);
                new_pose.add_product(3, a, 3..6, pose);
                new_pose.add_product(3, b, 0..6, load);
                new_load.add_product(3, c, 3..6, pose);
                new_load.add_product(3, d, 0..6, load);
            }
            Interval::Magnetised => {
                new_pose = a.times(pose).plus(&b.times(load));
                new_load = c.times(pose).plus(&d.times(load));
            }
        }
        (new_pose, new_load)
    }

    /// b d^-1, symmetric.
    #[inline(always)]
    fn compliance(&self) -> Mat6<L> {
        let Self { b, d, interval, .. } = self;
        if *interval != Interval::Free {
            return d.transposed().solve_soon(&b.transposed());
        }
        let (below, last) = (d.block(3, 0), inverse(d.block(3, 3)));
        let (up, down) = (b.block(0, 3) * last, b.block(3, 3) * last);
        let mut C = *b;
        C.put(0, &(b.block(0, 0) - up * below), &(b.block(3, 0) - down * below));
        C.put(3, &up, &down);
        C
    }
}

/// What all pivots tell of stability.
#[derive(Clone, Copy, Debug)]
pub struct Stability<L> {
    /// Negative eigenvalues.
    pub index: L,
    /// Of the second variation, over that of a rod without loads.
    pub determinant: L,
}

/// Stability by all pivots.
#[inline(always)]
pub fn index<L: Lane>(transfers: &[Transfer<L>], one: L) -> Stability<L> {
    L::apart(one.token(), Index { transfers, one })
}

apart!(Index<'a, L: Lane>(transfers: &'a [Transfer<L>], one: L) -> Stability<L>, index_apart(transfers, one));

#[inline(always)]
fn index_apart<L: Lane>(transfers: &[Transfer<L>], one: L) -> Stability<L> {
    let mut found = Stability { index: one.constant(0.0), determinant: one };
    let mut S = Mat6::zero(one);
    for (number, transfer) in transfers.iter().enumerate().rev() {
        if transfer.interval != Interval::Rigid {
            pivots(transfer, &S, &mut found);
        }
        // What the base holds does not yield.
        if number == 0 {
            break;
        }
        let left = transfer.d.minus(&S.times(&transfer.b));
        let right = S.times(&transfer.a).minus(&transfer.c);
        let next = left.solve_soon(&right);
        let half = one.constant(0.5);
        let turned = next.transposed();
        S = next.plus(&turned);
        for x in S.0.as_flattened_mut() {
            *x = *x * half;
        }
    }
    found
}

/// Adds negative eigenvalues of one pivot, and its determinant.
#[inline(always)]
fn pivots<L: Lane>(transfer: &Transfer<L>, S: &Mat6<L>, found: &mut Stability<L>) {
    let zero = found.index.constant(0.0);
    let one = zero.constant(1.0);
    let S = swapped(S);
    let (root, signs) = root(&swapped(&transfer.compliance()), one);
    let mut index = zero;
    let mut pivot = Mat6::zero(one).0;
    (0..6).for_each(|k| pivot[k][k] = signs[k]);
    for k in 0..6 {
        // B^T S, then J - B^T S B, whose other half is the same.
        let mut row = [zero; 6];
        for j in k..6 {
            for column in 0..6 {
                row[column] = root[k][j].mul_add(S.0[j][column], row[column]);
            }
        }
        for other in 0..=k {
            for j in 0..6 {
                pivot[k][other] = row[j].neg_mul_add(root[other][j], pivot[k][other]);
            }
            pivot[other][k] = pivot[k][other];
        }
    }
    for k in 0..6 {
        let negative = pivot[k][k].lt(zero);
        // A number that is none is no sign of stability.
        let positive = zero.lt(pivot[k][k]);
        index = L::select(negative | !positive, index + one, index);
        found.determinant = found.determinant * pivot[k][k];
        let inverse = one / pivot[k][k];
        for row in k + 1..6 {
            let factor = pivot[row][k] * inverse;
            for column in 0..6 {
                pivot[row][column] = factor.neg_mul_add(pivot[k][column], pivot[row][column]);
            }
        }
    }
    found.index = found.index + index;
}

/// B^T and J of C = B J B^T, rotations before displacements; a row of zeros and a sign of 1 where C does not yield. To
/// displacements along it an interval hardly yields, and less than its pass errs.
#[inline(always)]
fn root<L: Lane>(C: &Mat6<L>, one: L) -> ([[L; 6]; 6], [L; 6]) {
    let zero = one.constant(0.0);
    let (half, noise) = (one.constant(0.5), one.constant(64.0 * L::Scalar::EPSILON));
    let (mut c, mut root, mut signs) = (C.0, [[zero; 6]; 6], [one; 6]);
    let mut largest = zero;
    for k in 0..6 {
        largest = largest.max(C.0[k][k].abs());
        for column in 0..6 {
            c[k][column] = (C.0[k][column] + C.0[column][k]) * half;
        }
    }
    let least = largest * noise;
    for k in 0..6 {
        // A displacement that is negative within round-off does not yield, either.
        let is_negative = if k < 3 { c[k][k].lt(-least) } else { one.lt(zero) };
        let yields = least.lt(c[k][k]) | is_negative;
        signs[k] = L::select(is_negative, -one, one);
        let inverse = L::select(yields, one / c[k][k].abs().max(least).sqrt(), zero);
        let mut line = c[k];
        for column in 0..6 {
            line[column] = line[column] * inverse;
        }
        for row in k + 1..6 {
            for column in 0..6 {
                c[row][column] = (line[row] * signs[k]).neg_mul_add(line[column], c[row][column]);
            }
        }
        root[k] = line;
    }
    (root, signs)
}

/// The last of a pair first.
#[inline(always)]
fn swapped<L: Lane>(m: &Mat6<L>) -> Mat6<L> {
    let mut all = *m;
    for row in 0..6 {
        for column in 0..6 {
            all.0[row][column] = m.0[(row + 3) % 6][(column + 3) % 6];
        }
    }
    all
}
