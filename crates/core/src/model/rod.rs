//! The mechanics of one sample: what a backend needs to know, and nothing about materials or windings.

use super::{Axis, GradientEntry, Matrix, RodField, RodWall, Units, Vector};

/// A clamped rod under loads in a field; SI units, world frame unless said otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Rod {
    /// In m
    pub base_position: Vector,
    /// Body to world, by rows.
    pub base_rotation: Matrix,
    /// In T
    pub flux_density: Vector,
    /// What of the field varies in space; `None`: it is uniform.
    pub field: Option<RodField>,
    /// Wall that the tip may touch; `None`: the tip is free.
    pub wall: Option<RodWall>,
    /// In N
    pub tip_force: Vector,
    /// In N·m
    pub tip_moment: Vector,
    /// Whether a force acts on the lever arm of a rigid segment.
    pub rigid_force_arm: bool,
    /// Base to tip.
    pub segments: Vec<RodSegment>,
}

/// One stretch of a rod.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RodSegment {
    /// It bends.
    Flexible(FlexibleRod),
    /// It keeps its shape.
    Rigid(RigidRod),
}

/// A stretch that bends. What varies along it does so linearly: x(s) = x + (s / length) x_rise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlexibleRod {
    /// In m
    pub length: f64,
    /// EIx, EIy, GJ at the proximal end, body frame (N·m²)
    pub stiffness: Vector,
    /// What is added to them towards the distal end (N·m²)
    pub stiffness_rise: Vector,
    /// u* at the proximal end, body frame (1/m)
    pub rest_curvature: Vector,
    /// What is added to it towards the distal end (1/m)
    pub rest_curvature_rise: Vector,
    /// Force per length (N/m)
    pub load: Vector,
    /// Magnetic moment per length, body frame (A·m)
    pub dipole: Vector,
    /// 1 / (shear stiffness along x, along y, axial stiffness); zero: neither shears nor stretches (1/N)
    pub shear_compliance: Vector,
}

/// A stretch that does not bend.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RigidRod {
    /// In m
    pub length: f64,
    /// Magnetic moment, body frame (A·m²)
    pub dipole: Vector,
    /// Force, spread over the length (N)
    pub weight: Vector,
    /// Couple on it, in a field that varies or beside other loads of that kind alone (N·m)
    pub couple: Vector,
    /// Whether force and couple turn with it, and are given in the body frame; else they keep their direction.
    pub follows: bool,
}

/// A number of the rod by which solutions are differentiated; every user parameter is a combination of these.
///
/// Segments are given by their index in the rod, base to tip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Slot {
    /// Position of the base (m).
    BasePosition(Axis),
    /// Virtual rotation of the base about a world axis (rad): dR0 = hat(e) R0.
    BaseRotation(Axis),
    /// Flux density (T).
    FluxDensity(Axis),
    /// Gradient of the field (T/m).
    FieldGradient(GradientEntry),
    /// Where the gradient adds nothing to the field (m).
    FieldOrigin(Axis),
    /// Position of a dipole outside of the rod (m).
    SourcePosition(usize, Axis),
    /// Moment of a dipole outside of the rod (A·m²).
    SourceMoment(usize, Axis),
    /// Virtual rotation of the edges of a cuboid outside of the rod, its moment at rest (rad).
    SourceTurn(usize, Axis),
    /// Factor of a field sampled on a grid.
    MapScale(usize),
    /// Position of such a field (m).
    MapPosition(usize, Axis),
    /// Position of the wall (m).
    WallPosition(Axis),
    /// Virtual rotation of the wall about its position (rad).
    WallRotation(Axis),
    /// Radius of the wall (m).
    WallRadius,
    /// Radius of the ball at the tip (m).
    WallTipRadius,
    /// 1 / stiffness of the wall (m/N).
    WallCompliance,
    /// Where on the wall the tip is held, before it is moved there (m).
    WallAnchor(Axis),
    /// Force at the tip (N).
    TipForce(Axis),
    /// Couple at the tip (N·m).
    TipMoment(Axis),
    /// More rod past the entry point (m): a base-pose derivative with the loads fixed. What varies along the first piece
    /// that has a length goes on towards the base as it does there.
    Insertion,
    /// More of a segment at its distal end (m); what varies along it goes on as it does there.
    Length(usize),
    /// Stiffness of a flexible segment at its proximal end (N·m²).
    Stiffness(usize, Axis),
    /// What is added to the stiffness towards the distal end (N·m²).
    StiffnessRise(usize, Axis),
    /// Rest curvature of a flexible segment at its proximal end (1/m).
    RestCurvature(usize, Axis),
    /// What is added to the rest curvature towards the distal end (1/m).
    RestCurvatureRise(usize, Axis),
    /// Force per length of a flexible segment, world frame (N/m).
    Load(usize, Axis),
    /// Magnetic moment per length of a flexible segment, body frame (A·m).
    DipolePerLength(usize, Axis),
    /// Compliance of a flexible segment: to shear along body x and y, to stretch along z (1/N).
    ShearCompliance(usize, Axis),
    /// Magnetic moment of a rigid segment, body frame (A·m²).
    Dipole(usize, Axis),
    /// Force on a rigid segment, world frame, or body frame where it follows (N).
    Weight(usize, Axis),
    /// Couple on a rigid segment, in the same frame (N·m).
    Couple(usize, Axis),
}

