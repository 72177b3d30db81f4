//! The field of a magnetised cuboid outside of the rod, exact. F13

use super::nearest::least_on;
use crate::cpu::algebra::{Mat3, Vec3, dot, hat, transpose};
use crate::cpu::simd::apart::apart;
use crate::cpu::simd::lane::{Lane, Scalar, WIDEST};
use crate::model::{Cuboid, Derivatives, Vector, other_axes};

/// A cuboid as a point sees it.
#[derive(Clone, Copy, Debug)]
pub struct Seen<L> {
    /// Columns: the directions of its edges.
    edges: Mat3<L>,
    M: Vec3<L>,
    /// From the centre to the point.
    r: Vec3<L>,
    by: Derivatives<L>,
}

impl<L: Lane> Seen<L> {
    /// A cuboid of moment M at r from its centre: what derivatives of B up to this order need.
    #[inline(always)]
    pub fn new(cuboid: &Cuboid, edges: Mat3<L>, M: Vec3<L>, r: Vec3<L>, order: usize) -> Self {
        let half = &cuboid.half;
        Self { edges, M, r, by: L::apart(r.x.token(), DerivativesAt { half, r: transpose(edges) * r, order }) }
    }

    /// N M, N the second derivatives of the mean of 1 / r.
    #[inline(always)]
    pub fn B(&self) -> Vec3<L> {
        self.unit() * self.M
    }

    /// The gradient of B; it needs an order of 1.
    #[inline(always)]
    pub fn G(&self) -> Mat3<L> {
        self.in_world(third(&self.by, self.along_edges(self.M)))
    }

    /// Second derivatives of mu . B; they need an order of 2.
    #[inline(always)]
    pub fn T3(&self, mu: Vec3<L>) -> Mat3<L> {
        self.in_world(fourth(&self.by, self.along_edges(self.M), self.along_edges(mu)))
    }

    /// dB/dM, its edges at rest.
    #[inline(always)]
    pub fn unit(&self) -> Mat3<L> {
        self.in_world(second(&self.by))
    }

    /// d(G mu)/dM likewise; it needs an order of 1.
    #[inline(always)]
    pub fn pull(&self, mu: Vec3<L>) -> Mat3<L> {
        self.in_world(third(&self.by, self.along_edges(mu)))
    }

    /// By a rotation of its edges, its moment at rest: of B and of G mu; it needs an order of 2.
    #[inline(always)]
    pub fn by_turn(&self, mu: Vec3<L>) -> (Mat3<L>, Mat3<L>) {
        let (B, G, of_r, of_M) = (self.B(), self.G(), hat(self.r), hat(self.M));
        // Turned with its moment it has the field that it had, turned.
        let by_B = G * of_r + self.unit() * of_M - hat(B);
        let by_F = G * hat(mu) + self.T3(mu) * of_r + self.pull(mu) * of_M - hat(G * mu);
        (by_B, by_F)
    }

    #[inline(always)]
    fn along_edges(&self, v: Vec3<L>) -> Vec3<L> {
        transpose(self.edges) * v
    }

    #[inline(always)]
    fn in_world(&self, along_edges: Mat3<L>) -> Mat3<L> {
        self.edges * (along_edges * transpose(self.edges))
    }
}

/// Second derivatives, as a matrix.
#[inline(always)]
fn second<L: Lane>(by: &Derivatives<L>) -> Mat3<L> {
    symmetric(by.ii, by.ij)
}

/// Third derivatives times a vector.
#[inline(always)]
fn third<L: Lane>(by: &Derivatives<L>, v: Vec3<L>) -> Mat3<L> {
    let mut all = [by.ijk; 6];
    for i in 0..3 {
        let [j, k] = other_axes(i);
        all[i] = by.iii[i] * v[i] + by.iij[i][j] * v[j] + by.iij[i][k] * v[k];
        all[3 + i] = by.iij[j][k] * v[j] + by.iij[k][j] * v[k] + by.ijk * v[i];
    }
    let [xx, yy, zz, yz, xz, xy] = all;
    symmetric([xx, yy, zz], [yz, xz, xy])
}

/// Fourth derivatives times two vectors.
#[inline(always)]
fn fourth<L: Lane>(by: &Derivatives<L>, u: Vec3<L>, v: Vec3<L>) -> Mat3<L> {
    // Products along an edge, and along the two edges other than one.
    let same = [0, 1, 2].map(|i| u[i] * v[i]);
    let mixed = [0, 1, 2].map(|i| {
        let [j, k] = other_axes(i);
        u[j] * v[k] + u[k] * v[j]
    });
    let mut all = [by.ijk; 6];
    for i in 0..3 {
        let [j, k] = other_axes(i);
        let of_same = by.iiii[i] * same[i] + by.iijj[k] * same[j] + by.iijj[j] * same[k];
        all[i] = of_same + by.iiij[i][j] * mixed[k] + by.iiij[i][k] * mixed[j] + by.iijk[i] * mixed[i];
        let of_same = by.iiij[j][k] * same[j] + by.iiij[k][j] * same[k] + by.iijk[i] * same[i];
        all[3 + i] = of_same + by.iijj[i] * mixed[i] + by.iijk[j] * mixed[k] + by.iijk[k] * mixed[j];
    }
    let [xx, yy, zz, yz, xz, xy] = all;
    symmetric([xx, yy, zz], [yz, xz, xy])
}

