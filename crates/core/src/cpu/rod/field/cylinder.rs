//! The field of a magnetised cylinder outside of the rod, exact. F12

use super::nearest::least_on;
use crate::cpu::algebra::{Mat3, Vec3, dot, hat, outer};
use crate::cpu::simd::apart::apart;
use crate::cpu::simd::lane::Lane;
use crate::model::Cylinder;

/// Derivatives of a cylinder's potential at a point, per unit of its moment: by the square of the distance from the axis (s) and by the
/// coordinate along it (z).
#[derive(Clone, Copy, Debug)]
struct Slopes<L> {
    s: L,
    z: L,
    ss: L,
    sz: L,
    zz: L,
    sss: L,
    ssz: L,
    szz: L,
    zzz: L,
}

/// A cylinder as a point sees it.
#[derive(Clone, Copy, Debug)]
pub struct Seen<L> {
    axis: Vec3<L>,
    moment: L,
    /// From the centre to the point.
    r: Vec3<L>,
    /// The part of it across the axis.
    q: Vec3<L>,
    by: Slopes<L>,
}

impl<L: Lane> Seen<L> {
    /// A cylinder of moment M along its axis, at r from its centre: what derivatives of B up to this order need.
    #[inline(always)]
    pub fn new(cylinder: &Cylinder, M: Vec3<L>, r: Vec3<L>, order: usize) -> Self {
        // Without moment there is no axis, and no field.
        let moment = dot(M, M).sqrt();
        let axis = M * (r.x.constant(1.0) / moment.max(r.x.constant(f64::from(f32::MIN_POSITIVE))));
        let z = dot(axis, r);
        let q = r - axis * z;
        Self { axis, moment, r, q, by: L::apart(z.token(), SlopesAt { cylinder, s: dot(q, q), z, order }) }
    }

    #[inline(always)]
    pub fn B(&self) -> Vec3<L> {
        (self.q * (self.by.s + self.by.s) + self.axis * self.by.z) * -self.moment
    }

    /// The gradient of B; it needs an order of 1.
    #[inline(always)]
    pub fn G(&self) -> Mat3<L> {
        let Self { axis, q, by, .. } = *self;
        let two = by.s.constant(2.0);
        let q_part = q * (two * two * by.ss) + axis * (two * by.sz);
        let axis_part = q * (two * by.sz) + axis * (by.zz - two * by.s);
        outer(q, q_part, outer(axis, axis_part, Mat3::identity(two) * (two * by.s))) * -self.moment
    }

    /// Second derivatives of mu . B; they need an order of 2.
    #[inline(always)]
    pub fn T3(&self, mu: Vec3<L>) -> Mat3<L> {
        let Self { axis, q, by, .. } = *self;
        let constant = |x: f64| by.s.constant(x);
        let nu = dot(axis, mu);
        let u = mu - axis * nu;
        let c = dot(q, u);
        let (four, eight) = (constant(4.0), constant(8.0));
        // Over the plane across the axis, then with it, then along it.
        let across = four * by.ss * c + constant(2.0) * by.sz * nu;
        let q_part = q * (eight * by.sss * c + four * by.ssz * nu) + u * (four * by.ss);
        let mixed = u * (constant(2.0) * by.sz) + q * (four * by.ssz * c + constant(2.0) * by.szz * nu);
        let along = constant(2.0) * by.szz * c + by.zzz * nu - across;
        let mut sum = outer(axis, axis * along, Mat3::identity(c) * across);
        sum = outer(q, q_part, outer(u, q * (four * by.ss), sum));
        sum = outer(mixed, axis, outer(axis, mixed, sum));
        sum * -self.moment
    }

    /// dB/dM, where the cylinder turns with its moment; it needs an order of 1.
    #[inline(always)]
    pub fn unit(&self) -> Mat3<L> {
        let (B, G) = (self.B(), self.G());
        self.by_moment(B, G * hat(self.r) - hat(B))
    }

    /// d(G mu)/dM likewise; it needs an order of 2.
    #[inline(always)]
    pub fn pull(&self, mu: Vec3<L>) -> Mat3<L> {
        let G = self.G();
        let F = G * mu;
        self.by_moment(F, G * hat(mu) + self.T3(mu) * hat(self.r) - hat(F))
    }

    /// How what is `value` changes by the moment: along it in proportion, across it by `turn` of the rotation.
    #[inline(always)]
    fn by_moment(&self, value: Vec3<L>, turn: Mat3<L>) -> Mat3<L> {
        let per = self.moment.constant(1.0) / self.moment.max(self.moment.constant(f64::from(f32::MIN_POSITIVE)));
        outer(value, self.axis, turn * hat(self.axis)) * per
    }
}

apart!(SlopesAt<'a, L: Lane>(cylinder: &'a Cylinder, s: L, z: L, order: usize) -> Slopes<L>, slopes(cylinder, s, z, order));

