//! Fields sampled on a grid: B = -grad phi of a potential of cubic B-splines, so that it has a potential everywhere and
//! its gradient is continuous. F9

use super::{Matrix, Vector};
use std::sync::Arc;

/// Nodes that a grid needs in each direction.
pub const LEAST_MAP_NODES: usize = 4;
/// A share of what should not be there that asks for a look at the file.
const SUSPICIOUS: f64 = 0.05;
/// A point counts as inside up to this share of a step beyond the last node.
const EDGE: f64 = 1e-6;

/// A field sampled on a grid, as a user names it.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldMap {
    /// Its parameters start with `maps.` and this.
    pub name: String,
    /// Where it was read.
    pub file: String,
    /// Of the file's bytes.
    pub digest: String,
    /// Factor of the field; a current, where the file is per ampere.
    pub scale: f64,
    /// Where the file's origin is put, world frame (m)
    pub position: Vector,
    /// Units of its lengths and of its field, where the scene says them.
    pub units: [Option<String>; 2],
    /// What was read.
    pub grid: Arc<MapGrid>,
    /// Assumptions made when it was read, for notes.
    pub remarks: Vec<String>,
}

/// The potential on a grid of equal steps.
#[derive(Clone, Debug, PartialEq)]
pub struct MapGrid {
    /// Of the first node (m)
    pub origin: Vector,
    /// Between nodes (m)
    pub steps: Vector,
    /// Nodes along x, y, z.
    pub counts: [usize; 3],
    /// Of the B-splines, two more than nodes in each direction, x the fastest (T·m)
    pub coefficients: Vec<f64>,
    /// How well they obey Maxwell's equations.
    pub fit: MapFit,
    /// Whether a node of each cell has no value, x the fastest; empty where every node has one.
    pub gaps: Vec<bool>,
}

/// How well the data of a grid are a magnetic field where no current flows. Shares of the root of the mean square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapFit {
    /// Of div B, against the gradient of B: the residual of Laplace's equation, at the cells' middles.
    pub divergence: f64,
    /// Of what no potential gives, against B; `None` where a potential was read.
    pub rotation: Option<f64>,
}

/// A field sampled on a grid, as the mechanics sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct RodMap {
    /// Factor of the field.
    pub scale: f64,
    /// World frame (m)
    pub position: Vector,
    /// What was read.
    pub grid: Arc<MapGrid>,
}

/// The field at a point.
#[derive(Clone, Copy, Debug)]
pub struct MapPlace {
    /// In T
    pub flux_density: Vector,
    /// dB_i/dx_j (T/m)
    pub gradient: Matrix,
}

impl FieldMap {
    /// Its grid, and how well its data are a magnetic field.
    pub fn summary(&self) -> String {
        let MapGrid { counts: [x, y, z], steps, fit, .. } = &*self.grid;
        let [hx, hy, hz] = steps.map(|h| h * 1e3);
        let rotation = match fit.rotation {
            Some(rotation) => format!("; {:.2} % of B has no potential and is left out", 100.0 * rotation),
            None => String::new(),
        };
        let bad = fit.divergence.max(fit.rotation.unwrap_or(0.0)) > SUSPICIOUS;
        let doubt = if bad { ": see to units, signs, columns, noise and steps" } else { "" };
        let remarks: String = self.remarks.iter().map(|remark| format!("; {remark}")).collect();
        format!(
            "`maps.{}`: {x} x {y} x {z} nodes, {hx:.3} x {hy:.3} x {hz:.3} mm apart; div B is {:.2} % of the gradient{rotation}{doubt}{remarks}",
            self.name,
            100.0 * fit.divergence
        )
    }

    /// As the mechanics sees it.
    pub(super) fn rod_map(&self) -> RodMap {
        RodMap { scale: self.scale, position: self.position, grid: Arc::clone(&self.grid) }
    }
}

impl RodMap {
    /// The field at a point (m)
    pub fn local(&self, at: Vector) -> MapPlace {
        let place = self.grid.local(std::array::from_fn(|k| at[k] - self.position[k]));
        MapPlace {
            flux_density: place.flux_density.map(|x| x * self.scale),
            gradient: place.gradient.map(|row| row.map(|x| x * self.scale)),
        }
    }

    /// How far a point (m) is inside; negative outside (m).
    pub fn inside(&self, at: Vector) -> f64 {
        let MapGrid { origin, steps, counts, .. } = &*self.grid;
        let of_axis = |k: usize| {
            let along = at[k] - self.position[k] - origin[k];
            let margin = EDGE * steps[k];
            (along + margin).min((counts[k] - 1) as f64 * steps[k] + margin - along)
        };
        let inside = (0..3).map(of_axis).fold(f64::INFINITY, f64::min);
        let of_file = std::array::from_fn(|k| at[k] - self.position[k]);
        if self.grid.is_gap(of_file) { inside.min(-steps[0]) } else { inside }
    }
}

