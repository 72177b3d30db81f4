//! Numbers of a rod from observed shapes: Levenberg and Marquardt's method on analytic derivatives, the covariance of
//! the answer, and what the observations cannot tell apart.
//!
//! Numbers that must be positive are fitted by their logarithm, so that sensitivities are relative and a ridge such as
//! "stiffness and magnetic moment scale together" is a straight line.

mod analysis;
mod model;

use super::MakeEngine;
use crate::backend::BackendError;
use crate::model::{Parameter, PlanError, Scene, Vector};
use analysis::{NORMAL_95, analyse, findings, ridges, student_95};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use model::{Model, Search, State};
use nalgebra::DVector;

/// A point of a rod that was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservedPoint {
    /// From the base [m]; the tip if not given.
    pub arc_length: Option<f64>,
    /// World frame [m]
    pub position: Vector,
}

/// Points of one equilibrium.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObservedShape {
    /// Values of [`FitProblem::known`], SI.
    pub known: Vec<f64>,
    pub points: Vec<ObservedPoint>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct FitProblem {
    /// Where the fit starts.
    pub scene: Scene,
    /// What is fitted; parameters that stand together keep their ratios.
    pub free: Vec<Vec<Parameter>>,
    /// What differs from shape to shape and is known.
    pub known: Vec<Parameter>,
    pub shapes: Vec<ObservedShape>,
    /// Standard deviation of a coordinate [m]; estimated from the residuals if not given.
    pub noise: Option<f64>,
}

/// One fitted number, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    pub name: String,
    pub unit: &'static str,
    pub start: f64,
    pub value: f64,
    /// Standard deviation; infinite where the observations do not determine it.
    pub deviation: f64,
    /// 95 % of such intervals cover the truth.
    pub interval: [f64; 2],
}

/// A direction of the parameters and what the observations say about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Direction {
    /// Of the scaled sensitivities, over the noise.
    pub singular_value: f64,
    /// Weights of the parameters: relative changes, or changes of curvature times length.
    pub weights: Vec<f64>,
    pub strength: Strength,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strength {
    Determined,
    /// The noise hides changes of half the value.
    Weak,
    /// Nothing changes along it.
    Ridge,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    pub parameters: Vec<Fitted>,
    /// The scene with the fitted values.
    pub scene: Scene,
    /// By the values, SI; without what no observation determines.
    pub covariance: Vec<Vec<f64>>,
    /// Strongest first.
    pub directions: Vec<Direction>,
    /// What the directions mean, in words.
    pub findings: Vec<String>,
    /// Root mean square of the distances between points and model [m].
    pub rms: f64,
    /// Standard deviation of a coordinate: as given, or estimated [m].
    pub noise: f64,
    pub observations: usize,
    pub evaluations: usize,
    pub converged: bool,
    /// Model positions of every shape's points [m].
    pub positions: Vec<Vec<Vector>>,
    /// Base moments of the shapes [N·m].
    pub base_moments: Vec<Vector>,
}

#[derive(Debug, thiserror::Error)]
pub enum FitError {
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error(transparent)]
    Backend(#[from] BackendError),
    #[error("{observations} coordinates cannot determine {parameters} parameters: observe more, or free fewer")]
    TooFew { observations: usize, parameters: usize },
    #[error("`{0}` is zero and cannot be scaled: give it a value in the scene, or free its components one by one")]
    Zero(String),
    #[error("with the scene's own values shape {shape} has no stable equilibrium ({status}): start from other values")]
    NoStart { shape: usize, status: &'static str },
    #[error("the fit ended in vain: {0}")]
    Failed(String),
}

/// Fits a problem; the engine finds equilibria, the reference shapes and derivatives.
pub fn fit(problem: &FitProblem, make: &mut MakeEngine) -> Result<Fit, FitError> {
    let observations = 3 * problem.shapes.iter().map(|shape| shape.points.len()).sum::<usize>();
    let parameters = problem.free.len();
    if parameters == 0 || observations < parameters {
        return Err(FitError::TooFew { observations, parameters });
    }
    let model = Model::new(problem, make)?;
    let sigma = problem.noise.unwrap_or(model.length * 1e-3);
    let start = DVector::zeros(parameters);
    let mut search = Search { model, x: start, sigma, state: None, failure: None, worst: 0.0, evaluations: 0 };
    search.set_params(&DVector::zeros(parameters));
    if let Some(error) = search.failure.take() {
        return Err(error);
    }
    let method = LevenbergMarquardt::new().with_patience(40).with_ftol(1e-15).with_xtol(1e-14).with_gtol(0.0);
    let (mut search, report) = method.minimize(search);
    let converged = report.termination.was_successful();
    let x = search.x.clone();
    search.set_params(&x);
    let Some(state) = search.state else { return Err(FitError::Failed(format!("{:?}", report.termination))) };
    let squares = state.residuals.norm_squared();
    let freedom = observations - parameters;
    let noise = problem.noise.unwrap_or(if freedom > 0 { (squares / freedom as f64).sqrt() } else { 0.0 });
    let quantile = if problem.noise.is_some() { NORMAL_95 } else { student_95(freedom) };
    let (state, x) = leave_ridges(&mut search.model, state, x)?;
    let scene = search.model.scene(&x, None);
    let (covariance, open, directions) = analyse(&search.model, &state.jacobian, noise);
    let fitted = |k: usize| {
        let parameter = problem.free[k][0];
        let value = parameter.get(&scene);
        let rate = search.model.rate(k, value);
        let deviation = if open[k] { f64::INFINITY } else { rate * covariance[(k, k)].sqrt() };
        Fitted {
            name: search.model.names[k].clone(),
            unit: parameter.unit(),
            start: parameter.get(&problem.scene),
            value,
            deviation,
            interval: [value - quantile * deviation, value + quantile * deviation],
        }
    };
    let fitted: Vec<Fitted> = (0..parameters).map(fitted).collect();
    let rates: Vec<f64> = (0..parameters).map(|k| search.model.rate(k, fitted[k].value)).collect();
    let entry = |row: usize, column: usize| rates[row] * covariance[(row, column)] * rates[column];
    Ok(Fit {
        covariance: (0..parameters).map(|row| (0..parameters).map(|column| entry(row, column)).collect()).collect(),
        findings: findings(&search.model, &directions),
        directions,
        parameters: fitted,
        scene,
        rms: (3.0 * squares / observations as f64).sqrt(),
        noise,
        observations,
        evaluations: search.evaluations,
        converged,
        positions: state.positions,
        base_moments: state.base_moments,
    })
}

/// Takes back what the parameters have moved along ridges, where that changes nothing.
fn leave_ridges(model: &mut Model, state: State, x: DVector<f64>) -> Result<(State, DVector<f64>), FitError> {
    let mut nearer = x.clone();
    for row in ridges(&state.jacobian) {
        nearer -= &row * row.dot(&x);
    }
    if nearer == x {
        return Ok((state, x));
    }
    match model.solve(&nearer) {
        Ok(other) if other.residuals.norm() <= (1.0 + 1e-6) * state.residuals.norm() + 1e-12 * model.length => {
            Ok((other, nearer))
        }
        _ => Ok((state, x)),
    }
}
