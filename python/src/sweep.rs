//! Sweeps for Python: from files, from text, from arrays; run to memory or to a directory.

use super::engine;
use super::failure::Failure;
use super::job::{Line, Told, run, timed};
use super::scene::NativeScene;
use super::table::Table;
use numpy::{IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use rodsweep::input::sweep_of_table;
use rodsweep::model::{PlanOptions, Status};
use rodsweep::results::Solved;
use rodsweep::spec::{AxisSpec, BranchChoice, Distribution, InputTable, OutputQuantity, Shard, SweepSpec};
use rodsweep::sweep::{
    Memory, PathCheckOptions, PreparedSweep, Progress, ResultDirectory, RowSink, SpotCheckOptions, Summary, SweepJob,
};
use rodsweep::text::terminal;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A sweep, as the library has it.
#[pyclass(frozen, module = "rodsweep._rodsweep")]
pub struct NativeSweep {
    /// What it says.
    pub spec: Arc<SweepSpec>,
}

impl NativeSweep {
    /// Of a specification.
    pub fn new(spec: SweepSpec) -> NativeSweep {
        NativeSweep { spec: Arc::new(spec) }
    }
}

/// How a sweep is to be run.
#[derive(Clone, FromPyObject)]
#[pyo3(from_item_all)]
pub struct RunOptions {
    engine: String,
    precision: Option<String>,
    threads: Option<usize>,
    limit: Option<u64>,
    shard: Option<String>,
    part_size: Option<u64>,
    spot_check: bool,
    certain: bool,
    method: Option<String>,
}

impl RunOptions {
    /// For a study of a sweep: so many threads.
    pub fn threads(&self) -> Option<usize> {
        self.threads
    }

    /// Runs a sweep; rows go to the sink, which lies at a place, if anywhere. Answers with an account.
    pub fn run(
        &self,
        spec: &SweepSpec,
        line: &Line,
        (sink, place): (&mut dyn RowSink, Option<&Path>),
    ) -> Result<Value, Failure> {
        let progress = |progress: &Progress| line.tell(Told::Progress(*progress));
        let warn = |text: &str| line.tell(Told::Warning(text.into()));
        let shard = match &self.shard {
            Some(text) => Shard::parse(text).map_err(|error| Failure::at("shard", error))?,
            None => Shard::WHOLE,
        };
        for (key, number) in [("limit", self.limit), ("part_size", self.part_size)] {
            if number == Some(0) {
                return Err(Failure::at(key, "is 0; give a whole number from 1, or None"));
            }
        }
        let job = SweepJob::new(spec.clone())
            .engine(engine::request(&self.engine, self.precision.as_deref())?)
            .method(engine::method(self.method.as_deref())?)
            .shard(shard)
            .limit(self.limit)
            .part_size(self.part_size)
            .interrupt(&line.stop)
            .progress(Some(&progress))
            .warn(&warn)
            .spot_check(self.spot_check.then(|| SpotCheckOptions::of(&spec.scene)));
        let job = if self.certain { job.path_check(Some(PathCheckOptions::All)) } else { job };
        let mut sweep = job.prepare(sink)?;
        let mut backend = sweep.open()?;
        let (summary, seconds) = timed(|| sweep.run_on(backend.as_mut(), sink));
        Ok(account(&sweep, &summary?, seconds, place))
    }
}

/// The run in numbers.
fn account(sweep: &PreparedSweep<'_>, summary: &Summary, seconds: f64, place: Option<&Path>) -> Value {
    let solved = Solved { method: Some(sweep.method()), certain: summary.is_certain(), place };
    let distrust = (!summary.verdict.sound).then(|| terminal(&summary.verdict.explain(&solved)).into_owned());
    let counts = Status::ALL.into_iter().map(|status| (status.name().to_owned(), json!(summary.count(status))));
    let counts = counts.filter(|(_, count)| *count != json!(0)).collect::<serde_json::Map<_, _>>();
    json!({
        "total": summary.total, "solved": summary.solved, "resumed": summary.resumed, "failed": summary.failed(),
        "counts": counts, "rate": summary.rate, "seconds": seconds, "interrupted": summary.interrupted,
        "refined": summary.refined, "worst_error_estimate": summary.worst_error_estimate,
        "engine": summary.backend.to_string(), "reason": sweep.engine().reason(), "method": sweep.method(),
        "spot_check": summary.spot_check, "notes": summary.notes,
        "verdict": summary.verdict, "mark": summary.verdict.headline(), "distrust": distrust,
        "checked": summary.verdict.checked_sentence(), "path_check": summary.path_check,
    })
}

#[pymethods]
impl NativeSweep {
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<NativeSweep> {
        Ok(NativeSweep::new(SweepSpec::read(&path).map_err(Failure::from)?))
    }

    /// Of the text of a sweep file whose `scene` is "<scene>".
    #[staticmethod]
    fn parse(text: &str, scene: &NativeScene) -> PyResult<NativeSweep> {
        let scene = rodsweep::input::write_scene(&scene.scene);
        let spec = SweepSpec::parse_with("<sweep>".as_ref(), text, &[("<scene>", &scene)]);
        Ok(NativeSweep::new(spec.map_err(Failure::from)?))
    }

    /// Of columns of values, one a parameter.
    #[staticmethod]
    fn of_columns(
        scene: &NativeScene,
        names: Vec<String>,
        columns: Vec<PyReadonlyArray1<'_, f64>>,
        count: usize,
    ) -> PyResult<NativeSweep> {
        let mut parameters = Vec::new();
        for name in &names {
            parameters.extend(scene.parse(name)?);
        }
        let columns: Vec<Vec<f64>> = columns.iter().map(|column| column.as_array().to_vec()).collect();
        if parameters.len() != columns.len() || columns.iter().any(|column| column.len() != count) {
            return Err(Failure::input("the columns differ in length, or a name is a group").into());
        }
        if count == 0 {
            return Err(Failure::input("the table has no rows; give at least one").into());
        }
        let values = (0..count).flat_map(|row| columns.iter().map(move |column| column[row])).collect();
        let table = InputTable::new(parameters, values);
        Ok(NativeSweep::new(sweep_of_table(scene.scene.clone(), table).map_err(Failure::from)?))
    }

    /// With some things replaced.
    #[pyo3(signature = (*, scene, tolerance, steps, branch, derivatives, quantities, seed))]
    #[allow(clippy::too_many_arguments)]
    fn replaced(
        &self,
        scene: Option<PyRef<'_, NativeScene>>,
        tolerance: Option<f64>,
        steps: Option<usize>,
        branch: Option<&str>,
        derivatives: Option<Vec<String>>,
        quantities: Option<Vec<String>>,
        seed: Option<u64>,
    ) -> PyResult<NativeSweep> {
        let mut spec = (*self.spec).clone();
        if let Some(scene) = scene {
            let of = |scene: &rodsweep::model::Scene| {
                rodsweep::model::Parameter::all(scene).iter().map(|p| p.name(scene)).collect::<Vec<_>>()
            };
            if of(&scene.scene) != of(&spec.scene) {
                let text = "has other parameters than the sweep's scene; build the sweep anew for it";
                return Err(Failure::at("scene", text).into());
            }
            spec.scene = scene.scene.clone();
        }
        if let Some(tolerance) = tolerance {
            spec.tolerance = engine::tolerance(tolerance)?;
        }
        if let Some(steps) = steps {
            if !(1..=4096).contains(&steps) {
                return Err(Failure::at("steps", format!("is {steps}; give a number from 1 to 4096")).into());
            }
            spec.steps = Some(steps);
        }
        if let Some(branch) = branch {
            spec.branch = engine::branch(branch)?;
        }
        if let Some(names) = derivatives {
            let is_usual = spec.quantities == OutputQuantity::usual(&spec.scene, &spec.wrt);
            spec.wrt = NativeScene::new(spec.scene.clone()).parse_all(&names)?;
            if is_usual {
                spec.quantities = OutputQuantity::usual(&spec.scene, &spec.wrt);
            }
        }
        if let Some(names) = quantities {
            let quantity = |name: &String| engine::word("quantities", name, &OutputQuantity::ALL, OutputQuantity::name);
            spec.quantities = names.iter().map(quantity).collect::<Result<_, _>>()?;
            if let Some(quantity) = spec.quantities.iter().find(|quantity| !quantity.is_told_by(&spec.scene)) {
                let text = format!("`{}` needs a wall: add `[wall]` to the scene, or leave it out", quantity.name());
                return Err(Failure::at("quantities", text).into());
            }
        }
        spec.seed = seed.unwrap_or(spec.seed);
        spec.plan(PlanOptions::default()).map_err(Failure::from)?;
        Ok(NativeSweep::new(spec))
    }

    fn to_toml(&self) -> String {
        self.spec.to_toml()
    }

    /// The values of `method = "table"` as CSV that reads back identically.
    fn table_csv(&self) -> Option<String> {
        self.spec.table.as_ref().map(|table| table.to_csv(&self.spec.scene))
    }

    fn scene(&self) -> NativeScene {
        NativeScene::new(self.spec.scene.clone())
    }

    /// What it says, in short.
    fn info(&self) -> String {
        let SweepSpec { scene, axes, .. } = &*self.spec;
        let axis = |axis: &AxisSpec| {
            let mut value = json!({
                "parameters": axis.parameters.iter().map(|p| p.name(scene)).collect::<Vec<_>>(),
                "unit": axis.unit(), "scales": axis.scales, "points": axis.points,
            });
            let law = &axis.distribution;
            value["distribution"] = json!(law.name());
            law.numbers().into_iter().for_each(|(key, number)| value[key] = json!(number));
            if let Distribution::Values(values) = law {
                value["values"] = json!(values[..]);
            }
            value
        };
        let spec = &self.spec;
        let info = json!({
            "method": spec.method.name(), "sample_count": spec.sample_count, "seed": spec.seed,
            "axes": axes.iter().map(axis).collect::<Vec<_>>(),
            "uncertain": spec.uncertain.iter().map(axis).collect::<Vec<_>>(),
            "tolerance": spec.tolerance, "branch": spec.branch.name(), "format": spec.format.name(),
            "derivatives": spec.wrt.iter().map(|p| p.name(scene)).collect::<Vec<_>>(),
            "quantities": spec.quantities.iter().map(|q| q.name()).collect::<Vec<_>>(),
            "notes": spec.notes, "part_size": spec.chunk(),
            "names": spec.axis_parameters().iter().flatten().map(|p| p.name(scene)).collect::<Vec<_>>(),
        });
        info.to_string()
    }

    /// The values of some samples, SI: one row a sample, one column for each of `names`.
    fn values<'py>(&self, py: Python<'py>, start: u64, stop: u64) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (sampler, driven) = (self.spec.sampler(), self.spec.axis_parameters());
        let stop = stop.min(self.spec.sample_count);
        let mut row = vec![0.0; sampler.value_count()];
        let mut values = Vec::new();
        for index in start.min(stop)..stop {
            sampler.values(index, &mut row);
            values.extend(driven.iter().zip(&row).flat_map(|(driven, value)| driven.iter().map(move |_| *value)));
        }
        values.into_pyarray(py).reshape([values_len(start, stop) * driven.iter().flatten().count()])
    }

    /// Runs it; rows come back as a table, beside an account in JSON.
    fn run_to_memory(
        &self,
        py: Python<'_>,
        options: RunOptions,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<(Table, String)> {
        let spec = self.spec.clone();
        let threads = options.threads;
        let (rows, account) = run(py, threads, progress.as_ref(), move |line| {
            let mut memory = Memory::new();
            let account = options.run(&spec, line, (&mut memory, None))?;
            Ok((memory.into_table(), account))
        })?;
        Ok((Table::new(rows)?, account.to_string()))
    }

    /// Runs it; rows go to a directory.
    fn run_to_directory(
        &self,
        py: Python<'_>,
        directory: PathBuf,
        resume: bool,
        options: RunOptions,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<String> {
        let spec = self.spec.clone();
        let threads = options.threads;
        let account = run(py, threads, progress.as_ref(), move |line| {
            let mut sink = ResultDirectory::new(&directory).resume(resume);
            options.run(&spec, line, (&mut sink, Some(&directory)))
        })?;
        Ok(account.to_string())
    }

    /// Whether samples have a row for each equilibrium.
    fn lists_branches(&self) -> bool {
        self.spec.branch == BranchChoice::All
    }
}

fn values_len(start: u64, stop: u64) -> usize {
    stop.saturating_sub(start) as usize
}
