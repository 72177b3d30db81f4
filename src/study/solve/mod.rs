//! One scene, one call: the equilibrium on the branch from rest, its Jacobian, its shape, its other equilibria.

mod branches;
mod breaking;
mod error;
mod explain;
mod fold;
mod jacobian;
mod json;
mod shape;
mod solved;
mod text;

pub use branches::{AllBranches, FoundBranch};
pub use error::SolveError;
pub use explain::{Explanation, PlannedPass, PlannedPiece};
pub use fold::FoldLoad;
pub use jacobian::{Jacobian, Rows};
pub use shape::{Shape, along_segments, evenly_spaced, smooth_count};
pub use solved::Solved;

pub(in crate::study) use json::contact as contact_json;

use crate::backend::{BackendKind, Precision};
use crate::engines::{Engine, EngineRequest, cpu_f64, for_second_path, second_attempt, witness};
use crate::model::{
    Axis, Batch, DerivativeScale, Parameter, Plan, PlanOptions, Quantity, Scene, SegmentKind, SegmentParameter,
    Solutions, Status,
};
use crate::sweep::{Decision, decide, estimates_from, is_same_end};

/// Target error unless another is asked for.
const TOLERANCE: f64 = 1e-9;
/// Steps that are tried until the error estimate meets the tolerance.
const STEPS: [usize; 5] = [8, 16, 32, 64, 128];

/// Solves one scene: how precisely, on which engine, differentiated by what.
///
/// # Example
///
/// ```
/// use rodsweep::{input, study::Solve};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # std::env::set_current_dir(env!("CARGO_MANIFEST_DIR"))?;
/// let mut scene = input::read_scene("sweeps/scenes/tip_coil.toml".as_ref())?;
/// input::assign(&mut scene, &["coil.current.x=100 mA"])?;
/// let solved = Solve::new(scene).wrt(&["coil.current", "insertion"]).run()?;
/// println!("tip at {:?} m", solved.tip_position());
/// let jacobian = solved.jacobian();
/// for (k, name) in jacobian.names().iter().enumerate() {
///     let column = jacobian.position().map(|row| row[k]);
///     println!("by {name}: {column:?} m/{}", jacobian.units()[k]);
/// }
/// # assert!(solved.is_equilibrium() && solved.is_stable());
/// # assert_eq!(jacobian.names().last().map(String::as_str), Some("insertion"));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Solve {
    scene: Scene,
    /// Names of what to differentiate by.
    wrt: Option<Vec<String>>,
    tolerance: f64,
    engine: EngineRequest,
}

impl Solve {
    /// A scene, to be solved to a tolerance of 1e-9 on the CPU, differentiated by every current, by the insertion and
    /// by the tip force: by what a robot can move and what may push it.
    pub fn new(scene: Scene) -> Solve {
        Solve { scene, wrt: None, tolerance: TOLERANCE, engine: EngineRequest::any() }
    }

    /// Differentiates by these parameters, in this order; a group such as `coil.current` stands for its components.
    pub fn wrt(self, names: &[impl AsRef<str>]) -> Solve {
        Solve { wrt: Some(names.iter().map(|name| name.as_ref().to_owned()).collect()), ..self }
    }

    /// Asks for no derivatives.
    pub fn without_derivatives(self) -> Solve {
        Solve { wrt: Some(Vec::new()), ..self }
    }

    /// Target error of tip position over rod length and of tip rotation (rad), between 0 and 1.
    pub fn tolerance(self, tolerance: f64) -> Solve {
        Solve { tolerance, ..self }
    }

    /// The engine; the CPU in f64 unless another is asked for.
    pub fn engine(self, engine: EngineRequest) -> Solve {
        Solve { engine, ..self }
    }

    /// Solves. A rod that finds no equilibrium is no error: see [`Solved::status`].
    ///
    /// Steps are doubled until the error estimate meets the tolerance; the best attempt counts.
    ///
    /// # Errors
    ///
    /// A tolerance or a name that means nothing, a scene that makes no rod, an engine that cannot be used.
    pub fn run(&self) -> Result<Solved, SolveError> {
        check_tolerance(self.tolerance)?;
        let wrt = match &self.wrt {
            Some(names) => parse_parameters(&self.scene, names)?,
            None => default_parameters(&self.scene),
        };
        let engine = self.engine.choose_for_one(&self.scene, self.tolerance)?;
        let tolerance = engine.tolerance(self.tolerance);
        let options = PlanOptions {
            tolerance,
            stepper: engine.steppers()[0],
            steps: STEPS[0],
            derivative_scale: DerivativeScale::BARE,
            fold_rows: (engine.kind(), engine.precision()) == (BackendKind::Cpu, Precision::F64),
            ..PlanOptions::default()
        };
        let plan = Plan::single(&self.scene, &wrt, options)?;
        let batch = plan.batch(1, |_, _| {});
        let mut attempt = Attempt::refined(&plan, &batch, &engine)?;
        if engine.kind() == BackendKind::Gpu {
            attempt.repeat_on_gpu(&batch, &engine)?;
        }
        attempt.ask_the_reference(&batch, &engine)?;
        attempt.compare_with_finer(&batch, &engine)?;
        let Attempt { plan, solutions, solved_by } = attempt;
        Ok(Solved::new(plan, batch, solutions, engine, solved_by))
    }
}

/// Refuses a target error that no solution could have or that all have, before anything is read or solved.
///
/// # Errors
///
/// [`SolveError::Tolerance`] unless it lies between 0 and 1.
pub fn check_tolerance(tolerance: f64) -> Result<(), SolveError> {
    if tolerance > 0.0 && tolerance < 1.0 { Ok(()) } else { Err(SolveError::Tolerance { tolerance }) }
}

