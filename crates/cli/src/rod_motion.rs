//! The rod along a trajectory, for its figures.

use super::control::Driven;
use super::control_output::{closed, desired};
use rodsweep::model::{Parameter, Scene, SegmentKind, Vector};
use rodsweep::reference::shape_with_derivatives;
use rodsweep::report::{RodMotion, Stretch, StretchKind};
use rodsweep::study::Controlled;

/// Points along a centreline, and along a segment of a rod that moves.
const ROD_POINTS: usize = 81;
const SEGMENT_POINTS: usize = 14;
/// Places of a rod that moves, at most.
const FRAMES: usize = 100;
/// Time for a point where the trajectory has none [s].
const PACE: f64 = 0.1;

/// Points along the rod at one target.
pub fn centreline(driven: &Driven, point: &Controlled) -> Option<Vec<Vector>> {
    let scene = commanded(driven, point)?;
    let length = scene.rod().total_length();
    let at: Vec<f64> = (0..ROD_POINTS).map(|k| length * k as f64 / (ROD_POINTS - 1) as f64).collect();
    positions(&scene, point, &at)
}

/// The rod on its way along the trajectory; none where it cannot be integrated.
pub fn motion(driven: &Driven) -> Option<RodMotion> {
    let points: Vec<&Controlled> = closed(driven, driven.points.iter().collect());
    let intervals = points.len() - 1;
    let frames = intervals.min(FRAMES);
    let at = (0..=frames).map(|k| points[(k * intervals + frames / 2) / frames.max(1)]);
    let seconds = driven.trajectory.duration.unwrap_or(PACE * driven.points.len() as f64);
    Some(RodMotion {
        title: format!("{}: {}, {seconds} s", driven.scene.name, driven.trajectory.name),
        desired: points.iter().map(|point| desired(driven, point)).collect(),
        tips: points.iter().map(|point| point.tip).collect(),
        rods: at.map(|point| stretches(driven, point)).collect::<Option<_>>()?,
        seconds,
    })
}

fn stretches(driven: &Driven, point: &Controlled) -> Option<Vec<Stretch>> {
    let scene = commanded(driven, point)?;
    let mut at = Vec::new();
    let mut start = 0.0;
    for index in 0..scene.segments.len() {
        let length = scene.segment_length(index);
        at.extend((0..SEGMENT_POINTS).map(|k| start + length * k as f64 / (SEGMENT_POINTS - 1) as f64));
        start += length;
    }
    let positions = positions(&scene, point, &at)?;
    let stretch = |(segment, points): (&rodsweep::model::Segment, &[Vector])| Stretch {
        name: segment.name.clone(),
        kind: match &segment.kind {
            SegmentKind::Flexible(_) => StretchKind::Flexible,
            SegmentKind::Rigid(rigid) if rigid.coil.is_some() => StretchKind::Coil,
            SegmentKind::Rigid(_) => StretchKind::Rigid,
        },
        points: points.to_vec(),
        dipole: None,
    };
    Some(scene.segments.iter().zip(positions.chunks(SEGMENT_POINTS)).map(stretch).collect())
}

/// The scene with a point's inputs.
fn commanded(driven: &Driven, point: &Controlled) -> Option<Scene> {
    let mut scene = driven.scene.clone();
    let values = driven.inputs.iter().map(|input| input.parameter).zip(point.inputs.iter().copied());
    Parameter::set_all(&mut scene, values).ok()?;
    Some(scene)
}

fn positions(scene: &Scene, point: &Controlled, at: &[f64]) -> Option<Vec<Vector>> {
    let poses = shape_with_derivatives(&scene.rod(), point.base_moment, at, &[])?;
    Some(poses.into_iter().map(|pose| pose.position).collect())
}
