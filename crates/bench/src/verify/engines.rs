//! What every engine makes of all cases.

use super::cases::Case;
use rodsweep::backend::{BackendError, BackendInfo, BackendKind, Precision};
use rodsweep::engines::Engine;
use rodsweep::model::{PlanOptions, Solutions, Stepper};
use std::time::Instant;

/// An engine with its resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    pub kind: BackendKind,
    pub precision: Precision,
    pub stepper: Stepper,
    pub steps: usize,
}

impl Setup {
    pub const REFERENCE: Setup =
        Setup { kind: BackendKind::Reference, precision: Precision::F64, stepper: Stepper::Dop853, steps: 1 };
    /// So fine that its steps do not show.
    pub const FINE: Setup =
        Setup { kind: BackendKind::Cpu, precision: Precision::F64, stepper: Stepper::Dop853, steps: 32 };

    /// An f32 engine as `run` takes it, at steps that do not show in f32.
    pub fn single(kind: BackendKind) -> Setup {
        let stepper = Engine::new(kind, Precision::F32, "").steppers()[0];
        let steps = match stepper {
            Stepper::Rk4 => 64,
            Stepper::Tp6 | Stepper::Tp7 | Stepper::Dop853 => 8,
        };
        Setup { kind, precision: Precision::F32, stepper, steps }
    }

    pub fn options(&self) -> PlanOptions {
        let tolerance = match self.precision {
            Precision::F64 => 1e-12,
            Precision::F32 => 1e-6,
        };
        PlanOptions { tolerance, stepper: self.stepper, steps: self.steps, ..PlanOptions::default() }
    }

    pub fn name(&self) -> String {
        match self.kind {
            BackendKind::Reference => "reference".into(),
            kind => format!("{kind} {}", self.precision),
        }
    }

    pub fn method(&self) -> String {
        match self.kind {
            BackendKind::Reference => "adaptive".into(),
            _ => format!("{}, {} steps", self.stepper.name(), self.steps),
        }
    }
}

/// What an engine made of all cases.
pub struct Run {
    pub setup: Setup,
    pub info: Option<BackendInfo>,
    /// Of each case; `None` where the engine could not take it.
    pub solutions: Vec<Option<Solutions>>,
    /// Why it could not be had.
    pub skipped: Option<String>,
    /// Why it broke down.
    pub failed: Option<String>,
    pub seconds: f64,
}

impl Run {
    /// An engine that is passed over.
    pub fn skipped(setup: Setup, cases: usize, reason: String) -> Run {
        let solutions = (0..cases).map(|_| None).collect();
        Run { setup, info: None, solutions, skipped: Some(reason), failed: None, seconds: 0.0 }
    }
}

/// Solves every case; an engine that cannot be had is noted, not an error.
pub fn run(setup: Setup, cases: &[Case], progress: &mut dyn FnMut(&str)) -> Run {
    let mut run = Run { setup, info: None, solutions: Vec::new(), skipped: None, failed: None, seconds: 0.0 };
    for case in cases {
        let missing = run.failed.is_some() || run.skipped.is_some() && run.info.is_none();
        let solved = if missing { None } else { solve(&mut run, case, progress) };
        run.solutions.push(solved);
    }
    run
}

fn solve(run: &mut Run, case: &Case, progress: &mut dyn FnMut(&str)) -> Option<Solutions> {
    if run.setup.kind == BackendKind::Gpu {
        // Compiling may take a while on a software adapter.
        progress(&format!("{}: {}, {} samples", run.setup.name(), case.name, case.sample_count()));
    }
    let plan = case.plan.with_options(run.setup.options());
    let solved = Engine::new(run.setup.kind, run.setup.precision, "").make(&plan).and_then(|mut backend| {
        run.info.get_or_insert_with(|| backend.info());
        let start = Instant::now();
        let solutions = backend.solve(&case.batch)?;
        run.seconds += start.elapsed().as_secs_f64();
        Ok(solutions)
    });
    match solved {
        Ok(solutions) => Some(solutions),
        Err(BackendError::DeviceFailed { reason } | BackendError::OutOfMemory { reason }) => {
            run.failed = Some(format!("{}: {reason}", case.name));
            None
        }
        Err(error @ (BackendError::NoDevice { .. } | BackendError::Unsupported { .. })) => {
            run.skipped.get_or_insert(error.to_string());
            None
        }
    }
}
