//! Levenberg and Marquardt's method, then what its end says.

use super::analysis::{NORMAL_95, analyse, findings, ridges, student_95};
use super::model::{Model, Problem, Search, State};
use super::noise::{bend, misfit, noise_of_points};
use super::starts::{End, LESS_PATIENCE, PATIENCE, Start, descend};
use super::{Fit, FitError, FittedParameter};
use crate::study::MakeEngine;
use crate::study::witness::{CheckError, WitnessCheck};
use nalgebra::DVector;

/// Residuals below this share of the length leave nothing to look for.
const EXACT: f64 = 1e-7;
/// A rod that bends less (rad) has no second minimum near its points ...
const BENT: f64 = 2.0;
/// ... that is, within this share of the length.
const SLIGHT: f64 = 5e-3;
/// Residuals within so many times the noise, given or of the points themselves, are as good as any.
const NEAR: f64 = 2.0;
/// No further start is tried after so many evaluations: what is left is told as a misfit.
const MOST_EVALUATIONS: usize = 2000;
/// Another end is better where its residuals are below this share.
const BETTER: f64 = 0.999;

/// The engine finds equilibria, the reference shapes and derivatives.
pub(super) fn fit(problem: &Problem, make: &mut MakeEngine) -> Result<Fit, FitError> {
    let observations = problem.observed.coordinate_count();
    let parameters = problem.free.len();
    if parameters == 0 || observations < parameters {
        return Err(FitError::TooFew { observations, parameters });
    }
    let model = Model::new(problem, make)?;
    let sigma = problem.noise.unwrap_or(model.length * 1e-3);
    let x = DVector::zeros(parameters);
    let search = Search { model, x, sigma, state: None, failure: None, worst: 0.0, evaluations: 0, part: None };
    let noise_of_points = noise_of_points(&problem.observed, search.model.length);
    let (mut search, End { x, state, converged }) = best(search, problem.noise.or(noise_of_points))?;
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
    let rms = (squares / observations as f64).sqrt();
    let misfit = misfit(rms, problem.noise, noise_of_points, search.model.length);
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
        noise_of_points,
        mark: check.mark.clone().or_else(|| misfit.clone()),
        misfit,
        check,
    })
}

/// The best end of all descents. Others than the scene's own are tried where the rod is so bent that there may be other minima,
/// until one leaves no more than the noise of a coordinate (m).
fn best(search: Search<'_>, noise: Option<f64>) -> Result<(Search<'_>, End), FitError> {
    let problem = search.model.problem();
    let length = search.model.length;
    let (mut search, first) = descend(search, &DVector::zeros(problem.free.len()), PATIENCE);
    let mut best = first?;
    let rod = problem.scene.rod();
    let bend = bend(&problem.observed, rod.base_position, rod.base_rotation.map(|row| row[2]));
    let rms = |end: &End| (end.state.residuals.norm_squared() / end.state.residuals.len() as f64).sqrt();
    if rms(&best) < EXACT * length || (bend < BENT && rms(&best) < SLIGHT * length) {
        return Ok((search, best));
    }
    for start in Start::all() {
        let near = noise.map_or(EXACT * length, |noise| (NEAR * noise).clamp(EXACT * length, SLIGHT * length));
        let is_spent = search.evaluations > MOST_EVALUATIONS;
        if rms(&best) < near || is_spent || (matches!(start, Start::Circle { .. }) && rms(&best) < SLIGHT * length) {
            break;
        }
        let (after, place) = start.place(search);
        search = after;
        let Some(place) = place else { continue };
        let (after, end) = descend(search, &place, LESS_PATIENCE);
        search = after;
        if let Ok(end) = end
            && end.state.residuals.norm() < BETTER * best.state.residuals.norm()
        {
            best = end;
        }
    }
    Ok((search, best))
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
