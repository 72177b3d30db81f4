//! The rod as a flat record: one table gives the places of its numbers, their units, how they are written and read, and
//! the names by which shaders load them.
//!
//! Base entries, then each segment's: its length, then vectors; last what of the field varies in space. A load at the tip is one more line in `base`.

use super::rod::{FlexibleRod, RigidRod, Rod, RodSegment};
use super::{RodField, Units, Vector};

/// A vector of the record.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// As shaders call it.
    pub name: &'static str,
    /// Its place, from the start of its part of the record.
    pub at: usize,
    unit: fn(&Units) -> f64,
}

impl Field {
    /// One unit of it, SI.
    pub fn unit(&self, units: &Units) -> f64 {
        (self.unit)(units)
    }
}

/// A part of the record: `first` numbers, then vectors.
macro_rules! part {
    ($(#[$doc:meta])* $part:ident of $of:ty, $fields:ident, $length:ident, from $first:literal:
     $($name:ident $at:ident $unit:expr, $get:expr, $set:expr;)*) => {
        mod $part {
            #[allow(non_camel_case_types)]
            enum Order { $($name,)* Count }

            $(pub const $at: usize = $first + 3 * Order::$name as usize;)*
            pub const LENGTH: usize = $first + 3 * Order::Count as usize;
        }

        $(#[doc = concat!("Place of `", stringify!($name), "`.")] pub const $at: usize = $part::$at;)*
        /// Entries of such a part.
        pub const $length: usize = $part::LENGTH;
        $(#[$doc])*
        pub const $fields: &[Field] = &[$(Field { name: stringify!($name), at: $at, unit: $unit }),*];

        impl $of {
            fn write_vectors(&self, record: &mut Vec<f64>) {
                $(let get: fn(&$of) -> Vector = $get; record.extend(get(self));)*
            }

            /// Whether every vector is.
            pub(super) fn is_finite(&self) -> bool {
                let is_finite = |get: fn(&$of) -> Vector| get(self).iter().all(|x| x.is_finite());
                $(is_finite($get))&&*
            }

            fn read_vectors(&mut self, vector: impl Fn(usize) -> Vector) {
                $(let set: fn(&mut $of, Vector) = $set; set(self, vector($at));)*
            }
        }
    };
}

part! {
    /// The vectors before the first segment.
    base of Rod, BASE_FIELDS, BASE_RECORD, from 0:
    base_d1 BASE_D1_AT |_| 1.0, |rod| rod.base_column(0), |rod, d1| rod.set_base_column(0, d1);
    base_t BASE_T_AT |_| 1.0, |rod| rod.base_column(2), |rod, t| rod.set_base_column(2, t);
    flux_density FLUX_DENSITY_AT |units| units.field, |rod| rod.flux_density, |rod, b| rod.flux_density = b;
    tip_force TIP_FORCE_AT |units| units.force, |rod| rod.tip_force, |rod, f| rod.tip_force = f;
    tip_moment TIP_MOMENT_AT |units| units.moment(), |rod| rod.tip_moment, |rod, l| rod.tip_moment = l;
    base_position BASE_POSITION_AT |units| units.length, |rod| rod.base_position, |rod, p| rod.base_position = p;
}

part! {
    /// The vectors of a flexible segment.
    flexible of FlexibleRod, FLEXIBLE_FIELDS, FLEXIBLE_RECORD, from 1:
    stiffness STIFFNESS_AT |units| units.stiffness(), |rod| rod.stiffness, |rod, k| rod.stiffness = k;
    stiffness_rise STIFFNESS_RISE_AT |units| units.stiffness(), |rod| rod.stiffness_rise, |rod, k| rod.stiffness_rise = k;
    rest_curvature REST_CURVATURE_AT |units| units.curvature(), |rod| rod.rest_curvature, |rod, u| rod.rest_curvature = u;
    rest_curvature_rise REST_CURVATURE_RISE_AT |units| units.curvature(),
        |rod| rod.rest_curvature_rise, |rod, u| rod.rest_curvature_rise = u;
    load LOAD_AT |units| units.load(), |rod| rod.load, |rod, w| rod.load = w;
    dipole_per_length DIPOLE_PER_LENGTH_AT |units| units.dipole() / units.length, |rod| rod.dipole, |rod, mu| rod.dipole = mu;
    shear_compliance SHEAR_COMPLIANCE_AT |units| 1.0 / units.force,
        |rod| rod.shear_compliance, |rod, c| rod.shear_compliance = c;
}

part! {
    /// The vectors of a rigid segment.
    rigid of RigidRod, RIGID_FIELDS, RIGID_RECORD, from 1:
    dipole DIPOLE_AT |units| units.dipole(), |rod| rod.dipole, |rod, mu| rod.dipole = mu;
    weight WEIGHT_AT |units| units.force, |rod| rod.weight, |rod, w| rod.weight = w;
    couple COUPLE_AT |units| units.moment(), |rod| rod.couple, |rod, c| rod.couple = c;
}

impl RodSegment {
    /// Entries of this segment's record.
    pub fn record_len(&self) -> usize {
        match self {
            RodSegment::Flexible(_) => FLEXIBLE_RECORD,
            RodSegment::Rigid(_) => RIGID_RECORD,
        }
    }
}

impl Rod {
    fn base_column(&self, column: usize) -> Vector {
        self.base_rotation.map(|row| row[column])
    }

    fn set_base_column(&mut self, column: usize, values: Vector) {
        self.base_rotation.iter_mut().zip(values).for_each(|(row, value)| row[column] = value);
    }

    /// Writes the rod as a flat record: base entries, then each segment's. SI units.
    pub fn write_record(&self, record: &mut Vec<f64>) {
        record.clear();
        self.write_vectors(record);
        for segment in &self.segments {
            record.push(segment.length());
            match segment {
                RodSegment::Flexible(flexible) => flexible.write_vectors(record),
                RodSegment::Rigid(rigid) => rigid.write_vectors(record),
            }
        }
        if let Some(field) = &self.field {
            field.write(record);
        }
        if let Some(wall) = &self.wall {
            wall.write(record);
        }
    }

    /// Reads back what [`Rod::write_record`] wrote, entry by entry; `self` gives the kinds of the segments.
    pub fn read_record(&mut self, record: impl Fn(usize) -> f64) {
        let vector = |at: usize| -> Vector { [record(at), record(at + 1), record(at + 2)] };
        self.read_vectors(vector);
        let (d1, t) = (self.base_column(0), self.base_column(2));
        let d2 = [t[1] * d1[2] - t[2] * d1[1], t[2] * d1[0] - t[0] * d1[2], t[0] * d1[1] - t[1] * d1[0]];
        self.set_base_column(1, d2);
        let mut start = BASE_RECORD;
        for segment in &mut self.segments {
            let of_segment = |at: usize| vector(start + at);
            match segment {
                RodSegment::Flexible(flexible) => {
                    flexible.length = record(start);
                    flexible.read_vectors(of_segment);
                }
                RodSegment::Rigid(rigid) => {
                    rigid.length = record(start);
                    rigid.read_vectors(of_segment);
                }
            }
            start += segment.record_len();
        }
        if let Some(field) = &mut self.field {
            field.read(|at| record(start + at));
        }
        start += self.field.as_ref().map_or(0, RodField::record_len);
        if let Some(wall) = &mut self.wall {
            wall.read(|at| record(start + at));
        }
    }

    /// Unit of each entry of the record of segments of these kinds: divide an SI value by it.
    pub(super) fn record_units(flexible: impl Iterator<Item = bool>, units: &Units) -> Vec<f64> {
        let unit = |field: &Field| [field.unit(units); 3];
        let mut all: Vec<f64> = BASE_FIELDS.iter().flat_map(unit).collect();
        for flexible in flexible {
            all.push(units.length);
            all.extend(if flexible { FLEXIBLE_FIELDS } else { RIGID_FIELDS }.iter().flat_map(unit));
        }
        all
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

/// First record entry of what of the field varies in space.
pub fn field_offset(segments: &[RodSegment]) -> usize {
    BASE_RECORD + segments.iter().map(RodSegment::record_len).sum::<usize>()
}

/// First record entry of the wall of a rod that has one.
pub fn wall_offset(rod: &Rod) -> usize {
    field_offset(&rod.segments) + rod.field.as_ref().map_or(0, RodField::record_len)
}
