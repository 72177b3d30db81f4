//! The arguments that choose an engine.

use super::say;
use clap::{Args, ValueEnum};
use rodsweep::backend::{BackendKind, Precision};
use rodsweep::engines::EngineRequest;
use rodsweep::spec::MIXED_NOTE;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    /// A GPU where there is one, else the CPU engine
    Auto,
    Gpu,
    Cpu,
    /// Slow, scalar, trusted
    Reference,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PrecisionName {
    F32,
    F64,
    /// The default
    Auto,
    /// Of versions that had mixed precision: f64
    #[value(hide = true)]
    Mixed,
}

#[derive(Clone, Copy, Debug, Args)]
pub struct EngineArguments {
    /// What solves
    #[arg(long, value_enum, default_value = "auto")]
    pub backend: BackendName,
    /// Arithmetic; the default is f32 on a GPU and f64 elsewhere, or what a sweep file says
    #[arg(long, value_enum)]
    pub precision: Option<PrecisionName>,
}

impl EngineArguments {
    /// The request to the library.
    pub fn request(&self) -> EngineRequest {
        let backend = match self.backend {
            BackendName::Auto => None,
            BackendName::Gpu => Some(BackendKind::Gpu),
            BackendName::Cpu => Some(BackendKind::Cpu),
            BackendName::Reference => Some(BackendKind::Reference),
        };
        let request = EngineRequest::any().backend(backend);
        match self.precision {
            None | Some(PrecisionName::Auto) => request,
            Some(PrecisionName::F32) => request.precision(Some(Precision::F32)),
            Some(PrecisionName::F64) => request.precision(Some(Precision::F64)),
            Some(PrecisionName::Mixed) => {
                say(&format!("note: `--precision mixed`: {MIXED_NOTE}"));
                request.precision(Some(Precision::F64))
            }
        }
    }
}
