//! Levenberg and Marquardt's method, then what its end says.

use super::analysis::{NORMAL_95, analyse, findings, ridges, student_95};
use super::model::{MOST_EVALUATIONS, Model, NOISE, Problem, Search, State};
use super::noise::{bend, misfit, noise_of_points};
use super::starts::{End, LESS_PATIENCE, PATIENCE, Start, descend, stiffened};
use super::{Fit, FitError, FittedParameter};
use crate::study::MakeEngine;
use crate::study::witness::{CheckError, WitnessCheck};
use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::DVector;

/// Residuals below this share of the length leave nothing to look for.
const EXACT: f64 = 1e-7;
/// A rod that bends less (rad) has no second minimum near its points ...
const BENT: f64 = 2.0;
/// ... that is, within this share of the length.
const SLIGHT: f64 = 5e-3;
/// Residuals within so many times the noise, given or of the points themselves, are as good as any.
const NEAR: f64 = 2.0;
/// Evaluations under load take longer: no further start is tried after so many.
const MOST_LOADED: usize = 600;
/// Shares of the loads under which a fit under load begins.
const SHARES: [f64; 3] = [1.0 / 64.0, 0.125, 0.5];
/// Another end is better where its residuals are below this share.
const BETTER: f64 = 0.999;

/// The engine finds equilibria, the reference shapes and derivatives.
pub(super) fn fit(problem: &Problem, make: &mut MakeEngine) -> Result<Fit, FitError> {
    let observations = problem.observation_count();
    let parameters = problem.free.len();
    if parameters == 0 || observations < parameters {
        return Err(FitError::TooFew { observations, parameters });
    }
    let model = Model::new(problem, make)?;
    let sigma = problem.noise.unwrap_or(model.length * NOISE);
    let noise_of_points = noise_of_points(&problem.observed, model.length);
    let search = Search::new(model, sigma);
    let (mut search, End { x, state, converged }) = best(search, problem.noise.or(noise_of_points), make)?;
    let squares = state.residuals.norm_squared();
    let freedom = observations - parameters;
    let given = problem.given_noise(search.model.length);
    let noise = given.unwrap_or(if freedom > 0 { (squares / freedom as f64).sqrt() } else { 0.0 });
    let quantile = if given.is_some() { NORMAL_95 } else { student_95(freedom) };
    let (state, x) = leave_ridges(&mut search.model, state, x)?;
    let scene = search.model.scene(&x, None);
    let mut claim = |shape: usize| state.claims.get(shape).cloned();
    let check = WitnessCheck::of(&problem.scene, search.model.axes(), state.claims.len(), &mut claim);
    let check = check.map_err(|error| match error {
        CheckError::Plan(error) => FitError::from(error),
        CheckError::Backend(error) => error.into(),
    })?;
    let rms = search.model.point_rms(&state);
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
        rms: 3f64.sqrt() * rms,
        force_rms: search.model.force_rms(&state),
        noise,
        observations,
        evaluations: search.evaluations,
        converged,
        positions: state.positions,
        base_moments: state.base_moments,
        contacts: state.contacts,
        noise_of_points,
        mark: check.mark.clone().or_else(|| misfit.clone()),
        misfit,
        check,
    })
}

/// The best end of all descents. Others than the scene's own are tried where the rod is so bent that there may be other minima,
/// until one leaves no more than the noise of a coordinate (m).
fn best<'a>(search: Search<'a>, noise: Option<f64>, make: &mut MakeEngine) -> Result<(Search<'a>, End), FitError> {
    let (search, under_load) = match under_load(search, noise, make)? {
        (search, Some(end)) if rms(&end) < near(&search, noise) => return Ok((search, end)),
        others => others,
    };
    let (mut search, first) = from_scene(search);
    match first {
        Ok(first) if is_plain(&search, &first) => return Ok((search, first)),
        Err(error) if under_load.is_none() => return Err(error),
        _ => {}
    }
    search.most = if under_load.is_some() { MOST_LOADED } else { MOST_EVALUATIONS };
    let best = better(under_load, first);
    match by_starts(search, best, noise) {
        (search, Some(best)) => Ok((search, best)),
        (_, None) => Err(FitError::Failed("no start".into())),
    }
}

