//! A solution as JSON. Metres, radians, 1/m, N·m; quaternion x, y, z, w, body to world.

use super::{Rows, Solved};
use crate::model::Quantity;
use crate::results::{Contact, StabilityEvidence};
use serde_json::{Value, json};

impl Solved {
    /// The solution as JSON: metres, radians, 1/m, N·m; quaternion x, y, z, w; null where a number is undefined.
    pub fn to_json(&self) -> Value {
        let mut value = if self.is_equilibrium() { equilibrium(self) } else { failed(self) };
        if self.scene().wall.is_some() {
            value["contact"] = self.contact().map_or(Value::Null, contact);
        }
        if let Some(fold) = self.fold() {
            value["fold"] = json!({
                "load": number(fold.load),
                "error": fold.error,
                "parameters": self.jacobian().names(),
                "derivatives": fold.derivatives.iter().map(|(slope, _)| slope).collect::<Vec<_>>(),
                "derivative_errors": fold.derivatives.iter().map(|(_, error)| error).collect::<Vec<_>>(),
            });
        }
        value
    }
}

/// Numbers of the last iterate mean nothing here: null.
fn failed(solved: &Solved) -> Value {
    let solutions = solved.solutions();
    json!({
        "status": solved.status().name(),
        "converged": false,
        "stable": null,
        "iterations": number(solutions.get(0, Quantity::Iterations)),
        "residual": null,
        "error_estimate": null,
        "derivative_error": null,
        "load_fraction": number(solutions.get(0, Quantity::LoadFraction)),
        "base_curvature": null,
        "base_moment": null,
        "tip": null,
        "jacobian": null,
    })
}

/// At a fold: an equilibrium beyond it.
fn equilibrium(solved: &Solved) -> Value {
    let jacobian = solved.jacobian();
    let mut value = json!({
        "status": solved.status().name(),
        "converged": solved.is_converged(),
        "stable": solved.is_stable(),
        "stability_margin": number(solved.stability_margin()),
        "iterations": number(solved.solutions().get(0, Quantity::Iterations)),
        "residual": number(solved.residual()),
        "error_estimate": number(solved.error_estimate()),
        "derivative_error": number(solved.derivative_error()),
        "load_fraction": number(solved.load_fraction()),
        "base_curvature": solved.base_curvature(),
        "base_moment": solved.base_moment(),
        "tip": {
            "position": solved.tip_position(),
            "quaternion": solved.tip_quaternion(),
            "rotation": solved.tip_rotation(),
            "curvature": solved.tip_curvature(),
        },
        "jacobian": {
            "parameters": jacobian.names(),
            "position": rows(jacobian.position()),
            "rotation": rows(jacobian.rotation()),
            "base_curvature": rows(jacobian.base_curvature()),
            "residual": jacobian.residual().map(rows),
        },
    });
    if solved.has_no_energy() {
        value["stability_evidence"] = json!(solved.stability_evidence().map(StabilityEvidence::name));
    }
    if let (Some(normal_force), Some(force)) = (jacobian.normal_force(), jacobian.force()) {
        value["jacobian"]["normal_force"] = normal_force.into_iter().map(number).collect();
        value["jacobian"]["force"] = json!(rows(force));
    }
    value
}

/// A contact, SI.
pub(in crate::study) fn contact(contact: Contact) -> Value {
    json!({
        "touching": contact.touching,
        "gap": number(contact.gap),
        "normal_force": number(contact.normal_force),
        "force": contact.force.map(number),
        "normal": contact.normal.map(number),
        "friction_ratio": contact.friction_ratio,
        "holds": contact.holds,
        "angle": number(contact.angle),
        "body_gap": number(contact.body_gap),
        "force_error": number(contact.force_error),
    })
}

fn rows(rows: Rows) -> Vec<Vec<Value>> {
    rows.map(|row| row.into_iter().map(number).collect()).into()
}

/// A number, or null where it is undefined; whole ones without a point.
fn number(x: f64) -> Value {
    if x.fract() == 0.0 && x.abs() < 1e9 { json!(x as i64) } else { json!(x) }
}
