//! Currents for a trajectory, or for many targets at once.

use super::engine;
use super::failure::Failure;
use super::job::{Told, run};
use super::scene::NativeScene;
use super::studies::targets;
use super::table::Table;
use pyo3::prelude::*;
use rodsweep::figures::draw_control;
use rodsweep::input::{parse_coordinates, parse_limits};
use rodsweep::results::make_directory;
use rodsweep::spec::{Redundancy, Trajectory};
use rodsweep::study::{ControlEvent, ControlJob, ControlRun};
use std::path::PathBuf;
use std::sync::Arc;

/// Inputs for targets.
#[pyclass(frozen, module = "rodsweep._rodsweep")]
pub struct NativeControl {
    run: Arc<ControlRun>,
}

/// What is asked of the controller; `None`: as usual.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct ControlOptions {
    engine: String,
    precision: Option<String>,
    threads: Option<usize>,
    /// Such as `coil.current=0.3`.
    inputs: Vec<String>,
    coordinates: Option<Vec<String>>,
    tolerance: Option<f64>,
    tangent_weight: Option<f64>,
    redundancy: Option<String>,
    in_order: bool,
    closed: bool,
    name: String,
}

/// Finds inputs for targets: in order, each from where the last one ended, or all at once.
#[pyfunction]
pub fn control(
    py: Python<'_>,
    scene: &NativeScene,
    positions: Vec<[f64; 3]>,
    tangents: Option<Vec<[f64; 3]>>,
    normal_forces: Option<Vec<f64>>,
    options: ControlOptions,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<NativeControl> {
    let mut targets = targets(&positions, tangents.as_deref())?;
    if normal_forces.iter().flatten().any(|force| !force.is_finite()) {
        return Err(Failure::at("normal_forces", "hold a number that is not finite").into());
    }
    for (target, force) in targets.iter_mut().zip(normal_forces.into_iter().flatten()) {
        *target = target.pressing(force);
    }
    if targets.is_empty() {
        return Err(Failure::at("positions", "hold no target; give at least one").into());
    }
    let mut job =
        ControlJob::new(scene.scene.clone()).engine(engine::request(&options.engine, options.precision.as_deref())?);
    for text in &options.inputs {
        let wrong = |error| Failure::at("inputs", format!("`{text}`: {error}"));
        parse_limits(&scene.scene, text).map_err(wrong)?;
        job = job.input(text).map_err(wrong)?;
    }
    if let Some(names) = &options.coordinates {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        job = job.coordinates(parse_coordinates(&names).map_err(|error| Failure::at("coordinates", error))?);
    }
    for (key, number) in [("tolerance", options.tolerance), ("tangent_weight", options.tangent_weight)] {
        if number.is_some_and(|number| !(number > 0.0 && number.is_finite())) {
            return Err(Failure::at(key, "is no positive number; give a length in metres").into());
        }
    }
    if let Some(tolerance) = options.tolerance {
        job = job.tolerance(tolerance);
    }
    if let Some(weight) = options.tangent_weight {
        job = job.tangent_weight(weight);
    }
    if let Some(text) = &options.redundancy {
        job = job.redundancy(engine::word("redundancy", text, &Redundancy::ALL, Redundancy::name)?);
    }
    let mut trajectory = Trajectory::new(options.name, targets);
    trajectory.closed = options.closed;
    let in_order = options.in_order;
    let found = run(py, options.threads, progress.as_ref(), move |line| {
        let teller = line.clone();
        let job = job.on_event(move |event| {
            if let ControlEvent::Ended { ended, targets } = event {
                teller.tell(Told::Stage(format!("{ended} of {targets} targets ended")));
            }
        });
        let run = if in_order { job.follow(&trajectory)? } else { job.reach(&trajectory)? };
        Ok(run)
    })?;
    Ok(NativeControl { run: Arc::new(found) })
}

#[pymethods]
impl NativeControl {
    /// One row a target.
    fn table(&self) -> PyResult<Table> {
        Ok(Table::new(self.run.table())?)
    }

    /// Names of the inputs.
    fn inputs(&self) -> Vec<String> {
        self.run.inputs().iter().map(|input| input.name(self.run.scene())).collect()
    }

    /// Values of the inputs, target after target.
    fn values(&self) -> Vec<Vec<f64>> {
        self.run.results().iter().map(|result| result.inputs.clone()).collect()
    }

    fn json(&self) -> String {
        self.run.to_json().to_string()
    }

    fn text(&self) -> String {
        self.run.text()
    }

    fn missed(&self) -> usize {
        self.run.missed_count()
    }

    fn write(&self, path: PathBuf) -> PyResult<()> {
        Ok(self.run.write(&path).map_err(Failure::from)?)
    }

    fn draw(&self, py: Python<'_>, folder: PathBuf) -> PyResult<Vec<PathBuf>> {
        let found = self.run.clone();
        run(py, None, None, move |_| {
            make_directory(&folder)?;
            Ok(draw_control(&found, &folder)?.files)
        })
    }
}
