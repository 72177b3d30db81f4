//! Vectors and 3 x 3 matrices of lanes, in the words of WGSL.

use crate::cpu::simd::lane::Lane;

/// A vector of three lanes.
#[derive(Clone, Copy, Debug)]
pub struct Vec3<L> {
    pub x: L,
    pub y: L,
    pub z: L,
}

/// A matrix by its columns.
#[derive(Clone, Copy, Debug)]
pub struct Mat3<L> {
    pub x: Vec3<L>,
    pub y: Vec3<L>,
    pub z: Vec3<L>,
}

impl<L: Lane> Vec3<L> {
    #[inline(always)]
    pub fn splat(value: L) -> Self {
        Self { x: value, y: value, z: value }
    }

    #[inline(always)]
    pub fn select(mask: L::Mask, if_true: Self, if_false: Self) -> Self {
        Self {
            x: L::select(mask, if_true.x, if_false.x),
            y: L::select(mask, if_true.y, if_false.y),
            z: L::select(mask, if_true.z, if_false.z),
        }
    }
}

impl<L: Lane> Mat3<L> {
    #[inline(always)]
    pub fn zero(of: L) -> Self {
        let zero = Vec3::splat(of.constant(0.0));
        Self { x: zero, y: zero, z: zero }
    }

    #[inline(always)]
    pub fn identity(of: L) -> Self {
        let (o, i) = (of.constant(0.0), of.constant(1.0));
        Self { x: Vec3 { x: i, y: o, z: o }, y: Vec3 { x: o, y: i, z: o }, z: Vec3 { x: o, y: o, z: i } }
    }
}

/// `s a + b`
#[inline(always)]
pub fn axpy<L: Lane>(s: L, a: Vec3<L>, b: Vec3<L>) -> Vec3<L> {
    Vec3 { x: s.mul_add(a.x, b.x), y: s.mul_add(a.y, b.y), z: s.mul_add(a.z, b.z) }
}

#[inline(always)]
pub fn dot<L: Lane>(a: Vec3<L>, b: Vec3<L>) -> L {
    a.z.mul_add(b.z, a.y.mul_add(b.y, a.x * b.x))
}

#[inline(always)]
pub fn cross<L: Lane>(a: Vec3<L>, b: Vec3<L>) -> Vec3<L> {
    Vec3 { x: a.z.neg_mul_add(b.y, a.y * b.z), y: a.x.neg_mul_add(b.z, a.z * b.x), z: a.y.neg_mul_add(b.x, a.x * b.y) }
}

/// `a x b + c`
#[inline(always)]
pub fn cross_add<L: Lane>(a: Vec3<L>, b: Vec3<L>, c: Vec3<L>) -> Vec3<L> {
    Vec3 {
        x: a.z.neg_mul_add(b.y, a.y.mul_add(b.z, c.x)),
        y: a.x.neg_mul_add(b.z, a.z.mul_add(b.x, c.y)),
        z: a.y.neg_mul_add(b.x, a.x.mul_add(b.y, c.z)),
    }
}

/// `c - a x b`
#[inline(always)]
pub fn cross_sub<L: Lane>(a: Vec3<L>, b: Vec3<L>, c: Vec3<L>) -> Vec3<L> {
    cross_add(b, a, c)
}

#[inline(always)]
pub fn length<L: Lane>(a: Vec3<L>) -> L {
    dot(a, a).sqrt()
}

#[inline(always)]
pub fn transpose<L: Lane>(a: Mat3<L>) -> Mat3<L> {
    Mat3 {
        x: Vec3 { x: a.x.x, y: a.y.x, z: a.z.x },
        y: Vec3 { x: a.x.y, y: a.y.y, z: a.z.y },
        z: Vec3 { x: a.x.z, y: a.y.z, z: a.z.z },
    }
}

/// The adjugate, and the determinant.
#[inline(always)]
pub fn adjugate<L: Lane>(a: Mat3<L>) -> (Mat3<L>, L) {
    let (yz, zx, xy) = (cross(a.y, a.z), cross(a.z, a.x), cross(a.x, a.y));
    (transpose(Mat3 { x: yz, y: zx, z: xy }), dot(a.x, yz))
}

