//! The one place that knows every engine: which one to take and why, second attempts, the witness.

mod survey;

#[cfg(feature = "gpu")]
pub use survey::GpuSurvey;
pub use survey::{Memory, Survey, survey};

use crate::backend::{Backend, BackendError, BackendKind, Precision};
use crate::cpu::{Cpu, InstructionSet};
#[cfg(feature = "gpu")]
use crate::gpu;
use crate::model::{DerivativeScale, Magnet, Plan, PlanOptions, Scene, Stepper};
use crate::reference::Reference;

/// Why a field with nodes without a value is for the reference.
const GAPS: &str = "the sampled field has nodes without a value, which the reference alone models";

/// The finest tolerance that f32 meets on ordinary rods; finer ones need f64.
pub const F32_TOLERANCE: f64 = 2e-5;

/// Steps of a second attempt, at least.
const SECOND_STEPS: usize = 24;
/// Into how many they are cut where stiffness changes along a segment: a derivative by it is an integral over few steps.
const ALONG_TAPERS: usize = 2;
/// Into how many a finer attempt cuts each of them.
const FINER: usize = 4;
/// And what is asked of it at least.
const SECOND_TOLERANCE: f64 = 1e-9;
/// What is said of derivatives on that many steps; measured on random scenes.
pub const SECOND_DERIVATIVES: DerivativeScale = DerivativeScale { share: 100.0, floor: 1e-8 };

/// Samples from which on a GPU takes the doubt of its own rows: before, opening it in f64 costs more than it saves.
const MANY_SAMPLES: u64 = 10_000_000;

/// What is asked of the choice of an engine; by default everything is left to the program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EngineRequest {
    backend: Option<BackendKind>,
    precision: Option<Precision>,
}

impl EngineRequest {
    /// Any engine that meets the tolerance.
    pub fn any() -> EngineRequest {
        EngineRequest::default()
    }

    /// This engine and no other.
    pub fn of(backend: BackendKind) -> EngineRequest {
        EngineRequest::any().backend(Some(backend))
    }

    /// The engine; `None` leaves it to the program.
    pub fn backend(self, backend: Option<BackendKind>) -> EngineRequest {
        EngineRequest { backend, ..self }
    }

    /// Its arithmetic; `None` leaves it to the program.
    pub fn precision(self, precision: Option<Precision>) -> EngineRequest {
        EngineRequest { precision, ..self }
    }

    /// The engine that is asked for.
    pub fn asked_backend(&self) -> Option<BackendKind> {
        self.backend
    }

    /// The arithmetic that is asked for.
    pub fn asked_precision(&self) -> Option<Precision> {
        self.precision
    }

    /// Whether the program may take another engine where the one it chose cannot be used.
    pub fn is_open(&self) -> bool {
        self.backend.is_none()
    }

    /// Chooses for a tolerance: a GPU that is no software and meets it, else the CPU.
    ///
    /// # Errors
    ///
    /// An engine that does not exist here or has not the precision asked for.
    pub fn choose(&self, tolerance: f64) -> Result<Engine, BackendError> {
        let engine = |kind, precision, reason: &str| Engine { kind, precision, reason: reason.into() };
        let unsupported = |backend, precision: Precision| {
            let (what, remedy) = (precision.name().into(), "leave the precision out".into());
            Err(BackendError::Unsupported { backend, what, remedy })
        };
        match self.backend {
            None => any_engine(self.precision, tolerance),
            Some(kind @ BackendKind::Reference) => match self.precision {
                Some(precision @ Precision::F32) => unsupported(kind, precision),
                _ => Ok(engine(BackendKind::Reference, Precision::F64, "asked for")),
            },
            Some(BackendKind::Cpu) => {
                Ok(engine(BackendKind::Cpu, self.precision.unwrap_or(Precision::F64), "asked for"))
            }
            Some(BackendKind::Gpu) => {
                let needs_f64 = tolerance < F32_TOLERANCE && gpus_have_f64();
                let precision = self.precision.unwrap_or(if needs_f64 { Precision::F64 } else { Precision::F32 });
                Ok(engine(BackendKind::Gpu, precision, "asked for"))
            }
        }
    }

