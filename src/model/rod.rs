//! The mechanics of one sample: what a backend needs to know, and nothing about materials or windings.

use super::{Axis, Matrix, Vector};

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
    Flexible {
        /// [m]
        length: f64,
        /// EIx, EIy, GJ, body frame [N·m²]
        stiffness: Vector,
        /// u*, body frame [1/m]
        rest_curvature: Vector,
        /// Force per length [N/m]
        load: Vector,
    },
    Rigid {
        /// [m]
        length: f64,
        /// Magnetic moment, body frame [A·m²]
        dipole: Vector,
        /// Force per length [N/m]
        load: Vector,
    },
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
    /// More rod past the entry point: a base-pose derivative with the loads fixed.
    Insertion,
    Length(usize),
    Stiffness(usize, Axis),
    RestCurvature(usize, Axis),
    Dipole(usize, Axis),
    Load(usize, Axis),
}

/// Record entries before the first segment: d1, t (columns of the base rotation), B, f, l, p0.
pub const BASE_RECORD: usize = 18;
/// Record entries of a flexible segment: length, stiffness, rest curvature, load.
pub const FLEXIBLE_RECORD: usize = 10;
/// Record entries of a rigid segment: length, dipole, load.
pub const RIGID_RECORD: usize = 7;

impl RodSegment {
    pub fn length(&self) -> f64 {
        match *self {
            RodSegment::Flexible { length, .. } | RodSegment::Rigid { length, .. } => length,
        }
    }

    pub fn load(&self) -> Vector {
        match *self {
            RodSegment::Flexible { load, .. } | RodSegment::Rigid { load, .. } => load,
        }
    }

    /// Entries of this segment's record.
    pub fn record_len(&self) -> usize {
        match self {
            RodSegment::Flexible { .. } => FLEXIBLE_RECORD,
            RodSegment::Rigid { .. } => RIGID_RECORD,
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
            match segment {
                RodSegment::Flexible { length, stiffness, rest_curvature, load } => {
                    record.push(*length);
                    record.extend(stiffness);
                    record.extend(rest_curvature);
                    record.extend(load);
                }
                RodSegment::Rigid { length, dipole, load } => {
                    record.push(*length);
                    record.extend(dipole);
                    record.extend(load);
                }
            }
        }
    }

    /// Reads back what [`Rod::write_record`] wrote; `self` gives the kinds of the segments.
    pub fn read_record(&mut self, record: &[f64]) {
        let vector = |at: usize| -> Vector { [record[at], record[at + 1], record[at + 2]] };
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
            match segment {
                RodSegment::Flexible { length, stiffness, rest_curvature, load } => {
                    *length = record[start];
                    *stiffness = vector(start + 1);
                    *rest_curvature = vector(start + 4);
                    *load = vector(start + 7);
                }
                RodSegment::Rigid { length, dipole, load } => {
                    *length = record[start];
                    *dipole = vector(start + 1);
                    *load = vector(start + 4);
                }
            }
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
                        RodSegment::Flexible { stiffness, rest_curvature, load, .. } => {
                            stiffness.iter().all(|k| k.is_finite() && *k > 0.0)
                                && finite(rest_curvature)
                                && finite(load)
                        }
                        RodSegment::Rigid { dipole, load, .. } => finite(dipole) && finite(load),
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
