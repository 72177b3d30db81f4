//! Shapes and their derivatives as functions of the fitted numbers, and the problem as the method sees it.

use super::FitError;
use crate::backend::Backend;
use crate::model::{
    Axis, Parameter, Plan, PlanOptions, Quantity, Scene, SegmentParameter as S, Slot, Solutions, Vector, WallParameter,
};
use crate::reference::{Pose, shape_with_derivatives};
use crate::results::{Contact, pressed};
use crate::spec::{ObservedPoint, ObservedShape, ObservedShapes};
use crate::study::MakeEngine;
use crate::study::witness::Claim;
use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

/// No further start is tried after so many evaluations: what is left is told as a misfit.
pub(super) const MOST_EVALUATIONS: usize = 2000;
/// Steps over the rod: the answer is corrected to first order by the reference.
const STEPS: usize = 24;
/// Noise of a coordinate unless it is given, over the rod's length.
pub(super) const NOISE: f64 = 1e-3;

/// The numbers and the points of a fit.
#[derive(Clone, Debug)]
pub(super) struct Problem {
    /// Where the fit starts.
    pub scene: Scene,
    /// What is fitted; parameters that stand together keep their ratios.
    pub free: Vec<Vec<Parameter>>,
    pub observed: ObservedShapes,
    /// Standard deviation of a coordinate (m); estimated from the residuals if not given.
    pub noise: Option<f64>,
    /// Standard deviation of a measured force (N); that which pushes the rod aside by the noise of a coordinate if not given.
    pub force_noise: Option<f64>,
}

/// How the shapes follow from scaled parameters: 0 is the scene.
pub(super) struct Model<'a> {
    problem: &'a Problem,
    plan: Plan,
    engine: Box<dyn Backend>,
    pub names: Vec<String>,
    /// Whether a parameter is fitted by its logarithm.
    pub logarithmic: Vec<bool>,
    /// Of the rod (m)
    pub length: f64,
    /// By how much a force counts beside lengths (m/N).
    yielding: f64,
}

pub(super) struct State {
    /// Model less observation (m), forces as lengths, and by the scaled parameters.
    pub residuals: DVector<f64>,
    pub jacobian: DMatrix<f64>,
    pub positions: Vec<Vec<Vector>>,
    pub base_moments: Vec<Vector>,
    /// At the wall, by shape.
    pub contacts: Vec<Option<Contact>>,
    /// The engine's equilibrium of each shape, for the check against the reference.
    pub claims: Vec<Claim>,
}

impl<'a> Model<'a> {
    pub(crate) fn new(problem: &'a Problem, make: &mut MakeEngine) -> Result<Model<'a>, FitError> {
        let mut axes: Vec<Vec<Parameter>> = problem.observed.known.iter().map(|parameter| vec![*parameter]).collect();
        let mut logarithmic = Vec::new();
        for parameters in &problem.free {
            axes.extend(parameters.iter().map(|parameter| vec![*parameter]));
            let values: Vec<f64> = parameters.iter().map(|parameter| parameter.get(&problem.scene)).collect();
            let positive = parameters.iter().all(is_scale) && values.iter().all(|value| *value > 0.0);
            if !positive && parameters.len() > 1 {
                return Err(FitError::Zero(parameters[0].name(&problem.scene)));
            }
            logarithmic.push(positive);
        }
        let options = PlanOptions { tolerance: 1e-10, steps: STEPS, ..PlanOptions::default() };
        // Beside a wall the force at the tip follows the numbers, and only an engine tells how.
        let of_force: Vec<Parameter> = problem.free.concat();
        let wrt = if problem.scene.wall.is_some() { &of_force[..] } else { &[] };
        let plan = Plan::new(&problem.scene, &axes, wrt, options)?;
        let engine = make(&plan)?;
        let name = |parameters: &Vec<Parameter>| {
            let names: Vec<String> = parameters.iter().map(|parameter| parameter.name(&problem.scene)).collect();
            names.join("+")
        };
        let names = problem.free.iter().map(name).collect();
        let length = problem.scene.total_length();
        // L³ / 3 EI of a straight rod that is pushed aside.
        let of_rod = plan.units.length / (3.0 * plan.units.force);
        let noise = problem.noise.unwrap_or(NOISE * length);
        let yielding = problem.force_noise.map_or(of_rod, |force_noise| noise / force_noise);
        Ok(Model { problem, plan, engine, names, logarithmic, length, yielding })
    }

    /// The parameters that a row of inputs sets: known ones, then fitted ones.
    pub(crate) fn axes(&self) -> &[Vec<Parameter>] {
        &self.plan.axes
    }

    /// Change of a value by its scaled parameter.
    pub(crate) fn rate(&self, k: usize, value: f64) -> f64 {
        if self.logarithmic[k] { value } else { self.unit(k) }
    }

    /// Unit of a parameter that is fitted as it is: curvatures count by the rod's length.
    fn unit(&self, k: usize) -> f64 {
        if self.problem.free[k][0].unit() == "1/m" { 1.0 / self.length } else { 1.0 }
    }

    fn values(&self, x: &DVector<f64>) -> Vec<f64> {
        let mut values = Vec::new();
        for (k, parameters) in self.problem.free.iter().enumerate() {
            for parameter in parameters {
                let start = parameter.get(&self.problem.scene);
                values.push(if self.logarithmic[k] { start * x[k].exp() } else { start + self.unit(k) * x[k] });
            }
        }
        values
    }

    fn row(&self, x: &DVector<f64>, shape: Option<usize>) -> Vec<f64> {
        let known = match shape {
            Some(shape) => self.problem.observed.shapes[shape].known.clone(),
            None => self.problem.observed.known.iter().map(|parameter| parameter.get(&self.problem.scene)).collect(),
        };
        known.into_iter().chain(self.values(x)).collect()
    }

    /// The numbers and the points of a fit.
    pub(crate) fn problem(&self) -> &'a Problem {
        self.problem
    }

