//! Every engine that this machine has, in every arithmetic.

use super::clock::Timing;
use crate::bench_file::Work;
use crate::record::Record;
use rodsweep::backend::{Backend, BackendError, Precision};
use rodsweep::cpu::{Cpu, InstructionSet};
use rodsweep::gpu::{AdapterSummary, Device, Gpu, adapters};
use rodsweep::model::{Plan, PlanOptions};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    Cpu(InstructionSet),
    /// The adapter that the GPU engine takes.
    Gpu {
        software: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Engine {
    pub place: Place,
    pub precision: Precision,
}

/// Those of this machine, the CPU's best first, and the GPU's adapter if there is one.
pub fn engines() -> (Vec<Engine>, Option<AdapterSummary>) {
    let mut engines = Vec::new();
    for set in InstructionSet::available() {
        let precisions = [Precision::F64, Precision::F32].into_iter().filter(|asked| set.precision(*asked) == *asked);
        engines.extend(precisions.map(|precision| Engine { place: Place::Cpu(set), precision }));
    }
    let adapter = adapters().into_iter().next();
    if let Some(adapter) = &adapter {
        let place = Place::Gpu { software: adapter.is_software() };
        engines.push(Engine { place, precision: Precision::F32 });
        if adapter.has_f64 {
            engines.push(Engine { place, precision: Precision::F64 });
        }
    }
    (engines, adapter)
}

impl Engine {
    /// What a measurement of so many samples of a scene was made with, and its time.
    pub fn record(self, scene: &str, work: Work, options: PlanOptions, (timing, count): (Timing, usize)) -> Record {
        Record {
            work: work.name().into(),
            engine: self.name().into(),
            precision: self.precision.to_string(),
            method: options.stepper.name().into(),
            size: options.steps as f64,
            seconds: timing.median / count as f64,
            least: timing.least / count as f64,
            spread: timing.spread(),
            ..Record::new("precision", scene)
        }
    }

    /// The CPU with its best instructions.
    pub fn best(precision: Precision) -> Engine {
        Engine { place: Place::Cpu(InstructionSet::available()[0]), precision }
    }

    pub fn is_best(&self) -> bool {
        *self == Engine::best(self.precision)
    }

    pub fn is_software(&self) -> bool {
        self.place == Place::Gpu { software: true }
    }

    pub fn is_gpu(&self) -> bool {
        matches!(self.place, Place::Gpu { .. })
    }

    /// Without its precision.
    pub fn name(&self) -> &'static str {
        match self.place {
            Place::Cpu(set) => set.name(),
            Place::Gpu { software: true } => "GPU in software",
            Place::Gpu { software: false } => "GPU",
        }
    }

    pub fn make(&self, plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
        Ok(match self.place {
            Place::Cpu(set) => Box::new(Cpu::with_instruction_set(plan, self.precision, set)?),
            Place::Gpu { .. } => Box::new(Gpu::new(Device::open()?, plan, self.precision)?),
        })
    }

    /// The finest tolerance that its arithmetic allows to ask for.
    pub fn finest(&self) -> f64 {
        match self.precision {
            Precision::F64 => 1e-12,
            Precision::F32 => 1e-6,
        }
    }
}
