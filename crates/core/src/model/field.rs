//! A field that varies in space: a linear part, external magnets and arrays of coils, added to the uniform field. F0

use super::rotation::{multiply, rotation_matrix};
use super::{Axis, Cuboid, Cylinder, FieldDipole, FieldMap, Matrix, RodField, SourceForm, Vector};
use std::f64::consts::PI;

/// Magnetic constant over 4 pi (T·m/A)
pub const MU0_OVER_4PI: f64 = 1e-7;
/// Clearance of a magnet or an array of coils whose size is not stated (m)
pub const DEFAULT_CLEARANCE: f64 = 0.01;

/// An entry of the gradient G_ij = dB_i/dx_j, which is symmetric and traceless: zz = -(xx + yy).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GradientEntry {
    /// dBx/dx; dBz/dz falls as it grows.
    Xx,
    /// dBx/dy and dBy/dx.
    Xy,
    /// dBx/dz and dBz/dx.
    Xz,
    /// dBy/dy; dBz/dz falls as it grows.
    Yy,
    /// dBy/dz and dBz/dy.
    Yz,
}

/// What makes the field vary in space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FieldSources {
    /// By [`GradientEntry`] (T/m); `None`: not modelled.
    pub gradient: Option<[f64; 5]>,
    /// Where the gradient adds nothing (m)
    pub origin: Vector,
    /// External permanent magnets.
    pub magnets: Vec<Magnet>,
    /// Electromagnets around the rod.
    pub arrays: Vec<CoilArray>,
    /// Fields sampled on a grid.
    pub maps: Vec<FieldMap>,
    /// Where the field acts on a rigid segment.
    pub coil_load: CoilLoad,
}

/// Where the field acts on the dipole of a rigid segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum CoilLoad {
    /// The dipole is spread evenly over the segment's length.
    #[default]
    Distributed,
    /// All of it is at the middle.
    Middle,
}

/// An external permanent magnet.
#[derive(Clone, Debug, PartialEq)]
pub struct Magnet {
    /// Its parameters start with `magnets.` and this.
    pub name: String,
    /// Of its centre, world frame (m)
    pub position: Vector,
    /// Before it is turned, world frame (A·m²)
    pub moment: Vector,
    /// Rotation vector that turns it about its centre, world frame (rad)
    pub rotation: Vector,
    /// Factor of the moment.
    pub strength: f64,
    /// Its form; `None`: a dipole, or a sphere.
    pub body: Option<MagnetBody>,
    /// No part of the rod may come nearer to one of its dipoles, or to the surface of an exact magnet (m)
    pub clearance: f64,
}

/// A magnet with a size, magnetised evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagnetBody {
    /// Its form, before it is turned.
    pub shape: MagnetShape,
    /// Whether its field is that of its shape, or of the dipoles that have its second moment.
    pub is_exact: bool,
}

/// Forms that data sheets of magnets list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MagnetShape {
    /// A cylinder or a ring.
    Cylinder {
        /// Direction of its axis, of length one.
        axis: Vector,
        /// In m
        length: f64,
        /// In m
        diameter: f64,
        /// Diameter of the hole along the axis of a ring (m); 0: it has none.
        bore: f64,
    },
    /// A cuboid with edges along x, y and z of these lengths (m)
    Cuboid(Vector),
}

/// Coils with currents of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct CoilArray {
    /// Begins the names of its parameters.
    pub name: String,
    /// One for each coil (A)
    pub current: Vec<f64>,
    /// The dipoles of each coil.
    pub coils: Vec<Vec<UnitDipole>>,
    /// No part of the rod may come nearer to one of its dipoles; 0 for fictitious sources (m)
    pub clearance: f64,
}

/// A dipole of a coil.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitDipole {
    /// World frame (m)
    pub position: Vector,
    /// World frame (m²)
    pub moment_per_ampere: Vector,
}

