//! Equilibria of a rod whose tip is held at points of the wall, from rest, with the force there and its derivatives by the inputs.

use super::error::ContactError;
use crate::backend::{Backend, BackendKind};
use crate::engines::{Engine, cpu_f64};
pub(super) use crate::model::vectors::{cross, dot};
use crate::model::{
    Axis, Batch, ContactColumn, Parameter, Plan, PlanOptions, Quantity, Scene, Solutions, Status, TipOnWall, Vector,
    WallParameter,
};
use crate::spec::{SobolNet, SolutionMethod};
use crate::study::witness::{Claim, Press, is_raised};
use crate::study::workspace::{Inputs, MOST_INPUTS, WorkspaceInput};
use crate::sweep::choose_steps_for;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::AtomicBool;

/// Rows whose forces differ by less, over the unit of force or the force, are of one equilibrium.
const SAME: f64 = 1e-4;
/// Samples that choose the number of steps.
const PILOT_SAMPLES: u64 = 64;
const PILOT_SEED: u64 = 0x9170;
/// Held rods bend more than the free ones of the pilot.
const LEAST_STEPS: usize = 6;
/// Rows of one call for each thread, so that a flag is looked at in about a second; of the reference a row may take that long.
const ROWS: usize = 128;
const ROWS_WITHOUT_CARE: usize = 1024;
const ROWS_OF_REFERENCE: usize = 1;

/// A row that is asked for: where the tip is held, and the inputs. With care it is what a sweep finds; without, it costs a seventh,
/// but is to be confirmed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ask {
    pub place: Vector,
    pub inputs: Inputs,
    pub has_care: bool,
}

/// A tip held at a point of the wall.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub status: Status,
    /// Whether it was solved with care.
    pub has_care: bool,
    /// Of rod and wall together.
    pub margin: f64,
    /// Of the wall where the tip is.
    pub normal: Vector,
    /// Along the normal (N).
    pub normal_force: f64,
    /// Along the wall, in two directions across the normal (N).
    pub along: [f64; 2],
    /// Between the direction into the wall and the tip's tangent (rad).
    pub angle: f64,
    /// Of the normal force and of both others by each input over half its range (N).
    pub rates: [[f64; 3]; MOST_INPUTS],
    /// The same by the place where the tip is held (N/m).
    pub drift: [[f64; 3]; 3],
}

impl Row {
    /// Force along the wall (N).
    pub(super) fn friction(&self) -> f64 {
        self.along[0].hypot(self.along[1])
    }

    /// Whether it is the equilibrium of another row of the same place and inputs; forces count by the unit.
    pub(super) fn is_same(&self, other: &Row, unit: f64) -> bool {
        let apart = (self.normal_force - other.normal_force).abs().max((self.friction() - other.friction()).abs());
        self.status.is_success() && apart <= SAME * unit.max(other.normal_force.abs())
    }
}

/// Solves held tips.
pub(super) struct HeldRod<'a> {
    table: HeldTable,
    careful: Box<dyn Backend>,
    /// On paths without care; `None`: all rows are solved with care.
    bold: Option<Box<dyn Backend>>,
    solves: u64,
    interrupt: Option<&'a AtomicBool>,
}

