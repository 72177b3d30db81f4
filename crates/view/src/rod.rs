//! One rod: values in, equilibrium out, with its shape and what is drawn beside it.

use crate::error::Refusal;
use crate::lines::Lines;
use crate::sources::sources;
use crate::wall::wall;
use rodsweep::draw::{StretchKind, Surroundings};
use rodsweep::figures::rod_shape;
use rodsweep::input::assign;
use rodsweep::model::{Rod, RodSegment, Scene, SegmentKind, Stiffness, Vector};
use rodsweep::reference::{Pose, shape_with_derivatives};
use rodsweep::study::{Solve, SolveError, Solved, along_segments, smooth_count};
use serde_json::{Map, Value, json};
use std::time::Instant;

/// Equilibria that are given a shape.
const MOST_BRANCHES: usize = 64;

/// The scene with other values: `{"coil.current.x": 0.1}`, SI, as by `--set`.
pub fn with_values(scene: &Scene, values: &Map<String, Value>) -> Result<Scene, Refusal> {
    let mut texts = Vec::with_capacity(values.len());
    for (name, value) in values {
        let number = value.as_f64().filter(|x| x.is_finite());
        let number = number.ok_or_else(|| Refusal::wrong(format!("`{name}`: give a number in SI units")))?;
        texts.push(format!("{name}={number:e}"));
    }
    let mut scene = scene.clone();
    assign(&mut scene, &texts).map_err(Refusal::wrong)?;
    Ok(scene)
}

/// Solves as `rodsweep solve` does.
pub fn solve(scene: Scene) -> Result<Solved, Refusal> {
    Solve::new(scene).run().map_err(of_solve)
}

fn of_solve(error: SolveError) -> Refusal {
    if error.is_usage() { Refusal::wrong(error) } else { Refusal::failed(error) }
}

/// The answer to `solve`; `rest` adds the rod without loads, `known` tells which lines of the field the page has, if it wants
/// any.
pub fn answer(scene: Scene, rest: bool, lines: &Lines, known: Option<u64>) -> Result<Value, Refusal> {
    let begun = Instant::now();
    let solved = solve(scene)?;
    let mut answer = json!({
        "solution": solved.to_json(),
        "stability_index": solved.stability_index(),
        "shape": shape(&solved),
        "engine": solved.engine(),
    });
    if rest {
        answer["rest"] = json!(rod_shape(&solved).ok().and_then(|figure| figure.rest));
    }
    if let Some(lines) = known.and_then(|known| lines.answer(solved.scene(), known)) {
        answer["lines"] = lines;
    }
    answer["seconds"] = json!(begun.elapsed().as_secs_f64());
    Ok(answer)
}

/// Every equilibrium, the first as of `solve --all-branches`, each with its shape.
pub fn branches(scene: Scene) -> Result<Value, Refusal> {
    let all = solve(scene)?.all_branches().map_err(of_solve)?;
    let mut answer = all.to_json();
    let shapes = all.branches().iter().take(MOST_BRANCHES).map(|branch| shape(branch.solved()));
    answer["shapes"] = shapes.collect();
    Ok(answer)
}

/// Stretches of the rod with their poses, and the arrows beside them; null where there is no equilibrium.
pub fn shape(solved: &Solved) -> Value {
    if !solved.is_equilibrium() {
        return Value::Null;
    }
    let (scene, rod) = (solved.scene(), solved.rod());
    let count = smooth_count(&rod);
    let at = along_segments(scene, count);
    let Some(poses) = shape_with_derivatives(&solved.pressed_rod(), solved.base_wrench(), &at, &[]) else {
        return Value::Null;
    };
    let each = poses.chunks(count).enumerate();
    let stretches: Vec<Value> = each.map(|(index, poses)| stretch(scene, &rod, index, poses)).collect();
    let around = Surroundings::of(scene);
    let mut shape = json!({
        "stretches": stretches,
        "flux_density": rod.flux_density,
        "tip_force": rod.tip_force,
        "sources": sources(around.as_ref()),
    });
    if scene.wall.is_some() {
        shape["wall"] = wall(scene);
    }
    if let Some(around) = around {
        shape["flux_density_at_tip"] = json!(around.magnitude(solved.tip_position()));
    }
    shape
}

fn stretch(scene: &Scene, rod: &Rod, index: usize, poses: &[Pose]) -> Value {
    let rotations: Vec<f64> = poses.iter().flat_map(|pose| pose.rotation.as_flattened().iter().copied()).collect();
    let positions: Vec<f64> = poses.iter().flat_map(|pose| pose.position).collect();
    let in_world = dipole(scene, rod, index)
        .zip(poses.first())
        .map(|(dipole, pose)| -> Vector { pose.rotation.map(|row| (0..3).map(|k| row[k] * dipole[k]).sum()) });
    json!({
        "name": scene.segments[index].name,
        "kind": StretchKind::of(&scene.segments[index]).name(),
        "radius": radius(scene, index),
        "positions": positions,
        "rotations": rotations,
        "dipole": in_world,
    })
}

/// Dipole moment of a coil or a magnet (A·m²), body frame.
fn dipole(scene: &Scene, rod: &Rod, index: usize) -> Option<Vector> {
    match rod.segments.get(scene.piece_indices(index).start) {
        Some(RodSegment::Rigid(rigid)) if StretchKind::of(&scene.segments[index]).has_dipole() => Some(rigid.dipole),
        _ => None,
    }
}

/// Outer radius of a tube (m).
fn radius(scene: &Scene, index: usize) -> Option<f64> {
    match &scene.segments[index].kind {
        SegmentKind::Flexible(flexible) => match flexible.stiffness {
            Stiffness::Tube { outer_radius, .. } => Some(outer_radius),
            _ => None,
        },
        SegmentKind::Rigid(_) => None,
    }
}
