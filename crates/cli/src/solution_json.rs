//! The JSON of `rodsweep solve`. Metres, radians, 1/m, N·m; quaternion x, y, z, w, body to world.

use super::solve::Solved;
use rodsweep::model::{Matrix, Quantity, Slot, Vector, base_curvature, base_curvature_rate, tip_curvature};
use rodsweep::reference::residual_by_base_moment;
use serde_json::{Value, json};

/// The solution, and its shape and plan where they are asked for.
pub fn text(solved: &Solved, shape: Option<Value>, plan: Option<Value>) -> String {
    let mut value = value(solved);
    for (name, part) in [("shape", shape), ("plan", plan)] {
        if let Some(part) = part {
            value[name] = part;
        }
    }
    serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
}

pub fn value(solved: &Solved) -> Value {
    if solved.solutions.is_equilibrium(0) { equilibrium(solved) } else { failed(solved) }
}

/// Numbers of the last iterate mean nothing here: null.
fn failed(solved: &Solved) -> Value {
    let solutions = &solved.solutions;
    json!({
        "status": solutions.status(0).name(),
        "converged": false,
        "stable": null,
        "iterations": number(solutions.get(0, Quantity::Iterations)),
        "residual": null,
        "error_estimate": null,
        "load_fraction": number(solutions.get(0, Quantity::LoadFraction)),
        "base_curvature": null,
        "base_moment": null,
        "tip": null,
        "jacobian": null,
    })
}

/// At a fold: an equilibrium beyond it.
fn equilibrium(solved: &Solved) -> Value {
    let Solved { plan, batch, solutions, .. } = solved;
    let rod = plan.sample_rod(batch, 0);
    let m0 = solutions.vector(0, Quantity::BaseMoment);
    let rotation = solutions.tip_rotation(0);
    let derivatives = 0..plan.derivatives.len();
    let rows = |from: usize| -> Vec<Vec<Value>> {
        let row = |row: usize| derivatives.clone().map(|k| number(solutions.derivative(0, k, from + row))).collect();
        (0..3).map(row).collect()
    };
    let curvature_columns: Vec<Vector> = derivatives.clone().map(|k| base_curvature_column(solved, k)).collect();
    let curvature_rows: Vec<Vec<Value>> =
        (0..3).map(|row| curvature_columns.iter().map(|column| number(column[row])).collect()).collect();
    let names: Vec<&str> = plan.derivatives.iter().map(|derivative| derivative.name.as_str()).collect();
    json!({
        "status": solutions.status(0).name(),
        "converged": solutions.status(0).is_converged(),
        "stable": solutions.get(0, Quantity::StabilityIndex) < 0.5,
        "stability_margin": number(solutions.get(0, Quantity::StabilityMargin)),
        "iterations": number(solutions.get(0, Quantity::Iterations)),
        "residual": number(solutions.get(0, Quantity::Residual) * plan.units.moment()),
        "error_estimate": number(solutions.get(0, Quantity::ErrorEstimate)),
        "load_fraction": number(solutions.get(0, Quantity::LoadFraction)),
        "base_curvature": base_curvature(&rod, m0),
        "base_moment": m0,
        "tip": {
            "position": solutions.vector(0, Quantity::TipPosition),
            "quaternion": quaternion(&rotation),
            "rotation": rotation,
            "curvature": tip_curvature(&rod, &rotation),
        },
        "jacobian": {
            "parameters": names,
            "position": rows(0),
            "rotation": rows(3),
            "base_curvature": curvature_rows,
            "residual": residual_rows(solved),
        },
    })
}

/// A number, or null where it is undefined; whole ones without a point.
fn number(x: f64) -> Value {
    if x.fract() == 0.0 && x.abs() < 1e9 { json!(x as i64) } else { json!(x) }
}

/// d(u0) by derivative `k`: through the base moment, and directly.
fn base_curvature_column(solved: &Solved, k: usize) -> Vector {
    let Solved { plan, batch, solutions, .. } = solved;
    let rod = plan.sample_rod(batch, 0);
    let m0 = solutions.vector(0, Quantity::BaseMoment);
    let dm0: Vector = std::array::from_fn(|axis| solutions.derivative(0, k, 6 + axis));
    // A slot that stands in no term of u0: what is left is the base moment's part.
    let through_moment = base_curvature_rate(&rod, m0, Slot::Insertion, dm0);
    let mut sum = through_moment;
    for (slot, entry) in &plan.derivatives[k].terms {
        let rate = plan.entry(batch, 0, *entry);
        let direct = base_curvature_rate(&rod, m0, *slot, [0.0; 3]);
        for axis in 0..3 {
            sum[axis] += rate * direct[axis];
        }
    }
    sum
}

/// d(residual) by each derivative, the base moment held [N·m per unit]; null where the rod cannot be integrated.
fn residual_rows(solved: &Solved) -> Value {
    let Solved { plan, batch, solutions, .. } = solved;
    let m0 = solutions.vector(0, Quantity::BaseMoment);
    let Some(matrix) = residual_by_base_moment(&plan.sample_rod(batch, 0), m0) else { return Value::Null };
    let entry = |row: usize, k: usize| -> f64 {
        (0..3).map(|axis| -matrix[row][axis] * solutions.derivative(0, k, 6 + axis)).sum()
    };
    json!(
        (0..3)
            .map(|row| (0..plan.derivatives.len()).map(|k| number(entry(row, k))).collect())
            .collect::<Vec<Vec<Value>>>()
    )
}

/// Unit quaternion x, y, z, w of a rotation, w not negative.
fn quaternion(rotation: &Matrix) -> [f64; 4] {
    let r = rotation;
    // The largest component first, for its square root loses no digits.
    let four = [
        1.0 + r[0][0] - r[1][1] - r[2][2],
        1.0 - r[0][0] + r[1][1] - r[2][2],
        1.0 - r[0][0] - r[1][1] + r[2][2],
        1.0 + r[0][0] + r[1][1] + r[2][2],
    ];
    let (xy, xz, yz) = (r[0][1] + r[1][0], r[0][2] + r[2][0], r[1][2] + r[2][1]);
    let (xw, yw, zw) = (r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]);
    let largest = (0..4).max_by(|a, b| four[*a].total_cmp(&four[*b])).unwrap_or(3);
    let q = match largest {
        0 => [four[0], xy, xz, xw],
        1 => [xy, four[1], yz, yw],
        2 => [xz, yz, four[2], zw],
        _ => [xw, yw, zw, four[3]],
    };
    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt().copysign(if q[3] < 0.0 { -1.0 } else { 1.0 });
    q.map(|x| x / norm)
}
