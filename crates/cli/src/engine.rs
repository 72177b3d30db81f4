//! Picks the engine and says why.

use super::args::{BackendName, EngineArguments};
use rodsweep::backend::{Backend, BackendError, BackendKind, Precision};
use rodsweep::gpu;
use rodsweep::lanes::Lanes;
use rodsweep::model::{Plan, PlanOptions, Stepper};
use rodsweep::reference::Reference;

/// The finest tolerance that f32 meets on ordinary rods; finer ones need f64.
pub const F32_TOLERANCE: f64 = 2e-5;

/// Steps of a second attempt, at least.
const SECOND_STEPS: usize = 24;

/// An engine and why it was taken.
#[derive(Clone, Debug)]
pub struct Engine {
    pub kind: BackendKind,
    pub precision: Precision,
    pub reason: String,
}

impl Engine {
    /// Follows the arguments; `auto` takes a GPU that is no software and meets the tolerance, else the CPU.
    pub fn choose(arguments: &EngineArguments, tolerance: f64) -> Result<Engine, BackendError> {
        let engine = |kind, precision, reason: &str| Engine { kind, precision, reason: reason.into() };
        let asked: Option<Precision> = arguments.precision.map(Into::into);
        let f64_or_asked = asked.unwrap_or(Precision::F64);
        match arguments.backend {
            BackendName::Reference => match asked {
                Some(Precision::F32) => Err(unsupported(BackendKind::Reference, "f32", "leave `--precision` out")),
                _ => Ok(engine(BackendKind::Reference, Precision::F64, "asked for")),
            },
            BackendName::Cpu => Ok(engine(BackendKind::Cpu, f64_or_asked, "asked for")),
            BackendName::Gpu => {
                let has_f64 =
                    || gpu::chosen_adapters().is_ok_and(|chosen| chosen.iter().all(|adapter| adapter.has_f64));
                let needs_f64 = tolerance < F32_TOLERANCE && has_f64();
                let precision = asked.unwrap_or(if needs_f64 { Precision::F64 } else { Precision::F32 });
                Ok(engine(BackendKind::Gpu, precision, "asked for"))
            }
            BackendName::Auto => Ok(match gpu::chosen_adapters()?.first() {
                None => engine(BackendKind::Cpu, f64_or_asked, "this machine has no GPU"),
                Some(adapter) if adapter.is_software() => {
                    let reason = format!("the only GPU is software ({})", adapter.name);
                    engine(BackendKind::Cpu, f64_or_asked, &reason)
                }
                Some(adapter) => {
                    let needs_f64 = asked.map_or(tolerance < F32_TOLERANCE, |asked| asked == Precision::F64);
                    match (needs_f64, adapter.has_f64) {
                        (true, false) => {
                            let reason = format!("{tolerance:.0e} needs f64, which {} has not", adapter.name);
                            engine(BackendKind::Cpu, Precision::F64, &reason)
                        }
                        (true, true) => {
                            engine(BackendKind::Gpu, Precision::F64, &format!("found {}, with f64", adapter.name))
                        }
                        (false, _) => engine(BackendKind::Gpu, Precision::F32, &format!("found {}", adapter.name)),
                    }
                }
            }),
        }
    }

    /// The same for one sample at a time, which needs no GPU: `auto` is the CPU.
    pub fn choose_for_one(arguments: &EngineArguments, tolerance: f64) -> Result<Engine, BackendError> {
        let backend = match arguments.backend {
            BackendName::Auto => BackendName::Cpu,
            asked => asked,
        };
        Engine::choose(&EngineArguments { backend, ..*arguments }, tolerance)
    }

    /// Methods of integration that suit it.
    pub fn steppers(&self) -> &'static [Stepper] {
        match (self.kind, self.precision) {
            (BackendKind::Gpu, Precision::F32) => &[Stepper::Tp6, Stepper::Rk4],
            (_, Precision::F32) => &[Stepper::Tp7, Stepper::Tp6, Stepper::Dop853],
            (_, Precision::F64) => &[Stepper::Dop853, Stepper::Tp7, Stepper::Tp6],
        }
    }

    /// The tolerance that this engine is held to.
    pub fn tolerance(&self, asked: f64) -> f64 {
        match self.precision {
            Precision::F32 => asked.max(F32_TOLERANCE),
            Precision::F64 => asked,
        }
    }

    pub fn make(&self, plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
        match self.kind {
            BackendKind::Reference => Ok(reference(plan)),
            BackendKind::Cpu => Ok(Box::new(Lanes::new(plan, self.precision)?)),
            BackendKind::Gpu => gpu::open(plan, self.precision),
        }
    }
}

pub fn reference(plan: &Plan) -> Box<dyn Backend> {
    Box::new(Reference::new(plan))
}

/// The CPU engine in f64.
pub fn cpu_f64(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Lanes::new(plan, Precision::F64)?))
}

/// The CPU engine in f64 at a resolution that leaves no doubt, for samples that failed or are doubtful.
pub fn second_attempt(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    let steps = plan.options.steps.max(SECOND_STEPS);
    cpu_f64(&plan.with_options(PlanOptions { stepper: Stepper::Dop853, steps, ..plan.options }))
}

fn unsupported(backend: BackendKind, what: &str, remedy: &str) -> BackendError {
    BackendError::Unsupported { backend, what: what.into(), remedy: remedy.into() }
}
