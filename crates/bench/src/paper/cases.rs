//! Random configurations with the reference's answers.

use crate::baseline::{Column, Input, Jacobian, Rod, Tip, damped_least_squares};
use crate::error::BenchError;
use crate::random::Random;
use rodsweep::backend::Backend;
use rodsweep::model::{Batch, Parameter, Plan, PlanOptions, Quantity, Scene, SegmentParameter, Solutions, Vector};
use rodsweep::reference::Reference;

/// Largest current (A).
pub const CURRENT: f64 = 0.3;
/// A step along a path, as a share of the largest current: how far away a warm start is.
pub const NEAR: f64 = 0.01;
/// How far a step of control is to move the tip, over the length.
pub const REACH: f64 = 0.01;
/// Columns below this share of what turns the tip by a radian are measured against that.
pub const SMALL_COLUMN: f64 = 1e-3;

/// One configuration.
pub struct Case {
    /// Currents (A)
    pub values: Vec<f64>,
    pub rod: Rod,
    /// With slightly other currents.
    pub near: Rod,
    pub near_values: Vec<f64>,
    /// Where the tip is to go from here (m)
    pub reach: Vector,
    pub truth: Jacobian,
}

/// All configurations; the plan sweeps the currents and differentiates by the inputs.
pub struct Cases {
    pub plan: Plan,
    pub inputs: Vec<Input>,
    pub names: Vec<String>,
    /// In m
    pub length: f64,
    /// Change of each input that bends the rod by about a radian.
    pub scales: Vec<f64>,
    pub list: Vec<Case>,
    /// Configurations without a stable equilibrium on the path from rest.
    pub left_out: usize,
    pub random: u64,
}

/// Draws currents; insertion stays as the scene has it.
pub fn draw(scene: &Scene, name: &str, samples: usize, seed: u64) -> Result<Cases, BenchError> {
    let refused = |source| BenchError::Baseline { scene: name.to_owned(), source };
    let base = Rod::new(scene).map_err(refused)?;
    let is_current = |p: &Parameter| matches!(p, Parameter::Segment(_, SegmentParameter::Current(_)));
    let currents: Vec<Parameter> = Parameter::all(scene).into_iter().filter(is_current).collect();
    if currents.is_empty() {
        return Err(BenchError::NothingToControl { scene: name.to_owned() });
    }
    let mut wrt = currents.clone();
    wrt.push(Parameter::Insertion);
    let axes: Vec<Vec<Parameter>> = currents.iter().map(|current| vec![*current]).collect();
    let plan = Plan::new(scene, &axes, &wrt, PlanOptions::default())?;
    let inputs: Result<Vec<Input>, _> = wrt.iter().map(|parameter| Input::new(*parameter, scene)).collect();
    let inputs = inputs.map_err(refused)?;
    let mut random = Random(seed);
    let mut list = Vec::new();
    let rows: Vec<Vec<f64>> =
        (0..samples).map(|_| currents.iter().map(|_| random.within(-CURRENT, CURRENT)).collect()).collect();
    let truth = Reference::new(&plan).solve(&batch(&plan, &rows))?;
    let mut left_out = 0;
    for (sample, values) in rows.into_iter().enumerate() {
        let mut shift = || if random.unit() < 0.5 { -NEAR * CURRENT } else { NEAR * CURRENT };
        let near: Vec<f64> = values.iter().map(|value| value + shift()).collect();
        let mut reach: Vector = std::array::from_fn(|_| random.within(-1.0, 1.0));
        let size = reach.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-3);
        reach = reach.map(|x| x / size * REACH * base.length());
        if !truth.status(sample).is_success() {
            left_out += 1;
            continue;
        }
        let rod = |values: &[f64]| Rod::new(&plan.sample_scene(values)).map_err(refused);
        let (rod, near, near_values) = (rod(&values)?, rod(&near)?, near);
        list.push(Case { values, rod, near, near_values, reach, truth: jacobian(&truth, sample, inputs.len()) });
    }
    if list.is_empty() {
        return Err(BenchError::NoConfiguration { scene: name.to_owned() });
    }
    let names = plan.derivatives.iter().map(|derivative| derivative.name.clone()).collect();
    let scales = inputs.iter().map(|input| base.scale(input)).collect();
    Ok(Cases { plan, inputs, names, length: base.length(), scales, list, left_out, random: seed ^ 0x5eed })
}

/// A row of an engine as the baselines give it.
pub fn jacobian(solutions: &Solutions, sample: usize, inputs: usize) -> Jacobian {
    let tip = Tip { p: solutions.vector(sample, Quantity::TipPosition), R: solutions.tip_rotation(sample) };
    let column = |k: usize| Column {
        dp: std::array::from_fn(|row| solutions.derivative(sample, k, row)),
        w: std::array::from_fn(|row| solutions.derivative(sample, k, 3 + row)),
    };
    Jacobian { tip, columns: (0..inputs).map(column).collect() }
}

impl Cases {
    /// Error of the tip's position over the length, and of the worst column (dp/L, w), relative.
    pub fn errors(&self, case: &Case, found: &Jacobian) -> [f64; 2] {
        let distance = |a: &Vector, b: &Vector| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
        let both = |a: &Column, b: &Column| {
            (distance(&a.dp, &b.dp) / (self.length * self.length) + distance(&a.w, &b.w)).sqrt()
        };
        let none = Column { dp: [0.0; 3], w: [0.0; 3] };
        let mut worst = 0.0f64;
        for (k, (found, truth)) in found.columns.iter().zip(&case.truth.columns).enumerate() {
            let size = both(truth, &none).max(SMALL_COLUMN / self.scales[k]);
            let error = both(found, truth) / size;
            worst = if error > worst || error.is_nan() { error } else { worst };
        }
        [distance(&found.tip.p, &case.truth.tip.p).sqrt() / self.length, worst]
    }
}

/// The inputs that a step of damped least squares leads to.
pub fn moved(cases: &Cases, values: &[f64], reach: [f64; 3], solutions: &Solutions, sample: usize) -> Vec<f64> {
    let found = jacobian(solutions, sample, cases.inputs.len());
    let moves = damped_least_squares(&found.columns, &cases.scales, cases.length, reach);
    values.iter().zip(&moves).map(|(value, by)| value + by).collect()
}

/// A batch of a plan whose axes are the currents.
pub fn batch(plan: &Plan, rows: &[Vec<f64>]) -> Batch {
    plan.batch(rows.len(), |sample, row| {
        if let Some(values) = rows.get(sample) {
            row.copy_from_slice(values);
        }
    })
}
