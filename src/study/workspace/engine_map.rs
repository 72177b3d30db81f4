//! An engine as a map from inputs to tips: from rest on one plan, near given base moments on another.

use super::error::WorkspaceError;
use super::inputs::WorkspaceInput;
use super::seeds::net_points;
use super::tip_map::{Inputs, MOST_INPUTS, Tip, TipMap, difference, distance, norm};
use crate::backend::{Backend, BackendError};
use crate::engines::{Engine, cpu_f64, second_attempt};
use crate::model::{
    Axis, Batch, ContactColumn, Parameter, Plan, PlanOptions, Quantity, Scene, Solutions, Status, Vector,
};
use crate::spec::SolutionMethod;
use crate::sweep::choose_steps_for;
use rayon::prelude::*;
use std::ops::Range;

/// Samples that choose the number of steps.
const PILOT_SAMPLES: u64 = 64;
const PILOT_SEED: u64 = 0x9170;

/// How equilibria are computed.
#[derive(Clone, Debug)]
pub struct MapOptions {
    /// What solves.
    pub engine: Engine,
    /// Target error of the tip over the rod's length.
    pub tolerance: f64,
    /// Steps over the rod, where the sweep fixes them.
    pub steps: Option<usize>,
}

/// A tip is the one that was known within so many tolerances, and its base moment within a share.
const SAME_TIP: f64 = 4.0;
const SAME_MOMENT: f64 = 0.01;

/// An equilibrium that was found: what it takes to find it again.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// Inputs over half their range.
    pub at: Inputs,
    /// Internal moment at the base (N·m).
    pub base_moment: Vector,
    /// Position of the tip (m).
    pub position: Vector,
}

impl Known {
    /// Whether this is that equilibrium again, its tip off by so much at most (m).
    fn is_found(&self, tip: &Tip, most: f64) -> bool {
        let moment = norm(difference(tip.base_moment, self.base_moment));
        tip.usable && distance(tip.position, self.position) <= most && moment <= SAME_MOMENT * norm(self.base_moment)
    }
}

/// A rod that inputs act on, with an engine.
pub struct EngineMap {
    reader: TipReader,
    plan: Plan,
    rest: Box<dyn Backend>,
    engine: Engine,
    second: Option<Box<dyn Backend>>,
    near: Option<(Plan, Box<dyn Backend>)>,
    /// With derivatives by a force on the tip: from rest, and near given base moments.
    soft: [Option<(Box<dyn Backend>, Plan)>; 2],
    solves: u64,
}

impl EngineMap {
    /// Plans and opens the engine; a pilot chooses the steps where they are not fixed.
    ///
    /// # Errors
    ///
    /// Inputs that the scene does not allow, or an engine that cannot be used.
    pub fn new(scene: &Scene, inputs: &[WorkspaceInput], options: &MapOptions) -> Result<EngineMap, WorkspaceError> {
        let plan = plan(scene, inputs, options)?;
        let plan = match options.steps {
            Some(_) => plan,
            None => {
                let batch = batch(&plan, inputs, &net_points(inputs.len(), PILOT_SAMPLES, PILOT_SEED));
                plan.with_options(choose_steps_for(&plan, &batch, &cpu_f64)?.options(&plan))
            }
        };
        let rest = options.engine.make(&plan)?;
        let mut first = 0;
        let derivatives = inputs
            .iter()
            .map(|input| {
                let of_input = first..first + input.parameters.len();
                first += input.parameters.len();
                of_input
            })
            .collect();
        Ok(EngineMap {
            reader: TipReader { inputs: inputs.to_vec(), derivatives },
            plan,
            rest,
            engine: options.engine.clone(),
            second: None,
            near: None,
            soft: [None, None],
            solves: 0,
        })
    }

    /// What solves, for a person.
    pub fn engine(&self) -> String {
        self.rest.info().to_string()
    }

    /// Engine, precision, stepper, steps and tolerance.
    pub fn method(&self) -> SolutionMethod {
        SolutionMethod::of(&self.rest.info(), &self.plan)
    }

    /// Equilibria computed so far, those of second attempts included.
    pub fn solves(&self) -> u64 {
        self.solves
    }

    /// What is commanded.
    pub fn inputs(&self) -> &[WorkspaceInput] {
        &self.reader.inputs
    }

    /// Equilibria from rest with the derivatives of the tip by a force on it (m/N), row k by force component k.
    ///
    /// # Errors
    ///
    /// An engine that fails.
    pub fn with_compliance(&mut self, inputs: &[Inputs]) -> Result<Vec<(Tip, [Vector; 3])>, WorkspaceError> {
        self.softened(inputs, None)
    }

