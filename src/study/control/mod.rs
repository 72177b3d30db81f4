//! Which inputs bring the tip to where it should be: along a trajectory, or to many targets at once.
//!
//! Every equilibrium comes from an engine: from rest for the first point, then continued from the last base moment. A
//! step is taken only to a stable equilibrium close to the one that the derivatives predict.

mod descent;
mod engines;
mod least_squares;
mod targets;
mod trajectory;
mod window;

pub use targets::TargetOptions;

use super::MakeEngine;
use crate::backend::{Backend, BackendError, Precision};
use crate::model::{Parameter, Plan, PlanError, PlanOptions, Quantity, Scene, SegmentParameter, Stepper, Vector};
use descent::{Descent, State};
use engines::{SHARE, STEPS, Search};
use least_squares::{Inputs, norm2};
use std::sync::Arc;

/// Most inputs of one controller: three coil sets and insertion.
pub const MOST_INPUTS: usize = 10;
/// Tips nearer than this, over the rod's length, are one equilibrium.
const SAME: f64 = 1e-6;
const SAME_F32: f64 = 1e-4;
/// Noise of a tip in f32 over the rod's length.
const NOISE_F32: f64 = 4e-6;

/// A parameter that is commanded, within limits (SI).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlInput {
    pub parameter: Parameter,
    pub low: f64,
    pub high: f64,
}

/// Where the tip should be [m], and along what unit vector its tangent should point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Target {
    pub position: Vector,
    pub tangent: Option<Vector>,
}

/// What becomes of inputs that the tip does not need.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Redundancy {
    /// They change as little as possible, as in the paper.
    #[default]
    LeastChange,
    /// Currents relax towards zero.
    LeastCurrent,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlOptions {
    /// Coordinates of the tip that are controlled; the others are free.
    pub coordinates: [bool; 3],
    /// Length by which a tangent's error counts [m].
    pub tangent_weight: f64,
    /// A target is reached where this is left of it [m].
    pub tolerance: f64,
    /// Equilibria for one target.
    pub most_iterations: usize,
    pub redundancy: Redundancy,
}

impl Default for ControlOptions {
    fn default() -> Self {
        Self {
            coordinates: [true; 3],
            tangent_weight: 0.01,
            tolerance: 1e-8,
            most_iterations: 200,
            redundancy: Redundancy::LeastChange,
        }
    }
}

/// How the search for one target ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Outcome {
    Reached,
    /// The nearest point within the limits of the inputs.
    AtLimit,
    /// The nearest point that the tip can go to; no limit is in the way.
    Unreachable,
    /// Every step, however short, leads away, or to no stable equilibrium nearby.
    Stuck,
    IterationLimit,
}

impl Outcome {
    pub const ALL: [Outcome; 5] =
        [Outcome::Reached, Outcome::AtLimit, Outcome::Unreachable, Outcome::Stuck, Outcome::IterationLimit];

    /// The word written to files.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Reached => "reached",
            Outcome::AtLimit => "at-limit",
            Outcome::Unreachable => "unreachable",
            Outcome::Stuck => "stuck",
            Outcome::IterationLimit => "iteration-limit",
        }
    }
}

/// What came of one target; SI.
#[derive(Clone, Debug, PartialEq)]
pub struct Controlled {
    pub target: Target,
    /// Values of the inputs.
    pub inputs: Vec<f64>,
    pub tip: Vector,
    pub tangent: Vector,
    /// What is left: controlled coordinates, and the tangent times its weight [m].
    pub residual: f64,
    pub outcome: Outcome,
    /// Equilibria with Jacobian that it took.
    pub iterations: usize,
    pub margin: f64,
    pub error_estimate: f64,
    /// Internal moment at the base [N·m].
    pub base_moment: Vector,
    /// Whether the loads, raised together from zero, lead to this equilibrium.
    pub from_rest: bool,
    /// Wall time of the search; of its share in a batch [s].
    pub seconds: f64,
}

#[derive(Debug, thiserror::Error)]
pub enum ControlError {
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error(transparent)]
    Backend(#[from] BackendError),
    #[error("{0} inputs; at least 1 and at most {MOST_INPUTS} are possible: name the ones to control with")]
    InputCount(usize),
    #[error("`{name}` may lie between {low} and {high}: give a lower and a higher limit")]
    Limits { name: String, low: f64, high: f64 },
    #[error(
        "no stable equilibrium is reached from rest with the first inputs ({status}); change the limits or the scene"
    )]
    NoStart { status: &'static str },
    #[error("none of {0} inputs within the limits gives a stable equilibrium: change the limits or the scene")]
    NoTable(usize),
}

/// What is commanded, and what for.
#[derive(Clone, Debug)]
struct Task {
    inputs: Vec<ControlInput>,
    options: ControlOptions,
    /// Of moments [N·m]
    unit: f64,
    /// Of the rod [m]
    length: f64,
    /// The scene's own values, held within the limits; scaled.
    home: Inputs,
}

/// A rod with its inputs, ready to be controlled.
pub struct Control {
    task: Arc<Task>,
    /// From rest; its axes are the inputs, its derivatives by them.
    pub plan: Plan,
    rest: Box<dyn Backend>,
    /// At growing resolutions, the last that of the plan.
    searches: Vec<Search>,
    /// The one in use.
    resolution: usize,
    precision: Precision,
}