    /// The same for a scene: walls are for the CPU, and so are fields that vary in space, unless a GPU is asked for. That solves fields in
    /// f32 and leaves those that are sampled on a grid, and loads that turn with the rod, to the CPU; a scene with a wall it refuses.
    ///
    /// # Errors
    ///
    /// As [`EngineRequest::choose`].
    pub fn choose_for(&self, scene: &Scene, tolerance: f64) -> Result<Engine, BackendError> {
        if !scene.has_unknown_force() {
            return self.choose(tolerance);
        }
        if scene.wall.is_some() {
            refuse_beside_wall(scene, self.backend)?;
        }
        if has_gaps(scene) {
            return Ok(Engine::new(BackendKind::Reference, Precision::F64, GAPS));
        }
        let on_cpu = |reason: &str| {
            let precision = self.precision.unwrap_or(Precision::F64);
            Ok(Engine::new(BackendKind::Cpu, precision, reason))
        };
        match self.backend {
            None if scene.wall.is_some() => on_cpu("walls are for the CPU"),
            None | Some(BackendKind::Gpu) if scene.has_load_without_energy() => {
                on_cpu("a load turns with the rod, or a moment acts inside of it, which no GPU kernel models")
            }
            None => on_cpu("the field varies in space; a GPU solves that where it is asked for"),
            Some(BackendKind::Gpu) if has_exact_magnet(scene) => {
                on_cpu("the field of a magnet is that of its cylinder or cuboid, which no GPU kernel models")
            }
            Some(BackendKind::Gpu) if !scene.sources.maps.is_empty() => {
                on_cpu("the field is sampled on a grid, which no GPU kernel models")
            }
            Some(BackendKind::Gpu) if self.precision == Some(Precision::F64) => {
                on_cpu("the field varies in space, which GPU kernels model in f32 alone")
            }
            Some(BackendKind::Gpu) => Ok(Engine::new(BackendKind::Gpu, Precision::F32, "asked for")),
            Some(_) => self.choose(tolerance),
        }
    }

    /// The same for one sample of a scene at a time, which needs no GPU: the CPU unless another is asked for.
    ///
    /// # Errors
    ///
    /// As [`EngineRequest::choose`].
    pub fn choose_for_one(&self, scene: &Scene, tolerance: f64) -> Result<Engine, BackendError> {
        self.backend(Some(self.backend.unwrap_or(BackendKind::Cpu))).choose_for(scene, tolerance)
    }
}

#[cfg(feature = "gpu")]
fn any_engine(asked: Option<Precision>, tolerance: f64) -> Result<Engine, BackendError> {
    let engine = |kind, precision, reason: String| Ok(Engine { kind, precision, reason });
    let on_cpu = asked.unwrap_or(Precision::F64);
    let adapters = gpu::chosen_adapters()?;
    let Some(adapter) = adapters.first() else {
        return engine(BackendKind::Cpu, on_cpu, "this machine has no GPU".into());
    };
    if adapter.is_software() {
        return engine(BackendKind::Cpu, on_cpu, format!("the only GPU is software ({})", adapter.name));
    }
    let needs_f64 = asked.map_or(tolerance < F32_TOLERANCE, |asked| asked == Precision::F64);
    match (needs_f64, adapter.has_f64) {
        (true, false) => {
            let reason = format!("{tolerance:.0e} needs f64, which {} has not", adapter.name);
            engine(BackendKind::Cpu, Precision::F64, reason)
        }
        (true, true) => engine(BackendKind::Gpu, Precision::F64, format!("found {}, with f64", adapter.name)),
        (false, _) => engine(BackendKind::Gpu, Precision::F32, format!("found {}", adapter.name)),
    }
}

#[cfg(not(feature = "gpu"))]
fn any_engine(asked: Option<Precision>, _: f64) -> Result<Engine, BackendError> {
    let reason = "built without GPU engine".into();
    Ok(Engine { kind: BackendKind::Cpu, precision: asked.unwrap_or(Precision::F64), reason })
}

fn gpus_have_f64() -> bool {
    #[cfg(feature = "gpu")]
    return gpu::chosen_adapters().is_ok_and(|chosen| chosen.iter().all(|adapter| adapter.has_f64));
    #[cfg(not(feature = "gpu"))]
    return false;
}

/// An engine and why it was taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Engine {
    kind: BackendKind,
    precision: Precision,
    reason: String,
}

