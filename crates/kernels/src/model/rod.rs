//! The mechanics of one sample: what a backend needs to know, and nothing about materials or windings.

use super::{Axis, Matrix, Units, Vector};

/// A clamped rod under dead loads in a uniform field; SI units, world frame unless said otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Rod {
    /// [m]
    pub base_position: Vector,
    /// Body to world, by rows.
    pub base_rotation: Matrix,
    /// [T]
    pub flux_density: Vector,
    /// [N]
    pub tip_force: Vector,
    /// [N·m]
    pub tip_moment: Vector,
    pub rigid_force_arm: bool,
    /// Base to tip.
    pub segments: Vec<RodSegment>,
}

/// One stretch of a rod.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RodSegment {
    Flexible(FlexibleRod),
    Rigid(RigidRod),
}

/// A stretch that bends. What varies along it does so linearly: x(s) = x + (s / length) x_rise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlexibleRod {
    /// [m]
    pub length: f64,
    /// EIx, EIy, GJ at the proximal end, body frame [N·m²]
    pub stiffness: Vector,
    /// What is added to them towards the distal end [N·m²]
    pub stiffness_rise: Vector,
    /// u* at the proximal end, body frame [1/m]
    pub rest_curvature: Vector,
    /// What is added to it towards the distal end [1/m]
    pub rest_curvature_rise: Vector,
    /// Force per length [N/m]
    pub load: Vector,
    /// Magnetic moment per length, body frame [A·m]
    pub dipole: Vector,
    /// 1 / (shear stiffness along x, along y, axial stiffness); zero: neither shears nor stretches [1/N]
    pub shear_compliance: Vector,
}

/// A stretch that does not bend.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RigidRod {
    /// [m]
    pub length: f64,
    /// Magnetic moment, body frame [A·m²]
    pub dipole: Vector,
    /// Dead force, spread over the length [N]
    pub weight: Vector,
}

/// A number of the rod by which solutions are differentiated; every user parameter is a combination of these.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Slot {
    BasePosition(Axis),
    /// Virtual rotation of the base about a world axis: dR0 = hat(e) R0.
    BaseRotation(Axis),
    FluxDensity(Axis),
    TipForce(Axis),
    TipMoment(Axis),
    /// More rod past the entry point: a base-pose derivative with the loads fixed. What varies along the first piece
    /// that has a length goes on towards the base as it does there.
    Insertion,
    /// More of a segment at its distal end; what varies along it goes on as it does there.
    Length(usize),
    Stiffness(usize, Axis),
    StiffnessRise(usize, Axis),
    RestCurvature(usize, Axis),
    RestCurvatureRise(usize, Axis),
    /// Force per length of a flexible segment.
    Load(usize, Axis),
    /// Magnetic moment per length of a flexible segment.
    DipolePerLength(usize, Axis),
    ShearCompliance(usize, Axis),
    /// Magnetic moment of a rigid segment.
    Dipole(usize, Axis),
    /// Force on a rigid segment.
    Weight(usize, Axis),
}

/// Record entries before the first segment: d1, t (columns of the base rotation), B, f, l, p0.
pub const BASE_RECORD: usize = 18;
/// Record entries of a flexible segment: its length, then vectors from these offsets on.
pub const FLEXIBLE_RECORD: usize = 22;
pub const STIFFNESS_AT: usize = 1;
pub const STIFFNESS_RISE_AT: usize = 4;
pub const REST_CURVATURE_AT: usize = 7;
pub const REST_CURVATURE_RISE_AT: usize = 10;
pub const LOAD_AT: usize = 13;
pub const DIPOLE_PER_LENGTH_AT: usize = 16;
pub const SHEAR_COMPLIANCE_AT: usize = 19;
/// Record entries of a rigid segment: its length, then vectors from these offsets on.
pub const RIGID_RECORD: usize = 7;
pub const DIPOLE_AT: usize = 1;
pub const WEIGHT_AT: usize = 4;

impl Slot {
    /// One unit of the slot, SI.
    pub fn unit(&self, units: &Units) -> f64 {
        match self {
            Slot::BaseRotation(_) => 1.0,
            Slot::BasePosition(_) | Slot::Insertion | Slot::Length(_) => units.length,
            Slot::FluxDensity(_) => units.field,
            Slot::TipForce(_) | Slot::Weight(..) => units.force,
            Slot::TipMoment(_) => units.moment(),
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
            | Slot::Weight(segment, _) => Some(segment),
            _ => None,
        }
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
    /// EIx, EIy, GJ at the distal end [N·m²]
    pub fn distal_stiffness(&self) -> Vector {
        std::array::from_fn(|k| self.stiffness[k] + self.stiffness_rise[k])
    }

    /// u* at the distal end [1/m]
    pub fn distal_rest_curvature(&self) -> Vector {
        std::array::from_fn(|k| self.rest_curvature[k] + self.rest_curvature_rise[k])
    }

    /// The vectors in the order of the record.
    fn vectors(&self) -> [&Vector; 7] {
        [
            &self.stiffness,
            &self.stiffness_rise,
            &self.rest_curvature,
            &self.rest_curvature_rise,
            &self.load,
            &self.dipole,
            &self.shear_compliance,
        ]
    }

    fn is_valid(&self) -> bool {
        let positive = |v: Vector| v.iter().all(|k| *k > 0.0);
        self.vectors().iter().all(|v| v.iter().all(|x| x.is_finite()))
            && positive(self.stiffness)
            && positive(self.distal_stiffness())
            && self.shear_compliance.iter().all(|c| *c >= 0.0)
    }
}

impl RigidRod {
    fn is_valid(&self) -> bool {
        self.dipole.iter().chain(&self.weight).all(|x| x.is_finite())
    }
}

impl RodSegment {
    pub fn length(&self) -> f64 {
        match self {
            RodSegment::Flexible(flexible) => flexible.length,
            RodSegment::Rigid(rigid) => rigid.length,
        }
    }

