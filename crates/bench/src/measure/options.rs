//! What is asked of a measurement, and which of its parts that means.

use crate::bench_file::BenchSpec;
use crate::error::BenchError;

/// What can be measured beside the scenes.
const PARTS: [&str; 8] = ["peak", "reference", "features", "throughput", "device", "stages", "trust", "hard"];
/// Those that a GPU takes part in.
const ON_A_GPU: [&str; 2] = ["throughput", "device"];

/// Which engines are measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Engines {
    /// Every one of the machine.
    #[default]
    All,
    /// The CPU with all its instruction sets.
    Cpu,
    /// The GPU, in hardware or software.
    Gpu,
}

/// How much is measured; by default all of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeasureOptions {
    pub(super) quick: bool,
    pub(super) only: Vec<String>,
    pub(super) engines: Engines,
}

impl MeasureOptions {
    /// Everything, on every engine.
    pub fn new() -> MeasureOptions {
        MeasureOptions::default()
    }

    /// Less of everything, in less than a minute.
    pub fn quick(self, quick: bool) -> MeasureOptions {
        MeasureOptions { quick, ..self }
    }

    /// These parts and scenes only; all where there is no name.
    pub fn only(self, only: impl IntoIterator<Item = impl Into<String>>) -> MeasureOptions {
        MeasureOptions { only: only.into_iter().map(Into::into).collect(), ..self }
    }

    /// These engines only.
    pub fn engines(self, engines: Engines) -> MeasureOptions {
        MeasureOptions { engines, ..self }
    }
}

/// Parts and scenes by name: all where it names nothing.
pub struct Selection(Vec<String>);

impl Selection {
    pub fn new(options: &MeasureOptions, specs: &[BenchSpec]) -> Result<Selection, BenchError> {
        let scenes = specs.iter().map(|spec| spec.name.as_str());
        let known: Vec<&str> = PARTS.into_iter().chain(scenes.clone()).collect();
        let only = &options.only;
        if only.is_empty() && options.engines == Engines::Gpu {
            return Ok(Selection(ON_A_GPU.into_iter().chain(scenes).map(str::to_owned).collect()));
        }
        match only.iter().find(|name| !known.contains(&name.as_str())) {
            None => Ok(Selection(only.clone())),
            Some(name) => {
                let known = known.into_iter().map(str::to_owned).collect();
                Err(BenchError::UnknownPart { name: name.clone(), known })
            }
        }
    }

    /// Whether it is to be measured.
    pub fn has(&self, name: &str) -> bool {
        self.0.is_empty() || self.names(name)
    }

    /// Whether it was asked for by name.
    pub fn names(&self, name: &str) -> bool {
        self.0.iter().any(|other| other == name)
    }
}
