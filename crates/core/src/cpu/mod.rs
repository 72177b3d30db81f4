//! The CPU engine: the reduced form, SIMD across samples, rayon across blocks of samples.
//!
//! Samples are led from rest to their loads, a register at a time; those that meet a narrow pass are packed anew and led
//! with care. Files and functions have a twin of the same name in `shaders/`.
#![allow(non_snake_case)]

mod algebra;
mod blocks;
mod contact;
mod equilibrium;
mod ladder;
mod multiple_shooting;
mod rod;
mod simd;

use crate::backend::{Backend, BackendError, BackendInfo, BackendKind, Precision, RungCount};
use crate::model::{Batch, ColumnNoise, Entry, Plan, Solutions};
use blocks::count;
pub use blocks::count::PassOperations;
use blocks::kernels::{Job, Kernels};
use blocks::scratch::Pool;
use blocks::tally::{self, Tally};
use ladder::Rung;
pub use ladder::ladder;
use pulp::Arch;
use rod::program::Program;
use rod::terms::ProgramTerms;
pub use simd::counted::Operations;
use simd::lane::{F32, F64, Scalar};

/// Vector instructions that a kernel is compiled for; all are in one binary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// x86-64, registers of 512 bits: 8 samples in f64.
    Avx512,
    /// x86-64, registers of 256 bits: 4 samples in f64.
    Avx2,
    /// AArch64, registers of 128 bits: 2 samples in f64.
    Neon,
    /// Any machine, one sample at a time, in f64 whichever precision is asked for.
    Scalar,
}

impl InstructionSet {
    /// Those of this machine, the best first.
    pub fn available() -> Vec<InstructionSet> {
        use InstructionSet::{Avx2, Avx512, Neon, Scalar};
        [Avx512, Avx2, Neon, Scalar].into_iter().filter(|set| set.arch().is_some()).collect()
    }

    /// For single samples: the narrowest with kernels for the scene's terms.
    pub fn for_one() -> InstructionSet {
        use InstructionSet::{Avx2, Neon, Scalar};
        [Avx2, Neon].into_iter().find(|set| set.arch().is_some()).unwrap_or(Scalar)
    }

    /// The precision in which it computes where one is asked for.
    pub fn precision(self, asked: Precision) -> Precision {
        if self == InstructionSet::Scalar { Precision::F64 } else { asked }
    }

    /// As users know it, for example `AVX-512`.
    pub fn name(self) -> &'static str {
        match self {
            InstructionSet::Avx512 => "AVX-512",
            InstructionSet::Avx2 => "AVX2",
            InstructionSet::Neon => "NEON",
            InstructionSet::Scalar => "scalar",
        }
    }

    /// Runs functions compiled for these instructions; `None` where this machine lacks them.
    pub fn arch(self) -> Option<Arch> {
        match self {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => pulp::x86::V4::try_new().map(Arch::V4),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => pulp::x86::V3::try_new().map(Arch::V3),
            #[cfg(target_arch = "aarch64")]
            InstructionSet::Neon => pulp::aarch64::Neon::try_new().map(Arch::Neon),
            InstructionSet::Scalar => Some(Arch::Scalar),
            #[allow(unreachable_patterns)]
            _ => None,
        }
    }
}

/// The CPU engine, prepared for a plan.
pub struct Cpu {
    plan: Plan,
    precision: Precision,
    program: Program,
    /// One unit of each entry, SI.
    units: Vec<f64>,
    column_noise: Option<ColumnNoise>,
    set: InstructionSet,
    arch: Arch,
    /// Whether every sample is solved by nodes.
    by_nodes: bool,
    /// Whether the start of some samples is left aside.
    leaves_some_starts: bool,
    /// What each rung has done so far, by its number.
    rungs: [Tally; Rung::ALL.len()],
    /// Beside a wall in a uniform field: the same rods without it.
    free: Option<Box<Cpu>>,
    /// Memory of blocks, in either precision.
    pools: (Pool<f64>, Pool<f32>),
}

impl Cpu {
    /// With the best instructions of this machine.
    ///
    /// # Errors
    ///
    /// None, as these instructions are there.
    pub fn new(plan: &Plan, precision: Precision) -> Result<Self, BackendError> {
        Self::with_instruction_set(plan, precision, InstructionSet::available()[0])
    }