    /// Equilibria that were found before, with the derivatives of the tip by a force on it. In a field that varies each is found again from
    /// its base moment; what is not found so is solved from rest.
    pub(super) fn with_compliance_again(&mut self, known: &[Known]) -> Result<Vec<(Tip, [Vector; 3])>, WorkspaceError> {
        let inputs: Vec<Inputs> = known.iter().map(|known| known.at).collect();
        let Scene { sources, wall, .. } = &self.plan.scene;
        if !sources.varies() || wall.is_some() {
            return self.softened(&inputs, None);
        }
        let moments: Vec<Vector> = known.iter().map(|known| known.base_moment).collect();
        let mut all = self.softened(&inputs, Some(&moments))?;
        let most = SAME_TIP * self.plan.options.tolerance * self.plan.units.length;
        let left: Vec<usize> = (0..known.len()).filter(|row| !known[*row].is_found(&all[*row].0, most)).collect();
        let inputs: Vec<Inputs> = left.iter().map(|row| inputs[*row]).collect();
        for (row, found) in left.into_iter().zip(self.softened(&inputs, None)?) {
            all[row] = found;
        }
        Ok(all)
    }

    /// Equilibria with the derivatives of the tip by a force on it, from rest or near base moments (N·m).
    fn softened(
        &mut self,
        inputs: &[Inputs],
        moments: Option<&[Vector]>,
    ) -> Result<Vec<(Tip, [Vector; 3])>, WorkspaceError> {
        let soft = &mut self.soft[usize::from(moments.is_some())];
        if soft.is_none() {
            let of_inputs = self.plan.derivatives.iter().map(|derivative| derivative.parameter);
            let wrt: Vec<Parameter> = of_inputs.chain(Axis::ALL.map(Parameter::TipForce)).collect();
            let plan = Plan::new(&self.plan.scene, &self.plan.axes, &wrt, self.plan.options)?;
            let plan = if moments.is_some() { plan.with_lone_starts() } else { plan };
            *soft = Some((self.engine.make(&plan)?, plan));
        }
        let Some((backend, plan)) = soft else { return Ok(Vec::new()) };
        let (first, at_once) = (self.plan.derivatives.len(), backend.batch_size().max(1));
        let mut all = Vec::with_capacity(inputs.len());
        for (chunk, rows) in inputs.chunks(at_once).enumerate() {
            let mut batch = batch(plan, &self.reader.inputs, rows);
            for (row, moment) in moments.unwrap_or_default().iter().skip(chunk * at_once).take(rows.len()).enumerate() {
                plan.set_lone_start(&mut batch, row, *moment);
            }
            let solutions = backend.solve(&batch)?;
            self.solves += rows.len() as u64;
            let tips = self.reader.tips(plan, &solutions);
            let rates = |row: usize| match solutions.status(row).is_success() {
                true => std::array::from_fn(|force| {
                    std::array::from_fn(|axis| solutions.derivative(row, first + force, axis))
                }),
                false => [[f64::NAN; 3]; 3],
            };
            all.extend(tips.into_iter().enumerate().map(|(row, tip)| (tip, rates(row))));
        }
        Ok(all)
    }

    /// Second attempts at what found no equilibrium, as a run makes them.
    fn try_again(&mut self, rows: &[Inputs], solutions: &mut Solutions) -> Result<(), BackendError> {
        let failed = |row: &usize| {
            matches!(solutions.status(*row), Status::StepLimit | Status::NotConverged | Status::NonFinite)
        };
        let failed: Vec<usize> = (0..rows.len()).filter(failed).collect();
        if failed.is_empty() {
            return Ok(());
        }
        if self.second.is_none() {
            self.second = Some(second_attempt(&self.plan)?);
        }
        let Some(second) = &mut self.second else { return Ok(()) };
        let again: Vec<Inputs> = failed.iter().map(|row| rows[*row]).collect();
        let found = second.solve(&batch(&self.plan, &self.reader.inputs, &again))?;
        self.solves += again.len() as u64;
        for (from, to) in failed.into_iter().enumerate() {
            solutions.copy_row(to, &found, from);
        }
        Ok(())
    }
}

impl EngineMap {
    /// Derivatives of position (m) and rotation (rad) by each input over half its range, of equilibria from rest.
    ///
    /// # Errors
    ///
    /// An engine that fails.
    pub fn pose_jacobians(&mut self, inputs: &[Inputs]) -> Result<Vec<Option<Vec<[f64; 6]>>>, WorkspaceError> {
        let mut all = Vec::with_capacity(inputs.len());
        for rows in inputs.chunks(self.rest.batch_size().max(1)) {
            let solutions = self.rest.solve(&batch(&self.plan, &self.reader.inputs, rows))?;
            self.solves += rows.len() as u64;
            let columns = |row: usize| {
                let of = |(input, derivatives): (&WorkspaceInput, &Range<usize>)| {
                    std::array::from_fn(|k| {
                        let parts = derivatives.clone().zip(&input.rates);
                        let sum: f64 = parts.map(|(at, rate)| rate * solutions.derivative(row, at, k)).sum();
                        sum * input.half_range()
                    })
                };
                self.reader.inputs.iter().zip(&self.reader.derivatives).map(of).collect()
            };
            all.extend((0..rows.len()).map(|row| solutions.status(row).is_success().then(|| columns(row))));
        }
        Ok(all)
    }
}

