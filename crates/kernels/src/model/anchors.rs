//! Equilibria on a grid over a sweep's axes, from which the samples between them start.
//!
//! Each anchor is solved from rest. Between the corners of a cell the base moment is predicted by
//! Σ w (m0 + ½ J δ): multilinear weights w, the corner's slopes J, and the way δ from the corner. Whatever is of second
//! order or less along the axes is met exactly. The inverse of W is Σ w W⁻¹.

use super::path::{ANCHOR_MARGIN, ANCHOR_MISMATCH};
use super::{Entry, Plan, Vector};
use std::sync::Arc;

/// Axes of a grid, at most.
pub const MOST_ANCHOR_AXES: usize = 4;
/// Numbers of a vector as it is stored: the fourth is zero.
const STRIDE: usize = 4;

/// An axis of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnchorAxis {
    /// Value of the first point, SI.
    pub from: f64,
    /// Between two points, SI.
    pub spacing: f64,
    /// At least two.
    pub points: usize,
}

/// What is known at one point of the grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Anchor {
    /// Of the equilibrium (plan units, world frame).
    pub m0: Vector,
    /// Change of m0 from one point of each axis to the next, to first order.
    pub slopes: Vec<Vector>,
    /// Columns of W⁻¹: change of m0 by the moment at the tip.
    pub inverse: [Vector; 3],
    /// Stability margin; below zero where there is no stable equilibrium.
    pub margin: f64,
}

/// The grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Anchors {
    axes: Vec<AnchorAxis>,
    /// By anchor, the last axis fastest: m0, slopes, inverse.
    rows: Vec<f32>,
    /// By cell, as its first corner: what the predictions along its edges miss; infinite where a corner is no good.
    mismatches: Vec<f32>,
}

/// What is predicted of a sample.
#[derive(Clone, Copy, Debug)]
pub struct Prediction {
    /// Base moment (plan units).
    pub m0: [f32; 3],
    /// Columns of W⁻¹.
    pub inverse: [[f32; 3]; 3],
}

/// Equilibria to start from, and where a sample lies among them.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanAnchors {
    /// On a grid of the axes.
    pub grid: Arc<Anchors>,
    /// First entry of a sample's coordinates on the grid.
    pub entry: usize,
}

impl Plan {
    /// The same plan with a grid of equilibria to start from, one axis of it for each of the plan.
    pub fn with_anchors(&self, grid: Arc<Anchors>) -> Plan {
        let mut plan = self.clone();
        let entry = plan.entries.len();
        plan.entries.extend((0..grid.axes().len()).map(|axis| Entry::Varying(self.input_count + axis)));
        plan.input_count += grid.axes().len();
        plan.anchors = Some(PlanAnchors { grid, entry });
        plan
    }
}

impl Anchors {
    /// A grid of solved points, the last axis fastest.
    pub fn new(axes: Vec<AnchorAxis>, anchors: &[Anchor]) -> Anchors {
        let vectors = |anchor: &Anchor| [&[anchor.m0], &anchor.slopes[..], &anchor.inverse].concat();
        let rows = anchors.iter().flat_map(vectors).flat_map(|[x, y, z]| [x as f32, y as f32, z as f32, 0.0]).collect();
        let mut grid = Anchors { axes, rows, mismatches: Vec::new() };
        grid.mismatches = (0..anchors.len()).map(|first| grid.mismatch(first, anchors)).collect();
        grid
    }

    /// Its axes.
    pub fn axes(&self) -> &[AnchorAxis] {
        &self.axes
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.mismatches.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.mismatches.is_empty()
    }

    /// Share of the cells from which samples may start.
    pub fn usable_share(&self) -> f64 {
        let cells: usize = self.axes.iter().map(|axis| axis.points - 1).product();
        let usable = self.mismatches.iter().filter(|mismatch| mismatch.is_finite()).count();
        usable as f64 / cells.max(1) as f64
    }

    /// Place of a value on an axis, in points.
    pub fn coordinate(&self, axis: usize, value: f64) -> f64 {
        let AnchorAxis { from, spacing, .. } = self.axes[axis];
        (value - from) / spacing
    }

