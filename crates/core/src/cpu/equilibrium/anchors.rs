//! Base moments between the points of a grid of equilibria.
//!
//! Between the corners of a cell the base moment is Σ w (m0 + ½ J δ): multilinear weights w, the corner's slopes J, and the
//! way δ from the corner. Whatever is of second order or less along the axes is met exactly. The inverse of W is Σ w W⁻¹.

use crate::cpu::simd::lane::Scalar;
use crate::model::tolerances::is_close;
use crate::model::{ANCHOR_STRIDE, Anchors, BLOCK, MOST_ANCHOR_AXES};

/// What is predicted of a sample.
#[derive(Clone, Copy, Debug)]
pub struct Prediction {
    /// Base moment (plan units).
    pub m0: [f32; 3],
    /// Columns of W⁻¹.
    pub inverse: [[f32; 3]; 3],
}

/// The cell of a sample and what its edges miss; infinite outside of the grid.
#[inline(always)]
pub fn cell(grid: &Anchors, coordinates: &[f32; MOST_ANCHOR_AXES]) -> (usize, f32) {
    let mut first = 0;
    for (axis, at) in grid.axes().iter().zip(coordinates) {
        // The far end belongs to the last cell. NaN is outside.
        if !(*at >= 0.0 && *at <= (axis.points - 1) as f32) {
            return (0, f32::INFINITY);
        }
        first = first * axis.points + (*at as usize).min(axis.points - 2);
    }
    (first, grid.mismatches()[first])
}

/// What is predicted within a cell.
#[inline(always)]
pub fn predict(grid: &Anchors, first: usize, coordinates: &[f32; MOST_ANCHOR_AXES]) -> Prediction {
    let count = grid.axes().len();
    let mut share = [0.0f32; MOST_ANCHOR_AXES];
    let mut strides = [0usize; MOST_ANCHOR_AXES];
    let mut stride = 1;
    for axis in (0..count).rev() {
        let floor = (coordinates[axis] as usize).min(grid.axes()[axis].points - 2);
        share[axis] = coordinates[axis] - floor as f32;
        strides[axis] = stride;
        stride *= grid.axes()[axis].points;
    }
    let width = ANCHOR_STRIDE * (count + 4);
    let mut m0 = [0.0f32; ANCHOR_STRIDE];
    let mut inverse = [[0.0f32; ANCHOR_STRIDE]; 3];
    for corner in 0..grid.corners() {
        let (mut at, mut weight, mut way) = (first, 1.0f32, [0.0f32; MOST_ANCHOR_AXES]);
        for axis in 0..count {
            let is_far = corner >> axis & 1 == 1;
            at += if is_far { strides[axis] } else { 0 };
            weight *= if is_far { share[axis] } else { 1.0 - share[axis] };
            way[axis] = if is_far { share[axis] - 1.0 } else { share[axis] };
        }
        let vectors = grid.rows()[at * width..][..width].as_chunks::<ANCHOR_STRIDE>().0;
        add(&mut m0, weight, &vectors[0]);
        for axis in 0..count {
            add(&mut m0, 0.5 * weight * way[axis], &vectors[1 + axis]);
        }
        for (sum, column) in inverse.iter_mut().zip(&vectors[1 + count..]) {
            add(sum, weight, column);
        }
    }
    let three = |[x, y, z, _]: [f32; ANCHOR_STRIDE]| [x, y, z];
    Prediction { m0: three(m0), inverse: inverse.map(three) }
}

/// Puts what is predicted of a sample, from its coordinates in the inputs from `column` on, where the end of its path would
/// lie. Returns what the edges of its cell miss; infinite, and nothing is predicted, where it may not start from anchors.
#[inline(always)]
pub fn anchored_end<From: Scalar, To: Scalar>(
    (grid, column): (&Anchors, usize),
    newton_tolerance: f64,
    inputs: &[From],
    sample: usize,
    ends: &mut [To],
) -> f32 {
    let mut at = [0.0f32; MOST_ANCHOR_AXES];
    for (axis, at) in at.iter_mut().enumerate().take(grid.axes().len()) {
        *at = inputs[(column + axis) * BLOCK + sample].to_f64() as f32;
    }
    let (first, mismatch) = cell(grid, &at);
    if mismatch < f32::INFINITY {
        let Prediction { m0, inverse } = predict(grid, first, &at);
        let mut put = |column: usize, value: f32| ends[column * BLOCK + sample] = Scalar::from_f64(value.into());
        // As `store_end` puts them: reached, not ramped, no passes, under the full load.
        [1.0, 0.0, 0.0, 1.0].into_iter().enumerate().for_each(|(column, value)| put(column, value));
        m0.into_iter().enumerate().for_each(|(k, value)| put(4 + k, value));
        for (k, vector) in inverse.into_iter().enumerate() {
            vector.into_iter().enumerate().for_each(|(axis, value)| put(7 + 3 * k + axis, value));
        }
        put(16, if is_close(mismatch.into(), newton_tolerance) { 1.0 } else { 0.0 });
    }
    mismatch
}

#[inline(always)]
fn add(sum: &mut [f32; ANCHOR_STRIDE], factor: f32, vector: &[f32; ANCHOR_STRIDE]) {
    for (sum, x) in sum.iter_mut().zip(vector) {
        *sum += factor * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Anchor, AnchorAxis};

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
            let (first, mismatch) = cell(&grid, &at);
            assert!(mismatch < 1e-6, "{mismatch}");
            let found = predict(&grid, first, &at);
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
        let miss = |x: f32, y: f32| cell(&grid, &[x, y, 0.0, 0.0]).1;
        assert!(miss(10.5, 2.5).is_infinite() && miss(9.5, 1.5).is_infinite() && miss(11.5, 2.5).is_finite());
        assert!(miss(-0.01, 1.0).is_infinite() && miss(20.01, 1.0).is_infinite() && miss(f32::NAN, 1.0).is_infinite());
        assert!(miss(20.0, 4.0).is_finite());
    }

    #[test]
    fn corners_on_two_branches_are_no_start() {
        let axes = vec![AnchorAxis { from: 0.0, spacing: 1.0, points: 3 }];
        let at =
            |m: f64| Anchor { m0: [m, 0.0, 0.0], slopes: vec![[0.1, 0.0, 0.0]], inverse: [[1.0; 3]; 3], margin: 1.0 };
        let grid = Anchors::new(axes, &[at(0.0), at(0.1), at(0.7)]);
        let miss = |x: f32| cell(&grid, &[x, 0.0, 0.0, 0.0]).1;
        assert!(miss(0.5).is_finite() && miss(1.5).is_infinite());
    }
}