impl Engine {
    /// A given engine.
    pub fn new(kind: BackendKind, precision: Precision, reason: impl Into<String>) -> Engine {
        Engine { kind, precision, reason: reason.into() }
    }

    /// Which engine.
    pub fn kind(&self) -> BackendKind {
        self.kind
    }

    /// Its arithmetic.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// Why it was taken, in a few words.
    pub fn reason(&self) -> &str {
        &self.reason
    }

    /// The CPU in the same precision.
    pub fn on_the_cpu(&self) -> Engine {
        Engine { kind: BackendKind::Cpu, ..self.clone() }
    }

    /// Methods of integration that suit it, the first by default.
    pub fn steppers(&self) -> &'static [Stepper] {
        match (self.kind, self.precision) {
            (BackendKind::Gpu, Precision::F32) => &[Stepper::Tp6, Stepper::Rk4],
            (_, Precision::F32) => &[Stepper::Tp7, Stepper::Tp6, Stepper::Dop853],
            // The twelve stages of DOP853 are too many for the registers of a GPU.
            (BackendKind::Gpu, Precision::F64) => &[Stepper::Tp7, Stepper::Tp6],
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

    /// The engine, prepared for a plan.
    ///
    /// # Errors
    ///
    /// A device that cannot be used, or a plan that the engine does not model.
    pub fn make(&self, plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
        // No GPU kernel starts from a base moment in a field that varies, or leaves it aside.
        let is_limp = || !plan.searches() && plan.scene.rod().is_too_limp();
        let searches = plan.start.is_some() && (plan.terms.varying_field || is_limp());
        match self.kind {
            BackendKind::Gpu if searches => self.on_the_cpu().make(plan),
            BackendKind::Reference => Ok(witness(plan)),
            _ if has_gaps(&plan.scene) => Ok(witness(plan)),
            BackendKind::Cpu => Ok(Box::new(Cpu::new(plan, self.precision)?)),
            #[cfg(feature = "gpu")]
            BackendKind::Gpu => gpu::open(plan, self.precision),
            #[cfg(not(feature = "gpu"))]
            BackendKind::Gpu => Err(BackendError::NoDevice { reason: "built without the feature `gpu`".into() }),
        }
    }
}

impl Engine {
    /// Whether [`Engine::settle`] pays for a sweep of so many samples: by a GPU in f32 that is hardware and has f64.
    pub fn settles(&self, sample_count: u64) -> bool {
        #[cfg(feature = "gpu")]
        let is_able = || {
            let is_able = |adapter: &gpu::AdapterSummary| adapter.has_f64 && !adapter.is_software();
            gpu::chosen_adapters().is_ok_and(|chosen| chosen.iter().all(is_able))
        };
        #[cfg(not(feature = "gpu"))]
        let is_able = || false;
        let is_single = (self.kind, self.precision) == (BackendKind::Gpu, Precision::F32);
        is_single && sample_count >= MANY_SAMPLES && is_able()
    }

    /// The same engine in f64 on twice the steps, for rows whose only doubt is their error estimate.
    ///
    /// # Errors
    ///
    /// A device that cannot be used, or a plan that the engine does not model.
    pub fn settle(&self, plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
        let engine = Engine::new(self.kind, Precision::F64, "settles doubt");
        let steps = 2 * plan.options.steps;
        engine.make(&plan.with_options(PlanOptions { stepper: engine.steppers()[0], steps, ..plan.options }))
    }

