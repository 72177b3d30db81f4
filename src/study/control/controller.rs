//! A rod with its inputs and the engines that solve it.

use super::descent::{Ended, State};
use super::engines::{Engines, SHARE, STEPS};
use super::inputs::{Inputs, MOST_INPUTS};
use super::least_squares::norm2;
use super::task::Task;
use super::{ControlError, ControlOptions, Outcome, TargetResult};
use crate::backend::Precision;
use crate::model::{Parameter, Plan, PlanOptions, Quantity, Scene, Stepper};
use crate::spec::ControlInput;
use crate::study::MakeEngine;
use std::sync::Arc;

/// Tips nearer than this, over the rod's length, are one equilibrium.
const SAME: f64 = 1e-6;
const SAME_F32: f64 = 1e-4;
/// Targets that are worked on at a time, so that memory does not grow with their number but by what each result holds.
pub(super) const GROUP: usize = 8192;
/// Noise of a tip in f32 over the rod's length.
const NOISE_F32: f64 = 4e-6;

/// A rod with its inputs, ready to be controlled.
pub struct Controller {
    pub(super) task: Arc<Task>,
    pub(super) engines: Engines,
    /// Where searches begin: at first the scene's own values; scaled.
    pub(super) home: Inputs,
    /// Starts that were tabled last, and how many were asked for.
    pub(super) tabled: Option<(usize, Arc<Vec<State>>)>,
}

impl Controller {
    /// Prepares engines, at the lowest resolution whose error is small beside the tolerance.
    ///
    /// # Errors
    ///
    /// Inputs, limits or a tolerance that make no sense, a scene that makes no plan, or an engine that cannot be used.
    pub fn new(
        scene: &Scene,
        inputs: &[ControlInput],
        options: ControlOptions,
        stepper: Stepper,
        make: &mut MakeEngine,
    ) -> Result<Controller, ControlError> {
        if inputs.is_empty() || inputs.len() > MOST_INPUTS {
            return Err(ControlError::InputCount(inputs.len()));
        }
        for ControlInput { parameter, low, high } in inputs {
            if !(low < high && low.is_finite() && high.is_finite()) {
                return Err(ControlError::Limits { name: parameter.name(scene), low: *low, high: *high });
            }
        }
        if options.tolerance.is_nan() || options.tolerance <= 0.0 {
            return Err(ControlError::Tolerance(options.tolerance));
        }
        let axes: Vec<Vec<Parameter>> = inputs.iter().map(|input| vec![input.parameter]).collect();
        let wrt: Vec<Parameter> = inputs.iter().map(|input| input.parameter).collect();
        let tolerance = SHARE * options.tolerance / scene.total_length();
        let plan_options = PlanOptions { tolerance, stepper, steps: STEPS[0], ..PlanOptions::default() };
        let plan = Plan::new(scene, &axes, &wrt, plan_options)?;
        let rest = make(&plan)?;
        let length = scene.total_length();
        let tolerance = match rest.info().precision {
            Precision::F32 => options.tolerance.max(NOISE_F32 * length),
            Precision::F64 => options.tolerance,
        };
        let options = options.with_tolerance(tolerance);
        let task = Arc::new(Task {
            inputs: inputs.to_vec(),
            options,
            unit: plan.units.moment(),
            length,
            wall: scene.wall,
            // L³ / 3 EI of a straight rod that is pushed aside.
            yielding: plan.units.length / (3.0 * plan.units.force),
        });
        let own: Vec<f64> = inputs.iter().map(|input| input.parameter.get(scene)).collect();
        let home = task.scaled(&own);
        let engines = Engines::refined(Arc::clone(&task), plan, rest, make)?;
        Ok(Controller { engines, task, home, tabled: None })
    }

    /// Makes trajectories quick and thorough: an engine for single searches, where that for many leaves most of itself
    /// idle; engines of fewer steps, for rods that bend less than the limits permit; one of more, where points are missed.
    ///
    /// # Errors
    ///
    /// An engine that cannot be used.
    pub fn for_trajectories(
        mut self,
        many: &mut MakeEngine,
        single: &mut MakeEngine,
    ) -> Result<Controller, ControlError> {
        self.engines.add_for_trajectories(many, single)?;
        Ok(self)
    }

    /// Makes targets thorough: an engine of more steps, for those that are missed by little.
    ///
    /// # Errors
    ///
    /// An engine that cannot be used.
    pub fn for_targets(mut self, make: &mut MakeEngine) -> Result<Controller, ControlError> {
        self.engines.add_for_targets(make)?;
        Ok(self)
    }

    /// Searches begin at other values of the inputs, in their order, held within the limits.
    pub fn begin_at(&mut self, values: &[f64]) {
        self.home = self.task.scaled(values);
    }

    /// The plan from rest: its axes are the inputs, its derivatives are by them.
    pub fn plan(&self) -> &Plan {
        &self.engines.plan
    }

    /// The engine that solves, for a person.
    pub fn engine(&self) -> String {
        self.engines.name()
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
        let share = if self.engines.precision == Precision::F32 { SAME_F32 } else { SAME };
        share * self.task.length
    }

    /// Results of ended searches; asks where the equilibria from rest with the same inputs are.
    pub(super) fn results(&mut self, ended: &[Ended]) -> Result<Vec<TargetResult>, ControlError> {
        let mut results = Vec::with_capacity(ended.len());
        for group in ended.chunks(GROUP) {
            let rows: Vec<Inputs> = group.iter().map(|ended| ended.z).collect();
            let solutions = self.engines.solve_from_rest(&rows)?;
            results.extend(group.iter().enumerate().map(|(row, ended)| {
                let tip = solutions.vector(row, Quantity::TipPosition);
                // The tip may be off by more than the tolerance.
                let error = ended.error(&self.task);
                let is_rough = error.is_nan() || error * self.task.length > self.task.options.tolerance;
                let is_single = self.engines.precision == Precision::F32;
                let outcome = match ended.outcome {
                    Outcome::Reached if is_rough && !is_single => Outcome::Inaccurate,
                    outcome => outcome,
                };
                let apart: [f64; 3] = std::array::from_fn(|a| tip[a] - ended.tip[a]);
                TargetResult {
                    target: ended.target,
                    inputs: (0..self.task.inputs.len()).map(|k| self.task.value(k, ended.z[k])).collect(),
                    tip: ended.tip,
                    tangent: ended.tangent,
                    residual: ended.residual,
                    outcome,
                    iterations: ended.iterations,
                    margin: ended.margin,
                    error_estimate: ended.error_estimate,
                    base_moment: ended.m0,
                    contact: ended.contact,
                    from_rest: solutions.status(row).is_success() && norm2(&apart).sqrt() < self.same(),
                    seconds: 0.0,
                }
            }));
        }
        Ok(results)
    }

    /// A state from rest at some inputs.
    pub(super) fn start(&mut self, z: Inputs) -> Result<State, ControlError> {
        let solutions = self.engines.solve_from_rest(&[z])?;
        let status = solutions.status(0);
        if status.is_success() {
            return Ok(State::new(&self.task, z, &solutions, 0));
        }
        let truth = self.engines.by_the_reference(&z)?;
        if truth.status(0).is_success() {
            return Ok(State::new(&self.task, z, &truth, 0));
        }
        Err(ControlError::NoStart { status: status.name() })
    }
}
