//! What changes with what: record entries and chain-rule coefficients that a swept parameter moves.

use super::record::{
    BASE_D1_AT, BASE_POSITION_AT, BASE_T_AT, COUPLE_AT, DIPOLE_AT, DIPOLE_PER_LENGTH_AT, FLUX_DENSITY_AT, LOAD_AT,
    REST_CURVATURE_AT, SHEAR_COMPLIANCE_AT, STIFFNESS_AT, TIP_FORCE_AT, TIP_MOMENT_AT, WEIGHT_AT, field_offset,
    record_offsets, wall_offset,
};
use super::{
    Axis, CoilWinding, Cuboid, FIELD_DIPOLE_RECORD, FIELD_MAP_RECORD, FIELD_RECORD, Frame, InnerLoad, LoadPlace,
    MagnetParameter, Parameter, Rigid, Rod, RodField, RodSegment, Scene, SegmentKind, SegmentParameter, ShearAxis,
    StiffnessAxis, WallParameter,
};
use std::ops::Range;

/// Where the numbers of a scene stand in the rod's record.
struct Record<'a> {
    scene: &'a Scene,
    rod: &'a Rod,
    offsets: Vec<usize>,
}

impl Record<'_> {
    /// First entries of the own pieces of a segment.
    fn pieces(&self, segment: usize) -> impl Iterator<Item = usize> + '_ {
        self.scene.own_pieces(segment).into_iter().map(|(piece, _)| self.offsets[piece])
    }

    /// Entries at some places in the record of each piece of a segment.
    fn on(&self, segment: usize, places: &[usize]) -> Vec<usize> {
        self.pieces(segment).flat_map(|at| places.iter().map(move |place| at + place)).collect()
    }

    fn all_of(&self, segment: usize) -> Vec<usize> {
        let pieces = self.scene.piece_indices(segment);
        pieces
            .flat_map(|piece| (0..self.rod.segments[piece].record_len()).map(move |k| (piece, k)))
            .map(|(piece, k)| self.offsets[piece] + k)
            .collect()
    }

    /// Force per length, or force, along some world axes.
    fn loads(&self, segment: usize, axes: Range<usize>) -> Vec<usize> {
        let at = match self.rod.segments[self.scene.piece_indices(segment).start] {
            RodSegment::Flexible(_) => LOAD_AT,
            RodSegment::Rigid(_) => WEIGHT_AT,
        };
        self.on(segment, &axes.map(|axis| at + axis).collect::<Vec<_>>())
    }

    fn all_loads(&self, axes: Range<usize>) -> Vec<usize> {
        (0..self.scene.segments.len()).flat_map(|segment| self.loads(segment, axes.clone())).collect()
    }
}

fn places(at: usize, axes: &[Axis]) -> Vec<usize> {
    axes.iter().map(|axis| at + axis.index()).collect()
}