impl Slot {
    /// One unit of the slot, SI.
    pub fn unit(&self, units: &Units) -> f64 {
        match self {
            Slot::BaseRotation(_) | Slot::MapScale(_) | Slot::WallRotation(_) | Slot::SourceTurn(..) => 1.0,
            Slot::WallPosition(_) | Slot::WallRadius | Slot::WallTipRadius | Slot::WallAnchor(_) => units.length,
            Slot::WallCompliance => units.length / units.force,
            Slot::BasePosition(_) | Slot::Insertion | Slot::Length(_) => units.length,
            Slot::FieldOrigin(_) | Slot::SourcePosition(..) | Slot::MapPosition(..) => units.length,
            Slot::FluxDensity(_) => units.field,
            Slot::FieldGradient(_) => units.gradient(),
            Slot::SourceMoment(..) => units.source_moment(),
            Slot::TipForce(_) | Slot::Weight(..) => units.force,
            Slot::TipMoment(_) | Slot::Couple(..) => units.moment(),
            Slot::Stiffness(..) | Slot::StiffnessRise(..) => units.stiffness(),
            Slot::RestCurvature(..) | Slot::RestCurvatureRise(..) => units.curvature(),
            Slot::DipolePerLength(..) => units.dipole() / units.length,
            Slot::ShearCompliance(..) => 1.0 / units.force,
            Slot::Dipole(..) => units.dipole(),
            Slot::Load(..) => units.load(),
        }
    }

    /// The segment it belongs to.
    pub fn segment(&self) -> Option<usize> {
        match *self {
            Slot::Length(segment)
            | Slot::Stiffness(segment, _)
            | Slot::StiffnessRise(segment, _)
            | Slot::RestCurvature(segment, _)
            | Slot::RestCurvatureRise(segment, _)
            | Slot::Load(segment, _)
            | Slot::DipolePerLength(segment, _)
            | Slot::ShearCompliance(segment, _)
            | Slot::Dipole(segment, _)
            | Slot::Weight(segment, _)
            | Slot::Couple(segment, _) => Some(segment),
            _ => None,
        }
    }

    /// Whether it is of the wall.
    pub fn is_of_wall(&self) -> bool {
        use Slot::{WallAnchor, WallCompliance, WallPosition, WallRadius, WallRotation, WallTipRadius};
        matches!(self, WallPosition(_) | WallRotation(_) | WallRadius | WallTipRadius | WallCompliance | WallAnchor(_))
    }