    /// Where each observed coordinate lies along the rod, 0 to 1.
    pub(crate) fn places(&self) -> Vec<f64> {
        let origin = DVector::zeros(self.problem.free.len());
        let of = |(index, shape): (usize, &ObservedShape)| {
            let length = self.scene(&origin, Some(index)).total_length();
            let place = move |point: &ObservedPoint| point.arc_length.map_or(1.0, |at| (at / length).min(1.0));
            // A force tells of the whole rod.
            let of_points = shape.points.iter().flat_map(move |point| [place(point); 3]);
            of_points.chain(shape.normal_forces.iter().map(|_| 1.0)).collect::<Vec<f64>>()
        };
        self.problem.observed.shapes.iter().enumerate().flat_map(of).collect()
    }

    /// The scene of a shape, or with the fitted values alone.
    pub(crate) fn scene(&self, x: &DVector<f64>, shape: Option<usize>) -> Scene {
        self.plan.sample_scene(&self.row(x, shape))
    }

    pub(crate) fn solve(&mut self, x: &DVector<f64>) -> Result<State, FitError> {
        let shapes = &self.problem.observed.shapes;
        let rows: Vec<Vec<f64>> = (0..shapes.len()).map(|shape| self.row(x, Some(shape))).collect();
        let batch = self.plan.batch(rows.len(), |i, row| row.copy_from_slice(&rows[i]));
        let solutions = self.engine.solve(&batch)?;
        let count = self.problem.observation_count();
        let mut state = State {
            residuals: DVector::zeros(count),
            jacobian: DMatrix::zeros(count, self.problem.free.len()),
            positions: Vec::new(),
            base_moments: Vec::new(),
            contacts: Vec::new(),
            claims: Vec::new(),
        };
        let mut first = 0;
        for (index, shape) in shapes.iter().enumerate() {
            let status = solutions.status(index);
            if !status.is_success() {
                return Err(FitError::NoStart { shape: index + 1, status: status.name() });
            }
            let m0 = solutions.vector(index, Quantity::BaseMoment);
            let scene = self.scene(x, Some(index));
            let chains: Vec<Vec<(Slot, f64)>> =
                self.problem.free.iter().enumerate().map(|(k, p)| self.chain(k, p, &scene)).collect();
            let mut slots: Vec<Slot> = Vec::new();
            for (slot, _) in chains.iter().flatten() {
                if !slots.contains(slot) {
                    slots.push(*slot);
                }
            }
            let length = scene.total_length();
            let at: Vec<f64> = shape.points.iter().map(|point| point.arc_length.unwrap_or(length)).collect();
            let contact = Contact::beside(scene.wall.as_ref(), &solutions, index);
            let of_force = slots.len();
            slots.extend(contact.iter().flat_map(|_| Axis::ALL.map(Slot::TipForce)));
            let rod = pressed(scene.rod(), &scene, contact.as_ref());
            let poses = shape_with_derivatives(&rod, m0, &at, &slots);
            let poses = poses.ok_or_else(|| FitError::Failed(format!("shape {} cannot be integrated", index + 1)))?;
            let forces: Vec<[f64; 4]> =
                (0..chains.len()).map(|k| self.force_rates(k, &scene, &solutions, index)).collect();
            for (pose, point) in poses.iter().zip(&shape.points) {
                for a in 0..3 {
                    state.residuals[first + a] = pose.position[a] - point.position[a];
                    for (k, chain) in chains.iter().enumerate() {
                        let of = |(slot, rate): &(Slot, f64)| {
                            let at = slots[..of_force].iter().position(|other| other == slot);
                            at.map_or(0.0, |at| rate * pose.derivatives[at].dp[a])
                        };
                        let through_force = by_force(pose, of_force, &forces[k], a);
                        state.jacobian[(first + a, k)] = chain.iter().map(of).sum::<f64>() + through_force;
                    }
                }
                first += 3;
            }
            for force in &shape.normal_forces {
                let of_model = contact.map_or(f64::NAN, |contact| contact.normal_force);
                state.residuals[first] = self.yielding * (of_model - force);
                forces.iter().enumerate().for_each(|(k, rates)| state.jacobian[(first, k)] = self.yielding * rates[0]);
                first += 1;
            }
            state.contacts.push(contact);
            state.positions.push(poses.iter().map(|pose| pose.position).collect());
            state.base_moments.push(m0);
            state.claims.push(Claim {
                inputs: rows[index].clone(),
                tip: solutions.vector(index, Quantity::TipPosition),
                error_estimate: solutions.get(index, Quantity::ErrorEstimate),
            });
        }
        Ok(state)
    }