    /// With given instructions.
    ///
    /// # Errors
    ///
    /// This machine lacks them.
    pub fn with_instruction_set(plan: &Plan, precision: Precision, set: InstructionSet) -> Result<Self, BackendError> {
        let unsupported = || BackendError::Unsupported {
            backend: BackendKind::Cpu,
            what: set.name().into(),
            remedy: "this machine lacks it".into(),
        };
        let arch = set.arch().ok_or_else(unsupported)?;
        let precision = set.precision(precision);
        let free = match plan.without_wall() {
            Some(free) => Some(Box::new(Self::with_instruction_set(&free, precision, set)?)),
            None => None,
        };
        let mut program = Program::new(plan, precision.epsilon());
        if set == InstructionSet::Scalar {
            program.terms = ProgramTerms::EVERY;
        }
        Ok(Self {
            plan: plan.clone(),
            precision,
            program,
            units: plan.entry_units(),
            column_noise: ColumnNoise::new(plan, precision.epsilon()),
            set,
            arch,
            by_nodes: plan.leaves_starts() == Some(true),
            leaves_some_starts: plan.leaves_starts().is_none(),
            rungs: Default::default(),
            free,
            pools: Default::default(),
        })
    }

    /// The same, solving every sample by nodes, which else only rods do that are too limp or too taut for a single pass.
    pub fn by_nodes(self) -> Self {
        Self { by_nodes: true, ..self }
    }

    /// Arithmetic operations of the passes over the rod for a sample of a batch.
    pub fn count_operations(&self, batch: &Batch, sample: usize) -> PassOperations {
        let mut inputs = vec![0.0; self.plan.input_count];
        for (entry, unit) in self.plan.entries.iter().zip(&self.units) {
            if let Entry::Varying(column) = *entry {
                inputs[column] = batch.inputs.get(sample, column) / unit;
            }
        }
        count::count_passes(&Program::new(&self.plan, self.precision.epsilon()), &inputs)
    }

    /// The instructions in use.
    pub fn instruction_set(&self) -> InstructionSet {
        self.set
    }
}

impl Backend for Cpu {
    fn info(&self) -> BackendInfo {
        let threads = rayon::current_num_threads();
        let device = format!("{}, {threads} thread{}", self.set.name(), if threads == 1 { "" } else { "s" });
        BackendInfo { kind: BackendKind::Cpu, precision: self.precision, device, driver: String::new() }
    }

    fn plan(&self) -> &Plan {
        &self.plan
    }

    fn batch_size(&self) -> usize {
        65_536
    }

    fn rungs(&self) -> Vec<RungCount> {
        let mut all = self.free.as_ref().map_or(Vec::new(), |free| free.rungs());
        all.extend(tally::account(&self.rungs));
        all
    }

    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        let mut solutions = Solutions::default();
        self.solve_into(batch, &mut solutions)?;
        Ok(solutions)
    }

    fn solve_into(&mut self, batch: &Batch, solutions: &mut Solutions) -> Result<(), BackendError> {
        solutions.reuse(&self.plan, batch.sample_count());
        match self.precision {
            Precision::F64 => self.fill::<f64>(batch, solutions),
            Precision::F32 => self.fill::<f32>(batch, solutions),
        }
        Ok(())
    }
}

/// Chooses the register type of a precision; that of single samples is there in f64 alone.
trait BlockScalar: Scalar {
    fn run(arch: Arch, job: Job<'_, Self>);
    /// The memory of an engine's blocks.
    fn pool(pools: &(Pool<f64>, Pool<f32>)) -> &Pool<Self>;
}

macro_rules! block_scalar {
    ($scalar:ty, $lane:ident, $pool:tt $(, $single:ty)?) => {
        impl BlockScalar for $scalar {
            fn pool(pools: &(Pool<f64>, Pool<f32>)) -> &Pool<$scalar> {
                &pools.$pool
            }

            fn run(arch: Arch, job: Job<'_, $scalar>) {
                match arch {
                    $(Arch::Scalar => <$single>::job(pulp::Scalar::new(), job),)?
                    #[cfg(target_arch = "x86_64")]
                    Arch::V3(token) => $lane::<pulp::x86::V3>::job(token, job),
                    #[cfg(target_arch = "x86_64")]
                    Arch::V4(token) => $lane::<pulp::x86::V4>::job(token, job),
                    #[cfg(target_arch = "aarch64")]
                    Arch::Neon(token) => $lane::<pulp::aarch64::Neon>::job(token, job),
                    #[allow(unreachable_patterns)]
                    _ => unreachable!("an instruction set that was not offered"),
                }
            }
        }
    };
}
block_scalar!(f64, F64, 0, F64<pulp::Scalar>);
block_scalar!(f32, F32, 1);