    /// Points between an anchor and the next along an axis.
    fn stride(&self, axis: usize) -> usize {
        self.axes[axis + 1..].iter().map(|axis| axis.points).product()
    }

    fn corners(&self) -> usize {
        1 << self.axes.len()
    }

    /// A corner of the cell of `first`; bit `axis` of `corner` is one step along that axis.
    fn corner(&self, first: usize, corner: usize) -> usize {
        first + (0..self.axes.len()).filter(|axis| corner >> axis & 1 == 1).map(|axis| self.stride(axis)).sum::<usize>()
    }

    /// The largest miss along the edges of a cell; infinite on the last points, where a corner is no good, or where
    /// corners do not agree: they may lie on two branches.
    fn mismatch(&self, first: usize, anchors: &[Anchor]) -> f32 {
        let is_last = |axis: usize| first / self.stride(axis) % self.axes[axis].points + 1 == self.axes[axis].points;
        if (0..self.axes.len()).any(is_last) {
            return f32::INFINITY;
        }
        let corner = |corner: usize| &anchors[self.corner(first, corner)];
        let are_good = (0..self.corners()).all(|k| corner(k).margin > ANCHOR_MARGIN);
        if !are_good {
            return f32::INFINITY;
        }
        let mut largest = 0.0f64;
        for (axis, from) in (0..self.axes.len()).flat_map(|axis| (0..self.corners()).map(move |from| (axis, from))) {
            if from >> axis & 1 == 1 {
                continue;
            }
            let (a, b) = (corner(from), corner(from | 1 << axis));
            let miss = |k: usize| b.m0[k] - a.m0[k] - 0.5 * (a.slopes[axis][k] + b.slopes[axis][k]);
            largest = largest.max((0..3).map(|k| miss(k) * miss(k)).sum::<f64>().sqrt());
        }
        if largest < ANCHOR_MISMATCH { largest as f32 } else { f32::INFINITY }
    }

    /// The cell of a sample and what its edges miss; infinite outside of the grid.
    #[inline(always)]
    pub fn cell(&self, coordinates: &[f32; MOST_ANCHOR_AXES]) -> (usize, f32) {
        let mut first = 0;
        for (axis, at) in self.axes.iter().zip(coordinates) {
            // The far end belongs to the last cell. NaN is outside.
            if !(*at >= 0.0 && *at <= (axis.points - 1) as f32) {
                return (0, f32::INFINITY);
            }
            first = first * axis.points + (*at as usize).min(axis.points - 2);
        }
        (first, self.mismatches[first])
    }

    /// What is predicted within a cell.
    #[inline(always)]
    pub fn predict(&self, first: usize, coordinates: &[f32; MOST_ANCHOR_AXES]) -> Prediction {
        let count = self.axes.len();
        let mut share = [0.0f32; MOST_ANCHOR_AXES];
        let mut strides = [0usize; MOST_ANCHOR_AXES];
        let mut stride = 1;
        for axis in (0..count).rev() {
            let floor = (coordinates[axis] as usize).min(self.axes[axis].points - 2);
            share[axis] = coordinates[axis] - floor as f32;
            strides[axis] = stride;
            stride *= self.axes[axis].points;
        }
        let width = STRIDE * (count + 4);
        let mut m0 = [0.0f32; STRIDE];
        let mut inverse = [[0.0f32; STRIDE]; 3];
        for corner in 0..self.corners() {
            let (mut at, mut weight, mut way) = (first, 1.0f32, [0.0f32; MOST_ANCHOR_AXES]);
            for axis in 0..count {
                let is_far = corner >> axis & 1 == 1;
                at += if is_far { strides[axis] } else { 0 };
                weight *= if is_far { share[axis] } else { 1.0 - share[axis] };
                way[axis] = if is_far { share[axis] - 1.0 } else { share[axis] };
            }
            let vectors = self.rows[at * width..][..width].as_chunks::<STRIDE>().0;
            add(&mut m0, weight, &vectors[0]);
            for axis in 0..count {
                add(&mut m0, 0.5 * weight * way[axis], &vectors[1 + axis]);
            }
            for (sum, column) in inverse.iter_mut().zip(&vectors[1 + count..]) {
                add(sum, weight, column);
            }
        }
        let three = |[x, y, z, _]: [f32; STRIDE]| [x, y, z];
        Prediction { m0: three(m0), inverse: inverse.map(three) }
    }
}

