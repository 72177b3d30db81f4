//! What of the field varies in space as the mechanics sees it: its record of numbers, its value at a point. F0, F1

use super::field::{CoilLoad, MU0_OVER_4PI, gradient_matrix, rotate};
use super::vectors::norm;
use super::{Cuboid, Cylinder, Matrix, RodMap, Units, Vector};

/// The part of the field that varies, as the mechanics sees it; SI units, world frame.
#[derive(Clone, Debug, PartialEq)]
pub struct RodField {
    /// By `model::GradientEntry` (T/m)
    pub gradient: [f64; 5],
    /// In m
    pub origin: Vector,
    /// All dipoles outside of the rod.
    pub dipoles: Vec<FieldDipole>,
    /// Fields sampled on a grid.
    pub maps: Vec<RodMap>,
    /// Where the field acts on a rigid segment.
    pub coil_load: CoilLoad,
}

/// A dipole outside of the rod.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldDipole {
    /// In m
    pub position: Vector,
    /// In A·m²
    pub moment: Vector,
    /// No part of the rod may come nearer to it, or to the surface of its form (m)
    pub clearance: f64,
    /// A point, or what has its exact field.
    pub form: SourceForm,
}

/// The form of what stands for a source of the field.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SourceForm {
    /// A dipole.
    #[default]
    Point,
    /// A cylinder or a ring along the moment.
    Cylinder(Cylinder),
    /// A cuboid.
    Cuboid(Cuboid),
}

impl SourceForm {
    /// In other units.
    pub fn scaled(self, unit: f64) -> Self {
        match self {
            Self::Point => Self::Point,
            Self::Cylinder(cylinder) => Self::Cylinder(cylinder.scaled(unit)),
            Self::Cuboid(cuboid) => Self::Cuboid(cuboid.scaled(unit)),
        }
    }

    /// Whether it is a cuboid.
    pub fn is_cuboid(&self) -> bool {
        matches!(self, Self::Cuboid(_))
    }
}

impl FieldDipole {
    /// Distance of a point from it, or from the surface of its form (m)
    pub fn distance(&self, at: Vector) -> f64 {
        let r = std::array::from_fn(|k| at[k] - self.position[k]);
        let size = norm(self.moment);
        match self.form {
            SourceForm::Point => norm(r),
            SourceForm::Cylinder(cylinder) => cylinder.distance(self.moment.map(|x| x / size), r),
            SourceForm::Cuboid(cuboid) => cuboid.distance(r),
        }
    }

    /// B and its gradient at `r` from it, where it is no point; mu0 / 4 pi is one.
    fn exact(&self, r: Vector) -> Option<(Vector, Matrix)> {
        match self.form {
            SourceForm::Point => None,
            SourceForm::Cylinder(cylinder) => Some(cylinder.field(self.moment, r)),
            SourceForm::Cuboid(cuboid) => Some(cuboid.field(self.moment, r)),
        }
    }
}

/// Entries of the record of a field before its dipoles: gradient and origin.
pub const FIELD_RECORD: usize = 8;
/// Entries of a dipole's record: position and moment.
pub const FIELD_DIPOLE_RECORD: usize = 6;
/// Entries of a map's record: scale and position.
pub const FIELD_MAP_RECORD: usize = 4;

impl RodField {
    /// That of a uniform field.
    pub fn none() -> Self {
        let coil_load = CoilLoad::Middle;
        Self { gradient: [0.0; 5], origin: [0.0; 3], dipoles: Vec::new(), maps: Vec::new(), coil_load }
    }

    /// Entries of its record.
    pub fn record_len(&self) -> usize {
        self.cuboid_record() + Cuboid::RECORD * self.cuboids()
    }

    /// Entries before those of its maps.
    pub fn map_record(&self) -> usize {
        FIELD_RECORD + FIELD_DIPOLE_RECORD * self.dipoles.len()
    }

    /// Entries before those of its cuboids.
    pub fn cuboid_record(&self) -> usize {
        self.map_record() + FIELD_MAP_RECORD * self.maps.len()
    }

    /// How many of its dipoles are cuboids.
    pub(super) fn cuboids(&self) -> usize {
        self.dipoles.iter().filter(|dipole| dipole.form.is_cuboid()).count()
    }

    /// Appends gradient, origin, each dipole's position and moment, each map's scale and position, the edges of each cuboid. SI units.
    pub(super) fn write(&self, record: &mut Vec<f64>) {
        record.extend(self.gradient);
        record.extend(self.origin);
        for dipole in &self.dipoles {
            record.extend(dipole.position);
            record.extend(dipole.moment);
        }
        for map in &self.maps {
            record.push(map.scale);
            record.extend(map.position);
        }
        for dipole in &self.dipoles {
            if let SourceForm::Cuboid(cuboid) = dipole.form {
                record.extend(cuboid.edges.as_flattened());
            }
        }
    }