impl Control {
    /// Prepares engines, at the lowest resolution whose error is small beside the tolerance.
    pub fn new(
        scene: &Scene,
        inputs: &[ControlInput],
        options: ControlOptions,
        stepper: Stepper,
        make: &mut MakeEngine,
    ) -> Result<Control, ControlError> {
        if inputs.is_empty() || inputs.len() > MOST_INPUTS {
            return Err(ControlError::InputCount(inputs.len()));
        }
        for ControlInput { parameter, low, high } in inputs {
            if !(low < high && low.is_finite() && high.is_finite()) {
                return Err(ControlError::Limits { name: parameter.name(scene), low: *low, high: *high });
            }
        }
        let axes: Vec<Vec<Parameter>> = inputs.iter().map(|input| vec![input.parameter]).collect();
        let wrt: Vec<Parameter> = inputs.iter().map(|input| input.parameter).collect();
        let tolerance = SHARE * options.tolerance / scene.total_length();
        let plan_options = PlanOptions { tolerance, stepper, steps: STEPS[0], ..PlanOptions::default() };
        let plan = Plan::new(scene, &axes, &wrt, plan_options)?;
        let mut home = [0.0; MOST_INPUTS];
        for (z, input) in home.iter_mut().zip(inputs) {
            *z = input.parameter.get(scene).clamp(input.low, input.high) / (0.5 * (input.high - input.low));
        }
        let mut control = Control {
            task: Arc::new(Task {
                inputs: inputs.to_vec(),
                options,
                unit: plan.units.moment(),
                length: scene.total_length(),
                home,
            }),
            rest: make(&plan)?,
            searches: Vec::new(),
            resolution: 0,
            plan,
            precision: Precision::F64,
        };
        control.precision = control.rest.info().precision;
        if control.precision == Precision::F32 {
            Arc::make_mut(&mut control.task).options.tolerance =
                options.tolerance.max(NOISE_F32 * scene.total_length());
        }
        control.refine(make)?;
        Ok(control)
    }

    /// The engine that solves.
    pub fn engine(&self) -> String {
        self.searches[self.resolution].engine.info().to_string()
    }

    /// What is commanded, within which limits.
    pub fn inputs(&self) -> &[ControlInput] {
        &self.task.inputs
    }

    /// The options in force: f32 reaches no tolerance below its noise.
    pub fn options(&self) -> &ControlOptions {
        &self.task.options
    }

    fn same(&self) -> f64 {
        let share = if self.precision == Precision::F32 { SAME_F32 } else { SAME };
        share * self.plan.scene.total_length()
    }

    /// What came of ended searches; asks where the equilibria from rest with the same inputs are.
    fn results(&mut self, ended: &[Descent]) -> Result<Vec<Controlled>, ControlError> {
        let rows: Vec<Inputs> = ended.iter().map(|descent| descent.at.z).collect();
        let solutions = self.solve_from_rest(&rows)?;
        let result = |(row, descent): (usize, &Descent)| {
            let at = &descent.at;
            let tip = solutions.vector(row, Quantity::TipPosition);
            let apart: [f64; 3] = std::array::from_fn(|a| tip[a] - at.tip[a]);
            Controlled {
                target: descent.target,
                inputs: (0..self.task.inputs.len()).map(|k| self.task.value(k, at.z[k])).collect(),
                tip: at.tip,
                tangent: at.tangent,
                residual: norm2(&at.missing(&self.task, &descent.target)).sqrt(),
                outcome: descent.outcome.unwrap_or(Outcome::IterationLimit),
                iterations: descent.iterations,
                margin: at.margin,
                error_estimate: at.error_estimate,
                base_moment: at.m0,
                from_rest: solutions.status(row).is_success() && norm2(&apart).sqrt() < self.same(),
                seconds: 0.0,
            }
        };
        Ok(ended.iter().enumerate().map(result).collect())
    }

    /// A state from rest at some inputs.
    fn start(&mut self, z: Inputs) -> Result<State, ControlError> {
        let solutions = self.solve_from_rest(&[z])?;
        match solutions.status(0) {
            status if status.is_success() => Ok(State::new(&self.task, z, &solutions, 0)),
            status => Err(ControlError::NoStart { status: status.name() }),
        }
    }
}

impl Task {
    /// Half the range of an input.
    fn scale(&self, k: usize) -> f64 {
        0.5 * (self.inputs[k].high - self.inputs[k].low)
    }

    fn low(&self, k: usize) -> f64 {
        self.inputs[k].low / self.scale(k)
    }

    fn high(&self, k: usize) -> f64 {
        self.inputs[k].high / self.scale(k)
    }

    fn is_current(&self, k: usize) -> bool {
        matches!(self.inputs[k].parameter, Parameter::Segment(_, SegmentParameter::Current(_)))
    }

    /// The value of a scaled input, exactly on its limit where it is there.
    fn value(&self, k: usize, z: f64) -> f64 {
        (z * self.scale(k)).clamp(self.inputs[k].low, self.inputs[k].high)
    }

    /// Point k of a sequence that fills the permitted inputs evenly (Roberts' generalised golden ratio); scaled.
    fn lattice(&self, k: usize) -> Inputs {
        let count = self.inputs.len();
        let ratio = (0..60).fold(2.0f64, |x, _| (1.0 + x).powf(1.0 / (count + 1) as f64));
        std::array::from_fn(|axis| {
            if axis >= count {
                return 0.0;
            }
            let share = (0.5 + (k + 1) as f64 * ratio.powi(-(axis as i32 + 1))).fract();
            self.low(axis) + share * (self.high(axis) - self.low(axis))
        })
    }
}
