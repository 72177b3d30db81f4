//! Levenberg and Marquardt's method, then what its end says.

use super::analysis::{NORMAL_95, analyse, findings, ridges, student_95};
use super::model::{Model, Problem, Search, State};
use super::{Fit, FitError, FittedParameter};
use crate::study::MakeEngine;
use crate::study::witness::{CheckError, WitnessCheck};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::DVector;

/// The engine finds equilibria, the reference shapes and derivatives.
pub(super) fn fit(problem: &Problem, make: &mut MakeEngine) -> Result<Fit, FitError> {
    let observations = problem.observed.coordinate_count();
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
    let mut claim = |shape: usize| state.claims.get(shape).cloned();
    let check = WitnessCheck::of(&problem.scene, search.model.axes(), state.claims.len(), &mut claim);
    let check = check.map_err(|error| match error {
        CheckError::Plan(error) => FitError::from(error),
        CheckError::Backend(error) => error.into(),
    })?;
    let (covariance, open, directions) = analyse(&state.jacobian, noise);
    let fitted = |k: usize| {
        let parameter = problem.free[k][0];
        let value = parameter.get(&scene);
        let rate = search.model.rate(k, value);
        let deviation = if open[k] { f64::INFINITY } else { rate * covariance[(k, k)].sqrt() };
        FittedParameter {
            name: search.model.names[k].clone(),
            unit: parameter.unit(),
            start: parameter.get(&problem.scene),
            value,
            deviation,
            interval: [value - quantile * deviation, value + quantile * deviation],
        }
    };
    let fitted: Vec<FittedParameter> = (0..parameters).map(fitted).collect();
    let rates: Vec<f64> = (0..parameters).map(|k| search.model.rate(k, fitted[k].value)).collect();
    let entry = |row: usize, column: usize| rates[row] * covariance[(row, column)] * rates[column];
    Ok(Fit {
        covariance: (0..parameters).map(|row| (0..parameters).map(|column| entry(row, column)).collect()).collect(),
        findings: findings(&search.model.names, &search.model.logarithmic, &directions),
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
        check,
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
