//! The rod on its way along a trajectory.

use super::centreline::positions;
use super::field;
use super::wall::wall_of_run;
use crate::draw::{RodMotion, Stretch, StretchKind};
use crate::model::{Scene, Segment, Vector};
use crate::study::{ControlRun, TargetResult, along_segments};

/// Points along a segment.
const SEGMENT_POINTS: usize = 14;
/// Places of the rod, at most.
const FRAMES: usize = 100;
/// Points of the path, at most; of more every second or third is drawn.
const MOST_POINTS: usize = 4000;
/// Time for a point where the trajectory has none (s).
const SECONDS_A_POINT: f64 = 0.1;

/// `None` where the rod cannot be integrated.
pub(crate) fn rod_motion(run: &ControlRun) -> Option<RodMotion> {
    let points: Vec<&TargetResult> = run.closed(run.results().iter().collect());
    let intervals = points.len().checked_sub(1)?;
    let frames = intervals.min(FRAMES);
    let at = (0..=frames).map(|k| points[(k * intervals + frames / 2) / frames.max(1)]);
    let at: Vec<(&TargetResult, Scene)> =
        at.map(|point| Some((point, run.commanded_scene(point)?))).collect::<Option<_>>()?;
    let every = points.len().div_ceil(MOST_POINTS).max(1);
    let seconds = run.trajectory().duration.unwrap_or(SECONDS_A_POINT * run.results().len() as f64);
    Some(RodMotion {
        title: format!("{}: {}, {seconds} s", run.scene().name, run.trajectory().name),
        desired: points.iter().step_by(every).map(|point| run.desired_tip(point)).collect(),
        tips: points.iter().step_by(every).map(|point| point.tip).collect(),
        rods: at.iter().map(|(point, scene)| stretches(scene, point)).collect::<Option<_>>()?,
        seconds,
        surroundings: field::still(run),
        wall: wall_of_run(run),
        magnets: at.iter().map(|(_, scene)| field::moved(run, scene)).collect(),
    })
}

fn stretches(scene: &Scene, point: &TargetResult) -> Option<Vec<Stretch>> {
    let positions =
        positions(scene, point.base_moment, point.contact.as_ref(), &along_segments(scene, SEGMENT_POINTS))?;
    let stretch = |(segment, points): (&Segment, &[Vector])| Stretch {
        name: segment.name.clone(),
        kind: StretchKind::of(segment),
        points: points.to_vec(),
        dipole: None,
    };
    Some(scene.segments.iter().zip(positions.chunks(SEGMENT_POINTS)).map(stretch).collect())
}
