//! An engine as a map from inputs to tips: from rest on one plan, near given loads at the base on another.

use super::error::WorkspaceError;
use super::inputs::WorkspaceInput;
use super::seeds::net_points;
use super::tip_map::{BaseLoad, Inputs, MOST_INPUTS, Tip, TipMap, difference, distance, norm};
use crate::backend::{Backend, BackendError, BackendKind, Precision};
use crate::engines::{Engine, can_answer_again, cpu_f64, second_attempt};
use crate::model::{
    Axis, Batch, ContactColumn, Parameter, Plan, PlanOptions, Quantity, Scene, Solutions, Start, Status, Vector,
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
    /// Load at the base.
    pub base: BaseLoad,
    /// Position of the tip (m).
    pub position: Vector,
}

impl Known {
    /// Whether this is that equilibrium again, its tip off by so much at most (m).
    fn is_found(&self, tip: &Tip, most: f64) -> bool {
        let moment = norm(difference(tip.base.moment, self.base.moment));
        tip.usable && distance(tip.position, self.position) <= most && moment <= SAME_MOMENT * norm(self.base.moment)
    }
}

/// A rod that inputs act on, with an engine.
pub struct EngineMap {
    reader: TipReader,
    plan: Plan,
    rest: Box<dyn Backend>,
    engine: Engine,
    second: Option<Box<dyn Backend>>,
    near: Option<Solver>,
    /// With derivatives by a force on the tip: from rest, and near given loads at the base.
    soft: Option<Solver>,
    soft_near: Option<Solver>,
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
            soft: None,
            soft_near: None,
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
    /// the load at its base; what is not found so is solved from rest.
    pub(super) fn with_compliance_again(&mut self, known: &[Known]) -> Result<Vec<(Tip, [Vector; 3])>, WorkspaceError> {
        let inputs: Vec<Inputs> = known.iter().map(|known| known.at).collect();
        if !self.near_is_quick() {
            return self.softened(&inputs, None);
        }
        let loads: Vec<BaseLoad> = known.iter().map(|known| known.base).collect();
        let mut all = self.softened(&inputs, Some(&loads))?;
        let most = SAME_TIP * self.plan.options.tolerance * self.plan.units.length;
        let left: Vec<usize> = (0..known.len()).filter(|row| !known[*row].is_found(&all[*row].0, most)).collect();
        let inputs: Vec<Inputs> = left.iter().map(|row| inputs[*row]).collect();
        for (row, found) in left.into_iter().zip(self.softened(&inputs, None)?) {
            all[row] = found;
        }
        Ok(all)
    }

    /// Equilibria with the derivatives of the tip by a force on it, from rest or near loads at the base.
    fn softened(
        &mut self,
        inputs: &[Inputs],
        loads: Option<&[BaseLoad]>,
    ) -> Result<Vec<(Tip, [Vector; 3])>, WorkspaceError> {
        let solver = match loads {
            None => &mut self.soft,
            Some(_) => &mut self.soft_near,
        };
        if solver.is_none() {
            let of_inputs = self.plan.derivatives.iter().map(|derivative| derivative.parameter);
            let wrt: Vec<Parameter> = of_inputs.chain(Axis::ALL.map(Parameter::TipForce)).collect();
            let plan = Plan::new(&self.plan.scene, &self.plan.axes, &wrt, self.plan.options)?;
            *solver = Some(match loads {
                None => Solver::from_rest(plan, &self.engine)?,
                Some(_) => Solver::near(plan, &self.engine)?,
            });
        }
        let Some(solver) = solver else { return Ok(Vec::new()) };
        let (first, at_once) = (self.plan.derivatives.len(), solver.backend.batch_size().max(1));
        let mut all = Vec::with_capacity(inputs.len());
        for (chunk, rows) in inputs.chunks(at_once).enumerate() {
            let loads = loads.map(|loads| &loads[chunk * at_once..][..rows.len()]);
            let solutions = solver.solve(&self.reader.inputs, rows, loads)?;
            self.solves += rows.len() as u64;
            let plan = &solver.plan;
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
            base: BaseLoad {
                moment: solutions.vector(row, Quantity::BaseMoment),
                force: solutions.base_force(row).unwrap_or(BaseLoad::NONE.force),
            },
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
            if let Some(first) = plan.base_force_row() {
                tip.force_rates[k] = std::array::from_fn(|axis| rate(first + axis));
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

    fn near_is_quick(&self) -> bool {
        self.plan.options.base_force
    }

    fn near(&mut self, inputs: &[(Inputs, BaseLoad)]) -> Result<Vec<Tip>, BackendError> {
        let solver = match &mut self.near {
            Some(solver) => solver,
            none => {
                let options = PlanOptions { base_moment_rows: true, ..self.plan.options };
                none.insert(Solver::near(self.plan.with_options(options), &self.engine)?)
            }
        };
        let mut tips = Vec::with_capacity(inputs.len());
        for rows in inputs.chunks(solver.backend.batch_size().max(1)) {
            let (values, loads): (Vec<Inputs>, Vec<BaseLoad>) = rows.iter().copied().unzip();
            let solutions = solver.solve(&self.reader.inputs, &values, Some(&loads))?;
            self.solves += rows.len() as u64;
            tips.append(&mut self.reader.tips(&solver.plan, &solutions));
        }
        Ok(tips)
    }
}

/// Prepared for one plan: from rest, or near given loads at the base.
struct Solver {
    /// The rods without starts.
    rods: Plan,
    /// As it is solved.
    plan: Plan,
    backend: Box<dyn Backend>,
}

impl Solver {
    fn from_rest(plan: Plan, engine: &Engine) -> Result<Solver, BackendError> {
        Ok(Solver { backend: engine.make(&plan)?, rods: plan.clone(), plan })
    }

    /// Where rows tell the load at the base whole, as in a field that varies, Newton's method begins there, on the fine grid alone.
    fn near(rods: Plan, engine: &Engine) -> Result<Solver, BackendError> {
        let plan = if rods.options.base_force { rods.with_near_starts() } else { rods.with_lone_starts() };
        Ok(Solver { backend: engine.make(&plan)?, rods, plan })
    }

    fn solve(
        &mut self,
        inputs: &[WorkspaceInput],
        rows: &[Inputs],
        loads: Option<&[BaseLoad]>,
    ) -> Result<Solutions, BackendError> {
        let batch = match loads {
            Some(loads) if self.rods.options.base_force => {
                let start = |(sample, load): (usize, &BaseLoad)| {
                    let n0 = Some(load.force).filter(|force| force.iter().all(|x| x.is_finite()));
                    Start { sample, m0: load.moment, n0, known: &[] }
                };
                let starts: Vec<Start> = loads.iter().enumerate().map(start).collect();
                self.rods.start_batch(&batch(&self.rods, inputs, rows), &starts)
            }
            _ => {
                let mut batch = batch(&self.plan, inputs, rows);
                for (row, load) in loads.unwrap_or_default().iter().enumerate() {
                    self.plan.set_lone_start(&mut batch, row, load.moment);
                }
                batch
            }
        };
        self.backend.solve(&batch)
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
    // Where neighbours are found quickly, rows tell the load at the base and how it follows the inputs.
    let is_sharp = (options.engine.kind(), options.engine.precision()) == (BackendKind::Cpu, Precision::F64);
    let base_force = is_sharp && can_answer_again(&plan) && !scene.rod().is_too_limp();
    Ok(plan.with_options(PlanOptions { base_force, base_moment_rows: base_force, ..plan.options }))
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