impl<'a> HeldRod<'a> {
    /// Plans and opens the engine; a pilot of the rod without its wall chooses the steps where they are not fixed. A flag that is
    /// raised ends whatever is being solved.
    pub(super) fn new(
        scene: &Scene,
        inputs: &[WorkspaceInput],
        (engine, tolerance, steps): (&Engine, f64, Option<usize>),
        interrupt: Option<&'a AtomicBool>,
    ) -> Result<HeldRod<'a>, ContactError> {
        let driven: Vec<Parameter> = inputs.iter().flat_map(|input| input.parameters.iter().copied()).collect();
        let mut axes: Vec<Vec<Parameter>> = driven.iter().map(|parameter| vec![*parameter]).collect();
        let usual = PlanOptions::default();
        let mut options = PlanOptions {
            tolerance: engine.tolerance(tolerance),
            stepper: engine.steppers()[0],
            steps: steps.unwrap_or(usual.steps),
            base_moment_rows: false,
            ..usual
        };
        if steps.is_none() {
            let free = Scene { wall: None, ..scene.clone() };
            let plan = Plan::new(&free, &axes, &driven, options)?;
            let net = net(inputs.len(), PILOT_SAMPLES, PILOT_SEED);
            let batch = plan.batch(net.len(), |row, values| {
                net.get(row).into_iter().for_each(|at| write(inputs, at, values));
            });
            let chosen = choose_steps_for(&plan, &batch, &cpu_f64)?.options(&plan);
            options = PlanOptions { steps: chosen.steps.max(LEAST_STEPS), ..chosen };
        }
        let mut held = scene.clone();
        if let Some(wall) = &mut held.wall {
            wall.tip = TipOnWall::Sticks(wall.position);
        }
        axes.extend(Axis::ALL.map(|axis| vec![Parameter::Wall(WallParameter::Anchor(axis))]));
        let by: Vec<Parameter> = axes.iter().flatten().copied().collect();
        let plan = Plan::new(&held, &axes, &by, options)?;
        let careful = engine.make(&plan)?;
        let bold = match engine.kind() {
            BackendKind::Cpu => Some(engine.make(&plan.with_options(PlanOptions { bold: true, ..plan.options }))?),
            _ => None,
        };
        let mut first = 0;
        let of_input = |input: &WorkspaceInput| {
            let own = first..first + input.parameters.len();
            first = own.end;
            own
        };
        let derivatives = inputs.iter().map(of_input).collect();
        let table = HeldTable { inputs: inputs.to_vec(), derivatives, axes, plan };
        Ok(HeldRod { table, careful, bold, solves: 0, interrupt })
    }

    /// EI/L² of the rod (N).
    pub(super) fn unit(&self) -> f64 {
        self.table.plan.units.force
    }

    /// What solves, for a person.
    pub(super) fn engine(&self) -> String {
        self.careful.info().to_string()
    }

    /// Engine, precision, stepper, steps and tolerance.
    pub(super) fn method(&self) -> SolutionMethod {
        SolutionMethod::of(&self.careful.info(), &self.table.plan)
    }

    /// Equilibria computed so far.
    pub(super) fn solves(&self) -> u64 {
        self.solves
    }

    /// The rod whose tip is held, and what each number of a claim drives.
    pub(super) fn held(&self) -> (&Scene, &[Vec<Parameter>]) {
        (&self.table.plan.scene, &self.table.axes)
    }

    /// Tip and force of an equilibrium, for the reference to solve again; `None` where the engine finds no equilibrium.
    pub(super) fn claim(&mut self, place: Vector, at: Inputs) -> Result<Option<(Claim, Press)>, ContactError> {
        let batch = self.table.batch(&[Ask { place, inputs: at, has_care: true }]);
        let solutions = self.careful.solve(&batch)?;
        let mut inputs = vec![0.0; self.table.axes.len()];
        self.table.write(&place, &at, &mut inputs);
        let claim = Claim {
            inputs,
            tip: solutions.vector(0, Quantity::TipPosition),
            error_estimate: solutions.get(0, Quantity::ErrorEstimate),
        };
        let press = Press {
            force: solutions.contact(0, ContactColumn::NormalForce),
            error: solutions.contact(0, ContactColumn::ForceError),
        };
        Ok(solutions.status(0).is_success().then_some((claim, press)))
    }

    /// One row for each that is asked. A search goes on without those that find no equilibrium: there are no second attempts.
    pub(super) fn solve(&mut self, asked: &[Ask]) -> Result<Vec<Row>, ContactError> {
        let is_bold = |ask: &Ask| self.bold.is_some() && !ask.has_care;
        let (bold, careful): (Vec<usize>, Vec<usize>) = (0..asked.len()).partition(|k| is_bold(&asked[*k]));
        let mut rows: Vec<Option<Row>> = vec![None; asked.len()];
        for (has_care, places) in [(false, bold), (true, careful)] {
            let asked: Vec<Ask> = places.iter().map(|k| asked[*k]).collect();
            let found = self.solve_alike(&asked, has_care)?;
            places.into_iter().zip(found).for_each(|(k, row)| rows[k] = Some(row));
        }
        Ok(rows.into_iter().flatten().collect())
    }

    /// Rows that are all solved with care, or all without.
    fn solve_alike(&mut self, asked: &[Ask], has_care: bool) -> Result<Vec<Row>, ContactError> {
        let mut rows = Vec::with_capacity(asked.len());
        let engine = self.bold.as_mut().filter(|_| !has_care).unwrap_or(&mut self.careful);
        let each = match (engine.info().kind, has_care) {
            (BackendKind::Reference, _) => ROWS_OF_REFERENCE,
            (_, true) => ROWS,
            (_, false) => ROWS_WITHOUT_CARE,
        };
        let size = (each * rayon::current_num_threads()).min(engine.batch_size()).max(1);
        for asked in asked.chunks(size) {
            if is_raised(self.interrupt) {
                return Err(ContactError::Interrupted);
            }
            let solutions = engine.solve(&self.table.batch(asked))?;
            self.solves += asked.len() as u64;
            let table = &self.table;
            let read = |row: usize| table.row(&solutions, row, has_care);
            rows.par_extend((0..asked.len()).into_par_iter().with_min_len(64).map(read));
        }
        Ok(rows)
    }
}