/// Weights of four neighbours for the value and its first three derivatives, in steps, a share `s` of a step after the
/// second.
fn weights(s: f64) -> [[f64; 4]; 3] {
    let r = 1.0 - s;
    [
        [r * r * r / 6.0, 2.0 / 3.0 - s * s * (1.0 - 0.5 * s), 2.0 / 3.0 - r * r * (1.0 - 0.5 * r), s * s * s / 6.0],
        [-0.5 * r * r, s * (1.5 * s - 2.0), -r * (1.5 * r - 2.0), 0.5 * s * s],
        [r, 3.0 * s - 2.0, 3.0 * r - 2.0, s],
    ]
}

impl MapGrid {
    /// The field at a point of the file's frame (m); beyond the last cell that cell goes on.
    pub fn local(&self, at: Vector) -> MapPlace {
        let u: Vector = std::array::from_fn(|k| (at[k] - self.origin[k]) / self.steps[k]);
        let cell: [usize; 3] = std::array::from_fn(|k| (u[k].max(0.0) as usize).min(self.counts[k] - 2));
        let by: [[[f64; 4]; 3]; 3] = std::array::from_fn(|k| weights(u[k] - cell[k] as f64));
        let [nx, ny] = [self.counts[0] + 2, self.counts[1] + 2];
        let derivative = |orders: [usize; 3]| -> f64 {
            let mut sum = 0.0;
            for k in 0..4 {
                for j in 0..4 {
                    let row = ((cell[2] + k) * ny + cell[1] + j) * nx + cell[0];
                    let along: f64 = (0..4).map(|i| by[0][orders[0]][i] * self.coefficients[row + i]).sum();
                    sum += by[2][orders[2]][k] * by[1][orders[1]][j] * along;
                }
            }
            (0..3).fold(-sum, |sum, axis| sum / self.steps[axis].powi(orders[axis] as i32))
        };
        let unit = |axis: usize| -> [usize; 3] { std::array::from_fn(|k| usize::from(k == axis)) };
        let flux_density = std::array::from_fn(|axis| derivative(unit(axis)));
        let both = |a: usize, b: usize| derivative(std::array::from_fn(|k| unit(a)[k] + unit(b)[k]));
        MapPlace { flux_density, gradient: std::array::from_fn(|a| std::array::from_fn(|b| both(a, b))) }
    }

    /// The grid with cells closed beside nodes that have no value, of all nodes with x the fastest.
    pub fn with_gaps(mut self, is_gap: &[bool]) -> Self {
        let [nx, ny, nz] = self.counts;
        let cell = |at: usize| [at % (nx - 1), at / (nx - 1) % (ny - 1), at / ((nx - 1) * (ny - 1))];
        let is_closed = |at: usize| {
            let [i, j, k] = cell(at);
            (0..8).any(|corner| is_gap[((k + corner / 4) * ny + j + corner / 2 % 2) * nx + i + corner % 2])
        };
        self.gaps = (0..(nx - 1) * (ny - 1) * (nz - 1)).map(is_closed).collect();
        self.fit.divergence = self.divergence();
        self
    }

    /// Whether some cells are closed.
    pub fn has_gaps(&self) -> bool {
        !self.gaps.is_empty()
    }

    /// Whether a point of the file's frame (m) lies in a cell that is closed.
    pub fn is_gap(&self, at: Vector) -> bool {
        if self.gaps.is_empty() {
            return false;
        }
        let of_axis = |k: usize| {
            let u = (at[k] - self.origin[k]) / self.steps[k];
            (u.max(0.0) as usize).min(self.counts[k] - 2)
        };
        let [i, j, k] = [0, 1, 2].map(of_axis);
        self.gaps[(k * (self.counts[1] - 1) + j) * (self.counts[0] - 1) + i]
    }

    /// The size of div B against the gradient of B, at the middles of the cells that are not closed.
    pub(super) fn divergence(&self) -> f64 {
        let [nx, ny, nz] = self.counts.map(|count| count - 1);
        let (mut square, mut all) = (0.0, 0.0);
        for cell in (0..nx * ny * nz).filter(|cell| self.gaps.get(*cell) != Some(&true)) {
            let index = [cell % nx, cell / nx % ny, cell / (nx * ny)];
            let at = std::array::from_fn(|k| self.origin[k] + (index[k] as f64 + 0.5) * self.steps[k]);
            let g = self.local(at).gradient;
            square += (g[0][0] + g[1][1] + g[2][2]).powi(2);
            all += g.as_flattened().iter().map(|x| x * x).sum::<f64>();
        }
        if all > 0.0 { (square / all).sqrt() } else { 0.0 }
    }
}
