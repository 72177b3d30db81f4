//! What can stop a benchmark or a check.

use crate::baseline::BaselineError;
use crate::record::RecordError;
use rodsweep::backend::BackendError;
use rodsweep::draw::ReportError;
use rodsweep::input::InputError;
use rodsweep::model::{ParameterError, PlanError};
use rodsweep::sweep::SweepError;
use std::io;
use std::path::PathBuf;

/// Why something could not be measured, compared, checked or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// A scene or a bench file.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A parameter that a scene does not have.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A plan that cannot be made.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// An engine or a device.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// A run with its files.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// A figure that could not be drawn or written.
    #[error(transparent)]
    Figure(#[from] ReportError),
    /// A name that is neither a part of a measurement nor a scene.
    #[error("nothing to measure is called `{name}`; known: {}", known.join(", "))]
    UnknownPart {
        /// The name.
        name: String,
        /// Every name that is known.
        known: Vec<String>,
    },
    /// GPUs alone are to be measured, and there is none.
    #[error("this machine has no GPU to measure")]
    NoGpu,
    /// No threads to measure on.
    #[error("no thread to time on: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// No sample of a bench file has an answer.
    #[error("{}: no sample has an answer; give smaller ranges in [[axis]]", file.display())]
    NoAnswers {
        /// The bench file.
        file: PathBuf,
    },
    /// A directory of bench files that cannot be listed.
    #[error("{}: {source}; name a directory", directory.display())]
    Directory {
        /// The directory.
        directory: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A directory without bench files.
    #[error("{}: it holds no bench file (.toml); see sweeps/bench for examples", directory.display())]
    NoBenchFiles {
        /// The directory.
        directory: PathBuf,
    },
    /// A file of a report that cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file of a report that cannot be understood.
    #[error("{}: {source}", directory.display())]
    ReportFile {
        /// Where it lies.
        directory: PathBuf,
        /// Which one, and what is wrong with it.
        source: ReportFileError,
    },
    /// A file or directory that cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or directory.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A scene that the literature's methods do not model.
    #[error("{scene}: {source}")]
    Baseline {
        /// What the scene is called.
        scene: String,
        /// What they do not model.
        source: BaselineError,
    },
    /// A scene without coils cannot be controlled.
    #[error("{scene}: no segment has a `coil`, so there is nothing to control; give one `coil`")]
    NothingToControl {
        /// What the scene is called.
        scene: String,
    },
    /// No random configuration of a scene has an answer.
    #[error("{scene}: no configuration has an answer; give weaker coils or a stiffer rod")]
    NoConfiguration {
        /// What the scene is called.
        scene: String,
    },
}

/// What is wrong with one of the files that a report is made of.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportFileError {
    /// A table of records.
    #[error("{file}: {source}")]
    Table {
        /// Its name.
        file: &'static str,
        /// What is wrong with it.
        source: RecordError,
    },
    /// The manifest.
    #[error("manifest.json: {0}")]
    Manifest(#[from] serde_json::Error),
}
