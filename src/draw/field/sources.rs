//! What makes the field around a rod, as figures draw it: magnets, coils, grids, and the field itself.

use super::super::colour::Colour;
use super::super::vectors::{along, bounds, distance, dot, middle, minus, nonzero, norm, plus, scaled, widest};
use crate::model::{
    CoilArray, FieldMap, FieldSources, Magnet, MagnetShape, Parameter, RodField, Scene, UnitDipole, Vector,
    rotation_matrix,
};
use std::sync::Arc;

/// A scene does not tell the size of a coil: its diameter is drawn as this share of its distance from the rod's base.
const COIL: f64 = 0.24;
/// Its length over its diameter, unless its dipoles reach farther.
const COIL_LENGTH: f64 = 0.6;
/// A rod keeps at least this share of the view's widest extent.
const LEAST_SHARE: f64 = 1.0 / 3.0;

/// What makes the field around a rod.
#[derive(Clone, Debug, PartialEq)]
pub struct Surroundings {
    /// Magnets, then coils.
    pub sources: Vec<FieldSource>,
    /// Boxes in which fields are sampled.
    pub grids: Vec<GridBox>,
    /// Whether lines of the field are drawn.
    pub has_lines: bool,
    uniform: Vector,
    field: RodField,
}

/// A magnet or a coil.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldSource {
    /// Of the magnet, or of the array and the number of the coil.
    pub name: String,
    /// Its form.
    pub body: SourceBody,
    /// Of its middle (m).
    pub position: Vector,
    /// From its south to its north pole, world frame (A·m²).
    pub moment: Vector,
    /// Of a coil (A)
    pub current: Option<f64>,
    /// Array and coil, by index; `None` of a magnet.
    pub coil: Option<[usize; 2]>,
    /// Whether it differs from sample to sample; it is drawn as in the scene.
    pub is_swept: bool,
    /// Places of its dipoles (m).
    pub dipoles: Vec<Vector>,
    /// How near to one of them a rod may come (m); `None` of a coil.
    pub clearance: Option<f64>,
}

/// The form of a source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SourceBody {
    /// Without a size.
    Dipole,
    /// A magnet.
    Cylinder(Cylinder),
    /// A magnet.
    Cuboid(Cuboid),
    /// Coils have no size in a scene: they are drawn the larger the farther away they are.
    Coil(Cylinder),
}

/// A straight cylinder about a source's middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Of length one, world frame.
    pub axis: Vector,
    /// In m
    pub length: f64,
    /// In m
    pub diameter: f64,
}

/// A cuboid about a source's middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    /// Directions of its edges, of length one, world frame.
    pub edges: [Vector; 3],
    /// Their lengths (m)
    pub size: Vector,
}

/// Where a field is sampled.
#[derive(Clone, Debug, PartialEq)]
pub struct GridBox {
    /// Of the map.
    pub name: String,
    /// Lower and upper limit of x, y and z (m).
    pub limits: [[f64; 2]; 3],
}

impl Surroundings {
    /// Of magnets.
    pub const MAGNET_COLOUR: Colour = Colour::hex(0xd3d9e0);
    /// Of coils around the rod.
    pub const COIL_COLOUR: Colour = Colour::hex(0xf3ddb0);
    /// Of lines of the field.
    pub const LINE_COLOUR: Colour = Colour::hex(0xa9b4c0);

    /// What surrounds the rod of a scene; `None` where the field is uniform.
    pub fn of(scene: &Scene) -> Option<Surroundings> {
        let FieldSources { magnets, arrays, maps, .. } = &scene.sources;
        let coils = arrays.iter().enumerate().flat_map(|(number, array)| coils(number, array, scene.base.position));
        Some(Surroundings {
            sources: magnets.iter().map(of_magnet).chain(coils).collect(),
            grids: maps.iter().map(grid).collect(),
            has_lines: true,
            uniform: scene.flux_density,
            field: scene.sources.rod_field()?,
        })
    }

    /// The same where a parameter of the scene is swept: no lines where it moves the field.
    pub fn swept(mut self, parameter: Parameter) -> Surroundings {
        let is_swept = |index: usize, source: &FieldSource| match parameter {
            Parameter::Magnet(magnet, _) => source.coil.is_none() && index == magnet,
            Parameter::ArrayCurrent(array, coil) => source.coil == Some([array, coil]),
            _ => false,
        };
        self.sources.iter_mut().enumerate().for_each(|(index, source)| source.is_swept |= is_swept(index, source));
        self.has_lines &= !matches!(
            parameter,
            Parameter::FluxDensity(_)
                | Parameter::FieldGradient(_)
                | Parameter::FieldOrigin(_)
                | Parameter::Magnet(..)
                | Parameter::ArrayCurrent(..)
                | Parameter::MapScale(_)
                | Parameter::MapPosition(..)
        );
        self
    }

