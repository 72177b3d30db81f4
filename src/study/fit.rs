//! Numbers of a rod from observed shapes: Levenberg and Marquardt's method on analytic derivatives, the covariance of
//! the answer, and what the observations cannot tell apart.
//!
//! Numbers that must be positive are fitted by their logarithm, so that sensitivities are relative and a ridge such as
//! "stiffness and magnetic moment scale together" is a straight line.

use super::MakeEngine;
use crate::backend::{Backend, BackendError};
use crate::model::{
    Parameter, Plan, PlanError, PlanOptions, Quantity, Scene, SegmentParameter as S, Slot, Vector,
};
use crate::reference::shape_with_derivatives;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

/// Steps over the rod: the answer is corrected to first order by the reference.
const STEPS: usize = 24;
/// A direction is a ridge where its singular value, over the largest, is below this.
const RIDGE: f64 = 1e-7;
/// A direction is weak where one standard deviation is this large: relative, or curvature times length.
const WEAK: f64 = 0.5;
/// Parameters that count in a direction have at least this share of the largest.
const COUNTS: f64 = 0.1;
const NORMAL_95: f64 = 1.959_963_984_540_054;

/// A point of a rod that was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservedPoint {
    /// From the base [m]; the tip if not given.
    pub arc_length: Option<f64>,
    /// World frame [m]
    pub position: Vector,
}

/// Points of one equilibrium.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObservedShape {
    /// Values of [`FitProblem::known`], SI.
    pub known: Vec<f64>,
    pub points: Vec<ObservedPoint>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct FitProblem {
    /// Where the fit starts.
    pub scene: Scene,
    /// What is fitted; parameters that stand together keep their ratios.
    pub free: Vec<Vec<Parameter>>,
    /// What differs from shape to shape and is known.
    pub known: Vec<Parameter>,
    pub shapes: Vec<ObservedShape>,
    /// Standard deviation of a coordinate [m]; estimated from the residuals if not given.
    pub noise: Option<f64>,
}

/// One fitted number, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    pub name: String,
    pub unit: &'static str,
    pub start: f64,
    pub value: f64,
    /// Standard deviation; infinite where the observations do not determine it.
    pub deviation: f64,
    /// 95 % of such intervals cover the truth.
    pub interval: [f64; 2],
}

/// A direction of the parameters and what the observations say about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Direction {
    /// Of the scaled sensitivities, over the noise.
    pub singular_value: f64,
    /// Weights of the parameters: relative changes, or changes of curvature times length.
    pub weights: Vec<f64>,
    pub strength: Strength,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strength {
    Determined,
    /// The noise hides changes of half the value.
    Weak,
    /// Nothing changes along it.
    Ridge,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    pub parameters: Vec<Fitted>,
    /// The scene with the fitted values.
    pub scene: Scene,
    /// By the values, SI; without what no observation determines.
    pub covariance: Vec<Vec<f64>>,
    /// Strongest first.
    pub directions: Vec<Direction>,
    /// What the directions mean, in words.
    pub findings: Vec<String>,
    /// Root mean square of the distances between points and model [m].
    pub rms: f64,
    /// Standard deviation of a coordinate: as given, or estimated [m].
    pub noise: f64,
    pub observations: usize,
    pub evaluations: usize,
    pub converged: bool,
    /// Model positions of every shape's points [m].
    pub positions: Vec<Vec<Vector>>,
    /// Base moments of the shapes [N·m].
    pub base_moments: Vec<Vector>,
}