/// Record entries that a swept parameter changes.
pub(super) fn touched_entries(parameter: Parameter, scene: &Scene, rod: &Rod, swept: &[Parameter]) -> Vec<usize> {
    let record = Record { scene, rod, offsets: record_offsets(&rod.segments) };
    let component = |axis: Axis| axis.index()..axis.index() + 1;
    match parameter {
        Parameter::BaseRotation(_) => [BASE_D1_AT, BASE_T_AT].iter().flat_map(|at| places(*at, &Axis::ALL)).collect(),
        Parameter::FluxDensity(axis) => vec![FLUX_DENSITY_AT + axis.index()],
        Parameter::FieldGradient(entry) => vec![field_offset(&rod.segments) + entry.index()],
        Parameter::FieldOrigin(axis) => vec![field_offset(&rod.segments) + 5 + axis.index()],
        Parameter::Magnet(magnet, _) => {
            let first = scene.sources.magnet_dipole(magnet);
            let mut entries = source_entries(rod, first..scene.sources.magnet_dipole(magnet + 1), 0);
            entries.extend(cuboid_entries(rod, first));
            entries
        }
        Parameter::ArrayCurrent(array, coil) => {
            let first = scene.sources.coil_dipole(array, coil);
            source_entries(rod, first..first + scene.sources.arrays[array].coils[coil].len(), 3)
        }
        Parameter::MapScale(map) => map_entries(rod, map, 0..1),
        Parameter::MapPosition(map, axis) => map_entries(rod, map, axis.index() + 1..axis.index() + 2),
        Parameter::TipForce(axis) => vec![TIP_FORCE_AT + axis.index()],
        Parameter::TipMoment(axis) => vec![TIP_MOMENT_AT + axis.index()],
        Parameter::BasePosition(axis) => vec![BASE_POSITION_AT + axis.index()],
        Parameter::Insertion => with_length(&record, 0),
        Parameter::Gravity(axis) | Parameter::DistributedForce(axis) => record.all_loads(component(axis)),
        Parameter::FluidDensity => record.all_loads(0..3),
        Parameter::InnerForce(force, axis) | Parameter::ForceAlong(force, axis) => {
            let InnerLoad { segment, place, frame, .. } = scene.inner_loads[force];
            match scene.station_index(force) {
                Some(station) if place != LoadPlace::Middle => {
                    vec![record.offsets[station] + WEIGHT_AT + axis.index()]
                }
                Some(station) if frame == Frame::Body => {
                    let couple = (0..3).map(|k| record.offsets[station] + COUPLE_AT + k);
                    couple.chain([record.offsets[station] + WEIGHT_AT + axis.index()]).collect()
                }
                _ => record.loads(segment, component(axis)),
            }
        }
        Parameter::InnerMoment(load, axis) => {
            let station = scene.station_index(load).into_iter();
            station.map(|station| record.offsets[station] + COUPLE_AT + axis.index()).collect()
        }
        Parameter::Wall(parameter) => parameter.entries().iter().map(|at| wall_offset(rod) + at).collect(),
        Parameter::Segment(index, parameter) => segment_entries(parameter, index, &record, swept),
    }
}

/// Entries of some dipoles outside of the rod, each from a place on.
fn source_entries(rod: &Rod, dipoles: Range<usize>, from: usize) -> Vec<usize> {
    let start = field_offset(&rod.segments) + FIELD_RECORD;
    let of = |dipole: usize| (from..FIELD_DIPOLE_RECORD).map(move |k| start + FIELD_DIPOLE_RECORD * dipole + k);
    dipoles.flat_map(of).collect()
}

/// The edges of a source, where it is a cuboid.
fn cuboid_entries(rod: &Rod, dipole: usize) -> Range<usize> {
    let Some(field) = rod.field.as_ref().filter(|field| field.dipoles[dipole].form.is_cuboid()) else { return 0..0 };
    let before = field.dipoles[..dipole].iter().filter(|of| of.form.is_cuboid()).count();
    let start = field_offset(&rod.segments) + field.cuboid_record() + Cuboid::RECORD * before;
    start..start + Cuboid::RECORD
}

/// Some entries of a field sampled on a grid.
fn map_entries(rod: &Rod, map: usize, of: Range<usize>) -> Vec<usize> {
    let before = rod.field.as_ref().map_or(0, RodField::map_record);
    let start = field_offset(&rod.segments) + before + FIELD_MAP_RECORD * map;
    of.map(|k| start + k).collect()
}

/// Segments of a scene whose numbers follow from a parameter.
pub(super) fn touched_segments(parameter: Parameter, scene: &Scene) -> Range<usize> {
    match parameter {
        Parameter::Insertion => 0..1,
        Parameter::Segment(index, _) => index..index + 1,
        Parameter::InnerForce(force, _) | Parameter::InnerMoment(force, _) | Parameter::ForceAlong(force, _) => {
            let segment = scene.inner_loads[force].segment;
            segment..segment + 1
        }
        Parameter::Gravity(_) | Parameter::DistributedForce(_) | Parameter::FluidDensity => 0..scene.segments.len(),
        Parameter::BasePosition(_)
        | Parameter::BaseRotation(_)
        | Parameter::FluxDensity(_)
        | Parameter::FieldGradient(_)
        | Parameter::FieldOrigin(_)
        | Parameter::Magnet(..)
        | Parameter::ArrayCurrent(..)
        | Parameter::MapScale(_)
        | Parameter::MapPosition(..)
        | Parameter::Wall(_)
        | Parameter::TipForce(_)
        | Parameter::TipMoment(_) => 0..0,
    }
}