    /// How normal force and force of the wall follow a scaled parameter; nothing without a wall.
    fn force_rates(&self, k: usize, scene: &Scene, solutions: &Solutions, row: usize) -> [f64; 4] {
        if scene.wall.is_none() {
            return [0.0; 4];
        }
        let first: usize = self.problem.free[..k].iter().map(Vec::len).sum();
        let mut rates = [0.0; 4];
        for (offset, parameter) in self.problem.free[k].iter().enumerate() {
            let rate = self.rate(k, parameter.get(scene));
            let of = solutions.force_derivative(row, first + offset);
            (0..4).for_each(|a| rates[a] += rate * of[a]);
        }
        rates
    }

    /// Measured forces less those of the model, root mean square (N); `None` without any.
    pub(crate) fn force_rms(&self, state: &State) -> Option<f64> {
        let count = self.problem.observed.force_count();
        let shapes = self.problem.observed.shapes.iter().zip(&state.contacts);
        let off = shapes.flat_map(|(shape, contact)| {
            shape.normal_forces.iter().map(move |force| contact.map_or(f64::NAN, |c| c.normal_force) - force)
        });
        (count > 0).then(|| (off.map(|x| x * x).sum::<f64>() / count as f64).sqrt())
    }

    /// Points less those of the model, root mean square of a coordinate (m).
    pub(crate) fn point_rms(&self, state: &State) -> f64 {
        let shapes = self.problem.observed.shapes.iter().zip(&state.positions);
        let off = shapes.flat_map(|(shape, positions)| shape.points.iter().zip(positions));
        let squares: f64 =
            off.map(|(point, of)| (0..3).map(|a| (of[a] - point.position[a]).powi(2)).sum::<f64>()).sum();
        let count = self.problem.observed.coordinate_count();
        if count > 0 { (squares / count as f64).sqrt() } else { 0.0 }
    }

    /// Rates of the slots by a scaled parameter.
    fn chain(&self, k: usize, parameters: &[Parameter], scene: &Scene) -> Vec<(Slot, f64)> {
        let of = |parameter: &Parameter| {
            let rate = self.rate(k, parameter.get(scene));
            parameter.chain(scene).into_iter().map(move |(slot, by)| (slot, rate * by)).collect::<Vec<_>>()
        };
        parameters.iter().flat_map(of).collect()
    }
}

impl Problem {
    /// The noise of a coordinate (m) where it is given; that of forces alone stands for it where there are no points.
    pub(super) fn given_noise(&self, length: f64) -> Option<f64> {
        let has_points = self.observed.coordinate_count() > 0;
        self.noise.or_else(|| self.force_noise.filter(|_| !has_points).map(|_| NOISE * length))
    }

