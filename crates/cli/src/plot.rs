//! `--plot`: the rod's shape in space, with its coils, the field and the loads.

use super::CommandError;
use super::solve::Solved;
use rodsweep::model::{RigidRod, Rod, RodSegment, SegmentPlan, Vector};
use rodsweep::reference::{Pose, shape, solve_rod};
use rodsweep::report::{self, ReportError, RodShape, Stretch, StretchKind};
use std::path::Path;

/// Points along one segment.
const POINTS: usize = 41;

/// Refuses a file name that says neither PNG nor SVG, before anything is solved.
pub fn check_extension(path: &Path) -> Result<(), ReportError> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("png" | "svg") => Ok(()),
        _ => Err(ReportError::Extension { path: path.to_owned() }),
    }
}

/// Draws the rod; its shape is integrated by the reference.
pub fn draw(solved: &Solved, path: &Path) -> Result<(), CommandError> {
    let rod = solved.plan.sample_rod(&solved.batch, 0);
    let equilibrium = solve_rod(&rod, &[]);
    if !equilibrium.status.is_converged() {
        return Err(CommandError::Usage(format!(
            "`--plot`: the reference finds no equilibrium to draw ({})",
            equilibrium.status.name()
        )));
    }
    let some = |v: Vector| v.iter().any(|x| *x != 0.0).then_some(v);
    let mut start = 0.0;
    let mut stretches = Vec::new();
    for (index, segment) in solved.scene.segments.iter().enumerate() {
        let length = solved.scene.segment_length(index);
        let at: Vec<f64> = (0..POINTS).map(|k| start + length * k as f64 / (POINTS - 1) as f64).collect();
        let poses = shape(&rod, &equilibrium, &at);
        let piece = solved.scene.piece_indices(index).start;
        stretches.push(stretch(&rod.segments[piece], &solved.plan.segments[piece], &segment.name, &poses));
        start += length;
    }
    let figure = RodShape {
        title: solved.scene.name.clone(),
        stretches,
        tip_rotation: Some(equilibrium.R_tip),
        flux_density: some(rod.flux_density),
        tip_force: some(rod.tip_force),
        rest: rest(&rod),
    };
    Ok(report::write(&figure, path)?)
}

fn stretch(segment: &RodSegment, plan: &SegmentPlan, name: &str, poses: &[Pose]) -> Stretch {
    let (kind, dipole) = match segment {
        RodSegment::Flexible(_) => (StretchKind::Flexible, None),
        RodSegment::Rigid(RigidRod { dipole, .. }) if plan.has_dipole => {
            let world = poses
                .first()
                .map(|pose| std::array::from_fn(|row| (0..3).map(|k| pose.rotation[row][k] * dipole[k]).sum()));
            (StretchKind::Coil, world)
        }
        RodSegment::Rigid(_) => (StretchKind::Rigid, None),
    };
    Stretch { name: name.into(), kind, points: poses.iter().map(|pose| pose.position).collect(), dipole }
}

/// Centreline without loads.
fn rest(rod: &Rod) -> Option<Vec<Vector>> {
    let mut unloaded = rod.clone();
    (unloaded.tip_force, unloaded.tip_moment) = ([0.0; 3], [0.0; 3]);
    for segment in &mut unloaded.segments {
        match segment {
            RodSegment::Flexible(flexible) => (flexible.load, flexible.dipole) = ([0.0; 3], [0.0; 3]),
            RodSegment::Rigid(rigid) => (rigid.dipole, rigid.weight) = ([0.0; 3], [0.0; 3]),
        }
    }
    let equilibrium = solve_rod(&unloaded, &[]);
    let length = rod.total_length();
    let at: Vec<f64> = (0..=4 * POINTS).map(|k| length * k as f64 / (4 * POINTS) as f64).collect();
    let points: Vec<Vector> = shape(&unloaded, &equilibrium, &at).into_iter().map(|pose| pose.position).collect();
    equilibrium.status.is_converged().then_some(points)
}