/// What a row of solutions says of a tip.
struct TipReader {
    inputs: Vec<WorkspaceInput>,
    /// Derivatives of the plan that belong to each input.
    derivatives: Vec<Range<usize>>,
}

impl TipReader {
    fn tips(&self, plan: &Plan, solutions: &Solutions) -> Vec<Tip> {
        (0..solutions.sample_count())
            .into_par_iter()
            .with_min_len(64)
            .map(|row| self.tip(plan, solutions, row))
            .collect()
    }

    fn tip(&self, plan: &Plan, solutions: &Solutions, row: usize) -> Tip {
        if !solutions.status(row).is_success() {
            return Tip::NONE;
        }
        let mut tip = Tip {
            usable: true,
            position: solutions.vector(row, Quantity::TipPosition),
            tangent: solutions.vector(row, Quantity::TipTangent),
            margin: solutions.get(row, Quantity::StabilityMargin),
            base_moment: solutions.vector(row, Quantity::BaseMoment),
            normal_force: solutions.contact(row, ContactColumn::NormalForce),
            ..Tip::NONE
        };
        for (k, (input, derivatives)) in self.inputs.iter().zip(&self.derivatives).enumerate() {
            let rate = |row_of: usize| {
                let parts = derivatives.clone().zip(&input.rates);
                let sum: f64 = parts.map(|(at, rate)| rate * solutions.derivative(row, at, row_of)).sum();
                sum * input.half_range()
            };
            tip.jacobian[k] = std::array::from_fn(rate);
            if plan.options.base_moment_rows {
                tip.moment_rates[k] = std::array::from_fn(|axis| rate(6 + axis));
            }
        }
        tip
    }
}

impl TipMap for EngineMap {
    fn input_count(&self) -> usize {
        self.reader.inputs.len()
    }

    fn solve_from_rest(&mut self, inputs: &[Inputs]) -> Result<Vec<Tip>, BackendError> {
        let mut tips = Vec::with_capacity(inputs.len());
        for rows in inputs.chunks(self.rest.batch_size().max(1)) {
            let mut solutions = self.rest.solve(&batch(&self.plan, &self.reader.inputs, rows))?;
            self.solves += rows.len() as u64;
            self.try_again(rows, &mut solutions)?;
            tips.append(&mut self.reader.tips(&self.plan, &solutions));
        }
        Ok(tips)
    }

    fn near(&mut self, inputs: &[(Inputs, Vector)]) -> Result<Vec<Tip>, BackendError> {
        if self.near.is_none() {
            let options = PlanOptions { base_moment_rows: true, ..self.plan.options };
            let plan = self.plan.with_options(options).with_lone_starts();
            let backend = self.engine.make(&plan)?;
            self.near = Some((plan, backend));
        }
        let Some((plan, mut backend)) = self.near.take() else { return Ok(Vec::new()) };
        let mut tips = Vec::with_capacity(inputs.len());
        for rows in inputs.chunks(backend.batch_size().max(1)) {
            let values: Vec<Inputs> = rows.iter().map(|(inputs, _)| *inputs).collect();
            let mut batch = batch(&plan, &self.reader.inputs, &values);
            rows.iter().enumerate().for_each(|(row, (_, m0))| plan.set_lone_start(&mut batch, row, *m0));
            let solutions = backend.solve(&batch)?;
            self.solves += rows.len() as u64;
            tips.append(&mut self.reader.tips(&plan, &solutions));
        }
        self.near = Some((plan, backend));
        Ok(tips)
    }
}

fn plan(scene: &Scene, inputs: &[WorkspaceInput], options: &MapOptions) -> Result<Plan, WorkspaceError> {
    // One axis for each parameter: an input may give several of them different values.
    let wrt: Vec<Parameter> = inputs.iter().flat_map(|input| input.parameters.iter().copied()).collect();
    let axes: Vec<Vec<Parameter>> = wrt.iter().map(|parameter| vec![*parameter]).collect();
    let usual = PlanOptions::default();
    let plan = Plan::new(
        scene,
        &axes,
        &wrt,
        PlanOptions {
            tolerance: options.engine.tolerance(options.tolerance),
            stepper: options.engine.steppers()[0],
            steps: options.steps.unwrap_or(usual.steps),
            base_moment_rows: false,
            ..usual
        },
    )?;
    Ok(plan)
}

fn batch(plan: &Plan, inputs: &[WorkspaceInput], rows: &[Inputs]) -> Batch {
    plan.batch(rows.len(), |row, values| {
        let row = rows.get(row).copied().unwrap_or([0.0; MOST_INPUTS]);
        let each = inputs.iter().zip(row).flat_map(|(input, t)| {
            let value = input.value(t);
            input.rates.iter().map(move |rate| rate * value)
        });
        values.iter_mut().zip(each).for_each(|(to, value)| *to = value);
    })
}