/// Gauss and Legendre's points and weights on [0, 1].
const LINE: [(f64, f64); 5] = [
    (0.046_910_077_030_668_004, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_6, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];
/// The same with eight points: the answer takes these, and its error estimate the difference.
const SHARP_LINE: [(f64, f64); 8] = [
    (0.019_855_071_751_231_856, 0.050_614_268_145_188_09),
    (0.101_666_761_293_186_58, 0.111_190_517_226_687_23),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_7),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
    (0.591_717_321_247_825, 0.181_341_891_689_181),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_7),
    (0.898_333_238_706_813_5, 0.111_190_517_226_687_23),
    (0.980_144_928_248_768_2, 0.050_614_268_145_188_09),
];
/// The same with three and four points, for segments within [`SHORT`].
const SHORT_LINE: [(f64, f64); 3] = [
    (0.112_701_665_379_258_31, 0.277_777_777_777_777_8),
    (0.5, 0.444_444_444_444_444_4),
    (0.887_298_334_620_741_7, 0.277_777_777_777_777_8),
];
const SHARP_SHORT_LINE: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_92),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_92),
];
/// A rigid segment is short where it is at most this share as long as it is away from every magnet. Of a dipole's force, which
/// falls like r^-4, three points leave at most 0.03 (L/r)^6 = 6e-7, and four 4e-3 (L/r)^8 = 2e-9.
const SHORT: f64 = 1.0 / 6.0;
const MIDDLE: [(f64, f64); 1] = [(0.5, 1.0)];
/// The field of a magnet of this strength is none.
const LEAST_STRENGTH: f64 = 1e-12;

impl CoilLoad {
    /// Both.
    pub const ALL: [CoilLoad; 2] = [CoilLoad::Distributed, CoilLoad::Middle];

    /// The word in files.
    pub fn name(self) -> &'static str {
        match self {
            CoilLoad::Distributed => "distributed",
            CoilLoad::Middle => "middle",
        }
    }

    /// Points along a rigid segment, as shares of its length, and their shares of its dipole.
    pub fn points(self) -> &'static [(f64, f64)] {
        match self {
            CoilLoad::Distributed => &LINE,
            CoilLoad::Middle => &MIDDLE,
        }
    }

    /// The same where rigid segments are so long, over the least distance of a magnet; then for the pass on twice the steps, too.
    /// What few points leave, as error estimates see it, is less than the target error.
    pub fn points_within(self, share: f64, tolerance: f64) -> [&'static [(f64, f64)]; 2] {
        match self {
            CoilLoad::Distributed if share <= SHORT && 0.03 * share.powi(6) <= tolerance => {
                [&SHORT_LINE, &SHARP_SHORT_LINE]
            }
            _ => [self.points(), self.check_points()],
        }
    }

    /// The same for the pass on twice the steps, from which the answer comes.
    pub fn check_points(self) -> &'static [(f64, f64)] {
        match self {
            CoilLoad::Distributed => &SHARP_LINE,
            CoilLoad::Middle => &MIDDLE,
        }
    }
}

impl GradientEntry {
    /// In the order of [`FieldSources::gradient`].
    pub const ALL: [GradientEntry; 5] =
        [GradientEntry::Xx, GradientEntry::Xy, GradientEntry::Xz, GradientEntry::Yy, GradientEntry::Yz];

    /// Place in [`FieldSources::gradient`].
    pub fn index(self) -> usize {
        self as usize
    }

    /// The word in names of parameters.
    pub fn name(self) -> &'static str {
        ["xx", "xy", "xz", "yy", "yz"][self.index()]
    }
}

/// The whole matrix of five entries.
pub fn gradient_matrix([xx, xy, xz, yy, yz]: [f64; 5]) -> Matrix {
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, -(xx + yy)]]
}

/// Gradient of MRI coils that make dBz/dx, dBz/dy and dBz/dz, with what Maxwell's equations bring along.
pub fn mri_gradient([x, y, z]: Vector) -> [f64; 5] {
    [-0.5 * z, 0.0, x, -0.5 * z, y]
}

impl FieldSources {
    /// Whether there is anything that varies.
    pub fn varies(&self) -> bool {
        let has_sources = !self.magnets.is_empty() || !self.arrays.is_empty();
        self.gradient.is_some() || has_sources || !self.maps.is_empty()
    }