/// How rows are asked for, and what they say.
struct HeldTable {
    inputs: Vec<WorkspaceInput>,
    /// Derivatives of the plan that belong to each input.
    derivatives: Vec<Range<usize>>,
    /// The parameters that each column of a batch sets.
    axes: Vec<Vec<Parameter>>,
    plan: Plan,
}

impl HeldTable {
    fn batch(&self, asked: &[Ask]) -> Batch {
        self.plan.batch(asked.len(), |row, values| {
            if let Some(ask) = asked.get(row) {
                self.write(&ask.place, &ask.inputs, values);
            }
        })
    }

    /// A value for each axis.
    fn write(&self, place: &Vector, at: &Inputs, values: &mut [f64]) {
        let first = values.len().saturating_sub(3);
        write(&self.inputs, at, values);
        values[first..].copy_from_slice(place);
    }

    fn row(&self, solutions: &Solutions, row: usize, has_care: bool) -> Row {
        let normal = solutions.contact_vector(row, ContactColumn::Normal);
        let across = across(normal);
        let project = |v: Vector| across.map(|t| dot(t, v));
        let rate = |derivative: usize| {
            let [along_normal, x, y, z] = solutions.force_derivative(row, derivative);
            let [a, b] = project([x, y, z]);
            [along_normal, a, b]
        };
        let mut rates = [[0.0; 3]; MOST_INPUTS];
        for ((to, input), derivatives) in rates.iter_mut().zip(&self.inputs).zip(&self.derivatives) {
            for (derivative, by) in derivatives.clone().zip(&input.rates) {
                let factor = by * input.half_range();
                rate(derivative).iter().zip(to.iter_mut()).for_each(|(from, to)| *to += factor * from);
            }
        }
        let driven = self.derivatives.last().map_or(0, |own| own.end);
        Row {
            status: solutions.status(row),
            has_care,
            margin: solutions.get(row, Quantity::StabilityMargin),
            normal,
            normal_force: solutions.contact(row, ContactColumn::NormalForce),
            along: project(solutions.contact_vector(row, ContactColumn::Force)),
            angle: angle(normal, solutions.vector(row, Quantity::TipTangent)),
            rates,
            drift: std::array::from_fn(|axis| rate(driven + axis)),
        }
    }
}

/// Puts the values of all inputs into a row of a batch.
fn write(inputs: &[WorkspaceInput], at: &Inputs, values: &mut [f64]) {
    let each = inputs.iter().zip(at).flat_map(|(input, t)| {
        let value = input.value(*t);
        input.rates.iter().map(move |rate| rate * value)
    });
    values.iter_mut().zip(each).for_each(|(to, value)| *to = value);
}

/// The first points of a scrambled Sobol' net over the inputs, scaled; `count` is a power of two.
pub(super) fn net(input_count: usize, count: u64, seed: u64) -> Vec<Inputs> {
    let net = SobolNet::new(input_count, seed);
    let point = |index| {
        let mut point = [0.5; MOST_INPUTS];
        net.point(index, &mut point[..input_count]);
        point.map(|x| 2.0 * x - 1.0)
    };
    (0..count).map(point).collect()
}

/// Two directions across a normal.
pub(super) fn across(n: Vector) -> [Vector; 2] {
    // The axis of the world that is farthest from the normal.
    let k = (0..3).min_by(|a, b| n[*a].abs().total_cmp(&n[*b].abs())).unwrap_or(0);
    let along = n[k];
    let first: Vector = std::array::from_fn(|a| f64::from(u8::from(a == k)) - along * n[a]);
    let size = dot(first, first).sqrt();
    let first = first.map(|x| x / size);
    [first, cross(n, first)]
}

/// Between the direction into the wall and a tangent; exact near 0 and near a right angle.
fn angle(normal: Vector, tangent: Vector) -> f64 {
    let c = cross(normal, tangent);
    dot(c, c).sqrt().atan2(-dot(normal, tangent))
}