    /// Reads back what `write` has appended.
    pub(super) fn read(&mut self, record: impl Fn(usize) -> f64) {
        let vector = |at: usize| -> Vector { [record(at), record(at + 1), record(at + 2)] };
        self.gradient = std::array::from_fn(&record);
        self.origin = vector(5);
        for (j, dipole) in self.dipoles.iter_mut().enumerate() {
            let at = FIELD_RECORD + FIELD_DIPOLE_RECORD * j;
            (dipole.position, dipole.moment) = (vector(at), vector(at + 3));
        }
        let first = self.map_record();
        for (k, map) in self.maps.iter_mut().enumerate() {
            let at = first + FIELD_MAP_RECORD * k;
            (map.scale, map.position) = (record(at), vector(at + 1));
        }
        let mut at = self.cuboid_record();
        for dipole in &mut self.dipoles {
            if let SourceForm::Cuboid(cuboid) = &mut dipole.form {
                cuboid.edges = [vector(at), vector(at + 3)];
                at += Cuboid::RECORD;
            }
        }
    }

    /// Unit of each entry of its record.
    pub(super) fn record_units(&self, units: &Units) -> Vec<f64> {
        let mut all = vec![units.gradient(); 5];
        all.extend([units.length; 3]);
        for _ in &self.dipoles {
            all.extend([units.length; 3]);
            all.extend([units.source_moment(); 3]);
        }
        for _ in &self.maps {
            all.extend([1.0, units.length, units.length, units.length]);
        }
        all.extend(std::iter::repeat_n(1.0, Cuboid::RECORD * self.cuboids()));
        all
    }

    /// Whether every number is finite.
    pub(super) fn is_finite(&self) -> bool {
        let mut record = Vec::new();
        self.write(&mut record);
        record.iter().all(|x| x.is_finite())
    }

    /// Force (N) on a dipole (A·m²), and its torque (N·m) but for that of the uniform field, at a point (m)
    pub fn load(&self, at: Vector, mu: Vector) -> (Vector, Vector) {
        let cross = |a: Vector, b: Vector| -> Vector {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let dot = |a: Vector, b: Vector| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
        let mut force = rotate(&gradient_matrix(self.gradient), mu);
        for dipole in &self.dipoles {
            let (r, moment) = (std::array::from_fn(|k| at[k] - dipole.position[k]), dipole.moment);
            if let Some((_, gradient)) = dipole.exact(r) {
                let pull = rotate(&gradient, mu);
                (0..3).for_each(|k| force[k] += MU0_OVER_4PI * pull[k]);
                continue;
            }
            let distance2 = dot(r, r);
            let by = 3.0 * MU0_OVER_4PI / (distance2 * distance2 * distance2.sqrt());
            let (a, b) = (dot(r, moment), dot(r, mu));
            let along = dot(moment, mu) - 5.0 * a * b / distance2;
            (0..3).for_each(|k| force[k] += by * (a * mu[k] + b * moment[k] + along * r[k]));
        }
        for map in &self.maps {
            let of_map = rotate(&map.local(at).gradient, mu);
            (0..3).for_each(|k| force[k] += of_map[k]);
        }
        (force, cross(mu, self.flux_density(at)))
    }

    /// Largest flux density beyond the uniform field (T) and largest gradient (T/m) at points spread over a ball, those too
    /// near a dipole left out.
    pub(super) fn strongest(&self, centre: Vector, radius: f64) -> (f64, f64) {
        let place = |k: usize| -> Vector { [k % 5, k / 5 % 5, k / 25].map(|k| 0.5 * k as f64 - 1.0) };
        let points = (0..125).map(place).filter(|at| norm(*at) <= 1.0);
        let points = points.map(|at| -> Vector { std::array::from_fn(|k| centre[k] + radius * at[k]) });
        let is_clear = |at: &Vector| self.dipoles.iter().all(|dipole| dipole.distance(*at) > dipole.clearance);
        points.filter(is_clear).fold((0.0, 0.0), |(b, g), at| {
            let [x, y, z] =
                [0, 1, 2].map(|k| norm(self.load(at, std::array::from_fn(|j| f64::from(u8::from(j == k)))).0));
            (norm(self.flux_density(at)).max(b), norm([x, y, z]).max(g))
        })
    }

    /// B beyond the uniform field (T) at a point (m)
    pub fn flux_density(&self, at: Vector) -> Vector {
        let from = |origin: Vector| -> Vector { std::array::from_fn(|k| at[k] - origin[k]) };
        let mut b = rotate(&gradient_matrix(self.gradient), from(self.origin));
        for dipole in &self.dipoles {
            let r = from(dipole.position);
            if let Some((exact, _)) = dipole.exact(r) {
                (0..3).for_each(|k| b[k] += MU0_OVER_4PI * exact[k]);
                continue;
            }
            let distance2: f64 = r.iter().map(|x| x * x).sum();
            let along: f64 = (0..3).map(|k| r[k] * dipole.moment[k]).sum();
            let by = MU0_OVER_4PI / (distance2 * distance2.sqrt());
            (0..3).for_each(|k| b[k] += by * (3.0 * along / distance2 * r[k] - dipole.moment[k]));
        }
        for map in &self.maps {
            let of_map = map.local(at).flux_density;
            (0..3).for_each(|k| b[k] += of_map[k]);
        }
        b
    }
}
