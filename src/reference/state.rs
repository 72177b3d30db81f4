//! The state at one point of the rod, as it is carried from segment to segment, and how it changes with each variation.

use super::chain::{Chain, Variation};
use nalgebra::{Matrix3, Vector3};

/// Change of the state along a variation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub w: Vector3<f64>,
    pub dp: Vector3<f64>,
    pub dm_body: Vector3<f64>,
}

/// State at one point of the rod: pose, moment in the body frame, columns.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub p: Vector3<f64>,
    pub R: Matrix3<f64>,
    pub m_body: Vector3<f64>,
    pub columns: Vec<Column>,
}

/// The state at the base.
pub(super) fn base_state(chain: &Chain, m0_body: Vector3<f64>, variations: &[Variation]) -> State {
    let column = |v: &Variation| Column { w: v.w0, dp: v.dp0, dm_body: v.dm0_body };
    State { p: Vector3::zeros(), R: chain.R0, m_body: m0_body, columns: variations.iter().map(column).collect() }
}