#[derive(Debug, thiserror::Error)]
pub enum FitError {
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error(transparent)]
    Backend(#[from] BackendError),
    #[error("{observations} coordinates cannot determine {parameters} parameters: observe more, or free fewer")]
    TooFew { observations: usize, parameters: usize },
    #[error("`{0}` is zero and cannot be scaled: give it a value in the scene, or free its components one by one")]
    Zero(String),
    #[error("with the scene's own values shape {shape} has no stable equilibrium ({status}): start from other values")]
    NoStart { shape: usize, status: &'static str },
    #[error("the fit ended in vain: {0}")]
    Failed(String),
}

/// Fits a problem; the engine finds equilibria, the reference shapes and derivatives.
pub fn fit(problem: &FitProblem, make: &mut MakeEngine) -> Result<Fit, FitError> {
    let observations = 3 * problem.shapes.iter().map(|shape| shape.points.len()).sum::<usize>();
    let parameters = problem.free.len();
    if parameters == 0 || observations < parameters {
        return Err(FitError::TooFew { observations, parameters });
    }
    let model = Model::new(problem, make)?;
    let sigma = problem.noise.unwrap_or(model.length * 1e-3);
    let start = DVector::zeros(parameters);
    let mut search = Search { model, x: start, sigma, state: None, failure: None, worst: 0.0, evaluations: 0 };
    search.set_params(&DVector::zeros(parameters));
    if let Some(error) = search.failure.take() {
        return Err(error);
    }
    let method = LevenbergMarquardt::new().with_patience(40).with_ftol(1e-15).with_xtol(1e-14).with_gtol(0.0);
    let (mut search, report) = method.minimize(search);
    let converged = report.termination.was_successful();
    let x = search.x.clone();
    search.set_params(&x);
    let Some(state) = search.state else { return Err(FitError::Failed(format!("{:?}", report.termination))) };
    let squares = state.residuals.norm_squared();
    let freedom = observations - parameters;
    let noise = problem.noise.unwrap_or(if freedom > 0 { (squares / freedom as f64).sqrt() } else { 0.0 });
    let quantile = if problem.noise.is_some() { NORMAL_95 } else { student_95(freedom) };
    let scene = search.model.scene(&x, None);
    let (covariance, open, directions) = analyse(&search.model, &state.jacobian, noise);
    let fitted = |k: usize| {
        let parameter = problem.free[k][0];
        let value = parameter.get(&scene);
        let rate = search.model.rate(k, value);
        let deviation = if open[k] { f64::INFINITY } else { rate * covariance[(k, k)].sqrt() };
        Fitted {
            name: search.model.names[k].clone(),
            unit: parameter.unit(),
            start: parameter.get(&problem.scene),
            value,
            deviation,
            interval: [value - quantile * deviation, value + quantile * deviation],
        }
    };
    let fitted: Vec<Fitted> = (0..parameters).map(fitted).collect();
    let rates: Vec<f64> = (0..parameters).map(|k| search.model.rate(k, fitted[k].value)).collect();
    let entry = |row: usize, column: usize| rates[row] * covariance[(row, column)] * rates[column];
    Ok(Fit {
        covariance: (0..parameters).map(|row| (0..parameters).map(|column| entry(row, column)).collect()).collect(),
        findings: findings(&search.model, &directions),
        directions,
        parameters: fitted,
        scene,
        rms: (3.0 * squares / observations as f64).sqrt(),
        noise,
        observations,
        evaluations: search.evaluations,
        converged,
        positions: state.positions,
        base_moments: state.base_moments,
    })
}

/// How the shapes follow from scaled parameters: 0 is the scene.
struct Model<'a> {
    problem: &'a FitProblem,
    plan: Plan,
    engine: Box<dyn Backend>,
    names: Vec<String>,
    /// Whether a parameter is fitted by its logarithm.
    logarithmic: Vec<bool>,
    /// Of the rod [m]
    length: f64,
}

struct State {
    /// Model less observation [m], and by the scaled parameters.
    residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
    positions: Vec<Vec<Vector>>,
    base_moments: Vec<Vector>,
}

impl<'a> Model<'a> {
    fn new(problem: &'a FitProblem, make: &mut MakeEngine) -> Result<Model<'a>, FitError> {
        let mut axes: Vec<Vec<Parameter>> = problem.known.iter().map(|parameter| vec![*parameter]).collect();
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
        let plan = Plan::new(&problem.scene, &axes, &[], options)?;
        let engine = make(&plan)?;
        let name = |parameters: &Vec<Parameter>| {
            let names: Vec<String> = parameters.iter().map(|parameter| parameter.name(&problem.scene)).collect();
            names.join("+")
        };
        let names = problem.free.iter().map(name).collect();
        Ok(Model { problem, plan, engine, names, logarithmic, length: problem.scene.total_length() })
    }

    /// Change of a value by its scaled parameter.
    fn rate(&self, k: usize, value: f64) -> f64 {
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
            Some(shape) => self.problem.shapes[shape].known.clone(),
            None => self.problem.known.iter().map(|parameter| parameter.get(&self.problem.scene)).collect(),
        };
        known.into_iter().chain(self.values(x)).collect()
    }