    /// As the mechanics sees it; `None` for a uniform field.
    pub fn rod_field(&self) -> Option<RodField> {
        let of_magnets = self.magnets.iter().flat_map(Magnet::dipoles);
        let of_arrays = self.arrays.iter().flat_map(CoilArray::dipoles);
        self.varies().then(|| RodField {
            gradient: self.gradient.unwrap_or_default(),
            origin: self.origin,
            dipoles: of_magnets.chain(of_arrays).collect(),
            maps: self.maps.iter().map(FieldMap::rod_map).collect(),
            coil_load: self.coil_load,
        })
    }

    /// Number of the first dipole of a magnet.
    pub fn magnet_dipole(&self, magnet: usize) -> usize {
        self.magnets[..magnet].iter().map(Magnet::dipole_count).sum()
    }

    /// Number of the first dipole of a coil.
    pub fn coil_dipole(&self, array: usize, coil: usize) -> usize {
        let before = self.arrays[..array].iter().flat_map(|array| &array.coils);
        let count: usize = before.chain(&self.arrays[array].coils[..coil]).map(Vec::len).sum();
        self.magnet_dipole(self.magnets.len()) + count
    }
}

impl Magnet {
    /// Body to world.
    pub(super) fn turned(&self) -> Matrix {
        rotation_matrix(self.rotation)
    }

    /// Places of its dipoles from its centre before it is turned: those of its second moment. F0
    pub(super) fn offsets(&self) -> Vec<Vector> {
        match self.body {
            Some(MagnetBody { shape, is_exact: false }) => shape.dipoles(),
            _ => vec![[0.0; 3]],
        }
    }

    /// Whether its field is that of its shape.
    pub fn is_exact(&self) -> bool {
        self.body.is_some_and(|body| body.is_exact)
    }

    /// Whether it is a cylinder or a ring with its exact field: its moment shows where its axis points.
    pub fn is_exact_cylinder(&self) -> bool {
        self.body.is_some_and(|body| body.is_exact && matches!(body.shape, MagnetShape::Cylinder { .. }))
    }

    /// Its strength; that of an exact cylinder is never nothing, for its moment shows where its axis points.
    fn shown_strength(&self) -> f64 {
        if self.is_exact_cylinder() && self.strength.abs() < LEAST_STRENGTH { LEAST_STRENGTH } else { self.strength }
    }

    /// How many dipoles stand for it.
    pub fn dipole_count(&self) -> usize {
        self.offsets().len()
    }

    /// The dipoles that stand for it.
    pub fn dipoles(&self) -> Vec<FieldDipole> {
        let (turned, offsets) = (self.turned(), self.offsets());
        let share = self.shown_strength() / offsets.len() as f64;
        let form = match self.body.filter(|body| body.is_exact).map(|body| body.shape) {
            None => SourceForm::Point,
            Some(MagnetShape::Cylinder { length, diameter, bore, .. }) => {
                SourceForm::Cylinder(Cylinder::new(length, [diameter, bore], self.clearance))
            }
            Some(MagnetShape::Cuboid(size)) => SourceForm::Cuboid(Cuboid::new(size, &turned)),
        };
        let moment = rotate(&turned, self.moment).map(|x| x * share);
        let dipole = |offset: &Vector| {
            let offset = rotate(&turned, *offset);
            let position = std::array::from_fn(|k| self.position[k] + offset[k]);
            FieldDipole { position, moment, clearance: self.clearance, form }
        };
        offsets.iter().map(dipole).collect()
    }
}

impl MagnetShape {
    /// In m³
    pub fn volume(&self) -> f64 {
        match self {
            Self::Cylinder { length, diameter, bore, .. } => PI / 4.0 * (diameter * diameter - bore * bore) * length,
            Self::Cuboid(size) => size.iter().product(),
        }
    }

