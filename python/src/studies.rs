//! The workspace and the sensitivity of a sweep, as the program computes and draws them.

use super::engine;
use super::failure::Failure;
use super::job::{Told, run};
use super::results::NativeResults;
use super::sweep::{NativeSweep, RunOptions};
use super::table::Table;
use pyo3::prelude::*;
use rodsweep::engines::EngineRequest;
use rodsweep::figures::{draw_sensitivity, draw_workspace};
use rodsweep::input::LARGEST;
use rodsweep::results::{Results, make_directory};
use rodsweep::spec::{SweepSpec, Target};
use rodsweep::study::sensitivity::{Estimator, EstimatorChoice, Sensitivity, SensitivityJob};
use rodsweep::study::workspace::{
    Convergence, Preference, Variation, Workspace, WorkspaceExtras, WorkspaceJob, WorkspaceStage,
};
use rodsweep::sweep::Memory;
use std::path::PathBuf;
use std::sync::Arc;

/// What a study is about.
#[derive(Clone)]
enum Source {
    Sweep(Arc<SweepSpec>),
    Results(Arc<Results>),
}

impl Source {
    fn spec(&self) -> &SweepSpec {
        match self {
            Source::Sweep(spec) => spec,
            Source::Results(results) => results.spec(),
        }
    }
}

/// Options of a workspace; `None`: as the sweep says.
#[derive(Clone, FromPyObject)]
#[pyo3(from_item_all)]
struct WorkspaceOptions {
    engine: String,
    precision: Option<String>,
    threads: Option<usize>,
    voxel: Option<f64>,
    minimum_margin: Option<f64>,
    any_stable: bool,
    fast: bool,
    seed: Option<u64>,
    length: Option<f64>,
    designs: Option<usize>,
    vary: Option<String>,
    convergence: bool,
}

impl WorkspaceOptions {
    fn job<'a>(&self, source: &'a Source, request: EngineRequest) -> WorkspaceJob<'a> {
        let spec = source.spec();
        let job = match source {
            Source::Sweep(spec) => WorkspaceJob::of_sweep(spec),
            Source::Results(results) => WorkspaceJob::of_results(results),
        };
        job.engine(request)
            .voxel(self.voxel.unwrap_or(spec.workspace.voxel))
            .minimum_margin(self.minimum_margin.unwrap_or(spec.workspace.minimum_margin))
            .seed(self.seed.unwrap_or(spec.workspace.seed))
            .length(self.length.or(spec.workspace.length))
            .any_stable(self.any_stable)
            .fast(self.fast)
    }
}

/// A measured workspace.
#[pyclass(frozen, module = "rodsweep._rodsweep")]
pub struct NativeWorkspace {
    source: Source,
    options: WorkspaceOptions,
    found: Arc<(Workspace, WorkspaceExtras, Vec<Convergence>)>,
}