/// A symmetric matrix by its diagonal entries, and by its others in the order of the axis that each does not name.
#[inline(always)]
fn symmetric<L: Lane>([xx, yy, zz]: [L; 3], [yz, xz, xy]: [L; 3]) -> Mat3<L> {
    Mat3 { x: Vec3 { x: xx, y: xy, z: xz }, y: Vec3 { x: xy, y: yy, z: yz }, z: Vec3 { x: xz, y: yz, z: zz } }
}

apart!(DerivativesAt<'a, L: Lane>(half: &'a Vector, r: Vec3<L>, order: usize) -> Derivatives<L>, derivatives(half, r, order));

/// Derivatives of the mean of 1 / r at a place along the edges. Far away differences of a thousandth and less are left of their terms: in
/// single precision each sample has its own in double precision.
#[inline(always)]
fn derivatives<L: Lane>(half: &Vector, r: Vec3<L>, order: usize) -> Derivatives<L> {
    if L::Scalar::SHARP { sharp(half, r, order) } else { one_by_one(half, r) }
}

/// See `model/cuboid.rs`.
#[inline(always)]
fn one_by_one<L: Lane>(half: &Vector, r: Vec3<L>) -> Derivatives<L> {
    let mut places = [[L::Scalar::default(); WIDEST]; 3];
    (0..3).for_each(|k| r[k].store(&mut places[k]));
    let cuboid = Cuboid { half: *half, edges: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };
    let each: [Derivatives<f64>; WIDEST] = std::array::from_fn(|lane| match lane < L::COUNT {
        true => cuboid.derivatives([0, 1, 2].map(|k| places[k][lane].to_f64())),
        false => Derivatives::default(),
    });
    let token = r.x.token();
    let gather = |of: &dyn Fn(&Derivatives<f64>) -> f64| {
        L::load(token, &std::array::from_fn::<_, WIDEST, _>(|lane| L::Scalar::from_f64(of(&each[lane]))))
    };
    let three = |of: fn(&Derivatives<f64>) -> &Vector| [0, 1, 2].map(|i| gather(&|d| of(d)[i]));
    let nine =
        |of: fn(&Derivatives<f64>) -> &[Vector; 3]| [0, 1, 2].map(|i| [0, 1, 2].map(|j| gather(&|d| of(d)[i][j])));
    Derivatives {
        ii: three(|d| &d.ii),
        ij: three(|d| &d.ij),
        iii: three(|d| &d.iii),
        iij: nine(|d| &d.iij),
        ijk: gather(&|d| d.ijk),
        iiii: three(|d| &d.iiii),
        iiij: nine(|d| &d.iiij),
        iijj: three(|d| &d.iijj),
        iijk: three(|d| &d.iijk),
    }
}