/// The descent from the scene's own values.
fn from_scene(search: Search<'_>) -> (Search<'_>, Result<End, FitError>) {
    let start = DVector::zeros(search.model.problem().free.len());
    descend(search, &start, PATIENCE)
}

/// Whether the points are met, or the rod is so little bent that it has no other minimum.
fn is_plain(search: &Search, end: &End) -> bool {
    let length = search.model.length;
    rms(end) < EXACT * length || (!is_bent(search) && rms(end) < SLIGHT * length)
}

/// Whether the observed rod is so bent that there may be other minima.
fn is_bent(search: &Search) -> bool {
    let problem = search.model.problem();
    let rod = problem.scene.rod();
    bend(&problem.observed, rod.base_position, rod.base_rotation.map(|row| row[2])) >= BENT
}

/// The end of a descent from where a rod ends that is hardly loaded, of one that is bent and loaded.
fn under_load<'a>(
    mut search: Search<'a>,
    noise: Option<f64>,
    make: &mut MakeEngine,
) -> Result<(Search<'a>, Option<End>), FitError> {
    if !is_bent(&search) || !is_loaded(&mut search) {
        return Ok((search, None));
    }
    match lighter(&mut search, noise, make)? {
        Some(place) => {
            let (search, end) = descend(search, &place, LESS_PATIENCE);
            Ok((search, end.ok()))
        }
        None => Ok((search, None)),
    }
}

/// Whether anything acts on the rod as the scene has it.
fn is_loaded(search: &mut Search) -> bool {
    let start = DVector::zeros(search.model.problem().free.len());
    search.set_params(&start);
    search.state.as_ref().is_some_and(|state| state.base_moments.iter().flatten().any(|moment| *moment != 0.0))
}

/// Residuals that are as good as any (m)
fn near(search: &Search, noise: Option<f64>) -> f64 {
    let length = search.model.length;
    noise.map_or(EXACT * length, |noise| (NEAR * noise).clamp(EXACT * length, SLIGHT * length))
}

/// Root of the mean square of the residuals (m)
fn rms(end: &End) -> f64 {
    (end.state.residuals.norm_squared() / end.state.residuals.len() as f64).sqrt()
}

/// The best of an end and of descents from other starts.
fn by_starts(mut search: Search<'_>, mut best: Option<End>, noise: Option<f64>) -> (Search<'_>, Option<End>) {
    let length = search.model.length;
    for start in Start::all() {
        let left = best.as_ref().map_or(f64::INFINITY, rms);
        let is_near = left < near(&search, noise) || (matches!(start, Start::Circle { .. }) && left < SLIGHT * length);
        if is_near || search.is_spent() {
            break;
        }
        let (after, place) = start.place(search);
        search = after;
        let Some(place) = place else { continue };
        let (after, end) = descend(search, &place, LESS_PATIENCE);
        (search, best) = (after, better(best, end));
    }
    (search, best)
}

/// The end of another descent where its residuals are clearly smaller.
fn better(best: Option<End>, other: Result<End, FitError>) -> Option<End> {
    match (best, other) {
        (Some(best), Ok(end)) if end.state.residuals.norm() < BETTER * best.state.residuals.norm() => Some(end),
        (None, Ok(end)) => Some(end),
        (best, _) => best,
    }
}

/// Scaled parameters of the same rod under a share of its loads, followed as the share grows. A rod that is hardly loaded is soon
/// solved, and its minima are those of its shape. `None`: it has no fit.
fn lighter(search: &mut Search, noise: Option<f64>, make: &mut MakeEngine) -> Result<Option<DVector<f64>>, FitError> {
    let problem = search.model.problem();
    let mut place: Option<DVector<f64>> = None;
    for share in SHARES {
        // Loads act by their ratio to stiffness.
        let stiffer = Problem { scene: stiffened(&problem.scene, 1.0 / share), ..problem.clone() };
        let lightly_loaded = Search::new(Model::new(&stiffer, make)?, search.sigma);
        let (after, end) = match &place {
            Some(from) => {
                let (after, end) = descend(lightly_loaded, from, LESS_PATIENCE);
                (after, end.ok())
            }
            None => by_starts(lightly_loaded, None, noise),
        };
        search.evaluations += after.evaluations;
        match end {
            Some(end) => place = Some(end.x),
            None => break,
        }
    }
    Ok(place)
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
