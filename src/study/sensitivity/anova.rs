//! Exact indices of a whole grid: slice means give the first order, means along an axis give the total.

use super::sums::Share;

/// Cells that the means along axes may take together; beyond that totals are left out.
const MAX_CELLS: u64 = 1 << 22;

/// One output on a grid whose first axis varies fastest, summed as it streams by.
#[derive(Clone, Debug, PartialEq)]
pub struct GridSums {
    points: Vec<u64>,
    offset: f64,
    count: u64,
    sum: f64,
    squares: f64,
    /// Sum and count by value of each axis.
    slices: Vec<Vec<[f64; 2]>>,
    /// The same by values of two axes, row by row of the upper triangle.
    pairs: Vec<Vec<[f64; 2]>>,
    /// The same by values of all axes but one; empty where there would be too many.
    lines: Vec<Vec<[f64; 2]>>,
}

impl GridSums {
    /// For a grid of so many points along each axis; the offset should be near the output's mean.
    pub fn new(points: &[u64], offset: f64) -> GridSums {
        let cells = |count: u64| vec![[0.0; 2]; count as usize];
        let rows = points.iter().fold(1u64, |rows, points| rows.saturating_mul(*points));
        let line_cells: u64 = points.iter().fold(0u64, |sum, points| sum.saturating_add(rows / points));
        let mut pairs = Vec::new();
        for i in 0..points.len() {
            for j in i + 1..points.len() {
                let count = points[i].saturating_mul(points[j]);
                pairs.push(if count <= MAX_CELLS { cells(count) } else { Vec::new() });
            }
        }
        GridSums {
            points: points.to_vec(),
            offset,
            count: 0,
            sum: 0.0,
            squares: 0.0,
            slices: points.iter().map(|points| cells(*points)).collect(),
            pairs,
            lines: match line_cells <= MAX_CELLS {
                true => points.iter().map(|points| cells(rows / points)).collect(),
                false => Vec::new(),
            },
        }
    }

    /// Adds the value at a place of the grid; NaN does not count.
    pub fn add(&mut self, index: u64, value: f64) {
        if value.is_nan() {
            return;
        }
        let y = value - self.offset;
        self.count += 1;
        self.sum += y;
        self.squares += y * y;
        let add = |cell: &mut [f64; 2]| *cell = [cell[0] + y, cell[1] + 1.0];
        let mut at = Vec::with_capacity(self.points.len());
        let mut stride = 1;
        for (axis, points) in self.points.iter().enumerate() {
            let place = index / stride % points;
            at.push(place);
            add(&mut self.slices[axis][place as usize]);
            if let Some(lines) = self.lines.get_mut(axis) {
                add(&mut lines[(index / (stride * points) * stride + index % stride) as usize]);
            }
            stride *= points;
        }
        let mut pairs = self.pairs.iter_mut();
        for i in 0..at.len() {
            for j in i + 1..at.len() {
                if let Some(cell) =
                    pairs.next().and_then(|pair| pair.get_mut((at[i] * self.points[j] + at[j]) as usize))
                {
                    add(cell);
                }
            }
        }
    }

    /// Places that count.
    pub fn row_count(&self) -> u64 {
        self.count
    }

    /// Mean over the grid.
    pub fn mean(&self) -> f64 {
        self.offset + self.shift()
    }

    /// Population variance over the grid.
    pub fn variance(&self) -> f64 {
        (self.squares / self.count as f64 - self.shift().powi(2)).max(0.0)
    }

    /// Index of first order.
    pub fn first(&self, axis: usize) -> Share {
        Share { part: self.between(&self.slices[axis]), whole: self.variance() }
    }

    /// Total index; `None` where the grid is too large for it.
    pub fn total(&self, axis: usize) -> Option<Share> {
        let whole = self.variance();
        self.lines.get(axis).map(|lines| Share { part: whole - self.between(lines), whole })
    }

    /// Index of second order; `None` where the grid is too large for it.
    pub fn second(&self, [i, j]: [usize; 2]) -> Option<Share> {
        let (i, j, count) = (i.min(j), i.max(j), self.points.len());
        let pair = &self.pairs[i * count - i * (i + 1) / 2 + j - i - 1];
        let alone = self.first(i).part + self.first(j).part;
        (!pair.is_empty()).then(|| Share { part: self.between(pair) - alone, whole: self.variance() })
    }

    fn shift(&self) -> f64 {
        self.sum / self.count as f64
    }

    /// Variance of the means of cells.
    fn between(&self, cells: &[[f64; 2]]) -> f64 {
        let filled = cells.iter().filter(|[_, count]| *count > 0.0);
        let squares: f64 = filled.map(|[sum, count]| count * (sum / count - self.shift()).powi(2)).sum();
        squares / self.count as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_and_products_have_their_shares() {
        // f = x + 2 y + x z on three even grids about zero.
        let points = [3, 4, 5];
        let value = |at: u64, points: u64| 2.0 * at as f64 / (points - 1) as f64 - 1.0;
        let variance = |points: u64| (0..points).map(|at| value(at, points).powi(2)).sum::<f64>() / points as f64;
        let mut sums = GridSums::new(&points, 0.3);
        for index in 0..60 {
            let at = [index % 3, index / 3 % 4, index / 12];
            let [x, y, z] = [0, 1, 2].map(|k| value(at[k], points[k]));
            sums.add(index, 1e3 + x + 2.0 * y + x * z);
        }
        let [vx, vy, vz] = points.map(variance);
        let whole = vx + 4.0 * vy + vx * vz;
        assert!((sums.variance() / whole - 1.0).abs() < 1e-9 && (sums.mean() - 1e3).abs() < 1e-12);
        let expected = [(vx, vx + vx * vz), (4.0 * vy, 4.0 * vy), (0.0, vx * vz)];
        for (axis, (first, total)) in expected.into_iter().enumerate() {
            assert!((sums.first(axis).value() - first / whole).abs() < 1e-9, "{axis}");
            assert!((sums.total(axis).unwrap().value() - total / whole).abs() < 1e-9, "{axis}");
        }
        for (pair, part) in [([0, 1], 0.0), ([0, 2], vx * vz), ([1, 2], 0.0)] {
            assert!((sums.second(pair).unwrap().value() - part / whole).abs() < 1e-9, "{pair:?}");
        }
    }
}