    /// The scene of a shape, or with the fitted values alone.
    fn scene(&self, x: &DVector<f64>, shape: Option<usize>) -> Scene {
        self.plan.sample_scene(&self.row(x, shape))
    }

    fn solve(&mut self, x: &DVector<f64>) -> Result<State, FitError> {
        let shapes = &self.problem.shapes;
        let rows: Vec<Vec<f64>> = (0..shapes.len()).map(|shape| self.row(x, Some(shape))).collect();
        let batch = self.plan.batch(rows.len(), |i, row| row.copy_from_slice(&rows[i]));
        let solutions = self.engine.solve(&batch)?;
        let count = 3 * shapes.iter().map(|shape| shape.points.len()).sum::<usize>();
        let mut state = State {
            residuals: DVector::zeros(count),
            jacobian: DMatrix::zeros(count, self.problem.free.len()),
            positions: Vec::new(),
            base_moments: Vec::new(),
        };
        let mut first = 0;
        for (index, shape) in shapes.iter().enumerate() {
            let status = solutions.status(index);
            if !status.is_success() {
                return Err(FitError::NoStart { shape: index + 1, status: status.name() });
            }
            let m0 = solutions.vector(index, Quantity::BaseMoment);
            let scene = self.scene(x, Some(index));
            let chains: Vec<Vec<(Slot, f64)>> = self.problem.free.iter().enumerate().map(|(k, p)| self.chain(k, p, &scene)).collect();
            let mut slots: Vec<Slot> = Vec::new();
            for (slot, _) in chains.iter().flatten() {
                if !slots.contains(slot) {
                    slots.push(*slot);
                }
            }
            let length = scene.total_length();
            let at: Vec<f64> = shape.points.iter().map(|point| point.arc_length.unwrap_or(length)).collect();
            let poses = shape_with_derivatives(&scene.rod(), m0, &at, &slots);
            let poses = poses.ok_or_else(|| FitError::Failed(format!("shape {} cannot be integrated", index + 1)))?;
            for (pose, point) in poses.iter().zip(&shape.points) {
                for a in 0..3 {
                    state.residuals[first + a] = pose.position[a] - point.position[a];
                    for (k, chain) in chains.iter().enumerate() {
                        let of = |(slot, rate): &(Slot, f64)| {
                            let at = slots.iter().position(|other| other == slot);
                            at.map_or(0.0, |at| rate * pose.derivatives[at].dp[a])
                        };
                        state.jacobian[(first + a, k)] = chain.iter().map(of).sum();
                    }
                }
                first += 3;
            }
            state.positions.push(poses.iter().map(|pose| pose.position).collect());
            state.base_moments.push(m0);
        }
        Ok(state)
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

/// Numbers that are positive and act by their ratio.
fn is_scale(parameter: &Parameter) -> bool {
    use Parameter as P;
    match parameter {
        P::Insertion => true,
        P::Segment(_, segment) => !matches!(
            segment,
            S::RestCurvature(_) | S::RestCurvatureNode(..) | S::DipolePerLength(_) | S::Current(_) | S::Alignment(_) | S::PoissonRatio
        ),
        _ => false,
    }
}

/// The problem as the method sees it: scaled parameters, residuals over the noise.
struct Search<'a> {
    model: Model<'a>,
    x: DVector<f64>,
    sigma: f64,
    state: Option<State>,
    failure: Option<FitError>,
    /// Largest norm of the residuals so far.
    worst: f64,
    evaluations: usize,
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
        let count = 3 * self.model.problem.shapes.iter().map(|shape| shape.points.len()).sum::<usize>();
        let bad = || DVector::from_element(count, 1e3 * (self.worst + self.model.length) / self.sigma);
        Some(self.state.as_ref().map_or_else(bad, |state| &state.residuals / self.sigma))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        self.state.as_ref().map(|state| &state.jacobian / self.sigma)
    }
}