/// Entries that change with the length of a segment: nodes cut it into pieces, whose values follow.
fn with_length(record: &Record, index: usize) -> Vec<usize> {
    let is_cut = record.scene.piece_indices(index).len() > 1;
    match &record.scene.segments[index].kind {
        SegmentKind::Flexible(_) if is_cut => record.all_of(index),
        SegmentKind::Flexible(_) => record.on(index, &[0]),
        SegmentKind::Rigid(_) => record.all_of(index),
    }
}

fn segment_entries(parameter: SegmentParameter, index: usize, record: &Record, swept: &[Parameter]) -> Vec<usize> {
    use SegmentParameter as S;
    let stiffness = |axis: StiffnessAxis| places(STIFFNESS_AT, axis.axes());
    let both = |at: usize| [at, at + 3];
    match parameter {
        S::Length => with_length(record, index),
        S::RestCurvature(axis) => record.on(index, &places(REST_CURVATURE_AT, &[axis])),
        S::RestCurvatureNode(_, axis) => record.on(index, &both(REST_CURVATURE_AT + axis.index())),
        S::Stiffness(axis) => record.on(index, &stiffness(axis)),
        S::StiffnessNode(_, axis) => {
            let at: Vec<usize> = stiffness(axis).into_iter().flat_map(both).collect();
            record.on(index, &at)
        }
        S::StiffnessShear(axis) => record.on(index, &places(SHEAR_COMPLIANCE_AT, ShearAxis::axes(axis))),
        S::StiffnessAxial => record.on(index, &[SHEAR_COMPLIANCE_AT + 2]),
        S::YoungsModulus | S::ShearModulus | S::PoissonRatio => record.on(index, &places(STIFFNESS_AT, &Axis::ALL)),
        S::InnerRadius | S::OuterRadius | S::Diameter => {
            let is_magnet = is_of_sheet(record.scene, index);
            let mut entries = match record.scene.segments[index].kind {
                SegmentKind::Flexible(_) => record.on(index, &places(STIFFNESS_AT, &Axis::ALL)),
                SegmentKind::Rigid(_) => Vec::new(),
            };
            entries.extend(record.loads(index, 0..3));
            entries.extend(if is_magnet { magnet_entries(index, record) } else { Vec::new() });
            entries
        }
        S::Remanence(_) | S::Magnetization(_) | S::VolumeFraction => magnet_entries(index, record),
        S::Density | S::LinearDensity | S::Mass => record.loads(index, 0..3),
        S::DipolePerLength(axis) => match record.scene.segments[index].kind {
            SegmentKind::Flexible(_) => record.on(index, &[DIPOLE_PER_LENGTH_AT + axis.index()]),
            SegmentKind::Rigid(_) => record.on(index, &[DIPOLE_AT + axis.index()]),
        },
        S::Current(axis) | S::Turns(axis) | S::Area(axis) if is_aligned(record.scene, index, swept) => {
            record.on(index, &[DIPOLE_AT + axis.index()])
        }
        S::Current(_) | S::Turns(_) | S::Area(_) | S::TurnsArea(..) | S::Alignment(_) => {
            record.on(index, &places(DIPOLE_AT, &Axis::ALL))
        }
    }
}

/// Entries of a segment's dipole.
fn magnet_entries(index: usize, record: &Record) -> Vec<usize> {
    match record.scene.segments[index].kind {
        SegmentKind::Flexible(_) => record.on(index, &places(DIPOLE_PER_LENGTH_AT, &Axis::ALL)),
        SegmentKind::Rigid(_) => record.on(index, &places(DIPOLE_AT, &Axis::ALL)),
    }
}

