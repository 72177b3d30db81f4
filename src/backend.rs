//! The one trait between the engines and everything above them: batch in, solutions out.

use crate::model::{Batch, Plan, Solutions};
use std::fmt;

/// Arithmetic of an engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Precision {
    F32,
    F64,
}

impl Precision {
    /// Distance from 1 to the next number.
    pub fn epsilon(self) -> f64 {
        match self {
            Precision::F32 => f32::EPSILON.into(),
            Precision::F64 => f64::EPSILON,
        }
    }

    /// Bytes of a number.
    pub fn size(self) -> usize {
        match self {
            Precision::F32 => size_of::<f32>(),
            Precision::F64 => size_of::<f64>(),
        }
    }
}

/// Which engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BackendKind {
    Reference,
    Cpu,
    Gpu,
}

/// What solves, for logs and manifests.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BackendInfo {
    pub kind: BackendKind,
    pub precision: Precision,
    /// For example `avx512, 2 threads` or the adapter's name.
    pub device: String,
    /// Driver and its version; empty for the CPU.
    pub driver: String,
}

/// Why a whole batch could not be solved. A sample that fails is a status, not an error.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BackendError {
    #[error("the {backend} backend does not model {what}: {remedy}")]
    Unsupported { backend: BackendKind, what: String, remedy: String },
    #[error("no usable GPU: {reason}; use `--backend cpu`")]
    NoDevice { reason: String },
    #[error("the GPU failed: {reason}")]
    DeviceFailed { reason: String },
}

/// An engine prepared for one plan.
pub trait Backend: Send {
    fn info(&self) -> BackendInfo;

    fn plan(&self) -> &Plan;

    /// Samples of one call that keep the device busy without exceeding its limits.
    fn batch_size(&self) -> usize;

    /// Solves every sample of a batch; row i of the solutions belongs to sample i.
    ///
    /// The row of a sample depends on that sample's inputs alone.
    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError>;
}

impl fmt::Display for BackendKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            BackendKind::Reference => "reference",
            BackendKind::Cpu => "cpu",
            BackendKind::Gpu => "gpu",
        })
    }
}

impl fmt::Display for Precision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Precision::F32 => "f32",
            Precision::F64 => "f64",
        })
    }
}

impl fmt::Display for BackendInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} ({})", self.kind, self.precision, self.device)
    }
}
