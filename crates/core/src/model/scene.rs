//! One rod in one field, as a user describes it.

use super::profile::{Piece, pieces};
use super::rotation::rotation_matrix;
use super::{
    Body, Coil, FieldSources, FlexibleRod, InnerLoad, LoadPlace, MagnetMaterial, Node, Profile, RigidRod, Rod,
    RodField, RodSegment, SceneError, Vector, Wall,
};
use std::f64::consts::PI;

/// Standard acceleration of gravity on Earth (m/s²)
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// A rod, clamped at its base, in a field. Lengths, forces and so on in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Title of its figures; may be empty.
    pub name: String,
    /// Where the rod is held.
    pub base: Base,
    /// Uniform flux density, world frame (T)
    pub flux_density: Vector,
    /// What is added to it and varies in space.
    pub sources: FieldSources,
    /// What acts on the rod besides the field.
    pub loads: Loads,
    /// Dead forces inside of the rod.
    pub inner_loads: Vec<InnerLoad>,
    /// Wall that the tip may touch; `None`: the tip is free.
    pub wall: Option<Wall>,
    /// Base to tip.
    pub segments: Vec<Segment>,
    /// Length pushed in at the base of the first segment, above its own; its material moves on (m)
    pub inserted: f64,
    /// Whether a force acts on the lever arm of a rigid segment. `false` reproduces published codes.
    pub rigid_force_arm: bool,
}

/// Pose of the clamped end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Base {
    /// World frame (m)
    pub position: Vector,
    /// Rotation vector, body to world (rad)
    pub rotation: Vector,
}

/// Dead loads in the world frame. A term that is `None` is not modelled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loads {
    /// In N
    pub tip_force: Option<Vector>,
    /// In N·m
    pub tip_moment: Option<Vector>,
    /// In m/s²
    pub gravity: Option<Vector>,
    /// Along the whole rod (N/m)
    pub distributed_force: Option<Vector>,
    /// For buoyancy (kg/m³)
    pub fluid_density: Option<f64>,
}

/// A part of a rod, of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Begins the names of its parameters; no two segments share one.
    pub name: String,
    /// In m
    pub length: f64,
    /// Whether it bends, and what that takes.
    pub kind: SegmentKind,
}

/// What a segment is made of.
#[derive(Clone, Debug, PartialEq)]
pub enum SegmentKind {
    /// It bends and twists.
    Flexible(Flexible),
    /// It keeps its shape.
    Rigid(Rigid),
}

/// A segment that bends and twists.
#[derive(Clone, Debug, PartialEq)]
pub struct Flexible {
    /// Against bending and torsion.
    pub stiffness: Stiffness,
    /// Body frame (1/m)
    pub rest_curvature: Profile,
    /// Against shear along body x and y (N); `None`: does not shear.
    pub stiffness_shear: Option<[f64; 2]>,
    /// Against stretch (N); `None`: does not stretch.
    pub stiffness_axial: Option<f64>,
    /// For weight; `None`: weighs nothing.
    pub density: Option<Density>,
    /// Of a permanent magnet, body frame (A·m)
    pub dipole_per_length: Option<Vector>,
    /// The tube's material, where that tells the dipole.
    pub magnet: Option<MagnetMaterial>,
}

/// Stiffness against bending and torsion: given, or computed from a tube.
#[derive(Clone, Debug, PartialEq)]
pub enum Stiffness {
    /// Principal stiffnesses.
    Direct {
        /// EI about body x (N·m²)
        bending_x: f64,
        /// EI about body y (N·m²)
        bending_y: f64,
        /// GJ (N·m²)
        torsion: f64,
    },
    /// Principal stiffnesses, linear between nodes.
    Nodes(Vec<Node>),
    /// A homogeneous round tube.
    Tube {
        /// 0 for a solid rod (m)
        inner_radius: f64,
        /// In m
        outer_radius: f64,
        /// In Pa
        youngs_modulus: f64,
        /// Shear modulus or Poisson's ratio, for torsion.
        shear: ShearElasticity,
    },
}

/// Elasticity of an isotropic material in shear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShearElasticity {
    /// In Pa
    Modulus(f64),
    /// Above -1; with Young's modulus it tells the shear modulus.
    PoissonRatio(f64),
}

/// Mass of a flexible segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Density {
    /// Of the material (kg/m³); needs a tube.
    Volume(f64),
    /// Of the rod (kg/m); taken as given, without buoyancy.
    Linear(f64),
}

