//! The dimension of the set of tips, by the rank of the Jacobian over all rows.

use super::step::Singular;
use super::tip_map::Tip;

/// Singular values below this share of the largest are round-off, and those below this share of a voxel do not count.
const ROUND_OFF: f64 = 1e-6;
const VOXEL_SHARE: f64 = 1e-3;
/// Rows of which so many have a smaller value.
const QUANTILE: f64 = 0.9;
/// A body is thin whose thickness, twice the median of its smallest singular value, is less than so many voxels.
const THIN: f64 = 3.0;

/// What is known of the dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dimension {
    /// 0 a point, 1 a curve, 2 a surface, 3 a body.
    pub rank: usize,
    /// 90 %-quantiles of the singular values (m per half range).
    pub quantiles: [f64; 3],
    /// Twice the median of the third singular value (m): how thick a body is at least.
    pub thickness: f64,
    /// Whether a body is thin beside the voxel.
    pub is_thin: bool,
    /// Singular values that are no larger do not count (m per half range).
    pub least: f64,
}

impl Dimension {
    /// Decides from all usable tips, never from one: near the axis of a workspace a Jacobian may well be singular.
    pub fn of(tips: &[Tip], input_count: usize, edge: f64) -> Dimension {
        let mut values: [Vec<f64>; 3] = Default::default();
        for tip in tips.iter().filter(|tip| tip.usable) {
            let singular = Singular::new(&tip.jacobian[..input_count]).values;
            values.iter_mut().zip(singular).for_each(|(all, value)| all.push(value));
        }
        values.iter_mut().for_each(|all| all.sort_by(f64::total_cmp));
        let quantile = |all: &Vec<f64>, share: f64| match all.len() {
            0 => 0.0,
            count => all[((share * (count - 1) as f64).round() as usize).min(count - 1)],
        };
        let quantiles = [0, 1, 2].map(|k| quantile(&values[k], QUANTILE));
        let least = (ROUND_OFF * quantiles[0]).max(VOXEL_SHARE * edge);
        let rank = quantiles.iter().filter(|value| **value > least).count();
        let thickness = 2.0 * quantile(&values[2], 0.5);
        Dimension { rank, quantiles, thickness, is_thin: rank == 3 && thickness < THIN * edge, least }
    }

    /// The word for it.
    pub fn name(&self) -> &'static str {
        match (self.rank, self.is_thin) {
            (0, _) => "point",
            (1, _) => "curve",
            (2, _) => "surface",
            (_, true) => "thin body",
            _ => "body",
        }
    }
}
