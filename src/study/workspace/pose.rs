//! The rank of the tip's pose: position and, times a length, rotation.

use super::engine_map::EngineMap;
use super::error::WorkspaceError;
use super::growth::Grown;
use super::tip_map::{Inputs, padded};
use crate::model::Scene;
use crate::study::pose_length::pose_length;
use nalgebra::DMatrix;
use serde::Serialize;

/// Voxels that are looked at.
const ROWS: usize = 1024;
/// Values below this share of the largest are round-off.
const ROUND_OFF: f64 = 1e-6;
const QUANTILE: f64 = 0.9;

/// How many numbers of the pose the inputs can set at once.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoseRank {
    /// At most six.
    pub rank: usize,
    /// 90 %-quantiles of the singular values (m per half range), the largest first.
    pub sigma: Vec<f64>,
    /// What rotations (rad) are multiplied by (m).
    pub length: f64,
}

impl PoseRank {
    pub(super) fn of(
        map: &mut EngineMap,
        grown: &Grown,
        scene: &Scene,
        length: Option<f64>,
    ) -> Result<PoseRank, WorkspaceError> {
        let length = pose_length(scene, length);
        let places: Vec<usize> = grown.reached().collect();
        let every = places.len().div_ceil(ROWS).max(1);
        let inputs: Vec<Inputs> = places.iter().step_by(every).map(|at| padded(grown.inputs_of(*at))).collect();
        let mut values: Vec<Vec<f64>> = Vec::new();
        for rows in map.pose_jacobians(&inputs)?.into_iter().flatten() {
            let matrix = DMatrix::from_fn(6, rows.len(), |row, column| match row {
                0..3 => rows[column][row],
                _ => length * rows[column][row],
            });
            let mut singular: Vec<f64> = matrix.singular_values().iter().copied().collect();
            singular.sort_by(|a, b| b.total_cmp(a));
            values.resize(values.len().max(singular.len()), Vec::new());
            values.iter_mut().zip(singular).for_each(|(all, value)| all.push(value));
        }
        let quantile = |all: &mut Vec<f64>| {
            all.sort_by(f64::total_cmp);
            all[((QUANTILE * (all.len() - 1) as f64).round() as usize).min(all.len() - 1)]
        };
        let sigma: Vec<f64> = values.iter_mut().map(quantile).collect();
        let largest = sigma.first().copied().unwrap_or(0.0);
        let rank = sigma.iter().filter(|value| **value > ROUND_OFF * largest).count();
        Ok(PoseRank { rank, sigma, length })
    }
}
