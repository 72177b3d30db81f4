//! Comparison of an engine with golden results, in measures that do not depend on units.

use super::golden::GoldenCase;
use rayon::prelude::*;
use rodsweep::backend::Backend;
use rodsweep::model::{
    Axis, Matrix, Parameter, Plan, PlanOptions, Quantity, Scene, Slot, Solutions, Status, Units, Vector,
};

/// In f64, columns smaller than this share of their natural size are measured against it.
pub const SMALL_COLUMN: f64 = 1e-3;
/// In f32 a column is a sum of terms of its natural size, rounded to 1e-7 of that: it is measured against at least it.
pub const SMALL_COLUMN_F32: f64 = 1.0;

/// Largest errors an engine may show.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// Tip position over rod length, and tip rotation [rad].
    pub pose: f64,
    /// Base moment over the larger of itself and the moment that bends the rod by one radian.
    pub moment: f64,
    /// Columns of (dp/L, w), relative.
    pub jacobian: f64,
    /// Columns below this share of their natural size are measured against it.
    pub small_column: f64,
}

/// Errors measured on one scene.
#[derive(Clone, Debug)]
pub struct Errors {
    pub name: String,
    pub status: Status,
    pub index: f64,
    pub pose: f64,
    pub moment: f64,
    pub jacobian: f64,
    /// Parameter of the worst column.
    pub worst_column: String,
}

/// Solves every case alone, several at a time, and compares; panics with the list of offenders, worst values first.
pub fn check_golden(
    cases: &[GoldenCase],
    options: PlanOptions,
    make: impl Fn(&Plan) -> Box<dyn Backend> + Sync,
    tolerance: Tolerance,
) -> Vec<Errors> {
    let mut all: Vec<Errors> =
        cases.par_iter().map(|case| measure(case, options, tolerance.small_column, &make)).collect();
    all.sort_by(|a, b| b.jacobian.total_cmp(&a.jacobian));
    let fails = |e: &&Errors| {
        let good = e.pose <= tolerance.pose && e.moment <= tolerance.moment && e.jacobian <= tolerance.jacobian;
        !good || !e.status.is_success()
    };
    let offenders: Vec<String> = all.iter().filter(fails).map(|e| format!("{e:?}")).collect();
    assert!(offenders.is_empty(), "beyond {tolerance:?}:\n{}", offenders.join("\n"));
    all
}

/// Solves one case and measures its errors.
pub fn measure(
    case: &GoldenCase,
    options: PlanOptions,
    small_column: f64,
    make: impl Fn(&Plan) -> Box<dyn Backend>,
) -> Errors {
    let mut wrt = case.parameters.clone();
    wrt.extend(Axis::ALL.map(Parameter::BaseRotation));
    let plan = Plan::single(&case.scene, &wrt, options).expect("a valid plan");
    let batch = plan.batch(1, |_, _| {});
    let solutions = make(&plan).solve(&batch).expect("a solved batch");
    let units = plan.units;
    let mut jacobian = (0.0, String::new());
    for (k, parameter) in wrt.iter().enumerate() {
        let expected = expected_column(case, k, *parameter);
        let found: [f64; 6] = std::array::from_fn(|row| solutions.derivative(0, k, row));
        let small = small_column * natural_size(&case.scene, *parameter, &units);
        let error = column_error(&found, &expected, small, units.length);
        // Also takes NaN as the worst.
        if error.is_nan() || error > jacobian.0 {
            jacobian = (error, parameter.name(&case.scene));
        }
    }
    Errors {
        name: case.scene.name.clone(),
        status: solutions.status(0),
        index: solutions.get(0, Quantity::StabilityIndex),
        pose: pose_error(&solutions, 0, &case.p_tip, &case.R_tip, units.length),
        moment: difference(&solutions.vector(0, Quantity::BaseMoment), &case.m0) / norm(&case.m0).max(units.moment()),
        jacobian: jacobian.0,
        worst_column: jacobian.1,
    }
}

/// Column k of the golden Jacobian; past its end, the base rotation's by the parameter's own chain rule.
fn expected_column(case: &GoldenCase, k: usize, parameter: Parameter) -> [f64; 6] {
    if k < case.parameters.len() {
        return std::array::from_fn(|row| case.J[row][k]);
    }
    let mut column = [0.0; 6];
    for (slot, rate) in parameter.chain(&case.scene) {
        let Slot::BaseRotation(axis) = slot else { unreachable!("a base rotation moves only the base rotation") };
        for (row, entry) in column.iter_mut().enumerate() {
            *entry += rate * case.J_R0[row][axis.index()];
        }
    }
    column
}

/// Larger of the tip's position error over the length and its rotation error [rad].
pub fn pose_error(solutions: &Solutions, sample: usize, p: &Vector, R: &Matrix, length: f64) -> f64 {
    let found = solutions.tip_rotation(sample);
    let rotation = (0..9).map(|k| (found[k / 3][k % 3] - R[k / 3][k % 3]).powi(2)).sum::<f64>().sqrt();
    let position = difference(&solutions.vector(sample, Quantity::TipPosition), p) / length;
    // |R1 - R2| is sqrt(2) times a small angle.
    if rotation.is_nan() { rotation } else { position.max(rotation / 2.0_f64.sqrt()) }
}

/// Size that a column (dp/L, w) has when a unit change of a rod-sized number turns the tip by one radian.
pub fn natural_size(scene: &Scene, parameter: Parameter, units: &Units) -> f64 {
    parameter.chain(scene).iter().map(|(slot, rate)| (rate / slot.unit(units)).powi(2)).sum::<f64>().sqrt()
}

/// Relative error of a column (dp/L, w); one smaller than `small` is measured against that.
pub fn column_error(found: &[f64; 6], expected: &[f64; 6], small: f64, length: f64) -> f64 {
    let scaled = |column: [f64; 6]| -> f64 {
        let square = |(row, x): (usize, &f64)| if row < 3 { (x / length).powi(2) } else { x.powi(2) };
        column.iter().enumerate().map(square).sum::<f64>().sqrt()
    };
    let error = scaled(std::array::from_fn(|row| found[row] - expected[row]));
    let size = scaled(*expected).max(small);
    if error == 0.0 { 0.0 } else { error / size }
}

pub fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

pub fn difference(a: &Vector, b: &Vector) -> f64 {
    norm(&std::array::from_fn::<f64, 3, _>(|k| a[k] - b[k]))
}
