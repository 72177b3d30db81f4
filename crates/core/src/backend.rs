//! The one trait between the engines and everything above them: batch in, solutions out.

use crate::model::{Batch, Plan, SampleRecipe, Solutions};
use std::collections::HashMap;
use std::fmt;
use std::ops::Range;

/// Arithmetic of an engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Precision {
    /// Single precision: about 7 digits.
    F32,
    /// Double precision: about 16 digits.
    F64,
}

impl Precision {
    /// Every one.
    pub const ALL: [Precision; 2] = [Precision::F32, Precision::F64];

    /// The word in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Precision::F32 => "f32",
            Precision::F64 => "f64",
        }
    }

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
    /// A plain f64 solver that the others are checked against.
    Reference,
    /// SIMD kernels on all threads.
    Cpu,
    /// WGSL compute shaders.
    Gpu,
}

/// What solves, for logs and manifests.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BackendInfo {
    /// The engine.
    pub kind: BackendKind,
    /// Arithmetic of its kernels.
    pub precision: Precision,
    /// For example `avx512, 2 threads` or the adapter's name.
    pub device: String,
    /// Driver and its version; empty for the CPU.
    pub driver: String,
}

/// Why a whole batch could not be solved. A sample that fails is a status, not an error.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BackendError {
    /// The engine lacks something that the plan or the caller asks for.
    #[error("the {backend} backend does not model {what}: {remedy}")]
    Unsupported {
        /// The engine that was asked.
        backend: BackendKind,
        /// What it lacks.
        what: String,
        /// What the user can do about it.
        remedy: String,
    },
    /// The machine has no GPU that works.
    #[error("no usable GPU: {reason}; use the CPU engine")]
    NoDevice {
        /// Why none can be used.
        reason: String,
    },
    /// The GPU or its driver gave up.
    #[error("the GPU failed: {reason}")]
    DeviceFailed {
        /// What went wrong.
        reason: String,
    },
    /// Buffers do not fit on the GPU.
    #[error("the GPU has too little memory: {reason}; use the CPU engine")]
    OutOfMemory {
        /// What did not fit.
        reason: String,
    },
}

impl BackendError {
    /// Whether a device is at fault, so that an engine on another could go on.
    pub fn is_of_device(&self) -> bool {
        !matches!(self, BackendError::Unsupported { .. })
    }
}

/// A rung of the ladder of methods in words: for the guide, and for whoever asks how a sample was solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LadderLine {
    /// The method.
    pub rung: &'static str,
    /// For which samples it is.
    pub samples: &'static str,
    /// Statuses that it gives; any other sample goes to the next rung.
    pub decides: &'static str,
}

/// What a rung of the ladder did: one method for all samples that the rungs before have left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RungCount {
    /// Its name, such as `load steps`.
    pub rung: String,
    /// Samples that it was given.
    pub samples: u64,
    /// Those that it left to the next.
    pub left: u64,
    /// Seconds, summed over threads.
    pub seconds: f64,
}

/// Makes a backend for a plan; fails where the engine cannot solve it.
pub type BackendFactory<'a> = &'a (dyn Fn(&Plan) -> Result<Box<dyn Backend>, BackendError> + Sync);

/// An engine prepared for one plan.
pub trait Backend: Send {
    /// Engine, arithmetic and device, for logs and manifests.
    fn info(&self) -> BackendInfo;

    /// The plan it was prepared for.
    fn plan(&self) -> &Plan;

    /// Samples of one call that keep the device busy without exceeding its limits.
    fn batch_size(&self) -> usize;

    /// Solves every sample of a batch; row i of the solutions belongs to sample i.
    ///
    /// The row of a sample depends on that sample's inputs alone.
    ///
    /// # Errors
    ///
    /// The device fails; a sample that fails has a status instead.
    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError>;

    /// The same into memory of a call before.
    ///
    /// # Errors
    ///
    /// As [`Backend::solve`].
    fn solve_into(&mut self, batch: &Batch, solutions: &mut Solutions) -> Result<(), BackendError> {
        *solutions = self.solve(batch)?;
        Ok(())
    }

    /// Makes the samples of a sweep, solves them and keeps what is known of their tips, without rows; `None` where
    /// the engine has no such way.
    ///
    /// `give` takes what comes back of each dispatch, in order; false ends the run.
    ///
    /// # Errors
    ///
    /// The device fails.
    fn reduce(
        &mut self,
        _job: &ReduceJob,
        _give: &mut dyn FnMut(Returned) -> bool,
    ) -> Result<Option<Reduced>, BackendError> {
        Ok(None)
    }

    /// What users should know of how it went so far, such as a device that was lost and opened again; each once.
    fn take_notes(&mut self) -> Vec<String> {
        Vec::new()
    }

    /// Where its own time went so far, by name (s); nothing where it keeps no account.
    fn timings(&self) -> Vec<(&'static str, f64)> {
        Vec::new()
    }

    /// Which rungs of its ladder took how many samples so far, in their order; nothing where it keeps no account.
    fn rungs(&self) -> Vec<RungCount> {
        Vec::new()
    }
}

/// A sweep of which no rows are kept.
#[derive(Clone, Copy)]
pub struct ReduceJob<'a> {
    /// `None` where samples do not follow from their index alone.
    pub recipe: Option<&'a SampleRecipe>,
    /// Samples, in order.
    pub ranges: &'a [Range<u64>],
    /// Edge of a voxel (m)
    pub voxel: f64,
    /// Samples of a larger error estimate come back.
    pub tolerance: f64,
    /// Samples of a range that must come back, ascending.
    pub wanted: &'a (dyn Fn(Range<u64>) -> Vec<u64> + Sync),
    /// Axis values of a sample, SI.
    pub values: &'a (dyn Fn(u64, &mut [f64]) + Sync),
}

/// Of one range of samples: those that come back as rows, and how many were counted where they were solved.
#[derive(Clone, Debug)]
pub struct Returned {
    /// Ascending.
    pub indices: Vec<u64>,
    /// Their inputs, in the same order.
    pub batch: Batch,
    /// Their rows, in the same order.
    pub solutions: Solutions,
    /// Samples counted as `Ok` and as `Ramped`. Neither their tips nor their residuals nor their error estimates lie
    /// beyond those of the rows given so far that are within the tolerance.
    pub counted: [u64; 2],
}

/// What came of [`Backend::reduce`].
#[derive(Clone, Debug)]
pub enum Reduced {
    /// Nothing was solved, for this reason.
    Declined(String),
    /// Counted samples in each voxel, by floor(position / voxel).
    Voxels(HashMap<[i32; 3], u32>),
}

impl BackendKind {
    /// Every engine.
    pub const ALL: [BackendKind; 3] = [BackendKind::Reference, BackendKind::Cpu, BackendKind::Gpu];

    /// The word in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            BackendKind::Reference => "reference",
            BackendKind::Cpu => "cpu",
            BackendKind::Gpu => "gpu",
        }
    }
}

impl fmt::Display for BackendKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for Precision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for BackendInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} ({})", self.kind, self.precision, self.device)
    }
}