/// Means over the circles of both ends; see `model/cylinder.rs`.
#[inline(always)]
fn slopes<L: Lane>(cylinder: &Cylinder, s: L, z: L, order: usize) -> Slopes<L> {
    let constant = |x: f64| s.constant(x);
    let (zero, one) = (constant(0.0), constant(1.0));
    let rho = s.sqrt();
    let mut sum = Slopes { s: zero, z: zero, ss: zero, sz: zero, zz: zero, sss: zero, ssz: zero, szz: zero, zzz: zero };
    let ends = cylinder.circles().flat_map(|circle| [1.0, -1.0].map(|side| (circle, side)));
    for ((a, of_circle), side) in ends {
        let a = constant(a);
        let a2 = a * a;
        let zeta = z - constant(side * cylinder.half_length);
        let (near, far) = (a - rho, a + rho);
        let (least, most) = (zeta.mul_add(zeta, near * near), zeta.mul_add(zeta, far * far));
        let ratio = (least / most).sqrt();
        let (stretched, height) = (most * ratio, zeta.abs());
        let (mut up, mut s3, mut s5, mut s7, mut q7, mut q9, mut p11) = (zero, zero, zero, zero, zero, zero, zero);
        for tau in cylinder.rule {
            let tau = constant(*tau);
            let d = one / ratio.mul_add(tau, one);
            let r2 = stretched.mul_add(tau, least) * d;
            let inverse2 = one / r2;
            let (inverse, weight) = (inverse2.sqrt(), (one + tau) * d);
            let (r, sine2) = (r2 * inverse, constant(4.0) * ratio * tau * d * d);
            let lift = one / (r + height);
            let n3 = weight * sine2 * inverse * inverse2;
            up = up + lift * (weight * inverse - s * n3 * (r + r + height) * lift);
            s3 = s3 + n3;
            if order > 0 {
                let n5 = n3 * inverse2;
                let n7 = n5 * inverse2;
                (s5, q7) = (s5 + n5, sine2.mul_add(n7, q7));
                if order > 1 {
                    let n9 = sine2 * n7 * inverse2;
                    (s7, q9, p11) = (s7 + n7, q9 + n9, (sine2 * inverse2).mul_add(n9, p11));
                }
            }
        }
        let share = of_circle * side / (2.0 * cylinder.half_length * cylinder.rule.len() as f64);
        let scale = ratio.sqrt() * constant(share);
        let up = up * (scale + scale);
        sum.s = sum.s - s3 * scale;
        sum.z = sum.z + L::select(zeta.lt(zero), up, -up);
        if order > 0 {
            let (first, half) = (-(s3 * scale), scale * constant(0.5));
            let ss = half * (s5 * constant(3.0) - a2 * q7 * constant(5.0));
            let sz = zeta * s5 * scale * constant(3.0);
            (sum.ss, sum.sz) = (sum.ss + ss, sum.sz + sz);
            sum.zz = sum.zz - (first + s * ss) * constant(4.0);
            if order > 1 {
                let ssz = zeta * half * (a2 * q9 * constant(35.0) - s7 * constant(15.0));
                let sss = half * (a2 * (q9 * constant(35.0) - a2 * p11 * constant(31.5)) - s7 * constant(7.5));
                (sum.ssz, sum.sss) = (sum.ssz + ssz, sum.sss + sss);
                sum.szz = sum.szz - (ss * constant(8.0) + s * sss * constant(4.0));
                sum.zzz = sum.zzz - (sz + s * ssz) * constant(4.0);
            }
        }
    }
    sum
}

/// Distance of a straight piece from the surface of a cylinder about the origin, negative inside.
#[inline(always)]
pub fn distance<L: Lane>(cylinder: &Cylinder, M: Vec3<L>, from: Vec3<L>, along: Vec3<L>) -> L {
    L::apart(M.x.token(), Distance { cylinder, M, from, along })
}

apart!(
    Distance<'a, L: Lane>(cylinder: &'a Cylinder, M: Vec3<L>, from: Vec3<L>, along: Vec3<L>) -> L,
    distance_apart(cylinder, M, from, along)
);

#[inline(always)]
fn distance_apart<L: Lane>(cylinder: &Cylinder, M: Vec3<L>, from: Vec3<L>, along: Vec3<L>) -> L {
    let zero = from.x.constant(0.0);
    let axis = M * (zero.constant(1.0) / dot(M, M).sqrt().max(zero.constant(f64::from(f32::MIN_POSITIVE))));
    least_on(zero, |share| {
        let r = from + along * share;
        let z = dot(axis, r);
        let q = r - axis * z;
        let outwards = dot(q, q).sqrt() - zero.constant(cylinder.radius);
        let beyond = z.abs() - zero.constant(cylinder.half_length);
        let inside = outwards.max(beyond).min(zero);
        let (x, y) = (outwards.max(zero), beyond.max(zero));
        (x * x + y * y).sqrt() + inside
    })
}
