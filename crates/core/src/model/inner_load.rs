//! Forces and couples inside of the rod: at a station, on a rigid segment, along a segment; those at the tip that turn with it.

use super::segment_chain::load_chain;
use super::{Axis, Parameter, RigidRod, Scene, SegmentKind, Slot, Vector};

/// A force, a couple or both, inside of the rod or at its tip.
#[derive(Clone, Debug, PartialEq)]
pub struct InnerLoad {
    /// Its parameters start with `loads.` and this.
    pub name: String,
    /// Index of the segment it acts on, from the base.
    pub segment: usize,
    /// Where on the segment.
    pub place: LoadPlace,
    /// In N; N/m along a segment
    pub force: Vector,
    /// `None`: it has no couple (N·m)
    pub moment: Option<Vector>,
    /// In which it keeps its direction.
    pub frame: Frame,
}

/// In which frame a load keeps its direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Frame {
    /// It is dead.
    #[default]
    World,
    /// It turns with the rod where it acts: a follower load.
    Body,
}

/// Where a force acts on its segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadPlace {
    /// At a point of a flexible segment: its distance from the proximal end (m). It is a point of the material.
    At(f64),
    /// At the middle of a rigid segment.
    Middle,
    /// Per length, all along the segment.
    Along,
    /// At the distal end of the rod.
    Tip,
}

/// Names that `[loads]` takes for itself.
pub const LOAD_KEYS: [&str; 5] = ["tip_force", "tip_moment", "gravity", "distributed_force", "fluid_density"];

impl Frame {
    /// Both.
    pub const ALL: [Frame; 2] = [Frame::World, Frame::Body];

    /// The word in files.
    pub fn name(self) -> &'static str {
        match self {
            Frame::World => "world",
            Frame::Body => "body",
        }
    }
}

impl InnerLoad {
    /// Whether it has an energy: a dead force. Others are carried by pieces without length.
    pub fn is_dead_force(&self) -> bool {
        self.moment.is_none() && self.frame == Frame::World
    }

    /// Whether the piece that carries it may have a couple.
    pub(super) fn has_couple(&self) -> bool {
        self.moment.is_some() || self.place == LoadPlace::Middle
    }
}

impl Scene {
    /// Whether a load other than a tip moment has no energy: a couple inside of the rod, or what turns with it.
    pub fn has_load_without_energy(&self) -> bool {
        !self.inner_loads.iter().all(InnerLoad::is_dead_force)
    }

    /// A load at the tip that turns with it, by its key under `[loads]`.
    pub(super) fn tip_load(&self, key: &str) -> Option<&InnerLoad> {
        self.inner_loads.iter().find(|load| load.place == LoadPlace::Tip && load.name == key)
    }

    /// Loads that a piece without length at the distal end of a segment carries, by their indices.
    pub(super) fn loads_at_end(&self, segment: usize) -> Vec<usize> {
        let is_there = |load: &InnerLoad| match load.place {
            LoadPlace::Tip => true,
            LoadPlace::Middle => !load.is_dead_force(),
            LoadPlace::At(_) | LoadPlace::Along => false,
        };
        let on = self.inner_loads.iter().enumerate().filter(|(_, load)| load.segment == segment && is_there(load));
        on.map(|(index, _)| index).collect()
    }

    /// The piece without length that carries a load. At the middle of a rigid segment, seen from its distal end, a force that turns with
    /// it is itself and a couple; a dead one is among the segment's own.
    pub(super) fn station(&self, load: usize) -> RigidRod {
        let InnerLoad { segment, place, force, moment, frame, .. } = self.inner_loads[load];
        let mut station = RigidRod { weight: force, couple: moment.unwrap_or_default(), ..RigidRod::default() };
        station.follows = frame == Frame::Body;
        if place == LoadPlace::Middle {
            if !station.follows {
                station.weight = [0.0; 3];
            } else {
                let arm = self.half_arm(segment);
                (0..2).for_each(|k| station.couple[k] += arm * [force[1], -force[0]][k]);
            }
        }
        station
    }

    /// Half of a rigid segment as a lever arm (m)
    fn half_arm(&self, segment: usize) -> f64 {
        if self.rigid_force_arm { 0.5 * self.segment_length(segment) } else { 0.0 }
    }

    /// The forces at points of a segment: their indices, and distances from its proximal end (m).
    pub(super) fn stations(&self, segment: usize) -> Vec<(usize, f64)> {
        let on = self.inner_loads.iter().enumerate().filter(|(_, force)| force.segment == segment);
        let at = |(index, force): (usize, &InnerLoad)| match force.place {
            LoadPlace::At(at) => Some((index, at)),
            LoadPlace::Middle | LoadPlace::Along | LoadPlace::Tip => None,
        };
        on.filter_map(at).collect()
    }

    /// Force per length on a segment, its weight aside, world frame (N/m).
    pub(super) fn force_per_length(&self, segment: usize) -> Vector {
        let whole = self.loads.distributed_force.unwrap_or_default();
        self.sum_of_forces(segment, LoadPlace::Along, whole)
    }

