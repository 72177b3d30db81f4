//! Dead forces inside of the rod: at a station, on a rigid segment, along a segment.

use super::segment_chain::load_chain;
use super::{Axis, Parameter, Scene, SegmentKind, Slot, Vector};

/// A dead force inside of the rod.
#[derive(Clone, Debug, PartialEq)]
pub struct InnerForce {
    /// Its parameters start with `loads.` and this.
    pub name: String,
    /// Index of the segment it acts on, from the base.
    pub segment: usize,
    /// Where on the segment.
    pub place: ForcePlace,
    /// World frame (N; N/m along a segment)
    pub force: Vector,
}

/// Where a force acts on its segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ForcePlace {
    /// At a point of a flexible segment: its distance from the proximal end (m). It is a point of the material.
    At(f64),
    /// At the middle of a rigid segment.
    Middle,
    /// Per length, all along the segment.
    Along,
}

/// Names that `[loads]` takes for itself.
pub const LOAD_KEYS: [&str; 5] = ["tip_force", "tip_moment", "gravity", "distributed_force", "fluid_density"];

impl Scene {
    /// The forces at points of a segment: their indices, and distances from its proximal end (m).
    pub(super) fn stations(&self, segment: usize) -> Vec<(usize, f64)> {
        let on = self.inner_forces.iter().enumerate().filter(|(_, force)| force.segment == segment);
        let at = |(index, force): (usize, &InnerForce)| match force.place {
            ForcePlace::At(at) => Some((index, at)),
            ForcePlace::Middle | ForcePlace::Along => None,
        };
        on.filter_map(at).collect()
    }

    /// Force per length on a segment, its weight aside, world frame (N/m).
    pub(super) fn force_per_length(&self, segment: usize) -> Vector {
        let whole = self.loads.distributed_force.unwrap_or_default();
        self.sum_of_forces(segment, ForcePlace::Along, whole)
    }

    /// Force at the middle of a rigid segment, weight and forces per length aside, world frame (N).
    pub(super) fn force_at_middle(&self, segment: usize) -> Vector {
        self.sum_of_forces(segment, ForcePlace::Middle, [0.0; 3])
    }

    fn sum_of_forces(&self, segment: usize, place: ForcePlace, start: Vector) -> Vector {
        let of = self.inner_forces.iter().filter(|force| force.segment == segment && force.place == place);
        of.fold(start, |sum, InnerForce { force, .. }| std::array::from_fn(|axis| sum[axis] + force[axis]))
    }

    /// Distance from the base of the point where a force acts, of one along a segment that of its middle (m)
    pub fn arc_length_of(&self, force: &InnerForce) -> f64 {
        let InnerForce { segment, place, .. } = *force;
        let before: f64 = (0..segment).map(|index| self.segment_length(index)).sum();
        let (length, inserted) = (self.segment_length(segment), if segment == 0 { self.inserted } else { 0.0 });
        before
            + match place {
                ForcePlace::At(at) => (at + inserted).clamp(0.0, length.max(0.0)),
                ForcePlace::Middle | ForcePlace::Along => 0.5 * length,
            }
    }

    /// Index in the rod of the segment without length that carries a force at a station.
    pub(super) fn station_index(&self, force: usize) -> Option<usize> {
        let segment = self.inner_forces[force].segment;
        let place = self.pieces(segment).iter().position(|piece| piece.force == Some(force))?;
        Some(self.first_piece(segment) + place)
    }
}

/// Parameters of the forces of a scene, in the scene's order.
pub(super) fn all(scene: &Scene) -> Vec<Parameter> {
    let of = |(index, force): (usize, &InnerForce)| {
        let parameter: fn(usize, Axis) -> Parameter = match force.place {
            ForcePlace::At(_) | ForcePlace::Middle => Parameter::InnerForce,
            ForcePlace::Along => Parameter::ForceAlong,
        };
        Axis::ALL.map(|axis| parameter(index, axis))
    };
    scene.inner_forces.iter().enumerate().flat_map(of).collect()
}

/// Slots and rates of a component of a force.
pub(super) fn chain(scene: &Scene, index: usize, axis: Axis) -> Vec<(Slot, f64)> {
    let InnerForce { segment, place, .. } = scene.inner_forces[index];
    match (place, &scene.segments[segment].kind) {
        (ForcePlace::At(_), _) => {
            scene.station_index(index).map(|station| (Slot::Weight(station, axis), 1.0)).into_iter().collect()
        }
        (ForcePlace::Along, SegmentKind::Rigid(_)) => load_chain(scene, segment, axis, scene.segment_length(segment)),
        (ForcePlace::Along | ForcePlace::Middle, _) => load_chain(scene, segment, axis, 1.0),
    }
}