fn workspace(
    py: Python<'_>,
    source: Source,
    options: WorkspaceOptions,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<NativeWorkspace> {
    let request = engine::request(&options.engine, options.precision.as_deref())?;
    let (source_there, options_there) = (source.clone(), options.clone());
    let found = run(py, options.threads, progress, move |line| {
        let (source, options) = (source_there, options_there);
        let tell = |stage: WorkspaceStage| line.tell(Told::Stage(stage.words()));
        let job = options.job(&source, request).interrupt(&line.stop).progress(Some(&tell));
        let scene = &source.spec().scene;
        let variation = options.vary.as_deref().map(|text| Variation::parse(scene, text)).transpose()?;
        let found = job.run()?;
        let mut extras = WorkspaceExtras::default();
        if let Some(designs) = options.designs {
            extras.robust = Some(job.robust(&found, designs)?);
        }
        extras.study = variation.as_ref().map(|variation| job.vary(&found, variation)).transpose()?;
        let convergence = if options.convergence && !options.fast { job.convergence(&found)? } else { Vec::new() };
        Ok((found, extras, convergence))
    })?;
    Ok(NativeWorkspace { source, options, found: Arc::new(found) })
}

#[pymethods]
impl NativeWorkspace {
    #[staticmethod]
    #[pyo3(signature = (sweep, options, progress))]
    fn of_sweep(
        py: Python<'_>,
        sweep: &NativeSweep,
        options: WorkspaceOptions,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<NativeWorkspace> {
        workspace(py, Source::Sweep(sweep.spec.clone()), options, progress.as_ref())
    }

    #[staticmethod]
    #[pyo3(signature = (results, options, progress))]
    fn of_results(
        py: Python<'_>,
        results: &NativeResults,
        options: WorkspaceOptions,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<NativeWorkspace> {
        workspace(py, Source::Results(results.results.clone()), options, progress.as_ref())
    }

    /// The account, as JSON.
    fn json(&self) -> String {
        let (found, extras, _) = &*self.found;
        found.json(&found.account(), extras)
    }

    fn text(&self) -> String {
        let (found, extras, _) = &*self.found;
        [found.account().text(), extras.text(found)].join("\n").trim_end().to_owned()
    }

    fn is_doubtful(&self) -> bool {
        self.found.0.is_doubtful()
    }

    /// One row a voxel.
    fn voxels(&self) -> PyResult<Table> {
        let (found, extras, _) = &*self.found;
        let table = extras.robust.as_ref().map_or_else(|| found.voxel_table(), |robust| robust.voxel_columns(found));
        Ok(Table::new(table)?)
    }

    /// One row a voxel of the middle of a thin workspace.
    fn surface(&self) -> PyResult<Option<Table>> {
        Ok(self.found.0.surface_table().map(Table::new).transpose()?)
    }

    /// One row a design of the uncertain rod, or of the number that was varied.
    fn designs(&self) -> PyResult<Option<Table>> {
        let extras = &self.found.1;
        let table = extras.robust.as_ref().map(|robust| robust.table());
        let table = table.or(extras.study.as_ref().map(|study| study.table()));
        Ok(table.map(Table::new).transpose()?)
    }

    /// Can the tip be there? Positions (m), and unit tangents where a direction is wanted.
    fn reach(
        &self,
        py: Python<'_>,
        positions: Vec<[f64; 3]>,
        tangents: Option<Vec<[f64; 3]>>,
        prefer: &str,
    ) -> PyResult<Table> {
        let preference = engine::word("prefer", prefer, &Preference::ALL, Preference::name)?;
        let targets = targets(&positions, tangents.as_deref())?;
        let request = engine::request(&self.options.engine, self.options.precision.as_deref())?;
        let (source, options, found) = (self.source.clone(), self.options.clone(), self.found.clone());
        let table = run(py, options.threads, None, move |_| {
            let (found, extras, _) = &*found;
            let mut map = options.job(&source, request).map(&found.inputs)?;
            let mut answers = found.reach(&mut map, &targets, preference, found.usual_tolerance())?;
            if let Some(robust) = &extras.robust {
                robust.rate(found, &mut answers);
            }
            Ok(found.reach_table(&answers))
        })?;
        Ok(Table::new(table)?)
    }

    /// Writes every file of the study; returns them.
    fn write(&self, py: Python<'_>, folder: PathBuf) -> PyResult<Vec<PathBuf>> {
        let found = self.found.clone();
        run(py, None, None, move |_| {
            let (found, extras, _) = &*found;
            Ok(found.write(&folder, &found.account(), extras, false)?)
        })
    }

    /// Draws the figures; returns the files.
    fn draw(&self, py: Python<'_>, folder: PathBuf) -> PyResult<Vec<PathBuf>> {
        let found = self.found.clone();
        run(py, None, None, move |_| {
            let (found, extras, convergence) = &*found;
            make_directory(&folder)?;
            Ok(draw_workspace(found, extras, convergence, &folder)?.files)
        })
    }
}

/// Places with unit tangents.
pub fn targets(positions: &[[f64; 3]], tangents: Option<&[[f64; 3]]>) -> Result<Vec<Target>, Failure> {
    let numbers = [("positions", Some(positions)), ("tangents", tangents)];
    for (key, vectors) in numbers.into_iter().filter_map(|(key, vectors)| Some((key, vectors?))) {
        if vectors.iter().flatten().any(|x| !x.is_finite()) {
            return Err(Failure::at(key, "hold a number that is not finite"));
        }
        if let Some(x) = vectors.iter().flatten().find(|x| x.abs() > LARGEST) {
            return Err(Failure::at(key, format!("hold {x:e}; give numbers of at most 1e60 in size")));
        }
    }
    let Some(tangents) = tangents else { return Ok(positions.iter().map(|position| Target::at(*position)).collect()) };
    let unit = |tangent: &[f64; 3]| {
        let length = tangent.iter().map(|x| x * x).sum::<f64>().sqrt();
        let is_direction = length > 0.0 && length.is_finite();
        is_direction.then(|| tangent.map(|x| x / length)).ok_or_else(|| Failure::at("tangents", "hold no direction"))
    };
    if tangents.len() != positions.len() {
        return Err(Failure::at("tangents", "are not as many as positions"));
    }
    positions.iter().zip(tangents).map(|(position, tangent)| Ok(Target::at(*position).along(unit(tangent)?))).collect()
}

/// Options of a study of sensitivity.
#[derive(Clone, FromPyObject)]
#[pyo3(from_item_all)]
struct SensitivityOptions {
    outputs: Vec<String>,
    inputs: Vec<String>,
    estimator: String,
    confidence: f64,
    degree: usize,
    with_unstable: bool,
    propagate: bool,
    choose: Option<usize>,
    noise: Option<f64>,
    tangent_noise: Option<f64>,
    minimum_margin: f64,
    limit: Option<u64>,
    /// What speaks against rows in memory.
    mark: Option<String>,
    /// How many rows in memory were checked, in a sentence.
    checked: Option<String>,
}

impl SensitivityOptions {
    fn apply(&self, job: SensitivityJob) -> Result<SensitivityJob, Failure> {
        const CHOICES: [(&str, EstimatorChoice); 7] = [
            ("auto", EstimatorChoice::Auto),
            ("azzini", EstimatorChoice::PickFreeze(Estimator::Azzini)),
            ("jansen", EstimatorChoice::PickFreeze(Estimator::Jansen)),
            ("saltelli", EstimatorChoice::PickFreeze(Estimator::Saltelli)),
            ("janon", EstimatorChoice::PickFreeze(Estimator::Janon)),
            ("chaos", EstimatorChoice::Chaos),
            ("slopes", EstimatorChoice::Slopes),
        ];
        let (_, estimator) = engine::word("estimator", &self.estimator, &CHOICES, |(name, _)| name)?;
        for (key, noise) in [("noise", self.noise), ("tangent_noise", self.tangent_noise)] {
            if noise.is_some_and(|noise| !(noise > 0.0 && noise.is_finite())) {
                return Err(Failure::at(key, "is no positive number"));
            }
        }
        Ok(job
            .outputs(&self.outputs)
            .inputs(&self.inputs)
            .estimator(estimator)
            .confidence(self.confidence)
            .degree(self.degree)
            .with_unstable(self.with_unstable)
            .propagate(self.propagate)
            .choose(self.choose)
            .noise(self.noise)
            .tangent_noise(self.tangent_noise)
            .minimum_margin(self.minimum_margin)
            .mark(self.mark.clone())
            .checked(self.checked.clone())
            .limit(self.limit))
    }
}

/// What was found of a sweep's sensitivity.
#[pyclass(frozen, module = "rodsweep._rodsweep")]
pub struct NativeSensitivity {
    found: Arc<Sensitivity>,
}

#[pymethods]
impl NativeSensitivity {
    /// Runs the sweep first, with the derivatives that are needed.
    #[staticmethod]
    fn of_sweep(
        py: Python<'_>,
        sweep: &NativeSweep,
        options: SensitivityOptions,
        run_options: RunOptions,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<NativeSensitivity> {
        let job = options.apply(SensitivityJob::of_sweep((*sweep.spec).clone()))?;
        let found = run(py, run_options.threads(), progress.as_ref(), move |line| {
            job.check()?;
            let mut memory = Memory::new();
            let account = run_options.run(&job.sweep(), line, (&mut memory, None))?;
            let [mark, checked] = ["mark", "checked"].map(|key| account[key].as_str().map(str::to_owned));
            Ok(job.with_rows(memory.into_table()).mark(mark).checked(checked).run()?)
        })?;
        Ok(NativeSensitivity { found: Arc::new(found) })
    }

    /// Of rows in memory, every column.
    #[staticmethod]
    fn of_rows(
        py: Python<'_>,
        sweep: &NativeSweep,
        rows: &Table,
        options: SensitivityOptions,
    ) -> PyResult<NativeSensitivity> {
        let job = options.apply(SensitivityJob::of_rows((*sweep.spec).clone(), rows.rows()?))?;
        let found = run(py, None, None, move |_| Ok(job.run()?))?;
        Ok(NativeSensitivity { found: Arc::new(found) })
    }

    /// Of a directory, read part by part.
    #[staticmethod]
    fn of_results(py: Python<'_>, results: &NativeResults, options: SensitivityOptions) -> PyResult<NativeSensitivity> {
        let job = options.apply(SensitivityJob::of_results((*results.results).clone()))?;
        let found = run(py, None, None, move |_| Ok(job.run()?))?;
        Ok(NativeSensitivity { found: Arc::new(found) })
    }

    /// Every table with rows, by name: `indices`, `moments`, `local` and others.
    fn tables(&self) -> PyResult<Vec<(String, Table)>> {
        let named = |(file, table): (&'static str, rodsweep::table::Table)| {
            Ok((file.trim_end_matches(".csv").to_owned(), Table::new(table)?))
        };
        Ok(self.found.tables().into_iter().map(named).collect::<Result<_, Failure>>()?)
    }

    fn json(&self) -> String {
        self.found.to_json().to_string()
    }

    fn text(&self) -> String {
        self.found.text()
    }

    fn write(&self, py: Python<'_>, folder: PathBuf) -> PyResult<Vec<PathBuf>> {
        let found = self.found.clone();
        run(py, None, None, move |_| {
            make_directory(&folder)?;
            Ok(found.write(&folder)?)
        })
    }

    fn draw(&self, py: Python<'_>, folder: PathBuf) -> PyResult<Vec<PathBuf>> {
        let found = self.found.clone();
        run(py, None, None, move |_| {
            make_directory(&folder)?;
            Ok(draw_sensitivity(&found, &folder)?.files)
        })
    }
}
