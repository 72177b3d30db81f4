//! `rodsweep solve --shape`: points along the rod, and how they move with the parameters.

use super::CommandError;
use super::solve::Solved;
use rodsweep::model::{Quantity, Slot, Vector};
use rodsweep::reference::{Pose, PoseDerivative, shape_with_derivatives};
use rodsweep::report::Table;
use rodsweep::sweep::{Dimension, parse_quantity};
use serde_json::{Value, json};

/// The arc lengths meant: a number of points evenly spaced from base to tip, or a list of lengths.
pub fn arc_lengths(text: &str, length: f64) -> Result<Vec<f64>, CommandError> {
    let wrong = |why: String| CommandError::Usage(format!("`--shape {text}`: {why}"));
    if let Ok(count) = text.trim().parse::<usize>() {
        if count < 2 {
            return Err(wrong("give at least 2 points, or lengths such as \"10 mm, 20 mm\"".into()));
        }
        return Ok((0..count).map(|k| length * k as f64 / (count - 1) as f64).collect());
    }
    let parse = |part: &str| {
        let at = parse_quantity(part.trim(), Dimension::of("m")).map_err(|error| wrong(error.to_string()))?;
        if at < 0.0 || at > length * (1.0 + 1e-12) {
            return Err(wrong(format!("{part} is not on the rod, which is {length} m long")));
        }
        Ok(at)
    };
    text.split(',').map(parse).collect()
}

/// Poses of a converged solution, each with one derivative for each of the plan's.
pub fn poses(solved: &Solved, arc_lengths: &[f64]) -> Result<Vec<Pose>, CommandError> {
    let Solved { plan, batch, solutions, .. } = solved;
    let mut slots: Vec<Slot> = plan.derivatives.iter().flat_map(|d| d.terms.iter().map(|(slot, _)| *slot)).collect();
    slots.sort_by_key(|slot| format!("{slot:?}"));
    slots.dedup();
    let rod = plan.sample_rod(batch, 0);
    let m0 = solutions.vector(0, Quantity::BaseMoment);
    let poses = shape_with_derivatives(&rod, m0, arc_lengths, &slots);
    let mut poses = poses.ok_or_else(|| CommandError::Usage("`--shape`: the rod cannot be integrated".into()))?;
    for pose in &mut poses {
        let of_slots = std::mem::take(&mut pose.derivatives);
        pose.derivatives = plan
            .derivatives
            .iter()
            .map(|derivative| {
                let mut sum = PoseDerivative::default();
                for (slot, entry) in &derivative.terms {
                    let rate = plan.entry(batch, 0, *entry);
                    let of_slot =
                        slots.iter().position(|other| other == slot).map(|at| of_slots[at]).unwrap_or_default();
                    for axis in 0..3 {
                        sum.dp[axis] += rate * of_slot.dp[axis];
                        sum.w[axis] += rate * of_slot.w[axis];
                        sum.du[axis] += rate * of_slot.du[axis];
                    }
                }
                sum
            })
            .collect();
    }
    Ok(poses)
}

/// A table for a person.
pub fn text(poses: &[Pose]) -> String {
    let mut table = Table::new(["s [mm]", "x [mm]", "y", "z", "u.x [1/m]", "u.y", "u.z"]);
    for pose in poses {
        let mut cells = vec![format!("{:.3}", pose.arc_length * 1e3)];
        cells.extend(pose.position.iter().map(|x| format!("{:.6}", x * 1e3)));
        cells.extend(pose.curvature.iter().map(|u| format!("{u:.6}")));
        table.row(cells);
    }
    format!("shape\n{table}")
}

/// The same for a program, derivatives included: `jacobian.*[point][row][parameter]`.
pub fn json(solved: &Solved, poses: &[Pose]) -> Value {
    let of = |value: fn(&Pose) -> Value| -> Vec<Value> { poses.iter().map(value).collect() };
    let rows = |value: fn(&PoseDerivative) -> Vector| -> Vec<Vec<Vec<f64>>> {
        let of_pose =
            |pose: &Pose| (0..3).map(|row| pose.derivatives.iter().map(|d| value(d)[row]).collect()).collect();
        poses.iter().map(of_pose).collect()
    };
    let names: Vec<&str> = solved.plan.derivatives.iter().map(|derivative| derivative.name.as_str()).collect();
    json!({
        "arc_length": of(|pose| json!(pose.arc_length)),
        "position": of(|pose| json!(pose.position)),
        "rotation": of(|pose| json!(pose.rotation)),
        "curvature": of(|pose| json!(pose.curvature)),
        "jacobian": {
            "parameters": names,
            "position": rows(|d| d.dp),
            "rotation": rows(|d| d.w),
            "curvature": rows(|d| d.du),
        },
    })
}
