//! What a passage along the rod yields: tip, stations, residual, and how they follow the load at the base.

use super::state::{Column, State};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// What one passage yields.
#[derive(Clone, Debug)]
pub(super) struct Passage {
    /// At the tip.
    pub tip: State,
    /// Columns at the end of each section of the flexible segments.
    pub stations: Vec<Vec<Column>>,
    /// u and its columns at the start of the first flexible segment.
    pub u_first: Vector3<f64>,
    pub du_first: Vec<Vector3<f64>>,
    /// u at the end of the last flexible segment.
    pub u_last: Vector3<f64>,
    /// n(L) - f_tip in the world frame, m(L) - l_tip in the tip's.
    pub residual: Vector6<f64>,
    pub dresidual: Vec<Vector6<f64>>,
}

impl Passage {
    /// dr/d(n0, m0); the first six columns must be those of the unknown.
    pub(super) fn matrix(&self) -> Matrix6<f64> {
        Matrix6::from_columns(&self.dresidual[..6])
    }

    /// d(m0)/d(l_tip): of the inverse, what tells of moments. In a uniform field it is the inverse of dr/dm0.
    pub(super) fn moment_inverse(&self) -> Option<Matrix3<f64>> {
        Some(self.matrix().try_inverse()?.fixed_view::<3, 3>(3, 3).into())
    }

    /// Largest entry of the unknown's columns: by how much errors grow along the rod.
    pub(super) fn growth(&self) -> f64 {
        let of = |c: &Column| c.w.amax().max(c.dp.amax()).max(c.dm_body.amax()).max(c.dn.amax());
        self.tip.columns[..6].iter().map(of).fold(1.0, f64::max)
    }

    /// A sum over the unknown's columns at the tip.
    pub(super) fn combined(&self, of: impl Fn(&Column) -> Vector3<f64>, by: &Vector6<f64>) -> Vector3<f64> {
        combined(&self.tip.columns, of, by)
    }

    /// The largest of what is measured at each station and at the tip, which a rigid segment may be alone.
    pub(super) fn largest(&self, measure: impl Fn(&[Column]) -> f64) -> f64 {
        self.stations.iter().chain([&self.tip.columns]).map(|columns| measure(columns)).fold(0.0, f64::max)
    }
}

/// A sum over the unknown's columns at one place.
pub(super) fn combined(columns: &[Column], of: impl Fn(&Column) -> Vector3<f64>, by: &Vector6<f64>) -> Vector3<f64> {
    (0..6).map(|k| of(&columns[k]) * by[k]).sum()
}
