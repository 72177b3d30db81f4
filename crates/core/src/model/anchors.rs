//! Equilibria on a grid over a sweep's axes, from which the samples between them start.
//!
//! Each anchor is solved from rest. Engines predict between the corners of a cell (`cpu/equilibrium/anchors.rs`, its twin in
//! `shaders`).

use super::tolerances::{ANCHOR_MARGIN, ANCHOR_MISMATCH};
use super::{Entry, Plan, Vector};
use std::sync::Arc;

/// Axes of a grid, at most.
pub const MOST_ANCHOR_AXES: usize = 4;
/// Numbers of a vector as it is stored: the fourth is zero.
pub const ANCHOR_STRIDE: usize = 4;

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

    /// By anchor, the last axis fastest: m0, a slope for each axis, the columns of W⁻¹, each of [`ANCHOR_STRIDE`] numbers.
    pub fn rows(&self) -> &[f32] {
        &self.rows
    }

    /// By cell, as its first corner: what the predictions along its edges miss; infinite where no sample may start.
    pub fn mismatches(&self) -> &[f32] {
        &self.mismatches
    }

    /// Points between an anchor and the next along an axis.
    pub fn stride(&self, axis: usize) -> usize {
        self.axes[axis + 1..].iter().map(|axis| axis.points).product()
    }

    /// Corners of a cell.
    pub fn corners(&self) -> usize {
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
}
