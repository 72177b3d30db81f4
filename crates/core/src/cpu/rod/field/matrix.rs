//! Matrices of six rows, and their elimination with a choice of pivots in each lane. Loops are written out: a closure is
//! compiled without the kernel's instructions.
#![allow(clippy::needless_range_loop)]

use crate::cpu::algebra::{Mat3, Vec3, cross, dot, inverse};
use crate::cpu::simd::apart::apart;
use crate::cpu::simd::lane::Lane;
use std::ops::Range;

/// A block is inverted where its volume is at least this share of the product of its sides.
const SOUND: f64 = 0.01;

/// By rows; the first three of a pair are of displacement or force, the last of rotation or moment.
#[derive(Clone, Copy, Debug)]
pub struct Mat6<L>(pub [[L; 6]; 6]);

impl<L: Lane> Mat6<L> {
    #[inline(always)]
    pub fn zero(of: L) -> Self {
        Self([[of.constant(0.0); 6]; 6])
    }

    #[inline(always)]
    pub fn identity(of: L) -> Self {
        let mut all = Self::zero(of);
        for k in 0..6 {
            all.0[k][k] = of.constant(1.0);
        }
        all
    }

    #[inline(always)]
    pub fn select(mask: L::Mask, a: &Self, b: &Self) -> Self {
        let mut all = *a;
        for row in 0..6 {
            for column in 0..6 {
                all.0[row][column] = L::select(mask, a.0[row][column], b.0[row][column]);
            }
        }
        all
    }

    /// Puts three columns from column `at` on: the first three rows, and the last.
    #[inline(always)]
    pub fn put(&mut self, at: usize, first: &Mat3<L>, last: &Mat3<L>) {
        for k in 0..3 {
            for row in 0..3 {
                self.0[row][at + k] = first[k][row];
                self.0[row + 3][at + k] = last[k][row];
            }
        }
    }

    #[inline(always)]
    pub fn transposed(&self) -> Self {
        let mut all = *self;
        for row in 0..6 {
            for column in 0..6 {
                all.0[row][column] = self.0[column][row];
            }
        }
        all
    }

    #[inline(always)]
    pub fn times(&self, b: &Self) -> Self {
        let mut all = *self;
        for row in 0..6 {
            for column in 0..6 {
                let mut sum = self.0[row][0] * b.0[0][column];
                for k in 1..6 {
                    sum = self.0[row][k].mul_add(b.0[k][column], sum);
                }
                all.0[row][column] = sum;
            }
        }
        all
    }

    /// Adds the product of three rows of `a`, from row `at` on and of columns `from` alone, with `b`.
    #[inline(always)]
    pub fn add_product(&mut self, at: usize, a: &Self, from: Range<usize>, b: &Self) {
        for row in at..at + 3 {
            for column in 0..6 {
                let mut sum = self.0[row][column];
                for k in from.clone() {
                    sum = a.0[row][k].mul_add(b.0[k][column], sum);
                }
                self.0[row][column] = sum;
            }
        }
    }

    #[inline(always)]
    pub fn plus(&self, b: &Self) -> Self {
        let mut all = *self;
        for row in 0..6 {
            for column in 0..6 {
                all.0[row][column] = self.0[row][column] + b.0[row][column];
            }
        }
        all
    }

    #[inline(always)]
    pub fn minus(&self, b: &Self) -> Self {
        let mut all = *self;
        for row in 0..6 {
            for column in 0..6 {
                all.0[row][column] = self.0[row][column] - b.0[row][column];
            }
        }
        all
    }

    /// The matrix times a pair of vectors.
    #[inline(always)]
    pub fn on(&self, first: Vec3<L>, last: Vec3<L>) -> (Vec3<L>, Vec3<L>) {
        let v = [first.x, first.y, first.z, last.x, last.y, last.z];
        let mut all = v;
        for row in 0..6 {
            all[row] = self.0[row][0] * v[0];
            for k in 1..6 {
                all[row] = self.0[row][k].mul_add(v[k], all[row]);
            }
        }
        (Vec3 { x: all[0], y: all[1], z: all[2] }, Vec3 { x: all[3], y: all[4], z: all[5] })
    }

