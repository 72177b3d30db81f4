//! The field of a cylinder that is magnetised evenly along its axis: integrals over the circles of its two ends. F12

use super::vectors::dot;
use super::{Matrix, Vector};
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Points on half of a circle, by rule.
const COUNTS: [usize; 5] = [8, 16, 32, 48, 80];
/// Their places: tan² of half of the angle theta.
static RULES: LazyLock<[Vec<f64>; 5]> = LazyLock::new(|| {
    COUNTS.map(|count| (0..count).map(|k| ((k as f64 + 0.5) * PI / (2 * count) as f64).tan().powi(2)).collect())
});
/// A rule leaves exp(-this) of the field.
const DIGITS: f64 = 25.0;

/// A magnetised cylinder about its centre; in m or in the plan's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Half of its length.
    pub half_length: f64,
    /// Its radius.
    pub radius: f64,
    /// Radius of the hole along its axis; 0: it has none.
    pub bore: f64,
    /// For points not nearer to its edges than its clearance.
    pub rule: &'static [f64],
}

/// Derivatives of the mean potential of an end, less that of the other, over the length: by the square of the distance from the axis
/// (s) and by the distance along it (z).
#[derive(Clone, Copy, Debug, Default)]
pub struct Slopes {
    /// By s.
    pub s: f64,
    /// By z.
    pub z: f64,
    /// By s twice.
    pub ss: f64,
    /// By s and z.
    pub sz: f64,
    /// By z twice.
    pub zz: f64,
    /// By s three times.
    pub sss: f64,
    /// By s twice and z.
    pub ssz: f64,
    /// By s and z twice.
    pub szz: f64,
    /// By z three times.
    pub zzz: f64,
}

impl Cylinder {
    /// The smallest clearance over the radius.
    pub const LEAST_CLEARANCE: f64 = 0.02;

    /// A cylinder that no point comes nearer to than `clearance`.
    pub fn new(length: f64, [diameter, bore]: [f64; 2], clearance: f64) -> Self {
        let radius = 0.5 * diameter;
        // The least distance from a point to the circle of an end, over the largest, bounds the error of the rule.
        let nearest = clearance / (2.0 * radius + clearance);
        let needed = DIGITS / (4.0 * nearest.sqrt().atanh());
        let rule = COUNTS.iter().position(|count| *count as f64 >= needed).unwrap_or(COUNTS.len() - 1);
        Self { half_length: 0.5 * length, radius, bore: 0.5 * bore, rule: &RULES[rule] }
    }

    /// In other units.
    pub fn scaled(self, unit: f64) -> Self {
        let [half_length, radius, bore] = [self.half_length, self.radius, self.bore].map(|x| x / unit);
        Self { half_length, radius, bore, ..self }
    }

    /// Radii of the circles that its field is summed over, with what each counts: the whole cylinder, and less than nothing for the
    /// hole.
    pub fn circles(&self) -> impl Iterator<Item = (f64, f64)> {
        let [whole, hole] = [self.radius, self.bore].map(|x| x * x);
        let all = [(self.radius, whole), (self.bore, -hole)];
        all.into_iter().filter(|(radius, _)| *radius > 0.0).map(move |(radius, area)| (radius, area / (whole - hole)))
    }

    /// Distance of a point from its surface, at `r` from its centre; negative inside, and in its hole.
    pub fn distance(&self, axis: Vector, r: Vector) -> f64 {
        let (z, q) = split(axis, r);
        let [outwards, along] = [dot(q, q).sqrt() - self.radius, z.abs() - self.half_length];
        match outwards.max(along) {
            inside if inside <= 0.0 => inside,
            _ => outwards.max(0.0).hypot(along.max(0.0)),
        }
    }

    /// B and its gradient at `r` from its centre, by a moment along its axis; mu0 / 4 pi is one.
    pub fn field(&self, moment: Vector, r: Vector) -> (Vector, Matrix) {
        let size = dot(moment, moment).sqrt();
        let axis = moment.map(|x| x / size);
        let (z, q) = split(axis, r);
        let of = self.slopes(dot(q, q), z);
        let b = std::array::from_fn(|k| -size * (2.0 * q[k] * of.s + axis[k] * of.z));
        let g = |i: usize, j: usize| {
            let across = f64::from(u8::from(i == j)) - axis[i] * axis[j];
            2.0 * across * of.s
                + 4.0 * q[i] * q[j] * of.ss
                + 2.0 * (q[i] * axis[j] + axis[i] * q[j]) * of.sz
                + axis[i] * axis[j] * of.zz
        };
        (b, std::array::from_fn(|i| std::array::from_fn(|j| -size * g(i, j))))
    }

    /// At this square of the distance from its axis, and this distance along it from its middle. F12
    pub fn slopes(&self, s: f64, z: f64) -> Slopes {
        let rho = s.sqrt();
        let mut sum = Slopes::default();
        let ends = self.circles().flat_map(|circle| [1.0, -1.0].map(|side| (circle, side)));
        for ((a, share), side) in ends {
            let zeta = z - side * self.half_length;
            let [least, most] = [a - rho, a + rho].map(|x| x * x + zeta * zeta);
            let ratio = (least / most).sqrt();
            let mut by = [0.0; 7];
            for tau in self.rule {
                let d = 1.0 / (1.0 + ratio * tau);
                let r2 = (least + most * ratio * tau) * d;
                let (r, sine2) = (r2.sqrt(), 4.0 * ratio * tau * d * d);
                let weight = (1.0 + tau) * d;
                let up = 1.0 / (r + zeta.abs());
                by[0] += weight * (up / r - s * sine2 * (2.0 * r + zeta.abs()) * up * up / (r * r2));
                let [n3, n5, n7, n9] = [3, 5, 7, 9].map(|power| weight * sine2 / r.powi(power));
                for (sum, term) in by[1..].iter_mut().zip([n3, n5, n7, sine2 * n7, sine2 * n9, sine2 * sine2 * n9 / r2])
                {
                    *sum += term;
                }
            }
            let scale = ratio.sqrt() * share * side / (2.0 * self.half_length * self.rule.len() as f64);
            let [up, s3, s5, s7, q7, q9, p11] = by.map(|x| scale * x);
            let (s1, ss) = (-s3, 0.5 * (3.0 * s5 - 5.0 * a * a * q7));
            let (sz, ssz) = (3.0 * zeta * s5, 0.5 * zeta * (35.0 * a * a * q9 - 15.0 * s7));
            let sss = 0.5 * (35.0 * a * a * q9 - 7.5 * s7 - 31.5 * a.powi(4) * p11);
            sum.s += s1;
            sum.z -= 2.0 * zeta.signum() * up;
            sum.ss += ss;
            sum.sz += sz;
            sum.zz -= 4.0 * (s1 + s * ss);
            sum.sss += sss;
            sum.ssz += ssz;
            sum.szz -= 8.0 * ss + 4.0 * s * sss;
            sum.zzz -= 4.0 * (sz + s * ssz);
        }
        sum
    }
}

/// A place along an axis, and across it.
fn split(axis: Vector, r: Vector) -> (f64, Vector) {
    let z = dot(axis, r);
    (z, std::array::from_fn(|k| r[k] - z * axis[k]))
}
