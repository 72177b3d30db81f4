//! From samples on a grid to the B-splines of a potential. F9

use super::Vector;
use super::field_map::{LEAST_MAP_NODES, MapFit, MapGrid};
use std::f64::consts::PI;

/// Numbers at the nodes of a grid, x the fastest.
struct Nodes<'a> {
    counts: [usize; 3],
    values: &'a [f64],
}

/// Second differences of the coefficients of the spline through `f` whose third derivative does not jump at the second
/// node nor at the last but one.
fn curvatures(f: &[f64]) -> Vec<f64> {
    let n = f.len();
    let second = |i: usize| f[i - 1] - 2.0 * f[i] + f[i + 1];
    let mut d = vec![0.0; n];
    (d[1], d[n - 2]) = (second(1), second(n - 2));
    // (d- + 4 d + d+) / 6 = second difference of f, by elimination.
    let mut factor = vec![0.0; n];
    for i in 2..n.saturating_sub(2) {
        let pivot = 1.0 / (4.0 - factor[i - 1]);
        factor[i] = pivot;
        d[i] = (6.0 * second(i) - d[i - 1]) * pivot;
    }
    for i in (2..n.saturating_sub(2)).rev() {
        d[i] -= factor[i] * d[i + 1];
    }
    (d[0], d[n - 1]) = (2.0 * d[1] - d[2], 2.0 * d[n - 2] - d[n - 3]);
    d
}

/// Coefficients of the cubic B-splines through values at equal steps, two more than values.
fn coefficients(f: &[f64]) -> Vec<f64> {
    let d = curvatures(f);
    let n = f.len();
    let mut c: Vec<f64> = std::iter::once(0.0).chain(f.iter().zip(&d).map(|(f, d)| f - d / 6.0)).collect();
    c.push(d[n - 1] + 2.0 * c[n] - c[n - 1]);
    c[0] = d[0] + 2.0 * c[1] - c[2];
    c
}

impl Nodes<'_> {
    /// Replaces each line along an axis by another of `length` numbers.
    fn each_line(&self, axis: usize, length: usize, of: impl Fn(&[f64]) -> Vec<f64>) -> ([usize; 3], Vec<f64>) {
        let mut counts = self.counts;
        counts[axis] = length;
        let mut all = vec![0.0; counts.iter().product()];
        let stride = |counts: &[usize; 3]| counts[..axis].iter().product::<usize>();
        let (from, to) = (stride(&self.counts), stride(&counts));
        let lines: usize = self.values.len() / self.counts[axis];
        let mut line = vec![0.0; self.counts[axis]];
        for k in 0..lines {
            let (low, high) = (k % from, k / from);
            for (i, x) in line.iter_mut().enumerate() {
                *x = self.values[high * from * self.counts[axis] + i * from + low];
            }
            for (i, x) in of(&line).into_iter().enumerate() {
                all[high * to * length + i * to + low] = x;
            }
        }
        (counts, all)
    }
}

/// Rows: cosines over n places, an orthonormal base in which differences along a line are diagonal.
fn cosines(n: usize) -> Vec<Vec<f64>> {
    let row = |k: usize| {
        let size = if k == 0 { 1.0 } else { 2.0_f64 } / n as f64;
        (0..n).map(|i| size.sqrt() * (PI * k as f64 * (i as f64 + 0.5) / n as f64).cos()).collect()
    };
    (0..n).map(row).collect()
}

/// Numbers at nodes in the base of cosines along all axes, or back.
fn transformed(counts: [usize; 3], values: Vec<f64>, back: bool) -> Vec<f64> {
    let mut values = values;
    for (axis, n) in counts.into_iter().enumerate() {
        let base = cosines(n);
        let entry = |k: usize, i: usize| if back { base[i][k] } else { base[k][i] };
        let dot = |line: &[f64]| (0..n).map(|k| (0..n).map(|i| entry(k, i) * line[i]).sum()).collect();
        (_, values) = Nodes { counts, values: &values }.each_line(axis, n, dot);
    }
    values
}

