//! The index of the second variation by elimination of intervals from the tip. F7
//!
//! z = (dp, w) and y = (dn, dm - w x m / 2) of an interval's end follow from those of its start by (a, b; c, d). Held at
//! its start its end yields by C = b d^-1. Where what lies beyond answers with y = S z, its pivot C^-1 - S has as many
//! negative eigenvalues as I - B^T S B, where C = B B^T: an interval that cannot lengthen needs no inverse of C.
#![allow(clippy::needless_range_loop)]

use super::matrix::Mat6;
use crate::lanes::lane::{Lane, Scalar};

/// How the end of an interval follows its start.
#[derive(Clone, Copy, Debug)]
pub struct Transfer<L> {
    pub a: Mat6<L>,
    pub b: Mat6<L>,
    pub c: Mat6<L>,
    pub d: Mat6<L>,
    /// Whether it bends; a rigid one has no b.
    pub bends: bool,
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
    let mut found = Stability { index: one.constant(0.0), determinant: one };
    let mut S = Mat6::zero(one);
    for transfer in transfers.iter().rev() {
        if transfer.bends {
            pivots(transfer, &S, &mut found);
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
    let C = transfer.d.transposed().solve_soon(&transfer.b.transposed());
    let (root, mut index) = root(&C, one);
    let product = root.transposed().times(&S.times(&root));
    let mut pivot = Mat6::identity(one).minus(&product).0;
    for k in 0..6 {
        let negative = pivot[k][k].lt(zero);
        // A number that is none is no sign of stability.
        let positive = zero.lt(pivot[k][k]);
        index = L::select(negative | !positive, index + one, index);
        found.determinant = found.determinant * pivot[k][k];
        let inverse = one / pivot[k][k];
        for row in k + 1..6 {
            let factor = pivot[row][k] * inverse;
            for column in k + 1..6 {
                pivot[row][column] = factor.neg_mul_add(pivot[k][column], pivot[row][column]);
            }
        }
    }
    found.index = found.index + index;
}

/// B of C = B B^T, a column of zeros where C does not yield; and one for each rotation in which C yields the wrong way,
/// which a short interval does in none. To displacements along it it hardly yields, and less than its pass errs.
#[inline(always)]
fn root<L: Lane>(C: &Mat6<L>, one: L) -> (Mat6<L>, L) {
    let zero = one.constant(0.0);
    let noise = one.constant(64.0 * L::Scalar::EPSILON);
    let (mut c, mut root, mut index) = (C.0, Mat6::zero(one), zero);
    let mut largest = zero;
    for k in 0..6 {
        largest = largest.max(c[k][k].abs());
    }
    let least = largest * noise;
    for k in [3, 4, 5, 0, 1, 2] {
        let yields = least.lt(c[k][k]);
        if k >= 3 {
            index = L::select(c[k][k].lt(-least), index + one, index);
        }
        let inverse = L::select(yields, one / c[k][k].max(least).sqrt(), zero);
        let mut column = [zero; 6];
        for row in 0..6 {
            column[row] = (c[row][k] + c[k][row]) * inverse * one.constant(0.5);
        }
        for row in 0..6 {
            root.0[row][k] = column[row];
            for other in 0..6 {
                c[row][other] = column[row].neg_mul_add(column[other], c[row][other]);
            }
        }
    }
    (root, index)
}