#[inline(always)]
fn sharp<L: Lane>(half: &Vector, r: Vec3<L>, order: usize) -> Derivatives<L> {
    let constant = |x: f64| r.x.constant(x);
    let (zero, one) = (constant(0.0), constant(1.0));
    let sides = [1.0, -1.0];
    let per_volume = constant(0.125 / half.iter().product::<f64>());
    let mut of = Derivatives {
        ii: [zero; 3],
        ij: [zero; 3],
        iii: [zero; 3],
        iij: [[zero; 3]; 3],
        ijk: zero,
        iiii: [zero; 3],
        iiij: [[zero; 3]; 3],
        iijj: [zero; 3],
        iijk: [zero; 3],
    };
    let at = [0, 1, 2].map(|k| sides.map(|side| r[k] + constant(side * half[k])));
    for k in 0..3 {
        let [i, j] = other_axes(k);
        let [up, down] = at[k];
        let below = [up, down].map(|z| z.lt(zero));
        let is_beside = below[1] & !below[0];
        let mut angles = [[zero; 2]; 2];
        let mut logarithms = [[zero; 2]; 2];
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let (x, y) = (at[i][a], at[j][b]);
            let share = per_volume * constant(sides[a] * sides[b]);
            let (x2, y2) = (x * x, y * y);
            let rho2 = x2 + y2;
            let [far_up, far_down] = [up, down].map(|z| z.mul_add(z, rho2).sqrt());
            let both = far_up + far_down;
            logarithms[a][b] = halved(constant(2.0 * half[k]), both, -1.0);
            let halves = [(up, far_up), (down, far_down)].map(|(z, far)| {
                let product = x * y;
                let signed = L::select(z.lt(zero), -product, product);
                halved(signed, z.abs() * far, 1.0)
            });
            angles[a][b] = merged(halves, 1.0);
            if order == 0 {
                continue;
            }
            // 1 / (R (R + |Z|)) at both ends, and what its slope by X is over X.
            let ends = [(up, far_up), (down, far_down)].map(|(z, far)| {
                let height = z.abs();
                let near = one / (far * (far + height));
                (near, near * near * (far + far + height) / far)
            });
            let signed = |of: [L; 2], beside: L| {
                let upper = L::select(below[0], -of[0], of[0]);
                let lower = L::select(below[1], of[1], -of[1]);
                upper + lower - L::select(is_beside, beside, zero)
            };
            let inverse = one / rho2;
            let g = signed([ends[0].0, ends[1].0], inverse + inverse);
            of.iij[i][j] = (share * x).mul_add(g, of.iij[i][j]);
            of.iij[j][i] = (share * y).mul_add(g, of.iij[j][i]);
            if k == 0 {
                of.ijk = of.ijk + share * (one / far_up - one / far_down);
            }
            if order > 1 {
                let q = signed([ends[0].1, ends[1].1], inverse * inverse * constant(4.0));
                of.iiij[i][j] = share.mul_add(g - x2 * q, of.iiij[i][j]);
                of.iiij[j][i] = share.mul_add(g - y2 * q, of.iiij[j][i]);
                of.iijj[k] = of.iijj[k] - share * x * y * q;
                let cubes = [(up, far_up), (down, far_down)].map(|(z, far)| z / (far * far * far));
                of.iijk[k] = of.iijk[k] - share * (cubes[0] - cubes[1]);
            }
        }
        of.ij[k] = total(logarithms, -1.0) * per_volume * constant(4.0);
        of.ii[k] = total(angles, 1.0) * per_volume * constant(-4.0);
    }
    for i in 0..3 {
        let [j, k] = other_axes(i);
        of.iii[i] = -(of.iij[j][i] + of.iij[k][i]);
        of.iiii[i] = -(of.iijj[j] + of.iijj[k]);
    }
    of
}

/// tan(phi / 2) of tan(phi) = y / x, x not negative, for a sign of 1; tanh(phi / 2) of tanh(phi) = y / x for -1. Of 0 / 0 it is zero.
#[inline(always)]
fn halved<L: Lane>(y: L, x: L, sign: f64) -> L {
    let root = (y * y).mul_add(y.constant(sign), x * x).max(y.constant(0.0)).sqrt();
    y / (x + root).max(y.constant(f64::MIN_POSITIVE))
}

/// The half of a difference of two of these, of tan or of tanh.
#[inline(always)]
fn merged<L: Lane>([plus, minus]: [L; 2], sign: f64) -> L {
    let along = (plus * minus).mul_add(plus.constant(sign), plus.constant(1.0));
    halved(plus - minus, along, sign)
}

/// phi_11 - phi_12 - phi_21 + phi_22 of their tangents, or their hyperbolic tangents.
#[inline(always)]
fn total<L: Lane>(of: [[L; 2]; 2], sign: f64) -> L {
    let eighth = halved(merged(of.map(|pair| merged(pair, sign)), sign), of[0][0].constant(1.0), sign);
    // The series of the arc tangent below 0.3, or of its hyperbolic sibling.
    let square = eighth * eighth * eighth.constant(-sign);
    let mut sum = square.constant(0.0);
    for k in (0..14).rev() {
        sum = sum.mul_add(square, square.constant(1.0 / f64::from(2 * k + 1)));
    }
    eighth * sum * eighth.constant(8.0)
}

/// Distance of a straight piece from the surface of a cuboid about the origin, negative inside.
#[inline(always)]
pub fn distance<L: Lane>(cuboid: &Cuboid, edges: Mat3<L>, from: Vec3<L>, along: Vec3<L>) -> L {
    let back = transpose(edges);
    L::apart(from.x.token(), Distance { half: &cuboid.half, from: back * from, along: back * along })
}

apart!(Distance<'a, L: Lane>(half: &'a Vector, from: Vec3<L>, along: Vec3<L>) -> L, distance_apart(half, from, along));

#[inline(always)]
fn distance_apart<L: Lane>(half: &Vector, from: Vec3<L>, along: Vec3<L>) -> L {
    let zero = from.x.constant(0.0);
    least_on(zero, |share| {
        let r = from + along * share;
        let beyond = [0, 1, 2].map(|k| r[k].abs() - zero.constant(half[k]));
        let inside = beyond[0].max(beyond[1]).max(beyond[2]).min(zero);
        let [x, y, z] = beyond.map(|x| x.max(zero));
        let out = Vec3 { x, y, z };
        dot(out, out).sqrt() + inside
    })
}