/// A segment that keeps its shape.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rigid {
    /// Spread over the length; taken as given, without buoyancy (kg)
    pub mass: Option<f64>,
    /// Coils on it that carry currents.
    pub coil: Option<Coil>,
    /// Of a permanent magnet, body frame (A·m)
    pub dipole_per_length: Option<Vector>,
    /// Cross-section, and the density where that tells the mass.
    pub body: Option<Body>,
    /// The body's material, where that tells the dipole.
    pub magnet: Option<MagnetMaterial>,
}

impl Flexible {
    /// Whether it is a permanent magnet.
    pub fn is_magnet(&self) -> bool {
        self.dipole_per_length.is_some() || self.magnet.is_some()
    }

    /// Dipole per length of its magnet, body frame (A·m)
    pub fn magnet_dipole_per_length(&self) -> Vector {
        dipole_per_length(self.dipole_per_length, self.magnet, || self.stiffness.cross_section())
    }
}

impl Rigid {
    /// Whether it is a permanent magnet.
    pub fn is_magnet(&self) -> bool {
        self.dipole_per_length.is_some() || self.magnet.is_some()
    }

    /// Dipole per length of its magnet, body frame (A·m)
    pub fn magnet_dipole_per_length(&self) -> Vector {
        dipole_per_length(self.dipole_per_length, self.magnet, || self.body.map(|body| body.cross_section()))
    }
}

fn dipole_per_length(given: Option<Vector>, magnet: Option<MagnetMaterial>, area: impl Fn() -> Option<f64>) -> Vector {
    match magnet {
        None => given.unwrap_or_default(),
        Some(magnet) => magnet.magnetization().map(|x| x * area().unwrap_or(0.0)),
    }
}

impl Scene {
    /// Sum of the segments' lengths (m).
    pub fn total_length(&self) -> f64 {
        self.segments.iter().map(|segment| segment.length).sum::<f64>() + self.inserted
    }

    /// Length of a segment as it is inserted (m).
    pub fn segment_length(&self, index: usize) -> f64 {
        self.segments[index].length + if index == 0 { self.inserted } else { 0.0 }
    }

    /// Makes what was inserted part of the first segment, whose nodes move on.
    pub fn absorb_insertion(&mut self) {
        let inserted = std::mem::take(&mut self.inserted);
        let Some(first) = self.segments.first_mut() else { return };
        first.length += inserted;
        for force in self.inner_loads.iter_mut().filter(|force| force.segment == 0) {
            if let LoadPlace::At(at) = &mut force.place {
                *at += inserted;
            }
        }
        if let SegmentKind::Flexible(Flexible { stiffness, rest_curvature, .. }) = &mut first.kind {
            if let Stiffness::Nodes(nodes) = stiffness {
                nodes.iter_mut().for_each(|node| node.at += inserted);
            }
            if let Profile::Nodes(nodes) = rest_curvature {
                nodes.iter_mut().for_each(|node| node.at += inserted);
            }
        }
    }

    /// Makes nodes that a shorter length has left beyond a segment's end give way to one there; forces move there.
    pub fn cut_nodes(&mut self) {
        for force in &mut self.inner_loads {
            if let LoadPlace::At(at) = &mut force.place {
                *at = at.min(self.segments[force.segment].length);
            }
        }
        for segment in &mut self.segments {
            let SegmentKind::Flexible(Flexible { stiffness, rest_curvature, .. }) = &mut segment.kind else { continue };
            *rest_curvature = rest_curvature.up_to(segment.length);
            if let Profile::Nodes(nodes) = stiffness.profile().up_to(segment.length) {
                *stiffness = Stiffness::Nodes(nodes);
            }
        }
    }

    /// The pieces of a segment, each a segment of the rod.
    pub fn pieces(&self, index: usize) -> Vec<Piece> {
        let inserted = if index == 0 { self.inserted } else { 0.0 };
        let length = self.segment_length(index);
        let mut pieces = match &self.segments[index].kind {
            SegmentKind::Flexible(flexible) => {
                let profiles = [&flexible.rest_curvature, &flexible.stiffness.profile()];
                pieces(&profiles, &self.stations(index), length, inserted)
            }
            SegmentKind::Rigid(_) => pieces(&[], &[], length, inserted),
        };
        if let Some(last) = pieces.last().copied() {
            pieces.extend(self.loads_at_end(index).into_iter().map(|load| last.carrier(load)));
        }
        pieces
    }

    /// Indices in the rod of the pieces of a segment.
    pub fn piece_indices(&self, index: usize) -> std::ops::Range<usize> {
        let first = self.first_piece(index);
        first..first + self.pieces(index).len()
    }

