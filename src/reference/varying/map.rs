//! A field sampled on a grid, by de Boor's algorithm on the B-splines of its potential and on their differences. F9

use crate::model::{RodMap, Units};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// In the units of the chain, positions from the base.
#[derive(Clone, Debug)]
pub(super) struct Map {
    pub scale: f64,
    grid: Arc<crate::model::MapGrid>,
    /// Of the first node.
    origin: Vector3<f64>,
    steps: Vector3<f64>,
    /// Of a potential in SI.
    unit: f64,
}

/// A spline over one cell from its coefficients, one more than its degree, a share `s` into the cell. They are used up.
fn de_boor(d: &mut [f64], s: f64) -> f64 {
    let p = d.len() - 1;
    for r in 1..=p {
        for j in (r..=p).rev() {
            let alpha = (s + (p - j) as f64) / (p + 1 - r) as f64;
            d[j] = (1.0 - alpha) * d[j - 1] + alpha * d[j];
        }
    }
    d[p]
}

/// A derivative over one cell of steps of length h: the spline of the coefficients' differences.
fn along(mut coefficients: [f64; 4], order: usize, s: f64, h: f64) -> f64 {
    let mut count = coefficients.len();
    for _ in 0..order {
        count -= 1;
        for k in 0..count {
            coefficients[k] = (coefficients[k + 1] - coefficients[k]) / h;
        }
    }
    de_boor(&mut coefficients[..count], s)
}

/// A symmetric matrix from what is on its diagonal and above.
fn symmetric(of: impl Fn(usize, usize) -> f64) -> Matrix3<f64> {
    let mut all = Matrix3::from_fn(|a, b| if a <= b { of(a, b) } else { 0.0 });
    all.fill_lower_triangle_with_upper_triangle();
    all
}

impl Map {
    pub(super) fn new(map: &RodMap, base: Vector3<f64>, units: &Units) -> Self {
        let origin = Vector3::from(map.position) + Vector3::from(map.grid.origin) - base;
        Self {
            scale: map.scale,
            grid: Arc::clone(&map.grid),
            origin: origin / units.length,
            steps: Vector3::from(map.grid.steps) / units.length,
            unit: 1.0 / (units.field * units.length),
        }
    }

    /// A derivative of the potential of unit scale.
    fn derivative(&self, x: Vector3<f64>, orders: [usize; 3]) -> f64 {
        let u = (x - self.origin).component_div(&self.steps);
        let cell: [usize; 3] = std::array::from_fn(|k| (u[k].floor().max(0.0) as usize).min(self.grid.counts[k] - 2));
        let s: [f64; 3] = std::array::from_fn(|k| u[k] - cell[k] as f64);
        let [nx, ny] = [self.grid.counts[0] + 2, self.grid.counts[1] + 2];
        let at = |i: usize, j: usize, k: usize| {
            self.unit * self.grid.coefficients[((cell[2] + k) * ny + cell[1] + j) * nx + cell[0] + i]
        };
        let on_line = |i: usize, j: usize| along(std::array::from_fn(|k| at(i, j, k)), orders[2], s[2], self.steps.z);
        let on_plane = |i: usize| along(std::array::from_fn(|j| on_line(i, j)), orders[1], s[1], self.steps.y);
        along(std::array::from_fn(on_plane), orders[0], s[0], self.steps.x)
    }

    fn by(&self, x: Vector3<f64>, axes: &[usize]) -> f64 {
        self.derivative(x, std::array::from_fn(|k| axes.iter().filter(|axis| **axis == k).count()))
    }

    /// Where a line from `p` by `arm` passes from one cell to the next, as shares of it.
    pub(super) fn faces(&self, p: Vector3<f64>, arm: Vector3<f64>) -> Vec<f64> {
        let (u, du) = ((p - self.origin).component_div(&self.steps), arm.component_div(&self.steps));
        let of_axis = |k: usize| (1..self.grid.counts[k] - 1).map(move |face| (face as f64 - u[k]) / du[k]);
        (0..3).flat_map(of_axis).filter(|at| 0.0 < *at && *at < 1.0).collect()
    }

    /// B of unit scale.
    pub(super) fn B(&self, x: Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|a, _| -self.by(x, &[a]))
    }

    /// Its gradient.
    pub(super) fn G(&self, x: Vector3<f64>) -> Matrix3<f64> {
        symmetric(|a, b| -self.by(x, &[a, b]))
    }

    /// Second derivatives of mu . B.
    pub(super) fn T3(&self, x: Vector3<f64>, mu: Vector3<f64>) -> Matrix3<f64> {
        symmetric(|a, b| -(0..3).map(|c| mu[c] * self.by(x, &[a, b, c])).sum::<f64>())
    }

    /// How far a point is inside; negative outside.
    pub(super) fn inside(&self, x: Vector3<f64>) -> f64 {
        let end = |k: usize| self.origin[k] + (self.grid.counts[k] - 1) as f64 * self.steps[k];
        let of_axis = |k: usize| (x[k] - self.origin[k]).min(end(k) - x[k]) + 1e-6 * self.steps[k];
        let inside = (0..3).map(of_axis).fold(f64::INFINITY, f64::min);
        let u = (x - self.origin).component_div(&self.steps);
        let of_file = std::array::from_fn(|k| self.grid.origin[k] + u[k] * self.grid.steps[k]);
        if self.grid.is_gap(of_file) { inside.min(-self.steps.x) } else { inside }
    }
}
