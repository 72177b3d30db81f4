//! How well points agree with others: as they are, but for a constant offset, but for a rigid motion (Kabsch).

use crate::model::Vector;
use nalgebra::{Matrix3, Vector3};

/// Root mean squares of the distances between pairs of points (m).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Agreement {
    /// As they are.
    pub rmse: f64,
    /// Mean of first less second.
    pub offset: Vector,
    /// Once the offset is taken away.
    pub centred_rmse: f64,
    /// After the best rotation and translation.
    pub aligned_rmse: f64,
}

/// Of pairs of points (m); none without a pair.
pub fn agreement(pairs: &[(Vector, Vector)]) -> Option<Agreement> {
    if pairs.is_empty() {
        return None;
    }
    let count = pairs.len() as f64;
    let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = pairs.iter().map(|(a, b)| ((*a).into(), (*b).into())).collect();
    let offset = pairs.iter().map(|(a, b)| a - b).sum::<Vector3<f64>>() / count;
    let root = |of: &dyn Fn(Vector3<f64>) -> f64| (pairs.iter().map(|(a, b)| of(a - b)).sum::<f64>() / count).sqrt();
    Some(Agreement {
        rmse: root(&|d| d.norm_squared()),
        offset: offset.into(),
        centred_rmse: root(&|d| (d - offset).norm_squared()),
        aligned_rmse: (squares_after_alignment(&pairs) / count).sqrt(),
    })
}

/// Sum of the squares that the best rotation and translation leave.
pub(super) fn squares_after_alignment(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> f64 {
    let count = pairs.len().max(1) as f64;
    let from = pairs.iter().map(|(tip, _)| tip).sum::<Vector3<f64>>() / count;
    let to = pairs.iter().map(|(_, to)| to).sum::<Vector3<f64>>() / count;
    let cross: Matrix3<f64> = pairs.iter().map(|(tip, other)| (other - to) * (tip - from).transpose()).sum();
    let svd = cross.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return f64::NAN };
    let mirrored = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    let turn = u * mirrored * v_t;
    pairs.iter().map(|(tip, other)| (turn * (tip - from) - (other - to)).norm_squared()).sum()
}