    /// A^-1 B with two digits less; by blocks, and in lanes where the first block is nearly singular by pivots.
    #[inline(always)]
    pub fn solve_soon(&self, b: &Self) -> Self {
        let (found, sound) = self.by_blocks(b);
        if L::any(!sound) { Self::select(sound, &found, &self.solve(b)) } else { found }
    }

    /// Three rows and columns, from these on.
    #[inline(always)]
    pub fn block(&self, row: usize, column: usize) -> Mat3<L> {
        let mut all = Mat3::zero(self.0[0][0]);
        for k in 0..3 {
            for j in 0..3 {
                all[k][j] = self.0[row + j][column + k];
            }
        }
        all
    }

    /// A^-1 B by elimination of three rows at once, and where that loses no more than those.
    #[inline(always)]
    fn by_blocks(&self, b: &Self) -> (Self, L::Mask) {
        let first = self.block(0, 0);
        let volume = dot(first.x, cross(first.y, first.z));
        let sides = dot(first.x, first.x) * dot(first.y, first.y) * dot(first.z, first.z);
        let sound = (sides * sides.constant(SOUND * SOUND)).lt(volume * volume);
        let first = inverse(first);
        let across = first * self.block(0, 3);
        let below = self.block(3, 0);
        let last = inverse(self.block(3, 3) - below * across);
        let mut found = *b;
        for at in [0, 3] {
            let up = first * b.block(0, at);
            let down = last * (b.block(3, at) - below * up);
            found.put(at, &(up - across * down), &down);
        }
        (found, sound)
    }

    /// A^-1 B by elimination, the largest pivot of each column chosen lane by lane.
    #[inline(always)]
    pub fn solve(&self, b: &Self) -> Self {
        self.solve_whole(b).0
    }

    /// A^-1 B by elimination with pivots, as [`Mat6::solve`], and det A.
    #[inline(always)]
    pub fn solve_whole(&self, b: &Self) -> (Self, L) {
        L::apart(self.0[0][0].token(), SolveWhole { a: self, b })
    }

    #[inline(always)]
    fn solve_whole_apart(&self, b: &Self) -> (Self, L) {
        let (mut a, mut b) = (self.0, b.0);
        let mut determinant = a[0][0].constant(1.0);
        for k in 0..6 {
            for row in k + 1..6 {
                let larger = a[k][k].abs().lt(a[row][k].abs());
                for column in 0..6 {
                    let (up, down) = (a[k][column], a[row][column]);
                    a[k][column] = L::select(larger, down, up);
                    a[row][column] = L::select(larger, up, down);
                    let (up, down) = (b[k][column], b[row][column]);
                    b[k][column] = L::select(larger, down, up);
                    b[row][column] = L::select(larger, up, down);
                }
                determinant = L::select(larger, -determinant, determinant);
            }
            determinant = determinant * a[k][k];
            let inverse = a[k][k].constant(1.0) / a[k][k];
            for row in k + 1..6 {
                let factor = a[row][k] * inverse;
                for column in k + 1..6 {
                    a[row][column] = factor.neg_mul_add(a[k][column], a[row][column]);
                }
                for column in 0..6 {
                    b[row][column] = factor.neg_mul_add(b[k][column], b[row][column]);
                }
            }
        }
        for k in (0..6).rev() {
            let inverse = a[k][k].constant(1.0) / a[k][k];
            for column in 0..6 {
                let mut x = b[k][column];
                for j in k + 1..6 {
                    x = a[k][j].neg_mul_add(b[j][column], x);
                }
                b[k][column] = x * inverse;
            }
        }
        (Self(b), determinant)
    }
}

apart!(SolveWhole<'a, L: Lane>(a: &'a Mat6<L>, b: &'a Mat6<L>) -> (Mat6<L>, L), a.solve_whole_apart(b));
