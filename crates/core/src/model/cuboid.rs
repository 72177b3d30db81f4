//! The field of a cuboid that is magnetised evenly: sums over its corners. F13

use super::field::rotate;
use super::vectors::{cross, dot};
use super::{Matrix, Vector};

/// A magnetised cuboid about its centre; in m or in the plan's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    /// Half of its edges.
    pub half: Vector,
    /// Directions of its edges in the world, of length one: two of them, and the third across both.
    pub edges: [Vector; 2],
}

/// Derivatives of the mean of 1 / r over a cuboid's volume, along its edges. Two indices that differ are known by the third.
#[derive(Clone, Copy, Debug, Default)]
pub struct Derivatives<T> {
    /// Twice along edge i.
    pub ii: [T; 3],
    /// Along the two edges other than k.
    pub ij: [T; 3],
    /// Three times along edge i.
    pub iii: [T; 3],
    /// Twice along i, once along j; nothing where both are one.
    pub iij: [[T; 3]; 3],
    /// Along each edge once.
    pub ijk: T,
    /// Four times along edge i.
    pub iiii: [T; 3],
    /// Three times along i, once along j; nothing where both are one.
    pub iiij: [[T; 3]; 3],
    /// Twice along each of the two edges other than k.
    pub iijj: [T; 3],
    /// Twice along edge i, once along each of the others.
    pub iijk: [T; 3],
}

impl Cuboid {
    /// Entries of its record: the directions of two edges.
    pub const RECORD: usize = 6;

    /// With edges of these lengths, turned by a rotation.
    pub(super) fn new(size: Vector, turned: &Matrix) -> Self {
        Self { half: size.map(|x| 0.5 * x), edges: [0, 1].map(|k| turned.map(|row| row[k])) }
    }

    /// In other units.
    pub fn scaled(self, unit: f64) -> Self {
        Self { half: self.half.map(|x| x / unit), ..self }
    }

    /// Rows: the directions of its edges.
    pub fn axes(&self) -> Matrix {
        [self.edges[0], self.edges[1], cross(self.edges[0], self.edges[1])]
    }

    /// Distance of a point from its surface, at `r` from its centre; negative inside.
    pub fn distance(&self, r: Vector) -> f64 {
        let local = rotate(&self.axes(), r);
        let beyond: Vector = std::array::from_fn(|k| local[k].abs() - self.half[k]);
        let out = beyond.map(|x| x.max(0.0));
        dot(out, out).sqrt() + beyond.into_iter().fold(f64::NEG_INFINITY, f64::max).min(0.0)
    }

    /// B and its gradient at `r` from its centre; mu0 / 4 pi is one.
    pub fn field(&self, moment: Vector, r: Vector) -> (Vector, Matrix) {
        let axes = self.axes();
        let [m, local] = [moment, r].map(|v| rotate(&axes, v));
        let of = self.derivatives(local);
        let b: Vector = std::array::from_fn(|i| {
            let [j, k] = others(i);
            of.ii[i] * m[i] + of.ij[k] * m[j] + of.ij[j] * m[k]
        });
        let mut g = [[0.0; 3]; 3];
        for i in 0..3 {
            let [j, k] = others(i);
            g[i][i] = of.iii[i] * m[i] + of.iij[i][j] * m[j] + of.iij[i][k] * m[k];
            g[i][j] = of.iij[i][j] * m[i] + of.iij[j][i] * m[j] + of.ijk * m[k];
            g[j][i] = g[i][j];
        }
        let in_world = |v: Vector| -> Vector { std::array::from_fn(|a| (0..3).map(|k| axes[k][a] * v[k]).sum()) };
        let half_turned = g.map(in_world);
        let turned: Matrix = std::array::from_fn(|b| in_world(std::array::from_fn(|k| half_turned[k][b])));
        (in_world(b), turned)
    }

    /// At a place along its edges, from its centre. F13
    pub fn derivatives(&self, r: Vector) -> Derivatives<f64> {
        let mut of = Derivatives::<f64>::default();
        let volume = 8.0 * self.half.iter().product::<f64>();
        let sides = [1.0, -1.0];
        for k in 0..3 {
            let (h, ends) = (self.half[k], sides.map(|side| r[k] + side * self.half[k]));
            let [i, j] = others(k);
            for (s_i, s_j) in sides.into_iter().flat_map(|a| sides.map(|b| (a, b))) {
                let (x, y) = (r[i] + s_i * self.half[i], r[j] + s_j * self.half[j]);
                let (share, rho2) = (s_i * s_j / volume, x * x + y * y);
                let [r1, r2] = ends.map(|z| (rho2 + z * z).sqrt());
                // 1 / (R (R + Z)) at one end less that at the other, and 1 / X of its slope by X.
                let (mut g, mut q) = match ends[0] >= 0.0 && ends[1] < 0.0 {
                    true => (-2.0 / rho2, -4.0 / (rho2 * rho2)),
                    false => (0.0, 0.0),
                };
                for (z, r, side) in [(ends[0], r1, 1.0), (ends[1], r2, -1.0)] {
                    let sign = if z < 0.0 { -side } else { side };
                    let near = 1.0 / (r * (r + z.abs()));
                    g += sign * near;
                    q += sign * near * near * (2.0 * r + z.abs()) / r;
                }
                of.ij[k] += share * 2.0 * (2.0 * h / (r1 + r2)).atanh();
                of.iij[i][j] += share * x * g;
                of.iij[j][i] += share * y * g;
                of.iiij[i][j] += share * (g - x * x * q);
                of.iiij[j][i] += share * (g - y * y * q);
                of.iijj[k] -= share * x * y * q;
                for (z, r, side) in [(ends[0], r1, 1.0), (ends[1], r2, -1.0)] {
                    of.ii[k] -= side * share * (x * y * z.signum()).atan2(z.abs() * r);
                    of.iijk[k] -= side * share * z / (r * r * r);
                    if k == 0 {
                        of.ijk += side * share / r;
                    }
                }
            }
        }
        for i in 0..3 {
            // Outside of the cuboid its potential has no sources.
            let [j, k] = others(i);
            of.iii[i] = -(of.iij[j][i] + of.iij[k][i]);
            of.iiii[i] = -(of.iijj[j] + of.iijj[k]);
        }
        of
    }
}

/// The two axes after one, in turn.
pub fn others(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}