impl MapGrid {
    /// From a potential at the nodes, x the fastest (T·m); B = -grad of it. `None` where there are too few nodes.
    pub fn from_potential(origin: Vector, steps: Vector, counts: [usize; 3], potential: &[f64]) -> Option<Self> {
        Self::splines(origin, steps, counts, potential, None)
    }

    /// From B at the nodes, x the fastest (T): the potential whose differences along the grid's edges are, in the sense of
    /// least squares, the integrals of splines through B.
    pub fn from_flux_density(origin: Vector, steps: Vector, counts: [usize; 3], b: [&[f64]; 3]) -> Option<Self> {
        let node_count: usize = counts.iter().product();
        if counts.iter().any(|count| *count < LEAST_MAP_NODES) || b.iter().any(|b| b.len() != node_count) {
            return None;
        }
        let mut rising = Vec::new();
        for axis in 0..3 {
            // Over one cell: h / 24 (c- + 11 c + 11 c+ + c++)
            let integral = |line: &[f64]| -> Vec<f64> {
                let c = coefficients(line);
                let of = |c: &[f64]| -steps[axis] / 24.0 * (c[0] + 11.0 * (c[1] + c[2]) + c[3]);
                c.windows(4).map(of).collect()
            };
            rising.push(Nodes { counts, values: b[axis] }.each_line(axis, counts[axis] - 1, integral));
        }
        let mut sources = vec![0.0; node_count];
        for (axis, (edges, rise)) in rising.iter().enumerate() {
            let weight = steps[axis].powi(-2);
            let ends = |line: &[f64]| -> Vec<f64> {
                let of = |i: usize| {
                    let before = if i > 0 { line[i - 1] } else { 0.0 };
                    weight * (before - line.get(i).copied().unwrap_or(0.0))
                };
                (0..=line.len()).map(of).collect()
            };
            let (_, all) = Nodes { counts: *edges, values: rise }.each_line(axis, counts[axis], ends);
            sources.iter_mut().zip(all).for_each(|(sum, x)| *sum += x);
        }
        let mut modes = transformed(counts, sources, false);
        let eigenvalue =
            |axis: usize, k: usize| (2.0 - 2.0 * (PI * k as f64 / counts[axis] as f64).cos()) * steps[axis].powi(-2);
        for (at, mode) in modes.iter_mut().enumerate() {
            let [i, j, k] = [at % counts[0], at / counts[0] % counts[1], at / (counts[0] * counts[1])];
            let sum = eigenvalue(0, i) + eigenvalue(1, j) + eigenvalue(2, k);
            *mode = if at == 0 { 0.0 } else { *mode / sum };
        }
        let potential = transformed(counts, modes, true);
        let (mut left, mut all) = (0.0, 0.0);
        for (axis, (_, rise)) in rising.iter().enumerate() {
            let differences = |line: &[f64]| line.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let nodes = Nodes { counts, values: &potential };
            let (_, found) = nodes.each_line(axis, counts[axis] - 1, differences);
            for (found, asked) in found.iter().zip(rise) {
                left += ((found - asked) / steps[axis]).powi(2);
                all += (asked / steps[axis]).powi(2);
            }
        }
        let rotation = if all > 0.0 { (left / all).sqrt() } else { 0.0 };
        Self::splines(origin, steps, counts, &potential, Some(rotation))
    }

    fn splines(
        origin: Vector,
        steps: Vector,
        counts: [usize; 3],
        potential: &[f64],
        rotation: Option<f64>,
    ) -> Option<Self> {
        let few = counts.iter().any(|count| *count < LEAST_MAP_NODES);
        if few || potential.len() != counts.iter().product::<usize>() {
            return None;
        }
        let (mut shape, mut values) = (counts, potential.to_vec());
        for (axis, count) in counts.into_iter().enumerate() {
            (shape, values) = Nodes { counts: shape, values: &values }.each_line(axis, count + 2, coefficients);
        }
        let fit = MapFit { divergence: 0.0, rotation };
        let mut grid = Self { origin, steps, counts, coefficients: values, fit, gaps: Vec::new() };
        grid.fit.divergence = grid.divergence();
        Some(grid)
    }
}