/// Whether the dipole of a segment follows from its cross-section.
fn is_of_sheet(scene: &Scene, index: usize) -> bool {
    match &scene.segments[index].kind {
        SegmentKind::Flexible(flexible) => flexible.magnet.is_some(),
        SegmentKind::Rigid(rigid) => rigid.magnet.is_some(),
    }
}

/// Whether each current of a coil set moves one component of the dipole.
fn is_aligned(scene: &Scene, index: usize, swept: &[Parameter]) -> bool {
    let tilts = |p: &Parameter| matches!(p, Parameter::Segment(i, SegmentParameter::Alignment(_)) if *i == index);
    match &scene.segments[index].kind {
        SegmentKind::Rigid(Rigid { coil: Some(coil), .. }) => {
            matches!(coil.winding, CoilWinding::Axes { .. }) && coil.alignment == [0.0; 3] && !swept.iter().any(tilts)
        }
        _ => false,
    }
}

/// Whether sweeping `other` may change the chain-rule coefficients of `parameter`.
pub(super) fn changes_chain(scene: &Scene, parameter: Parameter, other: Parameter) -> bool {
    use Parameter as P;
    use SegmentParameter as S;
    match (parameter, other) {
        (P::BaseRotation(_), P::BaseRotation(_)) => true,
        (P::Wall(WallParameter::Rotation(_)), P::Wall(WallParameter::Rotation(_)))
        | (P::Wall(WallParameter::Stiffness), P::Wall(WallParameter::Stiffness)) => true,
        (P::Magnet(a, of), P::Magnet(b, _)) => a == b && !matches!(of, MagnetParameter::Position(_)),
        // Densities weigh gravity's derivative; gravity weighs the derivative by densities.
        (P::Gravity(_) | P::FluidDensity, P::Segment(at, S::Length)) => match &scene.segments[at].kind {
            SegmentKind::Flexible(_) => false,
            SegmentKind::Rigid(rigid) => rigid.body.is_some_and(|body| body.density.is_some()),
        },
        (P::Gravity(_), P::Segment(_, parameter)) => {
            matches!(parameter, S::Density | S::LinearDensity | S::Mass | S::InnerRadius | S::OuterRadius | S::Diameter)
        }
        (P::Gravity(_), P::FluidDensity) | (P::FluidDensity, P::Gravity(_)) => true,
        (P::FluidDensity, P::Segment(_, S::InnerRadius | S::OuterRadius | S::Diameter)) => true,
        // The force on a rigid segment is its length times the force per length.
        (P::DistributedForce(_), P::Segment(_, S::Length)) => true,
        (P::Segment(_, S::Length), P::DistributedForce(_)) => true,
        (P::ForceAlong(force, _), P::Segment(at, S::Length)) => scene.inner_loads[force].segment == at,
        (P::Segment(at, S::Length), P::ForceAlong(force, _)) => scene.inner_loads[force].segment == at,
        // At a rigid segment's end a force at its middle that turns with it is a couple, too.
        (P::InnerForce(force, _), P::Segment(at, S::Length)) => scene.inner_loads[force].segment == at,
        (P::Segment(at, S::Length), P::InnerForce(force, _)) => scene.inner_loads[force].segment == at,
        (P::Segment(..), P::Gravity(_) | P::FluidDensity) => true,
        // Nodes are attached to the material.
        (P::Segment(0, of), P::Insertion) => is_of_node(of),
        (P::Segment(a, of), P::Segment(b, by)) => {
            let linear = |p: S| matches!(p, S::Current(_) | S::RestCurvature(_) | S::Stiffness(_));
            let never = matches!(of, S::RestCurvature(_) | S::Stiffness(_));
            let only_by_length = is_of_node(of) && by != S::Length;
            let independent = never || only_by_length || linear(of) && linear(by);
            a == b && !independent
        }
        _ => false,
    }
}

fn is_of_node(parameter: SegmentParameter) -> bool {
    matches!(parameter, SegmentParameter::RestCurvatureNode(..) | SegmentParameter::StiffnessNode(..))
}