    /// Whether it is of the part of the field that varies in space.
    pub fn is_of_sources(&self) -> bool {
        matches!(
            self,
            Slot::FieldGradient(_)
                | Slot::FieldOrigin(_)
                | Slot::SourcePosition(..)
                | Slot::SourceMoment(..)
                | Slot::SourceTurn(..)
                | Slot::MapScale(_)
                | Slot::MapPosition(..)
        )
    }

    /// Whether it is one of the numbers that a share of the load multiplies: forces, couples, and what the field is made of.
    pub fn is_load(&self) -> bool {
        use Slot::{Couple, FieldGradient, FluxDensity, Load, MapScale, SourceMoment, TipForce, TipMoment, Weight};
        matches!(
            self,
            FluxDensity(_)
                | FieldGradient(_)
                | SourceMoment(..)
                | MapScale(_)
                | TipForce(_)
                | TipMoment(_)
                | Load(..)
                | Weight(..)
                | Couple(..)
        )
    }

    /// Whether reciprocity needs an integral along the rod for it.
    pub(super) fn is_integral(&self) -> bool {
        use Slot::{DipolePerLength, Load, RestCurvature, RestCurvatureRise};
        self.is_compliance()
            || matches!(self, DipolePerLength(..) | Load(..) | RestCurvature(..) | RestCurvatureRise(..))
    }

    /// Whether it changes nothing where no force and no moment act.
    pub(super) fn is_compliance(&self) -> bool {
        matches!(self, Slot::Stiffness(..) | Slot::StiffnessRise(..) | Slot::ShearCompliance(..))
    }
}

impl FlexibleRod {
    /// EIx, EIy, GJ at the distal end (N·m²)
    pub fn distal_stiffness(&self) -> Vector {
        std::array::from_fn(|k| self.stiffness[k] + self.stiffness_rise[k])
    }

    /// u* at the distal end (1/m)
    pub fn distal_rest_curvature(&self) -> Vector {
        std::array::from_fn(|k| self.rest_curvature[k] + self.rest_curvature_rise[k])
    }

    fn is_valid(&self) -> bool {
        let positive = |v: Vector| v.iter().all(|k| *k > 0.0);
        self.is_finite()
            && positive(self.stiffness)
            && positive(self.distal_stiffness())
            && self.shear_compliance.iter().all(|c| *c >= 0.0)
    }
}

impl RodSegment {
    /// From its proximal to its distal end (m).
    pub fn length(&self) -> f64 {
        match self {
            RodSegment::Flexible(flexible) => flexible.length,
            RodSegment::Rigid(rigid) => rigid.length,
        }
    }

    /// Whether it bends.
    pub fn is_flexible(&self) -> bool {
        matches!(self, RodSegment::Flexible(_))
    }
}

impl Rod {
    /// Whether all loads have an energy: no moment acts but that of fields, and no force turns with the rod.
    pub fn has_energy(&self) -> bool {
        let none = [0.0; 3];
        let has = |segment: &RodSegment| match segment {
            RodSegment::Rigid(rigid) => rigid.couple == none && (!rigid.follows || rigid.weight == none),
            RodSegment::Flexible(_) => true,
        };
        self.tip_moment == none && self.segments.iter().all(has)
    }

    /// Sum of the segments' lengths (m).
    pub fn total_length(&self) -> f64 {
        self.segments.iter().map(RodSegment::length).sum()
    }

    /// Whether the numbers can be integrated: finite, lengths not negative, stiffness positive.
    pub fn is_valid(&self) -> bool {
        self.is_finite()
            && self.field.as_ref().is_none_or(RodField::is_finite)
            && self.wall.as_ref().is_none_or(RodWall::is_valid)
            && self.base_rotation.as_flattened().iter().all(|x| x.is_finite())
            && self.total_length() > 0.0
            && self.segments.iter().all(|segment| {
                let length = segment.length();
                length.is_finite()
                    && length >= 0.0
                    && match segment {
                        RodSegment::Flexible(flexible) => flexible.is_valid(),
                        RodSegment::Rigid(rigid) => rigid.is_finite(),
                    }
            })
    }
}