/// Inverse by cofactors; its accuracy suffices because Newton's iteration corrects itself.
#[inline(always)]
pub fn inverse<L: Lane>(a: Mat3<L>) -> Mat3<L> {
    let (adjugate, determinant) = adjugate(a);
    adjugate * (determinant.constant(1.0) / determinant)
}

/// Each column of `a` crossed with `v` and added to `c`: `a_k x v + c_k`
#[inline(always)]
pub fn columns_cross_add<L: Lane>(a: Mat3<L>, v: Vec3<L>, c: Mat3<L>) -> Mat3<L> {
    Mat3 { x: cross_add(a.x, v, c.x), y: cross_add(a.y, v, c.y), z: cross_add(a.z, v, c.z) }
}

/// `c_k - a_k x v`
#[inline(always)]
pub fn columns_cross_sub<L: Lane>(a: Mat3<L>, v: Vec3<L>, c: Mat3<L>) -> Mat3<L> {
    Mat3 { x: cross_sub(a.x, v, c.x), y: cross_sub(a.y, v, c.y), z: cross_sub(a.z, v, c.z) }
}

/// Each column of `a` crossed with `v`: `a_k x v`
#[inline(always)]
pub fn columns_cross<L: Lane>(a: Mat3<L>, v: Vec3<L>) -> Mat3<L> {
    Mat3 { x: cross(a.x, v), y: cross(a.y, v), z: cross(a.z, v) }
}

/// `a row^T + sum`
#[inline(always)]
pub fn outer<L: Lane>(a: Vec3<L>, row: Vec3<L>, sum: Mat3<L>) -> Mat3<L> {
    Mat3 { x: axpy(row.x, a, sum.x), y: axpy(row.y, a, sum.y), z: axpy(row.z, a, sum.z) }
}

/// `s a + b`
#[inline(always)]
pub fn columns_axpy<L: Lane>(s: L, a: Mat3<L>, b: Mat3<L>) -> Mat3<L> {
    Mat3 { x: axpy(s, a.x, b.x), y: axpy(s, a.y, b.y), z: axpy(s, a.z, b.z) }
}

/// `hat(v)`: the matrix whose columns are v x e_k.
#[inline(always)]
pub fn hat<L: Lane>(v: Vec3<L>) -> Mat3<L> {
    let zero = v.x.constant(0.0);
    Mat3 {
        x: Vec3 { x: zero, y: v.z, z: -v.y },
        y: Vec3 { x: -v.z, y: zero, z: v.x },
        z: Vec3 { x: v.y, y: -v.x, z: zero },
    }
}

/// `v . a_k` for each column.
#[inline(always)]
pub fn row_times<L: Lane>(v: Vec3<L>, a: Mat3<L>) -> Vec3<L> {
    Vec3 { x: dot(v, a.x), y: dot(v, a.y), z: dot(v, a.z) }
}

/// Whether two numbers, one of them below `near`, differ more than `most` times.
#[inline(always)]
pub fn differs_widely<L: Lane>(a: L, b: L, near: f64, most: f64) -> L::Mask {
    let most = a.constant(most);
    let is_near = a.min(b).lt(a.constant(near));
    is_near & ((a * most).lt(b) | (b * most).lt(a))
}

/// The longest load step from a margin below `near`, which a load step of `used` has taken there from `last`: as it falls, the next
/// uses up `share` of it. Beyond a pitchfork other branches are stable. A margin that does not fall bounds no step.
#[inline(always)]
pub fn affordable<L: Lane>(margin: L, last: L, used: L, near: f64, share: f64) -> L {
    let falls = margin.lt(last) & margin.lt(used.constant(near));
    L::select(falls, margin * used * used.constant(share) / (last - margin), used.constant(2.0))
}

#[inline(always)]
pub fn select_matrix<L: Lane>(mask: L::Mask, if_true: Mat3<L>, if_false: Mat3<L>) -> Mat3<L> {
    Mat3 {
        x: Vec3::select(mask, if_true.x, if_false.x),
        y: Vec3::select(mask, if_true.y, if_false.y),
        z: Vec3::select(mask, if_true.z, if_false.z),
    }
}
