//! Hard cases, what is right for each, and how an engine's answer is judged. Apart from the command line, so that the
//! tests judge by the same.

pub mod documented;
mod golden;
mod own;

use rodsweep::backend::{Backend, BackendError, BackendKind, Precision};
use rodsweep::lanes::Lanes;
use rodsweep::model::{Batch, Plan, PlanOptions, Quantity, Scene, Solutions, Status, Stepper, Vector};
use rodsweep::reference::solve_rod;
use std::time::Instant;

/// A scene, and what makes it hard.
pub struct Case {
    pub scene: Scene,
    pub why: String,
    pub truth: Truth,
}

/// Where the tip is on the branch from rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Truth {
    /// By independent programs or in closed form [m].
    Tip(Vector),
    /// Where the reference finds it.
    Reference,
    /// The branch ends before the full load.
    Nowhere,
}

/// The truth of a case, found once for all engines.
pub struct Answer {
    /// [m]
    tip: Option<Vector>,
    /// Errors of a residual are amplified so at the tip, where the rod is near a fold or a flip.
    amplification: f64,
}

/// An engine with its method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    pub kind: BackendKind,
    pub precision: Precision,
    pub stepper: Stepper,
}

/// What an engine made of a case.
pub struct Outcome {
    pub status: Status,
    /// Of the tip, against the truth, over the length; no number where there is no truth.
    pub error: f64,
    /// As the engine has it.
    pub estimate: f64,
    /// What the error may be.
    pub limit: f64,
    pub iterations: f64,
    pub load_fraction: f64,
    /// Over the rod; none where the engine chooses them itself.
    pub steps: Option<usize>,
    pub seconds: f64,
    pub verdict: Verdict,
}

#[derive(Clone, Copy, Debug, PartialEq)]
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
/// Error of a tip over the length: what steps and round-off leave in f64, ...
const LIMIT_F64: f64 = 1e-9;
/// ... and in f32: round-off of 6e-8 over some hundred stages.
const LIMIT_F32: f64 = 2e-5;
/// The quickest of so many solves is the time.
const SOLVES: usize = 3;

pub fn cases() -> Vec<Case> {
    let mut cases = golden::golden_cases();
    cases.extend(own::own_cases());
    cases
}

impl Case {
    /// A case for which the reference knows the truth.
    fn new(scene: Scene, why: &str) -> Case {
        Case { scene, why: why.into(), truth: Truth::Reference }
    }

    pub fn name(&self) -> &str {
        &self.scene.name
    }

    pub fn answer(&self) -> Answer {
        let found = solve_rod(&self.scene.rod(), &[]);
        let is_known = found.status.is_success();
        let tip = match self.truth {
            Truth::Tip(tip) => Some(tip),
            Truth::Reference => is_known.then_some(found.p_tip),
            Truth::Nowhere => None,
        };
        Answer { tip, amplification: if is_known { 1.0 / found.margin.min(1.0) } else { 1.0 } }
    }
}

impl Answer {
    fn limit(&self, precision: Precision) -> f64 {
        self.amplification
            * match precision {
                Precision::F64 => LIMIT_F64,
                Precision::F32 => LIMIT_F32,
            }
    }
}

impl Setup {
    pub const REFERENCE: Setup =
        Setup { kind: BackendKind::Reference, precision: Precision::F64, stepper: Stepper::Dop853 };
    pub const CPU_F64: Setup = Setup { kind: BackendKind::Cpu, ..Setup::REFERENCE };
    pub const CPU_F32: Setup = Setup { precision: Precision::F32, ..Setup::CPU_F64 };
    pub const GPU_F32: Setup = Setup { kind: BackendKind::Gpu, stepper: Stepper::Rk4, ..Setup::CPU_F32 };
    pub const GPU_F64: Setup = Setup { kind: BackendKind::Gpu, ..Setup::CPU_F64 };

    pub fn name(&self) -> String {
        match self.kind {
            BackendKind::Reference => "reference".into(),
            kind => format!("{kind} {}", self.precision),
        }
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
            let solutions = Lanes::new(&plan, self.precision)?.solve(&plan.batch(1, |_, _| {}))?;
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

    /// Solves a case and judges the answer.
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

impl Case {
    fn plan(&self) -> Plan {
        Plan::single(&self.scene, &[], PlanOptions::default()).expect("the built-in cases make rods")
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
