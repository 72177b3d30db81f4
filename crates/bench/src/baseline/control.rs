//! One step of control by damped least squares, as controllers of this catheter take it.

use super::method::{Column, Method, solve};
use super::rod::{Input, Rod};
use nalgebra::{DMatrix, Matrix3, Vector3};
use rodsweep::model::Vector;

/// Damping over the length of the rod, with inputs measured by what bends the rod by a radian. The papers do not
/// publish theirs.
const DAMPING: f64 = 0.05;

/// Where a step of control leads.
pub struct ControlStep {
    /// Changes of the inputs.
    pub moves: Vec<f64>,
    /// With the changed inputs.
    pub rod: Rod,
    /// The equilibrium there.
    pub unknowns: Vec<f64>,
}

/// Changes of the inputs that move the tip towards `error` (m): J^T (J J^T + damping²)^-1 error, inputs over `scales`.
pub fn damped_least_squares(columns: &[Column], scales: &[f64], length: f64, error: Vector) -> Vec<f64> {
    let J = DMatrix::from_fn(3, columns.len(), |row, k| columns[k].dp[row] * scales[k]);
    let damping = DAMPING * length;
    let square: Matrix3<f64> = (&J * J.transpose()).fixed_view::<3, 3>(0, 0) + Matrix3::identity() * damping * damping;
    let force = square.cholesky().map(|square| square.solve(&Vector3::from(error))).unwrap_or_default();
    let moves = J.transpose() * force;
    moves.iter().zip(scales).map(|(change, scale)| change * scale).collect()
}

/// From an equilibrium: Jacobian, damped least squares towards `error` (m), and the equilibrium there.
pub fn control_step(
    method: &dyn Method,
    rod: &Rod,
    unknowns: &[f64],
    inputs: &[Input],
    error: Vector,
) -> Option<ControlStep> {
    let jacobian = method.jacobian(rod, unknowns, inputs)?;
    let scales: Vec<f64> = inputs.iter().map(|input| rod.scale(input)).collect();
    let moves = damped_least_squares(&jacobian.columns, &scales, rod.length(), error);
    let moved = inputs.iter().zip(&moves).fold(rod.clone(), |rod, (input, by)| rod.moved(input, *by));
    let unknowns = solve(method, &moved, unknowns)?;
    Some(ControlStep { moves, rod: moved, unknowns })
}
