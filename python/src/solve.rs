//! Many samples of one scene, from arrays to arrays.

use super::block::{Block, BlockSink};
use super::engine;
use super::failure::Failure;
use super::job::{Line, Told, run, timed};
use super::scene::NativeScene;
use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rodsweep::engines::EngineRequest;
use rodsweep::input::sweep_of_rows;
use rodsweep::model::{Parameter, Scene};
use rodsweep::results::Solved;
use rodsweep::spec::{BranchChoice, InputTable, OutputQuantity, SolutionMethod, SweepSpec};
use rodsweep::sweep::{Memory, PathCheckOptions, Progress, SpotCheckOptions, Summary, SweepJob};
use rodsweep::table::{Table, Values};
use rodsweep::text::terminal;

/// Samples from which on a share is checked without being asked for.
const MANY: usize = 1000;

/// One call.
struct Request {
    scene: Scene,
    parameters: Vec<Parameter>,
    /// Of each parameter: one value for all samples, or one each.
    columns: Vec<Vec<f64>>,
    count: usize,
    wrt: Vec<Parameter>,
    engine: EngineRequest,
    tolerance: f64,
    branch: BranchChoice,
    method: Option<SolutionMethod>,
    /// `None`: one of a thousand, from a thousand samples on.
    spot_check: Option<bool>,
    /// Whether every path is followed twice.
    certain: bool,
    /// Whether values may be no numbers.
    lenient: bool,
}

/// What came of it.
struct Answer {
    block: Block,
    /// Of every equilibrium: what else is known.
    branches: Option<Table>,
    method: Option<SolutionMethod>,
    engine: String,
    notes: Vec<String>,
    spot_check: Option<String>,
    /// What the check has against the rows.
    distrust: Option<String>,
    checked: String,
    /// Of the library's call.
    seconds: f64,
}

impl Request {
    fn spec(self) -> Result<SweepSpec, Failure> {
        let Request { scene, parameters, columns, count, wrt, tolerance, branch, lenient, .. } = self;
        let too_many = || Failure::input(format!("{count} samples do not fit into memory: solve fewer at once"));
        let mut values = Vec::new();
        let size = count.checked_mul(columns.len()).ok_or_else(too_many)?;
        values.try_reserve_exact(size).map_err(|_| too_many())?;
        for row in 0..count {
            values.extend(columns.iter().map(|column| if column.len() == 1 { column[0] } else { column[row] }));
        }
        if let Some(at) = values.iter().position(|value| !value.is_finite()).filter(|_| !lenient) {
            let (name, row, value) = (parameters[at % columns.len()].name(&scene), at / columns.len(), values[at]);
            return Err(Failure::at(&name, format!("is {value} in sample {row}; give a finite number")));
        }
        let is_told = |quantity: &OutputQuantity| *quantity != OutputQuantity::FoldLoad && quantity.is_told_by(&scene);
        let quantities = OutputQuantity::ALL.into_iter().filter(is_told).collect();
        let spec = sweep_of_rows(scene, InputTable::new(parameters, values))?;
        // A table without columns has no rows, but the scene is a sample.
        let sample_count = count as u64;
        Ok(SweepSpec { sample_count, wrt, tolerance, branch, quantities, ..spec })
    }

    fn solve(self, line: &Line) -> Result<Answer, Failure> {
        let (count, engine, method, branch, checks, certain) =
            (self.count, self.engine, self.method, self.branch, self.spot_check, self.certain);
        let spec = self.spec()?;
        let few = SpotCheckOptions { least: 0, ..SpotCheckOptions::default() };
        let checks = match checks {
            Some(checks) => checks.then(|| SpotCheckOptions::of(&spec.scene)),
            None => (count >= MANY).then_some(few),
        };
        let progress = |progress: &Progress| line.tell(Told::Progress(*progress));
        let warn = |text: &str| line.tell(Told::Warning(text.into()));
        let job = SweepJob::new(spec)
            .engine(engine)
            .method(method)
            .interrupt(&line.stop)
            .progress(Some(&progress))
            .warn(&warn)
            .spot_check(checks);
        let job = if certain { job.path_check(Some(PathCheckOptions::All)) } else { job };
        let mut answer = Answer {
            block: Block::default(),
            branches: None,
            method: None,
            engine: String::new(),
            notes: Vec::new(),
            spot_check: None,
            distrust: None,
            checked: String::new(),
            seconds: 0.0,
        };
        let (result, seconds) = timed(|| -> Result<Summary, Failure> {
            if branch == BranchChoice::All {
                let mut memory = Memory::new();
                let mut sweep = job.prepare(&memory)?;
                let mut backend = sweep.open()?;
                answer.method = (count > 0).then(|| sweep.method());
                let summary = sweep.run_on(backend.as_mut(), &mut memory)?;
                let table = memory.into_table();
                answer.block = Block::new(&table.empty(), table.row_count())?;
                answer.block.push(&table);
                answer.branches = Some(table);
                return Ok(summary);
            }
            let mut sink = BlockSink { block: Block::default(), rows: count };
            let mut sweep = job.prepare(&sink)?;
            let mut backend = sweep.open()?;
            answer.method = (count > 0).then(|| sweep.method());
            let summary = sweep.run_on(backend.as_mut(), &mut sink)?;
            answer.block = sink.block;
            Ok(summary)
        });
        let summary = result?;
        answer.seconds = seconds;
        let certain = summary.is_certain();
        answer.engine = summary.backend.to_string();
        answer.notes = summary.notes;
        // What rows say of themselves, such as a failure, is no news to whoever gets them.
        let mut verdict = summary.verdict;
        verdict.doubts.retain(|doubt| !doubt.seen.is_empty());
        let solved = Solved { method: answer.method, certain, place: None };
        answer.distrust = Some(terminal(&verdict.explain(&solved)).into_owned()).filter(|text| !text.is_empty());
        answer.checked = verdict.checked_sentence();
        answer.spot_check = summary.spot_check.and_then(|check| serde_json::to_string(&check).ok());
        Ok(answer)
    }
}