    /// The engine for one sample at a time. On the CPU most of a wide register would stay idle; narrow ones are quicker.
    ///
    /// # Errors
    ///
    /// As [`Engine::make`].
    pub fn make_for_one(&self, plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
        match self.kind {
            BackendKind::Cpu if !has_gaps(&plan.scene) => {
                Ok(Box::new(Cpu::with_instruction_set(plan, self.precision, InstructionSet::for_one())?))
            }
            _ => self.make(plan),
        }
    }
}

/// Refuses what no engine does with a wall, and a GPU.
fn refuse_beside_wall(scene: &Scene, asked: Option<BackendKind>) -> Result<(), BackendError> {
    let refuse = |backend, what: &str, remedy: &str| {
        Err(BackendError::Unsupported { backend, what: what.into(), remedy: remedy.into() })
    };
    match asked {
        Some(backend @ BackendKind::Gpu) => {
            refuse(backend, "a wall", "walls are for the CPU; take `--backend cpu`, or leave the backend out")
        }
        _ if scene.rod().is_too_limp() => refuse(
            BackendKind::Cpu,
            "a wall at the tip of so limp or so taut a rod",
            "rods solved by nodes cannot touch a wall yet; leave out `[wall]`, or make the rod stiffer or its loads smaller",
        ),
        _ => Ok(()),
    }
}

/// Whether the field of a magnet is that of its shape.
fn has_exact_magnet(scene: &Scene) -> bool {
    scene.sources.magnets.iter().any(Magnet::is_exact)
}

/// Whether a sampled field has nodes without a value.
fn has_gaps(scene: &Scene) -> bool {
    scene.sources.maps.iter().any(|map| map.grid.has_gaps())
}

/// What is believed where engines differ: the scalar reference.
pub fn witness(plan: &Plan) -> Box<dyn Backend> {
    Box::new(Reference::new(plan))
}

/// The CPU engine in f64, or the reference where that alone models the field.
///
/// # Errors
///
/// A plan that the engine does not model.
pub fn cpu_f64(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    if has_gaps(&plan.scene) {
        return Ok(witness(plan));
    }
    Ok(Box::new(Cpu::new(plan, Precision::F64)?))
}

/// The CPU engine in f64 at a resolution that leaves no doubt, for samples that failed or are doubtful.
///
/// # Errors
///
/// A plan that the engine does not model.
pub fn second_attempt(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    cpu_f64(&for_second_attempt(plan))
}

/// Whether rows of a plan can be solved again from the load at their own base. In a uniform field it saves nothing; where stability
/// follows from the path alone, and beside a wall, the path is followed again.
pub(crate) fn can_answer_again(plan: &Plan) -> bool {
    plan.terms.varying_field && !plan.terms.wall && !plan.terms.load_without_energy && !has_gaps(&plan.scene)
}

/// The resolution of the second attempt, for searches that start where rows are.
///
/// # Errors
///
/// A plan that the engine does not model.
pub fn answer_on_finer_steps(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    answer_by(&for_second_attempt(plan))
}

/// The resolution of the finer attempt, for the same.
///
/// # Errors
///
/// A plan that the engine does not model.
pub fn answer_on_finest_steps(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    answer_by(&for_finer_attempt(plan))
}

/// The CPU engine in f64 for searches that start near an equilibrium of another grid.
///
/// # Errors
///
/// A plan that the engine does not model.
pub(crate) fn answer_by(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    let plan = plan.with_options(PlanOptions { fold_rows: false, ..plan.options });
    cpu_f64(&plan.with_near_starts())
}

/// The second attempt on finer steps, for samples whose error estimate misses the tolerance even so.
///
/// # Errors
///
/// A plan that the engine does not model.
pub fn finer_attempt(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    cpu_f64(&for_finer_attempt(plan))
}

fn for_finer_attempt(plan: &Plan) -> Plan {
    let plan = for_second_attempt(plan);
    plan.with_options(PlanOptions { refinement: FINER, ..plan.options })
}

/// Length of the steps of a second path, and of the corrections that it trusts, over those of the first.
const SECOND_PACE: f64 = 0.5;

/// The plan that follows the same paths from rest by other steps: to tips alone, without anchors.
pub(crate) fn for_second_path(plan: &Plan) -> Plan {
    let plan = Plan { derivatives: Vec::new(), anchors: None, ..plan.clone() };
    plan.with_options(PlanOptions { pace: SECOND_PACE, ..plan.options })
}

/// The plan that [`second_attempt`] solves.
pub(crate) fn for_second_attempt(plan: &Plan) -> Plan {
    let steps = plan.options.steps.max(SECOND_STEPS);
    let PlanOptions { error_share, .. } = PlanOptions::default();
    let derivative_scale = SECOND_DERIVATIVES;
    let stepper = Stepper::Dop853;
    let tolerance = plan.options.tolerance.min(SECOND_TOLERANCE);
    let refinement = plan.options.refinement.max(if plan.terms.taper { ALONG_TAPERS } else { 1 });
    let options = PlanOptions {
        tolerance,
        stepper,
        steps,
        refinement,
        error_share,
        error_floor: 0.0,
        derivative_scale,
        ..plan.options
    };
    plan.with_options(options)
}