    pub fn is_flexible(&self) -> bool {
        matches!(self, RodSegment::Flexible(_))
    }

    /// Entries of this segment's record.
    pub fn record_len(&self) -> usize {
        match self {
            RodSegment::Flexible(_) => FLEXIBLE_RECORD,
            RodSegment::Rigid(_) => RIGID_RECORD,
        }
    }
}

impl Rod {
    /// Sum of the segments' lengths [m].
    pub fn total_length(&self) -> f64 {
        self.segments.iter().map(RodSegment::length).sum()
    }

    /// Writes the rod as a flat record: base entries, then each segment's. SI units.
    pub fn write_record(&self, record: &mut Vec<f64>) {
        record.clear();
        let rotation = &self.base_rotation;
        record.extend((0..3).map(|row| rotation[row][0]));
        record.extend((0..3).map(|row| rotation[row][2]));
        record.extend(self.flux_density);
        record.extend(self.tip_force);
        record.extend(self.tip_moment);
        record.extend(self.base_position);
        for segment in &self.segments {
            record.push(segment.length());
            match segment {
                RodSegment::Flexible(flexible) => record.extend(flexible.vectors().into_iter().flatten()),
                RodSegment::Rigid(rigid) => record.extend(rigid.dipole.iter().chain(&rigid.weight)),
            }
        }
    }

    /// Reads back what [`Rod::write_record`] wrote, entry by entry; `self` gives the kinds of the segments.
    pub fn read_record(&mut self, record: impl Fn(usize) -> f64) {
        let vector = |at: usize| -> Vector { [record(at), record(at + 1), record(at + 2)] };
        let (d1, t) = (vector(0), vector(3));
        let d2 = [t[1] * d1[2] - t[2] * d1[1], t[2] * d1[0] - t[0] * d1[2], t[0] * d1[1] - t[1] * d1[0]];
        self.base_rotation = std::array::from_fn(|row| [d1[row], d2[row], t[row]]);
        self.flux_density = vector(6);
        self.tip_force = vector(9);
        self.tip_moment = vector(12);
        self.base_position = vector(15);
        let mut at = BASE_RECORD;
        for segment in &mut self.segments {
            let start = at;
            at += segment.record_len();
            *segment = match segment {
                RodSegment::Flexible(_) => RodSegment::Flexible(FlexibleRod {
                    length: record(start),
                    stiffness: vector(start + STIFFNESS_AT),
                    stiffness_rise: vector(start + STIFFNESS_RISE_AT),
                    rest_curvature: vector(start + REST_CURVATURE_AT),
                    rest_curvature_rise: vector(start + REST_CURVATURE_RISE_AT),
                    load: vector(start + LOAD_AT),
                    dipole: vector(start + DIPOLE_PER_LENGTH_AT),
                    shear_compliance: vector(start + SHEAR_COMPLIANCE_AT),
                }),
                RodSegment::Rigid(_) => RodSegment::Rigid(RigidRod {
                    length: record(start),
                    dipole: vector(start + DIPOLE_AT),
                    weight: vector(start + WEIGHT_AT),
                }),
            };
        }
    }

    /// Whether the numbers can be integrated: finite, lengths not negative, stiffness positive.
    pub fn is_valid(&self) -> bool {
        let finite = |v: &Vector| v.iter().all(|x| x.is_finite());
        finite(&self.base_position)
            && self.base_rotation.iter().all(finite)
            && finite(&self.flux_density)
            && finite(&self.tip_force)
            && finite(&self.tip_moment)
            && self.total_length() > 0.0
            && self.segments.iter().all(|segment| {
                let length = segment.length();
                length.is_finite()
                    && length >= 0.0
                    && match segment {
                        RodSegment::Flexible(flexible) => flexible.is_valid(),
                        RodSegment::Rigid(rigid) => rigid.is_valid(),
                    }
            })
    }
}

/// First record entry of each segment.
pub fn record_offsets(segments: &[RodSegment]) -> Vec<usize> {
    let mut at = BASE_RECORD;
    segments
        .iter()
        .map(|segment| {
            let start = at;
            at += segment.record_len();
            start
        })
        .collect()
}
