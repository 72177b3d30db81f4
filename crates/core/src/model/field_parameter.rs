//! Numbers of the sources of the field: their names, reading, setting, and how they move the rod's field.

use super::field::{rotate, turning};
use super::segment_chain::rotation_jacobian;
use super::{Axis, FieldSources, GradientEntry, Parameter, Scene, Slot, Vector};
use Parameter as P;

/// A number of an external magnet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MagnetParameter {
    /// Component of the position of its centre (m).
    Position(Axis),
    /// Component of its moment before it is turned (A·m²).
    Moment(Axis),
    /// Component of the rotation vector that turns it (rad).
    Rotation(Axis),
    /// Factor of its moment.
    Strength,
}

use MagnetParameter as M;

/// Parameters of the sources of a scene, in the scene's order.
pub(super) fn all(sources: &FieldSources) -> Vec<Parameter> {
    let mut all = Vec::new();
    if sources.gradient.is_some() {
        all.extend(GradientEntry::ALL.map(P::FieldGradient));
        all.extend(Axis::ALL.map(P::FieldOrigin));
    }
    for magnet in 0..sources.magnets.len() {
        let vectors: [fn(Axis) -> MagnetParameter; 3] = [M::Position, M::Moment, M::Rotation];
        // The moment of an exact cylinder stays along its axis: `strength` and `rotation` change it.
        let is_along = sources.magnets[magnet].is_exact_cylinder();
        let components = vectors.iter().flat_map(|vector| Axis::ALL.map(vector));
        let components = components.filter(|number| !(is_along && matches!(number, M::Moment(_))));
        all.extend(components.chain([M::Strength]).map(|parameter| P::Magnet(magnet, parameter)));
    }
    for (array, coils) in sources.arrays.iter().enumerate() {
        all.extend((0..coils.current.len()).map(|coil| P::ArrayCurrent(array, coil)));
    }
    for map in 0..sources.maps.len() {
        all.push(P::MapScale(map));
        all.extend(Axis::ALL.map(|axis| P::MapPosition(map, axis)));
    }
    all
}

impl MagnetParameter {
    /// Path after the magnet's name.
    pub(super) fn path(self) -> String {
        match self {
            M::Position(axis) => format!("position.{}", axis.name()),
            M::Moment(axis) => format!("moment.{}", axis.name()),
            M::Rotation(axis) => format!("rotation.{}", axis.name()),
            M::Strength => "strength".into(),
        }
    }

    pub(super) fn unit(self) -> &'static str {
        match self {
            M::Position(_) => "m",
            M::Moment(_) => "A·m²",
            M::Rotation(_) => "rad",
            M::Strength => "",
        }
    }
}

/// The number of a scene that a parameter of its sources drives.
pub(super) fn number(parameter: Parameter, sources: &mut FieldSources) -> Option<&mut f64> {
    match parameter {
        P::FieldGradient(entry) => Some(&mut sources.gradient.get_or_insert_default()[entry.index()]),
        P::FieldOrigin(axis) => Some(&mut sources.origin[axis.index()]),
        P::Magnet(magnet, parameter) => {
            let magnet = sources.magnets.get_mut(magnet)?;
            Some(match parameter {
                M::Position(axis) => &mut magnet.position[axis.index()],
                M::Moment(axis) => &mut magnet.moment[axis.index()],
                M::Rotation(axis) => &mut magnet.rotation[axis.index()],
                M::Strength => &mut magnet.strength,
            })
        }
        P::ArrayCurrent(array, coil) => sources.arrays.get_mut(array)?.current.get_mut(coil),
        P::MapScale(map) => Some(&mut sources.maps.get_mut(map)?.scale),
        P::MapPosition(map, axis) => Some(&mut sources.maps.get_mut(map)?.position[axis.index()]),
        _ => None,
    }
}

/// Slots and rates of a parameter of the sources.
pub(super) fn chain(parameter: Parameter, scene: &Scene) -> Vec<(Slot, f64)> {
    let sources = &scene.sources;
    match parameter {
        P::FieldGradient(entry) => vec![(Slot::FieldGradient(entry), 1.0)],
        P::FieldOrigin(axis) => vec![(Slot::FieldOrigin(axis), 1.0)],
        P::Magnet(magnet, parameter) => magnet_chain(sources, magnet, parameter),
        P::MapScale(map) => vec![(Slot::MapScale(map), 1.0)],
        P::MapPosition(map, axis) => vec![(Slot::MapPosition(map, axis), 1.0)],
        P::ArrayCurrent(array, coil) => {
            let first = sources.coil_dipole(array, coil);
            let dipoles = sources.arrays[array].coils[coil].iter().enumerate();
            dipoles.flat_map(|(k, dipole)| along(Slot::SourceMoment, first + k, dipole.moment_per_ampere)).collect()
        }
        _ => Vec::new(),
    }
}

fn along(slot: fn(usize, Axis) -> Slot, dipole: usize, rates: Vector) -> Vec<(Slot, f64)> {
    Axis::ALL.map(|axis| (slot(dipole, axis), rates[axis.index()])).to_vec()
}

fn magnet_chain(sources: &FieldSources, index: usize, parameter: MagnetParameter) -> Vec<(Slot, f64)> {
    let (magnet, first) = (&sources.magnets[index], sources.magnet_dipole(index));
    let (turned, offsets) = (magnet.turned(), magnet.offsets());
    let share = 1.0 / offsets.len() as f64;
    let scaled = |v: Vector, by: f64| v.map(|x| x * by);
    let each = |of: &dyn Fn(usize, Vector) -> Vec<(Slot, f64)>| -> Vec<(Slot, f64)> {
        offsets.iter().enumerate().flat_map(|(k, offset)| of(first + k, *offset)).collect()
    };
    match parameter {
        M::Position(axis) => each(&|dipole, _| vec![(Slot::SourcePosition(dipole, axis), 1.0)]),
        M::Moment(axis) => {
            let column = std::array::from_fn(|row| turned[row][axis.index()]);
            each(&|dipole, _| along(Slot::SourceMoment, dipole, scaled(column, magnet.strength * share)))
        }
        M::Strength => {
            each(&|dipole, _| along(Slot::SourceMoment, dipole, scaled(rotate(&turned, magnet.moment), share)))
        }
        M::Rotation(axis) => {
            let jacobian = rotation_jacobian(magnet.rotation);
            let moment = scaled(rotate(&turned, magnet.moment), magnet.strength * share);
            let turn: Vector = std::array::from_fn(|row| jacobian[row][axis.index()]);
            let turns_edges = magnet.is_exact() && !magnet.is_exact_cylinder();
            each(&|dipole, offset| {
                let mut chain = along(Slot::SourceMoment, dipole, turning(&jacobian, axis, moment));
                if turns_edges {
                    chain.extend(along(Slot::SourceTurn, dipole, turn));
                }
                chain.extend(along(Slot::SourcePosition, dipole, turning(&jacobian, axis, rotate(&turned, offset))));
                chain
            })
        }
    }
}
