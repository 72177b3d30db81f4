//! The native part of the Python package `rodsweep`: plain functions over arrays, tables and text.
//!
//! What users see is written in Python, in `python/rodsweep`. Here everything runs without the GIL, on a thread of its
//! own while Python listens for Ctrl-C.

mod block;
mod contact;
mod control;
mod engine;
mod failure;
mod fit;
mod job;
mod program;
mod results;
mod scene;
mod shape;
mod solve;
mod studies;
mod sweep;
mod table;

use pyo3::prelude::*;

/// The module `rodsweep._rodsweep`.
#[pymodule]
fn _rodsweep(module: &Bound<'_, PyModule>) -> PyResult<()> {
    rodsweep_stores::install();
    module.add("__version__", rodsweep::VERSION)?;
    module.add("STATUSES", rodsweep::model::Status::ALL.map(|status| status.name()).to_vec())?;
    module.add_class::<scene::NativeScene>()?;
    module.add_class::<sweep::NativeSweep>()?;
    module.add_class::<table::Table>()?;
    module.add_class::<table::Parts>()?;
    module.add_class::<results::NativeResults>()?;
    module.add_class::<studies::NativeWorkspace>()?;
    module.add_class::<studies::NativeSensitivity>()?;
    module.add_class::<contact::NativeContactMap>()?;
    module.add_class::<control::NativeControl>()?;
    module.add_class::<fit::NativeFit>()?;
    module.add_function(wrap_pyfunction!(solve::solve, module)?)?;
    module.add_function(wrap_pyfunction!(shape::shape, module)?)?;
    module.add_function(wrap_pyfunction!(control::control, module)?)?;
    module.add_function(wrap_pyfunction!(fit::fit, module)?)?;
    module.add_function(wrap_pyfunction!(program::program, module)?)?;
    module.add_function(wrap_pyfunction!(program::write_page, module)?)?;
    module.add_function(wrap_pyfunction!(program::quantity, module)?)?;
    module.add_function(wrap_pyfunction!(plain, module)?)?;
    module.add_function(wrap_pyfunction!(licenses, module)?)?;
    Ok(())
}

/// Text without characters that a terminal obeys.
#[pyfunction]
fn plain(text: &str) -> String {
    rodsweep::text::terminal(text).into_owned()
}

/// Licences and notices of this package and of everything that is built into it.
#[pyfunction]
fn licenses() -> &'static str {
    rodsweep::NOTICES
}