    /// Index in the rod of the first piece of a segment.
    pub(super) fn first_piece(&self, index: usize) -> usize {
        (0..index).map(|before| self.pieces(before).len()).sum()
    }

    /// The pieces of a segment that are of its own kind, forces at stations left out, with their indices in the rod.
    pub fn own_pieces(&self, index: usize) -> Vec<(usize, Piece)> {
        let pieces = (self.first_piece(index)..).zip(self.pieces(index));
        pieces.filter(|(_, piece)| piece.force.is_none()).collect()
    }

    /// Whether weight or another force acts between base and tip.
    pub fn has_inner_load(&self) -> bool {
        self.loads.gravity.is_some() || self.loads.distributed_force.is_some() || !self.inner_loads.is_empty()
    }

    /// Checks that the numbers describe a rod.
    ///
    /// # Errors
    ///
    /// The first number that does not.
    pub fn validate(&self) -> Result<(), SceneError> {
        super::validate::validate(self)
    }

    /// Whether its rods are solved with the force at the base unknown: the field varies in space, there is a wall, or a load other than a
    /// tip moment has no energy.
    pub fn has_unknown_force(&self) -> bool {
        self.sources.varies() || self.wall.is_some() || self.has_load_without_energy()
    }

    /// What of the field varies in space as the mechanics sees it; `None` where the loads tell the force at the base.
    pub fn rod_field(&self) -> Option<RodField> {
        self.sources.rod_field().or_else(|| self.has_unknown_force().then(RodField::none))
    }

    /// The mechanics of this scene: stiffness, dipole and load of every segment.
    pub fn rod(&self) -> Rod {
        let mut segments = Vec::new();
        for index in 0..self.segments.len() {
            self.each_rod_segment(index, |segment| segments.push(segment));
        }
        self.rod_of(segments)
    }

    /// Brings a rod of this scene up to date after some segments, each given with its first piece, and whatever is not
    /// of a segment have changed.
    pub(super) fn update_rod(&self, rod: &mut Rod, changed: &[(usize, usize)]) {
        let mut segments = std::mem::take(&mut rod.segments);
        for (index, first) in changed {
            let mut places = segments[*first..].iter_mut();
            self.each_rod_segment(*index, |segment| places.next().into_iter().for_each(|place| *place = segment));
        }
        *rod = self.rod_of(segments);
    }

    fn rod_of(&self, segments: Vec<RodSegment>) -> Rod {
        Rod {
            base_position: self.base.position,
            base_rotation: rotation_matrix(self.base.rotation),
            flux_density: self.flux_density,
            field: self.rod_field(),
            wall: self.wall.as_ref().map(Wall::rod_wall),
            tip_force: self.loads.tip_force.unwrap_or_default(),
            tip_moment: self.loads.tip_moment.unwrap_or_default(),
            rigid_force_arm: self.rigid_force_arm,
            segments,
        }
    }

    fn each_rod_segment(&self, index: usize, mut put: impl FnMut(RodSegment)) {
        match &self.segments[index].kind {
            SegmentKind::Flexible(flexible) => {
                let profile = flexible.stiffness.profile();
                let load = self.load(flexible, index);
                let [x, y] = flexible.stiffness_shear.unwrap_or([f64::INFINITY; 2]);
                let axial = flexible.stiffness_axial.unwrap_or(f64::INFINITY);
                let segment = |piece: &Piece| {
                    if let Some(force) = piece.force {
                        // A load at the base or withdrawn behind it acts on the clamp, not on the rod.
                        let station = if piece.start > 0.0 { self.station(force) } else { RigidRod::default() };
                        return RodSegment::Rigid(station);
                    }
                    let (stiffness, stiffness_rise) = profile.on(piece);
                    let (rest_curvature, rest_curvature_rise) = flexible.rest_curvature.on(piece);
                    RodSegment::Flexible(FlexibleRod {
                        length: piece.end - piece.start,
                        stiffness,
                        stiffness_rise,
                        rest_curvature,
                        rest_curvature_rise,
                        load,
                        dipole: flexible.magnet_dipole_per_length(),
                        shear_compliance: [1.0 / x, 1.0 / y, 1.0 / axial],
                    })
                };
                self.pieces(index).iter().map(segment).for_each(put);
            }
            SegmentKind::Rigid(rigid) => {
                let length = self.segment_length(index);
                let magnet = rigid.magnet_dipole_per_length();
                let coil = rigid.coil.map_or([0.0; 3], |coil| coil.dipole());
                let dipole = std::array::from_fn(|axis| coil[axis] + magnet[axis] * length);
                let weight = self.weight(rigid, index);
                put(RodSegment::Rigid(RigidRod { length, dipole, weight, ..RigidRod::default() }));
                self.loads_at_end(index).into_iter().for_each(|load| put(RodSegment::Rigid(self.station(load))));
            }
        }
    }

