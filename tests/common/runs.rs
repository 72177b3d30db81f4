//! Runs into result directories, and what they leave there.

use rodsweep::backend::Backend;
use rodsweep::results::{DirectoryStatus, Reduction, Results, ResultsError};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::{ResultDirectory, RunOptions, Summary, SweepError, run};
use rodsweep::table::Table;
use serde_json::Value;
use std::path::Path;

/// Runs into a new directory.
pub fn run_into(
    dir: &Path,
    spec: &SweepSpec,
    backend: &mut dyn Backend,
    options: &RunOptions,
) -> Result<Summary, SweepError> {
    run(spec, backend, options, &mut ResultDirectory::new(dir))
}

/// Goes on with what a directory holds.
pub fn resume_in(
    dir: &Path,
    spec: &SweepSpec,
    backend: &mut dyn Backend,
    options: &RunOptions,
) -> Result<Summary, SweepError> {
    run(spec, backend, options, &mut ResultDirectory::new(dir).resume(true))
}

/// The named columns, or all.
pub fn read_columns(dir: &Path, names: &[&str]) -> Result<Table, ResultsError> {
    Results::open(dir)?.read(names)
}

pub fn status_of(dir: &Path) -> Result<DirectoryStatus, ResultsError> {
    Results::open(dir)?.status()
}

pub fn reduced(dir: &Path, voxel: f64) -> Result<Reduction, ResultsError> {
    Results::open(dir)?.reduce(voxel)
}

pub fn spec_of(dir: &Path) -> Result<SweepSpec, ResultsError> {
    Ok(Results::open(dir)?.spec().clone())
}

/// The manifest as it is written.
pub fn manifest_of(dir: &Path) -> Value {
    let text = std::fs::read_to_string(dir.join("manifest.json")).expect("a manifest");
    serde_json::from_str(&text).expect("JSON")
}
