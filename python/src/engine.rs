//! Words of Python arguments as the library's choices.

use super::failure::Failure;
use pyo3::exceptions::PyDeprecationWarning;
use pyo3::prelude::*;
use rodsweep::backend::{BackendKind, Precision};
use rodsweep::engines::EngineRequest;
use rodsweep::input::one_of;
use rodsweep::spec::{BranchChoice, MIXED, MIXED_NOTE, PrecisionChoice, SolutionMethod};
use rodsweep::study::check_tolerance;
use std::ffi::CString;
#[cfg(feature = "gpu")]
use std::sync::OnceLock;

/// Of a fixed list of words.
pub fn word<T: Copy>(key: &str, text: &str, all: &[T], name: fn(T) -> &'static str) -> Result<T, Failure> {
    one_of(text, all, name).map_err(|problem| Failure::at(key, problem))
}

/// What must stand before the GPU is looked for: Mesa writes on the standard error where it is missing.
pub fn prepare(py: Python<'_>) -> PyResult<()> {
    py.import("rodsweep._runtime")?.call_method0("prepare")?;
    Ok(())
}

/// What is asked of the engine.
pub fn request(engine: &str, precision: Option<&str>) -> Result<EngineRequest, Failure> {
    if matches!(engine, "auto" | "gpu") {
        // Without it everything goes on, with lines of Mesa.
        let _ = Python::attach(prepare);
    }
    const ENGINES: [(&str, Option<BackendKind>); 4] = [
        ("auto", None),
        ("gpu", Some(BackendKind::Gpu)),
        ("cpu", Some(BackendKind::Cpu)),
        ("reference", Some(BackendKind::Reference)),
    ];
    let (_, mut backend) = word("engine", engine, &ENGINES, |(name, _)| name)?;
    if engine == "auto" && !has_gpu() {
        backend = Some(BackendKind::Cpu);
    }
    let request = EngineRequest::any().backend(backend);
    let Some(text) = precision else { return Ok(request) };
    if text == MIXED {
        let warn = |py: Python<'_>| -> PyResult<()> {
            let text = CString::new(format!("precision=\"mixed\": {MIXED_NOTE}"))?;
            PyErr::warn(py, &py.get_type::<PyDeprecationWarning>(), &text, 2)
        };
        Python::attach(warn).map_err(|error| Failure::input(error.to_string()))?;
        return Ok(request.precision(Some(Precision::F64)));
    }
    Ok(match word("precision", text, &PrecisionChoice::WORDS, PrecisionChoice::name)? {
        PrecisionChoice::Given(precision) => request.precision(Some(precision)),
        _ => request,
    })
}

/// Whether there is a GPU that is no software: looked for once, since that takes longer than a small batch.
#[cfg(feature = "gpu")]
fn has_gpu() -> bool {
    static ONLY_SOFTWARE: OnceLock<bool> = OnceLock::new();
    // An error is told by the choice of the engine.
    let look = || rodsweep::gpu::chosen_adapters().is_ok_and(|all| all.iter().all(|adapter| adapter.is_software()));
    !*ONLY_SOFTWARE.get_or_init(look)
}

#[cfg(not(feature = "gpu"))]
fn has_gpu() -> bool {
    false
}

/// A target error between 0 and 1.
pub fn tolerance(tolerance: f64) -> Result<f64, Failure> {
    check_tolerance(tolerance).map_err(|_| {
        Failure::at("tolerance", format!("is {tolerance}; give a number between 0 and 1, such as 1e-6"))
    })?;
    Ok(tolerance)
}

/// Which equilibria.
pub fn branch(text: &str) -> Result<BranchChoice, Failure> {
    word("branch", text, &BranchChoice::ALL, BranchChoice::name)
}

/// A method of solution as it was told.
pub fn method(text: Option<&str>) -> Result<Option<SolutionMethod>, Failure> {
    let read = |text: &str| {
        serde_json::from_str(text)
            .map_err(|error| Failure::at("method", format!("{error}; give the `method` of a solution")))
    };
    text.map(read).transpose()
}