    /// Force at the middle of a rigid segment, weight and forces per length aside, world frame (N).
    pub(super) fn force_at_middle(&self, segment: usize) -> Vector {
        self.sum_of_forces(segment, LoadPlace::Middle, [0.0; 3])
    }

    fn sum_of_forces(&self, segment: usize, place: LoadPlace, start: Vector) -> Vector {
        let is_one = |load: &&InnerLoad| load.segment == segment && load.place == place && load.frame == Frame::World;
        let of = self.inner_loads.iter().filter(is_one);
        of.fold(start, |sum, InnerLoad { force, .. }| std::array::from_fn(|axis| sum[axis] + force[axis]))
    }

    /// Distance from the base of the point where a force acts, of one along a segment that of its middle (m)
    pub fn arc_length_of(&self, force: &InnerLoad) -> f64 {
        let InnerLoad { segment, place, .. } = *force;
        let before: f64 = (0..segment).map(|index| self.segment_length(index)).sum();
        let (length, inserted) = (self.segment_length(segment), if segment == 0 { self.inserted } else { 0.0 });
        before
            + match place {
                LoadPlace::At(at) => (at + inserted).clamp(0.0, length.max(0.0)),
                LoadPlace::Middle | LoadPlace::Along => 0.5 * length,
                LoadPlace::Tip => length,
            }
    }

    /// Index in the rod of the piece without length that carries a load.
    pub(super) fn station_index(&self, force: usize) -> Option<usize> {
        let segment = self.inner_loads[force].segment;
        let place = self.pieces(segment).iter().position(|piece| piece.force == Some(force))?;
        Some(self.first_piece(segment) + place)
    }
}

/// Parameters of the forces of a scene, in the scene's order.
pub(super) fn all(scene: &Scene) -> Vec<Parameter> {
    let of = |(index, load): (usize, &InnerLoad)| {
        let force: fn(usize, Axis) -> Parameter = match load.place {
            LoadPlace::At(_) | LoadPlace::Middle | LoadPlace::Tip => Parameter::InnerForce,
            LoadPlace::Along => Parameter::ForceAlong,
        };
        let moment = load.moment.map(|_| Axis::ALL.map(|axis| Parameter::InnerMoment(index, axis)));
        let has_force = load.place != LoadPlace::Tip || load.moment.is_none();
        let force = has_force.then(|| Axis::ALL.map(|axis| force(index, axis)));
        [force, moment].into_iter().flatten().flatten()
    };
    scene.inner_loads.iter().enumerate().flat_map(of).collect()
}

/// Slots and rates of a component of a force.
pub(super) fn chain(scene: &Scene, index: usize, axis: Axis) -> Vec<(Slot, f64)> {
    let InnerLoad { segment, place, frame, .. } = scene.inner_loads[index];
    let at_station = || scene.station_index(index).map(|station| (Slot::Weight(station, axis), 1.0)).into_iter();
    match (place, &scene.segments[segment].kind) {
        (LoadPlace::At(_) | LoadPlace::Tip, _) => at_station().collect(),
        (LoadPlace::Middle, _) if frame == Frame::Body => {
            let arm = scene.half_arm(segment);
            let by_arm = match axis {
                Axis::X => Some((Axis::Y, -arm)),
                Axis::Y => Some((Axis::X, arm)),
                Axis::Z => None,
            };
            let couple = scene.station_index(index).zip(by_arm);
            at_station().chain(couple.map(|(station, (axis, rate))| (Slot::Couple(station, axis), rate))).collect()
        }
        (LoadPlace::Along, SegmentKind::Rigid(_)) => load_chain(scene, segment, axis, scene.segment_length(segment)),
        (LoadPlace::Along | LoadPlace::Middle, _) => load_chain(scene, segment, axis, 1.0),
    }
}

/// Slots and rates of a component of a couple.
pub(super) fn moment_chain(scene: &Scene, index: usize, axis: Axis) -> Vec<(Slot, f64)> {
    scene.station_index(index).map(|station| (Slot::Couple(station, axis), 1.0)).into_iter().collect()
}

/// Slots and rates by the length of a rigid segment: follower forces at its middle make couples at its distal end, which grow with the arm.
pub(super) fn length_chain(scene: &Scene, segment: usize) -> Vec<(Slot, f64)> {
    let half = if scene.rigid_force_arm { 0.5 } else { 0.0 };
    let follows = |index: &usize| {
        let load = &scene.inner_loads[*index];
        load.place == LoadPlace::Middle && load.frame == Frame::Body
    };
    let of = |index: usize| {
        let force = scene.inner_loads[index].force;
        let rates = [(Axis::X, half * force[1]), (Axis::Y, -half * force[0])];
        let station = scene.station_index(index);
        station.into_iter().flat_map(move |station| rates.map(|(axis, rate)| (Slot::Couple(station, axis), rate)))
    };
    scene.loads_at_end(segment).into_iter().filter(follows).flat_map(of).collect()
}
