//! An engine with its method, and the verdict on what it makes of a case.

use super::case::{Answer, Case};
use super::documented;
use rodsweep::backend::{Backend, BackendError, BackendKind, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::engines::Engine;
use rodsweep::model::{Batch, Plan, PlanOptions, Quantity, Solutions, Status, Stepper, Vector};
use std::time::Instant;

/// An engine with its method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Which engine.
    pub kind: BackendKind,
    /// Its arithmetic.
    pub precision: Precision,
    /// Its method of integration.
    pub stepper: Stepper,
}

/// What an engine made of a case.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Outcome {
    /// As the engine has it.
    pub status: Status,
    /// Of the tip, against the truth, over the length; no number where there is no truth.
    pub error: f64,
    /// As the engine has it.
    pub estimate: f64,
    /// What the error may be.
    pub limit: f64,
    /// Passes over the rod.
    pub iterations: f64,
    /// Share of the loads that the path from rest came to.
    pub load_fraction: f64,
    /// Over the rod; none where the engine chooses them itself.
    pub steps: Option<usize>,
    /// The quickest of a few solves (s).
    pub seconds: f64,
    /// Whether it is right.
    pub verdict: Verdict,
}

/// What is said of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// A success at the tip of the branch from rest.
    Ok,
    /// No answer, and rightly so: why.
    NoAnswer(&'static str),
    /// No answer where there is one: why, if known.
    GaveUp(Option<&'static str>),
    /// A success elsewhere.
    Wrong,
}

/// Steps that are tried, until the error estimate is below half the limit or no longer gets smaller. On fewer the
/// path from rest is too coarse to keep to its branch near a bifurcation (`tests/trust.rs`).
const STEPS: [usize; 7] = [16, 32, 64, 128, 256, 512, 1024];
/// What is said of a success that is off by more than the limit, but by less than its own estimate.
const DOUBTFUL: &str = "its error estimate is above the limit: a run solves it again";
/// An estimate that is not smaller by this factor has met round-off.
const GAIN: f64 = 0.9;
/// The quickest of so many solves is the time.
const SOLVES: usize = 3;

impl Setup {
    /// The scalar reference.
    pub const REFERENCE: Setup =
        Setup { kind: BackendKind::Reference, precision: Precision::F64, stepper: Stepper::Dop853 };
    /// The CPU in f64.
    pub const CPU_F64: Setup = Setup { kind: BackendKind::Cpu, ..Setup::REFERENCE };
    /// The CPU in f32.
    pub const CPU_F32: Setup = Setup { precision: Precision::F32, ..Setup::CPU_F64 };
    /// A GPU in f32.
    pub const GPU_F32: Setup = Setup { kind: BackendKind::Gpu, stepper: Stepper::Rk4, ..Setup::CPU_F32 };
    /// A GPU in f64.
    pub const GPU_F64: Setup = Setup { kind: BackendKind::Gpu, ..Setup::CPU_F64 };

    /// `cpu f64`
    pub fn name(&self) -> String {
        match self.kind {
            BackendKind::Reference => "reference".into(),
            kind => format!("{kind} {}", self.precision),
        }
    }

    /// The engine without its method.
    pub fn engine(&self) -> Engine {
        Engine::new(self.kind, self.precision, "")
    }

    fn options(&self, steps: usize) -> PlanOptions {
        let tolerance = match self.precision {
            Precision::F64 => 1e-12,
            Precision::F32 => 1e-6,
        };
        PlanOptions { tolerance, stepper: self.stepper, steps, ..PlanOptions::default() }
    }

    /// Steps that the cpu engine needs with this arithmetic and method; where it finds no answer, those that lead
    /// furthest.
    fn choose_steps(&self, plan: &Plan, limit: f64) -> Result<usize, BackendError> {
        let mut best: Option<(usize, f64)> = None;
        let mut furthest = (STEPS[0], -1.0);
        for steps in STEPS {
            let plan = plan.with_options(self.options(steps));
            let solutions = Cpu::new(&plan, self.precision)?.solve(&plan.batch(1, |_, _| {}))?;
            let load_fraction = solutions.get(0, Quantity::LoadFraction);
            if load_fraction > furthest.1 {
                furthest = (steps, load_fraction);
            }
            let estimate = solutions.get(0, Quantity::ErrorEstimate);
            if !solutions.status(0).is_success() || !estimate.is_finite() {
                continue;
            }
            let is_better = best.is_none_or(|(_, least)| estimate < GAIN * least);
            if !is_better {
                break;
            }
            best = Some((steps, estimate));
            if estimate <= limit {
                break;
            }
        }
        Ok(best.unwrap_or(furthest).0)
    }

    /// Solves a case and judges the answer; `make` prepares the engine for a plan.
    ///
    /// # Errors
    ///
    /// What the engine refuses or fails at.
    pub fn solve(
        &self,
        case: &Case,
        answer: &Answer,
        make: impl FnOnce(&Plan) -> Result<Box<dyn Backend>, BackendError>,
    ) -> Result<Outcome, BackendError> {
        let mut plan = case.plan();
        let limit = answer.limit(self.precision);
        let mut steps = None;
        if self.kind != BackendKind::Reference {
            let chosen = self.choose_steps(&plan, 0.5 * limit)?;
            steps = Some(chosen);
            plan = plan.with_options(self.options(chosen));
        }
        let (solutions, seconds) = time(make(&plan)?.as_mut(), &plan.batch(1, |_, _| {}))?;
        let tip = solutions.vector(0, Quantity::TipPosition);
        let error = answer.tip.map_or(f64::NAN, |truth| distance(tip, truth) / case.scene.total_length());
        let status = solutions.status(0);
        let estimate = solutions.get(0, Quantity::ErrorEstimate);
        let verdict = match documented::end(case.name()) {
            // Also false for NaN.
            _ if status.is_success() && error <= limit => Verdict::Ok,
            _ if status.is_success() && error <= estimate => Verdict::GaveUp(Some(DOUBTFUL)),
            _ if status.is_success() => Verdict::Wrong,
            Some(end) if end.statuses.contains(&status) => Verdict::NoAnswer(end.why),
            _ => Verdict::GaveUp(documented::shortcoming(case.name(), &self.name(), status).map(|known| known.why)),
        };
        Ok(Outcome {
            status,
            error,
            estimate,
            limit,
            iterations: solutions.get(0, Quantity::Iterations),
            load_fraction: solutions.get(0, Quantity::LoadFraction),
            steps,
            seconds,
            verdict,
        })
    }
}

fn time(backend: &mut dyn Backend, batch: &Batch) -> Result<(Solutions, f64), BackendError> {
    let mut best = f64::INFINITY;
    let mut solutions = None;
    for _ in 0..SOLVES {
        let start = Instant::now();
        solutions = Some(backend.solve(batch)?);
        best = best.min(start.elapsed().as_secs_f64());
    }
    Ok((solutions.expect("at least one solve"), best))
}

fn distance(a: Vector, b: Vector) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}