    /// Moment by a remanence (T): Br V / mu0 along a direction of length one (A·m²)
    pub fn moment(&self, remanence: f64, direction: Vector) -> Vector {
        direction.map(|x| x * remanence * self.volume() / (4.0 * PI * MU0_OVER_4PI))
    }

    /// Its largest extent along or across its axis, or along an edge (m)
    pub fn extent(&self) -> f64 {
        match self {
            Self::Cylinder { length, diameter, .. } => length.max(*diameter),
            Self::Cuboid(size) => size.iter().copied().fold(0.0, f64::max),
        }
    }

    /// Places of the dipoles that have its second moment, from its centre. F0
    fn dipoles(&self) -> Vec<Vector> {
        match *self {
            Self::Cylinder { axis, length, diameter, bore } => cylinder_dipoles(axis, length, [diameter, bore]),
            Self::Cuboid(size) => cuboid_dipoles(size),
        }
    }
}

/// Two dipoles on the axis of a cylinder or a ring, or four across it where it is flat.
fn cylinder_dipoles(axis: Vector, length: f64, [diameter, bore]: [f64; 2]) -> Vec<Vector> {
    let scaled = |v: Vector, by: f64| v.map(|x| x * by);
    let along = length * length / 12.0 - (diameter * diameter + bore * bore) / 16.0;
    if along >= 0.0 {
        let d = along.sqrt();
        return vec![scaled(axis, d), scaled(axis, -d)];
    }
    let e = (-2.0 * along).sqrt();
    let [one, other] = across(axis);
    vec![scaled(one, e), scaled(one, -e), scaled(other, e), scaled(other, -e)]
}

/// Two dipoles along each edge of a cuboid that is longer than the shortest; one in the middle of a cube.
fn cuboid_dipoles(size: Vector) -> Vec<Vector> {
    let shortest = size.iter().copied().fold(f64::INFINITY, f64::min);
    let longer: Vec<usize> = (0..3).filter(|k| size[*k] > shortest).collect();
    let place = |axis: usize, side: f64| -> Vector {
        let away = (longer.len() as f64 * (size[axis] * size[axis] - shortest * shortest) / 12.0).sqrt();
        std::array::from_fn(|k| if k == axis { side * away } else { 0.0 })
    };
    let all: Vec<Vector> = longer.iter().flat_map(|axis| [1.0, -1.0].map(|side| place(*axis, side))).collect();
    if all.is_empty() { vec![[0.0; 3]] } else { all }
}

impl CoilArray {
    /// The dipoles of all coils under their currents.
    fn dipoles(&self) -> impl Iterator<Item = FieldDipole> + '_ {
        self.coils.iter().zip(&self.current).flat_map(move |(coil, current)| {
            coil.iter().map(move |dipole| FieldDipole {
                position: dipole.position,
                moment: dipole.moment_per_ampere.map(|x| x * current),
                clearance: self.clearance,
                form: SourceForm::Point,
            })
        })
    }
}

/// `matrix v`
pub(super) fn rotate(matrix: &Matrix, v: Vector) -> Vector {
    std::array::from_fn(|row| (0..3).map(|k| matrix[row][k] * v[k]).sum())
}

/// Two unit vectors across a third.
fn across(axis: Vector) -> [Vector; 2] {
    let least = (0..3).fold(0, |best, k| if axis[k].abs() < axis[best].abs() { k } else { best });
    let cross = |a: Vector, b: Vector| -> Vector {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let unit = std::array::from_fn(|k| f64::from(u8::from(k == least)));
    let one = cross(axis, unit);
    let size = one.iter().map(|x| x * x).sum::<f64>().sqrt();
    let one = one.map(|x| x / size);
    [one, cross(axis, one)]
}

/// Columns of the virtual rotation by a rotation vector, applied to a vector: w x v for each axis.
pub(super) fn turning(jacobian: &Matrix, axis: Axis, v: Vector) -> Vector {
    let hat = [[0.0, v[2], -v[1]], [-v[2], 0.0, v[0]], [v[1], -v[0], 0.0]];
    let columns = multiply(&hat, jacobian);
    std::array::from_fn(|row| columns[row][axis.index()])
}
