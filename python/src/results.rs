//! Result directories for Python.

use super::failure::Failure;
use super::job::run;
use super::sweep::NativeSweep;
use super::table::{Parts, Table};
use pyo3::prelude::*;
use rodsweep::figures::RunFigures;
use rodsweep::model::Status;
use rodsweep::results::Results;
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;

/// A directory that a run has written to.
#[pyclass(frozen, module = "rodsweep._rodsweep")]
pub struct NativeResults {
    /// It.
    pub results: Arc<Results>,
}

#[pymethods]
impl NativeResults {
    #[staticmethod]
    fn open(directory: PathBuf) -> PyResult<NativeResults> {
        Ok(NativeResults {
            results: Arc::new(Results::open(&directory).map_err(|error| Failure::from(error).reading(&directory))?),
        })
    }

    fn directory(&self) -> PathBuf {
        self.results.directory().into()
    }

    fn sweep(&self) -> NativeSweep {
        NativeSweep::new(self.results.spec().clone())
    }

    /// The named columns of all rows, or all.
    fn table(&self, py: Python<'_>, names: Vec<String>) -> PyResult<Table> {
        let results = self.results.clone();
        let rows = run(py, None, None, move |_| {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let rows = results.read(&names)?;
            let columns = results.columns().iter().filter(|c| names.is_empty() || names.contains(&c.name.as_str()));
            let empty = rodsweep::table::Table { columns: columns.cloned().collect() };
            Ok(if rows.columns.is_empty() { empty } else { rows })
        })?;
        Ok(Table::new(rows)?)
    }

    fn parts(&self, names: Vec<String>) -> PyResult<Parts> {
        Ok(Parts::new(self.results.clone(), names)?)
    }

    /// What is there, as JSON.
    fn status(&self) -> PyResult<String> {
        let status = self.results.status().map_err(Failure::from)?;
        let counts = Status::ALL.into_iter().map(|of| (of.name().to_owned(), status.counts[of.code() as usize]));
        let counts = counts.filter(|(_, count)| *count > 0);
        let counts: serde_json::Map<_, _> = counts.map(|(name, count)| (name, json!(count))).collect();
        let damaged = status.damaged.iter().map(|(path, why)| json!({ "path": path, "reason": why }));
        let value = json!({
            "complete": status.is_complete(), "parts_total": status.parts_total, "parts_done": status.parts_done,
            "missing": status.missing, "missing_count": status.missing_count, "damaged": damaged.collect::<Vec<_>>(), "samples_done": status.samples_done,
            "counts": counts, "failed": status.failed(), "method": self.results.method(),
        });
        Ok(value.to_string())
    }

    /// The run's account of itself, as JSON.
    fn manifest(&self) -> PyResult<String> {
        let manifest = self.results.manifest().map_err(Failure::from)?;
        Ok(serde_json::to_string(&manifest).unwrap_or_default())
    }

    /// Whether the rows can be trusted, as JSON.
    fn verdict(&self) -> PyResult<Option<String>> {
        let verdict = self.results.verdict().map_err(Failure::from)?;
        Ok(verdict.and_then(|verdict| serde_json::to_string(&verdict).ok()))
    }

    /// What speaks against the rows, where and what helps.
    fn distrust(&self) -> PyResult<Option<String>> {
        let text = self.results.distrust().map_err(Failure::from)?;
        Ok(text.map(|text| rodsweep::text::terminal(&text).into_owned()))
    }

    /// Draws the figures of the run; returns the files.
    fn draw(&self, py: Python<'_>, folder: PathBuf, colour: Option<String>) -> PyResult<Vec<PathBuf>> {
        let results = self.results.clone();
        run(py, None, None, move |_| {
            rodsweep::results::make_directory(&folder)?;
            Ok(RunFigures::new().colour(colour.as_deref()).draw(&results, &folder)?)
        })
    }
}
