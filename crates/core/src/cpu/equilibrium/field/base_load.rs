//! The load at the base, force and moment: its size, and how far the rod is from a bifurcation by it.

use crate::cpu::algebra::{Vec3, dot};
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::simd::lane::Lane;

/// sqrt(3) over the norm of d(m0)/d(l_tip).
#[inline(always)]
pub fn margin<L: Lane>(inverse: &Mat6<L>) -> L {
    let mut square = inverse.0[3][3].constant(0.0);
    for row in &inverse.0[3..] {
        for x in &row[3..] {
            square = x.mul_add(*x, square);
        }
    }
    square.constant(3.0_f64.sqrt()) / square.sqrt()
}

/// Size of a change of the load at the base, against 1 and the load.
#[inline(always)]
pub fn size<L: Lane>(change: (Vec3<L>, Vec3<L>), base: (Vec3<L>, Vec3<L>)) -> L {
    norm(change) / (norm(base) + change.0.x.constant(1.0))
}

#[inline(always)]
pub fn norm<L: Lane>((n, m): (Vec3<L>, Vec3<L>)) -> L {
    (dot(n, n) + dot(m, m)).sqrt()
}

pub type Load<L> = (Vec3<L>, Vec3<L>);

#[inline(always)]
pub fn select<L: Lane>(mask: L::Mask, a: Load<L>, b: Load<L>) -> Load<L> {
    (Vec3::select(mask, a.0, b.0), Vec3::select(mask, a.1, b.1))
}