    /// Whether all that makes the field is the same, and so is the field everywhere.
    pub fn is_as(&self, other: &Surroundings) -> bool {
        let numbers = |of: &Surroundings| (of.uniform, of.field.gradient, of.field.origin);
        // What was read once is known by where it is.
        let maps = |of: &Surroundings| -> Vec<_> {
            of.field.maps.iter().map(|map| (map.scale, map.position, Arc::as_ptr(&map.grid))).collect()
        };
        numbers(self) == numbers(other)
            && self.field.dipoles == other.field.dipoles
            && maps(self) == maps(other)
            && self.sources == other.sources
    }

    /// Limits of a rod (m), and of the sources that leave it a third of the view.
    pub fn widened(&self, rod: [[f64; 2]; 3]) -> [[f64; 2]; 3] {
        widened(self.sources.iter(), rod)
    }

    /// |B| at a point (T, m); `None` where the field is not known.
    pub fn magnitude(&self, at: Vector) -> Option<f64> {
        self.is_known(at).then(|| norm(self.flux_density(at)))
    }

    /// B at a point (T, m).
    pub fn flux_density(&self, at: Vector) -> Vector {
        let varying = self.field.flux_density(at);
        std::array::from_fn(|k| self.uniform[k] + varying[k])
    }

    /// Whether the field is known at a point (m): outside of sources, inside of grids.
    pub fn is_known(&self, at: Vector) -> bool {
        self.field.maps.iter().all(|map| map.inside(at) >= 0.0) && !self.sources.iter().any(|source| source.holds(at))
    }
}

/// The limits of a rod, and of the sources that leave it a third of the view: the nearest first, an array of coils as a
/// whole (m).
pub(in crate::draw) fn widened<'a>(
    sources: impl Iterator<Item = &'a FieldSource>,
    rod: [[f64; 2]; 3],
) -> [[f64; 2]; 3] {
    let corners = |limits: [[f64; 2]; 3]| [0, 1].map(|side| limits.map(|of_axis| of_axis[side]));
    let mut groups: Vec<(Option<usize>, Vec<Vector>)> = Vec::new();
    for source in sources {
        let array = source.coil.map(|[array, _]| array);
        match groups.iter_mut().find(|(other, _)| array.is_some() && *other == array) {
            Some((_, points)) => points.extend(corners(source.limits())),
            None => groups.push((array, corners(source.limits()).into())),
        }
    }
    let away = |points: &[Vector]| distance(middle(bounds(points.iter().copied())), middle(rod));
    groups.sort_by(|(_, a), (_, b)| away(a).total_cmp(&away(b)));
    let mut limits = rod;
    for (_, points) in groups {
        let wider = bounds(points.into_iter().chain(corners(limits)));
        if widest(rod) >= LEAST_SHARE * widest(wider) {
            limits = wider;
        }
    }
    limits
}

impl FieldSource {
    /// Its smallest box along the axes (m).
    pub fn limits(&self) -> [[f64; 2]; 3] {
        let half = match self.body {
            SourceBody::Dipole => [0.0; 3],
            SourceBody::Cylinder(cylinder) | SourceBody::Coil(cylinder) => cylinder.half_extent(),
            SourceBody::Cuboid(cuboid) => cuboid.half_extent(),
        };
        std::array::from_fn(|k| [self.position[k] - half[k], self.position[k] + half[k]])
    }

    /// Whether a point (m) lies in it, or so near that a dipole is no model of it.
    fn holds(&self, at: Vector) -> bool {
        let r = minus(at, self.position);
        match self.body {
            SourceBody::Dipole => norm(r) < 0.25 * self.clearance.unwrap_or_default(),
            SourceBody::Cylinder(cylinder) | SourceBody::Coil(cylinder) => cylinder.holds(r),
            SourceBody::Cuboid(cuboid) => cuboid.holds(r),
        }
    }

    /// Whether it is a coil.
    pub fn is_coil(&self) -> bool {
        matches!(self.body, SourceBody::Coil(_))
    }
}

impl Cylinder {
    fn half_extent(&self) -> Vector {
        self.axis.map(|x| 0.5 * self.length * x.abs() + 0.5 * self.diameter * (1.0 - x * x).max(0.0).sqrt())
    }

    /// Whether it holds a point, seen from its middle.
    fn holds(&self, r: Vector) -> bool {
        let lengthwise = dot(r, self.axis);
        let outwards = norm(along(r, -lengthwise, self.axis));
        lengthwise.abs() <= 0.5 * self.length && outwards <= 0.5 * self.diameter
    }
}

impl Cuboid {
    /// Its extent along a direction of length one (m)
    pub(super) fn extent(&self, direction: Vector) -> f64 {
        (0..3).map(|k| self.size[k] * dot(self.edges[k], direction).abs()).sum()
    }