/// Solves samples. `columns[k]` holds the values of parameter `names[k]`: one for all samples, or one each.
#[pyfunction]
#[pyo3(signature = (scene, names, columns, count, wrt, *, engine, precision, tolerance, branch, threads, method, spot_check, certain, lenient, progress))]
#[allow(clippy::too_many_arguments)]
pub fn solve<'py>(
    py: Python<'py>,
    scene: &Bound<'py, NativeScene>,
    names: Vec<String>,
    columns: Vec<PyReadonlyArray1<'py, f64>>,
    count: usize,
    wrt: Vec<String>,
    engine: &str,
    precision: Option<&str>,
    tolerance: f64,
    branch: &str,
    threads: Option<usize>,
    method: Option<&str>,
    spot_check: Option<bool>,
    certain: bool,
    lenient: bool,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let scene = scene.get();
    let mut parameters = Vec::with_capacity(names.len());
    for name in &names {
        match scene.parse(name)?[..] {
            [parameter] => parameters.push(parameter),
            _ => return Err(Failure::at(name, "is a group; give its components").into()),
        }
    }
    let values = values_of(&names, &columns, count)?;
    if parameters.len() != values.len() {
        return Err(Failure::input("there are not as many columns as names").into());
    }
    let request = Request {
        scene: scene.scene.clone(),
        parameters,
        columns: values,
        count,
        wrt: scene.parse_all(&wrt)?,
        engine: engine::request(engine, precision)?,
        tolerance: engine::tolerance(tolerance)?,
        branch: engine::branch(branch)?,
        method: engine::method(method)?,
        spot_check,
        certain,
        lenient,
    };
    let answer = run(py, threads, progress.as_ref(), move |line| request.solve(line))?;
    answer.into_dict(py)
}

/// The values of each column: one for all samples, or one each.
pub(super) fn values_of(
    names: &[String],
    columns: &[PyReadonlyArray1<'_, f64>],
    count: usize,
) -> Result<Vec<Vec<f64>>, Failure> {
    let values = |(name, column): (&String, &PyReadonlyArray1<'_, f64>)| {
        let column = column.as_slice().map_err(|_| Failure::at(name, "is not contiguous"))?;
        match column.len() {
            length if length == 1 || length == count => Ok(column.to_vec()),
            length => Err(Failure::at(name, format!("has {length} values for {count} samples"))),
        }
    };
    names.iter().zip(columns).map(values).collect()
}

impl Answer {
    fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let Answer { block, branches, method, engine, notes, spot_check, distrust, checked, seconds } = self;
        let dict = PyDict::new(py);
        dict.set_item("rows", block.rows)?;
        dict.set_item("names", block.names)?;
        dict.set_item("numbers", block.numbers.into_pyarray(py))?;
        dict.set_item("status", block.statuses.into_pyarray(py))?;
        for (name, flags) in block.flags {
            dict.set_item(name, flags.into_pyarray(py))?;
        }
        dict.set_item("method", method.and_then(|method| serde_json::to_string(&method).ok()))?;
        dict.set_item("engine", engine)?;
        dict.set_item("notes", notes)?;
        dict.set_item("spot_check", spot_check)?;
        dict.set_item("distrust", distrust)?;
        dict.set_item("checked", checked)?;
        dict.set_item("seconds", seconds)?;
        if let Some(table) = branches {
            for column in table.columns {
                match (column.name.as_str(), column.values) {
                    ("sample" | "branch", Values::Index(values)) => {
                        dict.set_item(column.name, values.into_pyarray(py))?;
                    }
                    ("energy", Values::Double(values)) => dict.set_item("energy", values.into_pyarray(py))?,
                    ("from_rest" | "balanced", Values::Flag(flags)) => {
                        let flags: Vec<bool> = flags.into_iter().map(|flag| flag.unwrap_or(false)).collect();
                        dict.set_item(column.name, flags.into_pyarray(py))?;
                    }
                    _ => {}
                }
            }
        }
        Ok(dict)
    }
}