fn parse_parameters(scene: &Scene, names: &[String]) -> Result<Vec<Parameter>, SolveError> {
    let mut parameters = Vec::new();
    for name in names.iter().map(|name| name.trim()).filter(|name| !name.is_empty()) {
        parameters.extend(Parameter::parse(scene, name).map_err(SolveError::Derivative)?);
    }
    Ok(parameters)
}

/// Every current, insertion and tip force.
fn default_parameters(scene: &Scene) -> Vec<Parameter> {
    let is_current = |p: &Parameter| matches!(p, Parameter::Segment(_, SegmentParameter::Current(_)));
    let mut parameters: Vec<Parameter> = Parameter::all(scene).into_iter().filter(is_current).collect();
    if scene.segments.first().is_some_and(|first| matches!(first.kind, SegmentKind::Flexible(_))) {
        parameters.push(Parameter::Insertion);
    }
    parameters.extend(Axis::ALL.map(Parameter::TipForce));
    parameters
}

/// The answer of an engine at one resolution.
struct Attempt {
    plan: Plan,
    solutions: Solutions,
    /// The engine, in words.
    solved_by: String,
}

impl Attempt {
    /// Doubles the steps until the tolerance is met.
    fn refined(plan: &Plan, batch: &Batch, engine: &Engine) -> Result<Attempt, SolveError> {
        let mut best = Attempt::at(plan, batch, engine, STEPS[0])?;
        let mut is_met = best.meets_its_tolerance();
        for steps in &STEPS[1..] {
            // The reference chooses its steps itself.
            if is_met || engine.kind() == BackendKind::Reference {
                break;
            }
            let next = Attempt::at(plan, batch, engine, *steps)?;
            is_met = next.meets_its_tolerance();
            if !(best.is_success() && best.error_estimate() < next.error_estimate()) {
                best = next;
            }
        }
        Ok(best)
    }

    fn at(plan: &Plan, batch: &Batch, engine: &Engine, steps: usize) -> Result<Attempt, SolveError> {
        let plan = plan.with_options(PlanOptions { steps, ..plan.options });
        // A GPU would have to compile a kernel for each number of steps.
        let mut backend = if engine.kind() == BackendKind::Gpu { cpu_f64(&plan)? } else { engine.make(&plan)? };
        let solutions = backend.solve(batch)?;
        Ok(Attempt { solved_by: backend.info().to_string(), plan, solutions })
    }

    fn repeat_on_gpu(&mut self, batch: &Batch, engine: &Engine) -> Result<(), SolveError> {
        let mut backend = engine.make(&self.plan)?;
        self.solutions = backend.solve(batch)?;
        self.solved_by = backend.info().to_string();
        if !self.is_success() {
            self.solutions = second_attempt(&self.plan)?.solve(batch)?;
            self.solved_by = "cpu f64, after the GPU failed".into();
        }
        Ok(())
    }

    /// Follows the path from rest a second time, by other steps. Where its end differs, and where the engine's own does not reach the
    /// load, the reference decides.
    fn ask_the_reference(&mut self, batch: &Batch, engine: &Engine) -> Result<(), SolveError> {
        if engine.kind() == BackendKind::Reference || self.plan.start.is_some() {
            return Ok(());
        }
        use Status::{Fold, NotConverged, StepLimit, Unstable};
        let is_lost = matches!(self.solutions.status(0), Fold | StepLimit | NotConverged | Unstable);
        let is_elsewhere = || -> Result<bool, SolveError> {
            let again = cpu_f64(&for_second_path(&self.plan))?.solve(batch)?;
            Ok(!is_same_end(&self.plan, (&self.solutions, 0), (&again, 0)))
        };
        if !(is_lost || self.is_success() && is_elsewhere()?) {
            return Ok(());
        }
        let truth = witness(&self.plan).solve(batch)?;
        let decision = decide(&self.plan, (&mut self.solutions, 0), (&truth, 0));
        if decision != Decision::Kept {
            self.solved_by = match decision {
                Decision::Undecided => {
                    "two paths that do not end alike, between which the reference cannot decide".into()
                }
                _ => "reference f64, as the engine's paths did not end alike".into(),
            };
        }
        Ok(())
    }

    /// Compares the tip and its derivatives with those on twice the steps.
    fn compare_with_finer(&mut self, batch: &Batch, engine: &Engine) -> Result<(), SolveError> {
        let is_reference = engine.kind() == BackendKind::Reference || self.solved_by.starts_with("reference");
        if is_reference || !self.is_success() {
            return Ok(());
        }
        let fine = PlanOptions { refinement: 2, ..self.plan.options };
        let fine = cpu_f64(&self.plan.with_options(fine))?.solve(batch)?;
        let found = estimates_from(&self.plan, batch, (&self.solutions, &fine));
        let (tip, columns) = found.unwrap_or((0.0, 1.0));
        let mut raise = |quantity, to: f64| {
            let bare = self.solutions.get(0, quantity);
            self.solutions.set(0, quantity, to.max(bare));
        };
        raise(Quantity::ErrorEstimate, tip);
        if !self.plan.derivatives.is_empty() {
            raise(Quantity::DerivativeError, columns);
        }
        Ok(())
    }

    fn is_success(&self) -> bool {
        self.solutions.status(0).is_success()
    }

    fn error_estimate(&self) -> f64 {
        self.solutions.get(0, Quantity::ErrorEstimate)
    }

    fn meets_its_tolerance(&self) -> bool {
        self.is_success() && self.error_estimate() <= self.plan.options.tolerance
    }
}
