//! The arguments that choose an engine.

use clap::{Args, ValueEnum};
use rodsweep::backend::{BackendKind, Precision};
use rodsweep::engines::EngineRequest;

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
}

impl From<PrecisionName> for Precision {
    fn from(name: PrecisionName) -> Precision {
        match name {
            PrecisionName::F32 => Precision::F32,
            PrecisionName::F64 => Precision::F64,
        }
    }
}

#[derive(Clone, Copy, Debug, Args)]
pub struct EngineArguments {
    /// What solves
    #[arg(long, value_enum, default_value = "auto")]
    pub backend: BackendName,
    /// Arithmetic; the default is f32 on a GPU and f64 elsewhere
    #[arg(long, value_enum)]
    pub precision: Option<PrecisionName>,
}

impl EngineArguments {
    /// What the library is asked for.
    pub fn request(&self) -> EngineRequest {
        let backend = match self.backend {
            BackendName::Auto => None,
            BackendName::Gpu => Some(BackendKind::Gpu),
            BackendName::Cpu => Some(BackendKind::Cpu),
            BackendName::Reference => Some(BackendKind::Reference),
        };
        EngineRequest::any().backend(backend).precision(self.precision.map(Into::into))
    }
}
