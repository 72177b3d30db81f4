//! What the observations say: covariance, directions of the parameters from the strongest to the weakest, words.

use super::{Direction, Strength};
use nalgebra::{DMatrix, DVector};

/// A direction is a ridge where its singular value, over the largest, is below this.
const RIDGE: f64 = 1e-7;
/// A direction is weak where one standard deviation is this large: relative, or curvature times length.
const WEAK: f64 = 0.5;
/// Parameters that count in a direction have at least this share of the largest.
const COUNTS: f64 = 0.1;
pub(super) const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Covariance of the scaled parameters, which of them are open, and the directions, strongest first.
pub(in crate::study) fn analyse(jacobian: &DMatrix<f64>, noise: f64) -> (DMatrix<f64>, Vec<bool>, Vec<Direction>) {
    let count = jacobian.ncols();
    let svd = jacobian.clone().svd(false, true);
    let rows = svd.v_t.unwrap_or_else(|| DMatrix::identity(count, count));
    let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
    order.sort_by(|a, b| svd.singular_values[*b].total_cmp(&svd.singular_values[*a]));
    let largest = order.first().map_or(0.0, |k| svd.singular_values[*k]);
    let (mut covariance, mut open) = (DMatrix::zeros(count, count), vec![false; count]);
    let mut directions = Vec::new();
    for k in order {
        let (value, row) = (svd.singular_values[k], rows.row(k));
        let strength = if value <= RIDGE * largest {
            Strength::Ridge
        } else if noise > WEAK * value {
            Strength::Weak
        } else {
            Strength::Determined
        };
        if strength == Strength::Ridge {
            let most = row.amax();
            (0..count).for_each(|j| open[j] |= row[j].abs() > RIDGE.sqrt() * most);
        } else {
            covariance += row.transpose() * row * (noise / value).powi(2);
        }
        let singular_value = if noise > 0.0 { value / noise } else { f64::INFINITY };
        directions.push(Direction { singular_value, weights: row.iter().copied().collect(), strength });
    }
    (covariance, open, directions)
}

/// Unit vectors of the scaled parameters along which nothing changes.
pub(super) fn ridges(jacobian: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let svd = jacobian.clone().svd(false, true);
    let Some(rows) = svd.v_t else { return Vec::new() };
    let limit = RIDGE * svd.singular_values.amax();
    (0..rows.nrows()).filter(|k| svd.singular_values[*k] <= limit).map(|k| rows.row(k).transpose()).collect()
}

/// What weak directions and ridges mean, of parameters by name; logarithmic ones count by their ratio.
pub(in crate::study) fn findings(names: &[String], logarithmic: &[bool], directions: &[Direction]) -> Vec<String> {
    let of = |direction: &Direction| {
        let most = direction.weights.iter().fold(0.0f64, |most, weight| most.max(weight.abs()));
        let part: Vec<usize> =
            (0..direction.weights.len()).filter(|k| direction.weights[*k].abs() > COUNTS * most).collect();
        let named: Vec<&str> = part.iter().map(|k| names[*k].as_str()).collect();
        let what = match &named[..] {
            [name] => (*name).to_owned(),
            [head @ .., last] => format!("{} and {last}", head.join(", ")),
            [] => String::new(),
        };
        let share = |k: &usize| direction.weights[*k] / direction.weights[part[0]];
        let together = part.len() > 1 && part.iter().all(|k| logarithmic[*k] && (share(k) - 1.0).abs() < 0.01);
        let shares: Vec<String> = part.iter().map(|k| format!("{:+.2}", direction.weights[*k] / most)).collect();
        match direction.strength {
            Strength::Determined => None,
            Strength::Ridge if together => {
                Some(format!("{what} scale together: only their ratios can be told; give one of them another source"))
            }
            Strength::Ridge if part.len() == 1 => {
                Some(format!("{what} changes nothing that is observed: do not free it"))
            }
            Strength::Ridge => Some(format!("{what} compensate one another ({}): hold one of them", shares.join(", "))),
            Strength::Weak if part.len() == 1 => Some(format!("{what} is hidden by the noise")),
            Strength::Weak => Some(format!("{what} are told apart badly ({})", shares.join(", "))),
        }
    };
    directions.iter().filter_map(of).collect()
}

/// Two-sided 95 % quantile of Student's distribution (Cornish and Fisher's expansion; Abramowitz and Stegun 26.7.5).
pub(super) fn student_95(freedom: usize) -> f64 {
    let (z, n) = (NORMAL_95, freedom as f64);
    match freedom {
        0 => f64::INFINITY,
        1 => 12.706_204_736,
        2 => 4.302_652_730,
        _ => {
            let z2 = z * z;
            let g1 = z * (z2 + 1.0) / 4.0;
            let g2 = z * ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
            let g3 = z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
            z + g1 / n + g2 / (n * n) + g3 / (n * n * n)
        }
    }
}
