//! Numbers of a scene from observed shapes.

use super::failure::Failure;
use super::job::run;
use super::scene::NativeScene;
use pyo3::prelude::*;
use rodsweep::draw::{ImageFormat, Marked, encode};
use rodsweep::model::Parameter;
use rodsweep::spec::{ObservedPoint, ObservedShape, ObservedShapes};
use rodsweep::study::{Fit, FitJob};
use std::sync::Arc;

/// What was fitted.
#[pyclass(frozen, module = "rodsweep._rodsweep")]
pub struct NativeFit {
    found: Arc<(Fit, FitJob)>,
}

/// Points of one shape: arc length (NaN for the tip), then the position.
type Points = Vec<[f64; 4]>;

/// Fits; `values` holds the known parameters of each shape.
#[pyfunction]
#[pyo3(signature = (scene, known, values, shapes, normal_forces, free, noise, force_noise, threads))]
#[allow(clippy::too_many_arguments)]
pub fn fit(
    py: Python<'_>,
    scene: &NativeScene,
    known: Vec<String>,
    values: Vec<Vec<f64>>,
    shapes: Vec<Points>,
    normal_forces: Vec<Vec<f64>>,
    free: Option<Vec<String>>,
    noise: Option<f64>,
    force_noise: Option<f64>,
    threads: Option<usize>,
) -> PyResult<NativeFit> {
    let mut parameters = Vec::new();
    for name in &known {
        parameters.extend(scene.parse(name)?);
    }
    let is_empty = |(points, forces): (&Points, &Vec<f64>)| points.is_empty() && forces.is_empty();
    if shapes.is_empty() || normal_forces.len() != shapes.len() || shapes.iter().zip(&normal_forces).any(is_empty) {
        let problem = "hold no point; give at least one point, or a measured force, of each shape";
        return Err(Failure::at("positions", problem).into());
    }
    if scene.scene.wall.is_none() && normal_forces.iter().any(|forces| !forces.is_empty()) {
        let problem =
            "are given, and the scene has no wall that the tip could press on: add [wall] to it, or leave them out";
        return Err(Failure::at("normal_forces", problem).into());
    }
    if normal_forces.iter().flatten().any(|force| !force.is_finite()) {
        return Err(Failure::at("normal_forces", "hold a number that is not finite").into());
    }
    if values.len() != shapes.len() || values.iter().any(|row| row.len() != parameters.len()) {
        return Err(Failure::at("values", "are not one for each shape").into());
    }
    if values.iter().flatten().chain(shapes.iter().flatten().flat_map(|point| &point[1..])).any(|x| !x.is_finite()) {
        return Err(Failure::at("positions", "or values hold a number that is not finite").into());
    }
    if noise.is_some_and(|noise| !(noise > 0.0 && noise.is_finite())) {
        return Err(Failure::at("noise", "is no positive number; give a length in metres").into());
    }
    if force_noise.is_some_and(|noise| !(noise > 0.0 && noise.is_finite())) {
        return Err(Failure::at("force_noise", "is no positive number; give a force in newtons").into());
    }
    let mut observed = ObservedShapes { known: parameters, shapes: Vec::new() };
    for ((row, points), normal_forces) in values.into_iter().zip(&shapes).zip(normal_forces) {
        let mut own = scene.scene.clone();
        let pairs = observed.known.iter().copied().zip(row.iter().copied());
        Parameter::set_all(&mut own, pairs).map_err(Failure::from)?;
        let length = own.total_length();
        let points = points.iter().map(|[s, x, y, z]| {
            let arc_length = s.is_finite().then_some(*s);
            if arc_length.is_some_and(|s| !(0.0..=length * (1.0 + 1e-9)).contains(&s)) {
                return Err(Failure::at("arc_length", format!("is {s}; give 0 to {length} m, the length of the rod")));
            }
            Ok(ObservedPoint { arc_length, position: [*x, *y, *z] })
        });
        let points = points.collect::<Result<Vec<_>, Failure>>()?;
        observed.shapes.push(ObservedShape { known: row, points, normal_forces });
    }
    let mut job = FitJob::new(scene.scene.clone(), observed);
    if let Some(names) = &free {
        job = job.free(names).map_err(Failure::from)?;
    }
    if let Some(noise) = noise {
        job = job.noise(noise);
    }
    if let Some(force_noise) = force_noise {
        job = job.force_noise(force_noise);
    }
    let found = run(py, threads, None, move |_| {
        let fit = job.run()?;
        Ok((fit, job))
    })?;
    Ok(NativeFit { found: Arc::new(found) })
}

#[pymethods]
impl NativeFit {
    fn json(&self) -> String {
        self.found.0.to_json().to_string()
    }

    fn text(&self) -> String {
        self.found.0.text(&self.found.1)
    }

    fn scene(&self) -> NativeScene {
        NativeScene::new(self.found.0.scene.clone())
    }

    /// Fitted points, shape after shape.
    fn positions(&self) -> Vec<Vec<[f64; 3]>> {
        self.found.0.positions.clone()
    }

    /// The figure of observed and fitted points as a PNG or SVG.
    fn figure(&self, format: &str) -> PyResult<Vec<u8>> {
        let format = ImageFormat::of(format!("x.{format}").as_ref()).map_err(Failure::from)?;
        let (fit, job) = &*self.found;
        let figure = rodsweep::figures::fit(fit, job);
        let bytes = match fit.mark() {
            Some(mark) => encode(&Marked { figure: &figure, mark }, format),
            None => encode(&figure, format),
        };
        Ok(bytes.map_err(Failure::from)?)
    }
}