    /// Coordinates and forces.
    pub(super) fn observation_count(&self) -> usize {
        self.observed.coordinate_count() + self.observed.force_count()
    }
}

/// How a coordinate follows through the force of the wall, whose slots come last.
fn by_force(pose: &Pose, of_force: usize, rates: &[f64; 4], axis: usize) -> f64 {
    pose.derivatives[of_force..].iter().zip(&rates[1..]).map(|(by, rate)| rate * by.dp[axis]).sum()
}

/// Numbers that are positive and act by their ratio.
pub(in crate::study) fn is_scale(parameter: &Parameter) -> bool {
    use Parameter as P;
    match parameter {
        P::Insertion | P::Wall(WallParameter::Stiffness | WallParameter::Radius) => true,
        P::Segment(_, segment) => !matches!(
            segment,
            S::RestCurvature(_)
                | S::RestCurvatureNode(..)
                | S::DipolePerLength(_)
                | S::Remanence(_)
                | S::Magnetization(_)
                | S::Current(_)
                | S::Alignment(_)
                | S::PoissonRatio
        ),
        _ => false,
    }
}

/// The problem as the method sees it: scaled parameters, residuals over the noise.
pub(super) struct Search<'a> {
    pub model: Model<'a>,
    pub x: DVector<f64>,
    pub sigma: f64,
    pub state: Option<State>,
    pub failure: Option<FitError>,
    /// Largest norm of the residuals so far.
    pub worst: f64,
    pub evaluations: usize,
    /// After so many evaluations no other start is tried.
    pub most: usize,
    /// The part of the points that counts; `None`: all.
    pub part: Option<Part>,
}

/// Some of the observed coordinates, with a pull towards where a descent began.
pub(super) struct Part {
    /// Which coordinates count.
    pub kept: Vec<bool>,
    /// Scaled parameters that hold where the points do not tell.
    pub anchor: DVector<f64>,
    /// How far parameters go from there for as much as a coordinate that is off by its noise.
    pub reach: DVector<f64>,
}

impl<'a> Search<'a> {
    /// From the scene, all points counted.
    pub(super) fn new(model: Model<'a>, sigma: f64) -> Search<'a> {
        let x = DVector::zeros(model.problem.free.len());
        Search {
            model,
            x,
            sigma,
            state: None,
            failure: None,
            worst: 0.0,
            evaluations: 0,
            most: MOST_EVALUATIONS,
            part: None,
        }
    }

    /// Whether other starts have taken enough.
    pub(super) fn is_spent(&self) -> bool {
        self.evaluations > self.most
    }
}

impl Part {
    fn residuals(&self, all: &DVector<f64>, x: &DVector<f64>) -> DVector<f64> {
        let of = |row: usize| match row.checked_sub(self.kept.len()) {
            Some(k) => (x[k] - self.anchor[k]) / self.reach[k],
            None if self.kept[row] => all[row],
            None => 0.0,
        };
        DVector::from_fn(all.len() + x.len(), |row, _| of(row))
    }

    fn jacobian(&self, all: &DMatrix<f64>) -> DMatrix<f64> {
        let of = |row: usize, column: usize| match row.checked_sub(self.kept.len()) {
            Some(k) if k == column => 1.0 / self.reach[k],
            None if self.kept[row] => all[(row, column)],
            _ => 0.0,
        };
        DMatrix::from_fn(all.nrows() + all.ncols(), all.ncols(), of)
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Search<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x = x.clone();
        self.evaluations += 1;
        match self.model.solve(x) {
            Ok(state) => {
                self.worst = self.worst.max(state.residuals.amax());
                self.state = Some(state);
            }
            Err(error) => (self.state, self.failure) = (None, Some(error)),
        }
    }

    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        // A step to where there is no equilibrium is taken back when it looks bad enough.
        let count = self.model.problem.observation_count();
        let bad = || DVector::from_element(count, 1e3 * (self.worst + self.model.length) / self.sigma);
        let all = self.state.as_ref().map_or_else(bad, |state| &state.residuals / self.sigma);
        Some(match &self.part {
            Some(part) => part.residuals(&all, &self.x),
            None => all,
        })
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let all = self.state.as_ref().map(|state| &state.jacobian / self.sigma)?;
        Some(match &self.part {
            Some(part) => part.jacobian(&all),
            None => all,
        })
    }
}