    fn half_extent(&self) -> Vector {
        std::array::from_fn(|k| 0.5 * self.extent(std::array::from_fn(|j| f64::from(u8::from(j == k)))))
    }

    /// Whether it holds a point, seen from its middle.
    fn holds(&self, r: Vector) -> bool {
        (0..3).all(|k| dot(self.edges[k], r).abs() <= 0.5 * self.size[k])
    }

    /// Corners in turn of the faces that a reader sees who looks against a direction, from its middle; the first faces him most.
    pub(super) fn faces(&self, toward: Vector) -> Vec<[Vector; 4]> {
        let mut seen: Vec<usize> = (0..3).filter(|k| dot(self.edges[*k], toward).abs() > 0.02).collect();
        seen.sort_by(|a, b| dot(self.edges[*b], toward).abs().total_cmp(&dot(self.edges[*a], toward).abs()));
        let face = |k: usize| {
            let side = 0.5 * dot(self.edges[k], toward).signum();
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let middle = along([0.0; 3], side * self.size[k], self.edges[k]);
            [(0.5, 0.5), (0.5, -0.5), (-0.5, -0.5), (-0.5, 0.5)]
                .map(|(a, b)| along(along(middle, a * self.size[i], self.edges[i]), b * self.size[j], self.edges[j]))
        };
        seen.into_iter().map(face).collect()
    }
}

fn of_magnet(magnet: &Magnet) -> FieldSource {
    let dipoles = magnet.dipoles();
    let turned = rotation_matrix(magnet.rotation);
    let body = match magnet.body.map(|body| body.shape) {
        None => SourceBody::Dipole,
        Some(MagnetShape::Cylinder { axis, length, diameter, .. }) => {
            SourceBody::Cylinder(Cylinder { axis: turned.map(|row| dot(row, axis)), length, diameter })
        }
        Some(MagnetShape::Cuboid(size)) => {
            SourceBody::Cuboid(Cuboid { edges: [0, 1, 2].map(|k| turned.map(|row| row[k])), size })
        }
    };
    FieldSource {
        name: magnet.name.clone(),
        body,
        position: magnet.position,
        moment: sum(dipoles.iter().map(|dipole| dipole.moment)),
        current: None,
        coil: None,
        is_swept: false,
        dipoles: dipoles.iter().map(|dipole| dipole.position).collect(),
        // That of an exact magnet is about its surface, which is drawn.
        clearance: (!magnet.is_exact()).then_some(magnet.clearance),
    }
}

fn coils(number: usize, array: &CoilArray, base: Vector) -> impl Iterator<Item = FieldSource> + '_ {
    array.coils.iter().zip(&array.current).enumerate().map(move |(index, (dipoles, current))| {
        let (position, axis, reach) = axis_of(dipoles);
        let diameter = COIL * distance(position, base);
        FieldSource {
            name: format!("{} {}", array.name, index + 1),
            body: SourceBody::Coil(Cylinder { axis, length: (2.0 * reach).max(COIL_LENGTH * diameter), diameter }),
            position,
            moment: sum(dipoles.iter().map(|dipole| dipole.moment_per_ampere)).map(|x| x * current),
            current: Some(*current),
            coil: Some([number, index]),
            is_swept: false,
            dipoles: dipoles.iter().map(|dipole| dipole.position).collect(),
            clearance: None,
        }
    })
}

/// The middle of a coil's dipoles by their sizes, the direction of all, and how far they reach along it.
fn axis_of(dipoles: &[UnitDipole]) -> (Vector, Vector, f64) {
    let size = |dipole: &UnitDipole| norm(dipole.moment_per_ampere);
    let whole: f64 = dipoles.iter().map(size).sum();
    let weight = |dipole: &UnitDipole| if whole > 0.0 { size(dipole) / whole } else { 1.0 / dipoles.len() as f64 };
    let position = dipoles.iter().fold([0.0; 3], |sum, dipole| along(sum, weight(dipole), dipole.position));
    let moment = sum(dipoles.iter().map(|dipole| dipole.moment_per_ampere));
    let axis = if nonzero(moment) { scaled(moment, 1.0) } else { [0.0, 0.0, 1.0] };
    let reach = dipoles.iter().map(|dipole| dot(axis, minus(dipole.position, position)).abs()).fold(0.0, f64::max);
    (position, axis, reach)
}

fn sum(vectors: impl Iterator<Item = Vector>) -> Vector {
    vectors.fold([0.0; 3], plus)
}

fn grid(map: &FieldMap) -> GridBox {
    let of_axis = |k: usize| {
        let low = map.position[k] + map.grid.origin[k];
        [low, low + (map.grid.counts[k] - 1) as f64 * map.grid.steps[k]]
    };
    GridBox { name: map.name.clone(), limits: std::array::from_fn(of_axis) }
}
