//! A solved rod's shape in space, with its coils, the field and the loads.

use super::wall::wall;
use crate::draw::{ForceAt, RodShape, Stretch, StretchKind, Surroundings};
use crate::model::{Frame, InnerLoad, LoadPlace, RigidRod, Rod, RodSegment, Scene, Segment, Status, Vector};
use crate::reference::{Equilibrium, Pose, shape, solve_rod};
use crate::study::{Solved, along_segments, smooth_count};

/// Points along the rod at rest.
const REST_POINTS: usize = 164;

/// The reference, which integrates the shape, finds no equilibrium on the branch from rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the reference finds no equilibrium to draw ({})", status.name())]
pub struct NothingToDraw {
    /// What became of the rod.
    pub status: Status,
}

/// A solved rod with its loads and, dashed, the same rod without them. The reference solves it again from rest.
///
/// # Errors
///
/// No equilibrium on the branch from rest.
///
/// # Example
///
/// ```no_run
/// use rodsweep::{draw, figures, input, study::Solve};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let scene = input::read_scene("sweeps/scenes/tip_coil.toml".as_ref())?;
/// let solved = Solve::new(scene).run()?;
/// draw::write(&figures::rod_shape(&solved)?, "rod.png".as_ref())?;
/// # Ok(())
/// # }
/// ```
pub fn rod_shape(solved: &Solved) -> Result<RodShape, NothingToDraw> {
    let (scene, rod) = (solved.scene(), solved.rod());
    let equilibrium = solve_rod(&rod, &[]);
    if !equilibrium.status.is_converged() {
        return Err(NothingToDraw { status: equilibrium.status });
    }
    let count = smooth_count(&rod);
    let poses = shape(&rod, &equilibrium, &along_segments(scene, count));
    let of_segment = |(index, poses): (usize, &[Pose])| {
        stretch(&scene.segments[index], &rod.segments[scene.piece_indices(index).start], poses)
    };
    let stretches = poses.chunks(count).enumerate().map(of_segment).collect();
    let if_any = |v: Vector| v.iter().any(|x| *x != 0.0).then_some(v);
    Ok(RodShape {
        title: scene.name.clone(),
        stretches,
        tip_rotation: Some(equilibrium.R_tip),
        flux_density: if_any(rod.flux_density),
        surroundings: Surroundings::of(scene),
        wall: wall(solved),
        tip_force: if_any(rod.tip_force),
        inner_loads: inner_loads(scene, &rod, &equilibrium),
        rest: centreline_at_rest(&rod),
    })
}

/// Forces at points of the rod: at stations and at the middles of rigid segments.
fn inner_loads(scene: &Scene, rod: &Rod, equilibrium: &Equilibrium) -> Vec<ForceAt> {
    let is_drawn = |force: &&InnerLoad| force.place != LoadPlace::Along && force.force != [0.0; 3];
    let mut forces: Vec<&InnerLoad> = scene.inner_loads.iter().filter(is_drawn).collect();
    if forces.is_empty() {
        return Vec::new();
    }
    forces.sort_by(|a, b| scene.arc_length_of(a).total_cmp(&scene.arc_length_of(b)));
    let at: Vec<f64> = forces.iter().map(|force| scene.arc_length_of(force)).collect();
    let of = |(load, pose): (&InnerLoad, Pose)| {
        let turned = pose.rotation.map(|row| (0..3).map(|k| row[k] * load.force[k]).sum());
        let force = if load.frame == Frame::Body { turned } else { load.force };
        ForceAt { name: load.name.clone(), point: pose.position, force }
    };
    forces.into_iter().zip(shape(rod, equilibrium, &at)).map(of).collect()
}

fn stretch(segment: &Segment, rod: &RodSegment, poses: &[Pose]) -> Stretch {
    let kind = StretchKind::of(segment);
    let dipole = match rod {
        RodSegment::Rigid(RigidRod { dipole, .. }) if kind.has_dipole() => {
            let in_world = |pose: &Pose| pose.rotation.map(|row| (0..3).map(|k| row[k] * dipole[k]).sum());
            poses.first().map(in_world)
        }
        _ => None,
    };
    Stretch { name: segment.name.clone(), kind, points: poses.iter().map(|pose| pose.position).collect(), dipole }
}

/// Without loads.
fn centreline_at_rest(rod: &Rod) -> Option<Vec<Vector>> {
    let mut unloaded = Rod { field: None, wall: None, ..rod.clone() };
    (unloaded.tip_force, unloaded.tip_moment) = ([0.0; 3], [0.0; 3]);
    for segment in &mut unloaded.segments {
        match segment {
            RodSegment::Flexible(flexible) => (flexible.load, flexible.dipole) = ([0.0; 3], [0.0; 3]),
            RodSegment::Rigid(rigid) => {
                (rigid.dipole, rigid.weight, rigid.couple) = ([0.0; 3], [0.0; 3], [0.0; 3]);
            }
        }
    }
    let equilibrium = solve_rod(&unloaded, &[]);
    let length = rod.total_length();
    let at: Vec<f64> = (0..=REST_POINTS).map(|k| length * k as f64 / REST_POINTS as f64).collect();
    let points: Vec<Vector> = shape(&unloaded, &equilibrium, &at).into_iter().map(|pose| pose.position).collect();
    equilibrium.status.is_converged().then_some(points)
}