#[inline(always)]
fn add(sum: &mut [f32; STRIDE], factor: f32, vector: &[f32; STRIDE]) {
    for (sum, x) in sum.iter_mut().zip(vector) {
        *sum += factor * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// m0 of second order in both axes, and an inverse that is multilinear.
    fn anchor([x, y]: [f64; 2], spacing: [f64; 2], margin: f64) -> Anchor {
        let m0 = [x * x + 3.0 * x * y, y * y - x, 2.0 * x * y + 1.0];
        let by = [[2.0 * x + 3.0 * y, -1.0, 2.0 * y], [3.0 * x, 2.0 * y, 2.0 * x]];
        let slopes = (0..2).map(|axis| by[axis].map(|slope| slope * spacing[axis])).collect();
        let inverse = [[1.0 + x * y, 0.0, 0.0], [0.0, 1.0 + x, 0.0], [0.0, y, 1.0]];
        Anchor { m0, slopes, inverse, margin }
    }

    fn grid(margin: impl Fn(usize) -> f64) -> Anchors {
        let axes = vec![
            AnchorAxis { from: -1.0, spacing: 0.1, points: 21 },
            AnchorAxis { from: 0.0, spacing: 0.05, points: 5 },
        ];
        let place = |k: usize| [-1.0 + 0.1 * (k / 5) as f64, 0.05 * (k % 5) as f64];
        let anchors: Vec<Anchor> = (0..105).map(|k| anchor(place(k), [0.1, 0.05], margin(k))).collect();
        Anchors::new(axes, &anchors)
    }

    #[test]
    fn what_is_of_second_order_is_met() {
        let grid = grid(|_| 1.0);
        assert_eq!((grid.len(), grid.usable_share()), (105, 1.0));
        for (x, y) in [(-1.0, 0.0), (-0.93, 0.013), (0.44, 0.121), (1.0, 0.2)] {
            let at = [grid.coordinate(0, x) as f32, grid.coordinate(1, y) as f32, 0.0, 0.0];
            let (cell, mismatch) = grid.cell(&at);
            assert!(mismatch < 1e-6, "{mismatch}");
            let found = grid.predict(cell, &at);
            let expected = anchor([x, y], [0.1, 0.05], 1.0);
            for k in 0..3 {
                assert!((f64::from(found.m0[k]) - expected.m0[k]).abs() < 2e-6, "{x} {y}: {found:?} {expected:?}");
                for column in 0..3 {
                    let off = f64::from(found.inverse[column][k]) - expected.inverse[column][k];
                    assert!(off.abs() < 2e-6, "{x} {y}: {found:?} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn cells_without_good_corners_and_places_outside_are_no_start() {
        let grid = grid(|k| if k == 52 { 0.05 } else { 1.0 });
        // Four cells share that corner.
        assert_eq!((80.0 * (1.0 - grid.usable_share())).round(), 4.0);
        let cell = |x: f32, y: f32| grid.cell(&[x, y, 0.0, 0.0]).1;
        assert!(cell(10.5, 2.5).is_infinite() && cell(9.5, 1.5).is_infinite() && cell(11.5, 2.5).is_finite());
        assert!(cell(-0.01, 1.0).is_infinite() && cell(20.01, 1.0).is_infinite() && cell(f32::NAN, 1.0).is_infinite());
        assert!(cell(20.0, 4.0).is_finite());
    }

    #[test]
    fn corners_on_two_branches_are_no_start() {
        let axes = vec![AnchorAxis { from: 0.0, spacing: 1.0, points: 3 }];
        let at =
            |m: f64| Anchor { m0: [m, 0.0, 0.0], slopes: vec![[0.1, 0.0, 0.0]], inverse: [[1.0; 3]; 3], margin: 1.0 };
        let grid = Anchors::new(axes, &[at(0.0), at(0.1), at(0.7)]);
        assert!(grid.cell(&[0.5, 0.0, 0.0, 0.0]).1.is_finite() && grid.cell(&[1.5, 0.0, 0.0, 0.0]).1.is_infinite());
    }
}