    /// Force per length on a flexible segment, world frame (N/m).
    fn load(&self, flexible: &Flexible, index: usize) -> Vector {
        let load = self.force_per_length(index);
        let gravity = self.loads.gravity.unwrap_or_default();
        let density = self.linear_density(flexible);
        std::array::from_fn(|axis| load[axis] + density * gravity[axis])
    }

    /// Force on a rigid segment, world frame (N).
    fn weight(&self, rigid: &Rigid, index: usize) -> Vector {
        let (load, force) = (self.force_per_length(index), self.force_at_middle(index));
        let gravity = self.loads.gravity.unwrap_or_default();
        let length = self.segment_length(index);
        let mass = self.mass(rigid, length);
        std::array::from_fn(|axis| load[axis] * length + mass * gravity[axis] + force[axis])
    }

    /// Mass of a rigid segment, net of displaced fluid where it follows from a density (kg)
    pub fn mass(&self, rigid: &Rigid, length: f64) -> f64 {
        rigid.mass.unwrap_or_else(|| self.body_density(rigid) * length)
    }

    /// Mass per length that follows from the density of a rigid segment, net of displaced fluid (kg/m)
    pub(super) fn body_density(&self, rigid: &Rigid) -> f64 {
        let of = |body: &Body| Some((body.density? - self.loads.fluid_density.unwrap_or(0.0)) * body.cross_section());
        rigid.body.as_ref().and_then(of).unwrap_or(0.0)
    }

    /// Mass per length, net of displaced fluid where the density is of the material (kg/m).
    pub fn linear_density(&self, flexible: &Flexible) -> f64 {
        match flexible.density {
            None => 0.0,
            Some(Density::Linear(density)) => density,
            Some(Density::Volume(density)) => {
                let area = flexible.stiffness.cross_section().unwrap_or(0.0);
                (density - self.loads.fluid_density.unwrap_or(0.0)) * area
            }
        }
    }
}

impl Stiffness {
    /// Along the segment.
    pub fn profile(&self) -> Profile {
        match self {
            Stiffness::Nodes(nodes) => Profile::Nodes(nodes.clone()),
            _ => Profile::Constant(self.principal()),
        }
    }

    /// Stiffness about body x, y, z: EI, EI, GJ, at the first node where there are nodes (N·m²).
    pub fn principal(&self) -> Vector {
        match *self {
            Stiffness::Direct { bending_x, bending_y, torsion } => [bending_x, bending_y, torsion],
            Stiffness::Nodes(ref nodes) => nodes.first().map_or([f64::NAN; 3], |node| node.value),
            Stiffness::Tube { inner_radius, outer_radius, youngs_modulus, .. } => {
                // A negative radius must not pass as its own fourth power.
                let inner_radius = if inner_radius >= 0.0 { inner_radius } else { f64::NAN };
                let second_moment = PI / 4.0 * (outer_radius.powi(4) - inner_radius.powi(4));
                let bending = youngs_modulus * second_moment;
                [bending, bending, self.shear_modulus().unwrap_or(0.0) * 2.0 * second_moment]
            }
        }
    }

    /// Shear modulus of a tube (Pa); `None` where the stiffness is given.
    pub fn shear_modulus(&self) -> Option<f64> {
        match *self {
            Stiffness::Direct { .. } | Stiffness::Nodes(_) => None,
            Stiffness::Tube { shear: ShearElasticity::Modulus(modulus), .. } => Some(modulus),
            Stiffness::Tube { shear: ShearElasticity::PoissonRatio(ratio), youngs_modulus, .. } => {
                Some(youngs_modulus / (2.0 * (1.0 + ratio)))
            }
        }
    }

    /// Area of the tube's wall (m²); `None` where the stiffness is given.
    pub fn cross_section(&self) -> Option<f64> {
        match *self {
            Stiffness::Direct { .. } | Stiffness::Nodes(_) => None,
            Stiffness::Tube { inner_radius, outer_radius, .. } => {
                Some(PI * (outer_radius.powi(2) - inner_radius.powi(2)))
            }
        }
    }
}