/// Covariance of the scaled parameters, which of them are open, and the directions, strongest first.
fn analyse(model: &Model, jacobian: &DMatrix<f64>, noise: f64) -> (DMatrix<f64>, Vec<bool>, Vec<Direction>) {
    let count = model.names.len();
    let svd = jacobian.clone().svd(false, true);
    let rows = svd.v_t.unwrap_or_else(|| DMatrix::identity(count, count));
    let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
    order.sort_by(|a, b| svd.singular_values[*b].total_cmp(&svd.singular_values[*a]));
    let largest = order.first().map_or(0.0, |k| svd.singular_values[*k]);
    let (mut covariance, mut open) = (DMatrix::zeros(count, count), vec![false; count]);
    let mut directions = Vec::new();
    for k in order {
        let (value, row) = (svd.singular_values[k], rows.row(k));
        let strength = if value <= RIDGE * largest {
            Strength::Ridge
        } else if noise > WEAK * value {
            Strength::Weak
        } else {
            Strength::Determined
        };
        if strength == Strength::Ridge {
            let most = row.amax();
            (0..count).for_each(|j| open[j] |= row[j].abs() > RIDGE.sqrt() * most);
        } else {
            covariance += row.transpose() * row * (noise / value).powi(2);
        }
        let singular_value = if noise > 0.0 { value / noise } else { f64::INFINITY };
        directions.push(Direction { singular_value, weights: row.iter().copied().collect(), strength });
    }
    (covariance, open, directions)
}

/// What weak directions and ridges mean.
fn findings(model: &Model, directions: &[Direction]) -> Vec<String> {
    let of = |direction: &Direction| {
        let most = direction.weights.iter().fold(0.0f64, |most, weight| most.max(weight.abs()));
        let part: Vec<usize> =
            (0..direction.weights.len()).filter(|k| direction.weights[*k].abs() > COUNTS * most).collect();
        let names: Vec<&str> = part.iter().map(|k| model.names[*k].as_str()).collect();
        let what = match &names[..] {
            [name] => (*name).to_owned(),
            [head @ .., last] => format!("{} and {last}", head.join(", ")),
            [] => String::new(),
        };
        let share = |k: &usize| direction.weights[*k] / direction.weights[part[0]];
        let together = part.len() > 1 && part.iter().all(|k| model.logarithmic[*k] && (share(k) - 1.0).abs() < 0.01);
        let shares: Vec<String> = part.iter().map(|k| format!("{:+.2}", direction.weights[*k] / most)).collect();
        match direction.strength {
            Strength::Determined => None,
            Strength::Ridge if together => {
                Some(format!("{what} scale together: only their ratios can be told; give one of them another source"))
            }
            Strength::Ridge if part.len() == 1 => Some(format!("{what} changes nothing that is observed: do not free it")),
            Strength::Ridge => Some(format!("{what} compensate one another ({}): hold one of them", shares.join(", "))),
            Strength::Weak if part.len() == 1 => Some(format!("{what} is hidden by the noise")),
            Strength::Weak => Some(format!("{what} are told apart badly ({})", shares.join(", "))),
        }
    };
    directions.iter().filter_map(of).collect()
}

/// Two-sided 95 % quantile of Student's distribution (Cornish and Fisher's expansion; Abramowitz and Stegun 26.7.5).
fn student_95(freedom: usize) -> f64 {
    let (z, n) = (NORMAL_95, freedom as f64);
    match freedom {
        0 => f64::INFINITY,
        1 => 12.706_204_736,
        2 => 4.302_652_730,
        _ => {
            let z2 = z * z;
            let g1 = z * (z2 + 1.0) / 4.0;
            let g2 = z * ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
            let g3 = z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
            z + g1 / n + g2 / (n * n) + g3 / (n * n * n)
        }
    }
}
