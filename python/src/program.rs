//! The program inside the package, and the page that it exports.

use super::engine;
use super::failure::Failure;
use super::job::run;
use pyo3::prelude::*;
use rodsweep::input::{Dimension, parse_quantity};
use rodsweep_view::View;
use std::ffi::OsString;
use std::path::PathBuf;

/// Runs the program; the first argument is its name. The answer is the exit code.
#[pyfunction]
pub fn program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| rodsweep_cli::main_with(arguments))
}

/// Writes the page of a scene file, a sweep file or a result directory, as `rodsweep view --export` does.
#[pyfunction]
pub fn write_page(py: Python<'_>, source: PathBuf, to: PathBuf) -> PyResult<()> {
    engine::prepare(py)?;
    run(py, None, None, move |_| {
        View::open(&source)?.export(&to)?;
        Ok(())
    })
}

/// A text with a unit as a number in an SI unit, such as `1/m`.
#[pyfunction]
pub fn quantity(key: &str, text: &str, unit: &str) -> PyResult<f64> {
    Ok(parse_quantity(text, Dimension::of(unit)).map_err(|error| Failure::at(key, error))?)
}
