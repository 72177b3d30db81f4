//! What the baselines have in common: Newton's method on their unknowns, and the path of loads from rest.

use super::error::BaselineError;
use super::rod::{Input, Rod};
use nalgebra::{Matrix3, Vector3};
use rodsweep::model::{Matrix, Vector};

/// Newton's step below which the next one would be round-off (rad).
const ARRIVED: f64 = 1e-7;
/// A step must be shorter than the last by this factor.
const CONTRACTION: f64 = 0.5;
/// A first step above this is too far from the path (rad).
const TRUST: f64 = 1.0;
const MOST_STEPS: usize = 12;
/// Share of the load in the first step from rest, and in the smallest.
const FIRST_LOAD_STEP: f64 = 0.125;
const SMALLEST_LOAD_STEP: f64 = 1e-4;

/// Pose of the distal end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tip {
    /// World frame (m)
    pub p: Vector,
    /// Body to world, by rows.
    pub R: Matrix,
}

/// Change of the tip by one input, the rod staying in equilibrium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// In m per unit
    pub dp: Vector,
    /// Virtual rotation, world frame (rad per unit)
    pub w: Vector,
}

/// The tip and its change by each input.
#[derive(Clone, Debug, PartialEq)]
pub struct Jacobian {
    /// Where the tip is.
    pub tip: Tip,
    /// In the order of the inputs.
    pub columns: Vec<Column>,
}

/// Newton's step on the unknowns.
pub struct NewtonStep {
    /// To be added to the unknowns.
    pub step: Vec<f64>,
    /// In rad
    pub size: f64,
}

/// A method, prepared for a rod's segments and a resolution.
pub trait Method {
    /// The unknowns of the unloaded rod.
    fn rest(&self, rod: &Rod) -> Vec<f64>;

    /// One step of Newton's method; `None` where the numbers overflow or the matrix is singular.
    fn newton_step(&self, rod: &Rod, unknowns: &[f64]) -> Option<NewtonStep>;

    /// Where the unknowns lead.
    fn tip(&self, rod: &Rod, unknowns: &[f64]) -> Tip;

    /// The tip and its change by each input, at an equilibrium.
    fn jacobian(&self, rod: &Rod, unknowns: &[f64], inputs: &[Input]) -> Option<Jacobian>;
}

pub(super) fn tip(p: Vector3<f64>, R: &Matrix3<f64>) -> Tip {
    Tip { p: p.into(), R: std::array::from_fn(|row| std::array::from_fn(|col| R[(row, col)])) }
}

/// Newton's iteration from a guess near by: the unknowns at equilibrium.
pub fn solve<M: Method + ?Sized>(method: &M, rod: &Rod, guess: &[f64]) -> Option<Vec<f64>> {
    let mut unknowns = guess.to_vec();
    let mut allowed = TRUST;
    for _ in 0..MOST_STEPS {
        let NewtonStep { step, size } = method.newton_step(rod, &unknowns)?;
        // Also false for NaN.
        let contracts = size <= allowed;
        if !contracts {
            return None;
        }
        unknowns.iter_mut().zip(&step).for_each(|(x, dx)| *x += dx);
        if size <= ARRIVED {
            return Some(unknowns);
        }
        allowed = CONTRACTION * size.max(ARRIVED);
    }
    None
}

/// Raises all loads together from zero; each step starts where the last two point.
///
/// # Errors
///
/// Steps that have become too short: the load cannot be raised further.
pub fn from_rest<M: Method + ?Sized>(method: &M, rod: &Rod) -> Result<Vec<f64>, BaselineError> {
    let mut here = (0.0, method.rest(rod));
    let mut before: Option<(f64, Vec<f64>)> = None;
    let mut step = FIRST_LOAD_STEP;
    while here.0 < 1.0 {
        let next = if here.0 + step >= 1.0 { 1.0 } else { here.0 + step };
        let guess = match &before {
            None => here.1.clone(),
            Some((load, unknowns)) => {
                let ratio = (next - here.0) / (here.0 - load);
                here.1.iter().zip(unknowns).map(|(x, last)| x + ratio * (x - last)).collect()
            }
        };
        match solve(method, &rod.loaded(next), &guess) {
            Some(unknowns) => before = Some(std::mem::replace(&mut here, (next, unknowns))),
            None if step > SMALLEST_LOAD_STEP => step *= 0.5,
            None => return Err(BaselineError::NotConverged { load: here.0 }),
        }
    }
    Ok(here.1)
}
