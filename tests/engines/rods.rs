//! Random rods, and moving a rod along one of its numbers.
#![allow(non_snake_case)]

use rodsweep::model::{Axis, FlexibleRod, Rod, RodField, RodSegment, RodWall, Slot, SourceForm, Surface, Units};

/// Every slot of a rod.
pub fn all_slots(rod: &Rod) -> Vec<Slot> {
    let mut slots = vec![Slot::Insertion];
    let vectors: [fn(Axis) -> Slot; 5] =
        [Slot::BasePosition, Slot::BaseRotation, Slot::FluxDensity, Slot::TipForce, Slot::TipMoment];
    slots.extend(vectors.iter().flat_map(|vector| Axis::ALL.map(vector)));
    for (j, segment) in rod.segments.iter().enumerate() {
        slots.push(Slot::Length(j));
        let vectors: &[fn(usize, Axis) -> Slot] = match segment {
            RodSegment::Flexible(_) => &[
                Slot::Stiffness,
                Slot::StiffnessRise,
                Slot::RestCurvature,
                Slot::RestCurvatureRise,
                Slot::Load,
                Slot::DipolePerLength,
                Slot::ShearCompliance,
            ],
            RodSegment::Rigid(_) => &[Slot::Dipole, Slot::Weight],
        };
        slots.extend(vectors.iter().flat_map(|vector| Axis::ALL.map(|axis| vector(j, axis))));
    }
    slots
}

/// Every slot of its wall.
pub fn wall_slots(wall: &RodWall) -> Vec<Slot> {
    let mut slots: Vec<Slot> =
        [Slot::WallPosition, Slot::WallRotation].iter().flat_map(|vector| Axis::ALL.map(vector)).collect();
    slots.extend([Slot::WallTipRadius, Slot::WallCompliance]);
    if wall.kind.surface != Surface::Plane {
        slots.push(Slot::WallRadius);
    }
    if wall.kind.sticks {
        slots.extend(Axis::ALL.map(Slot::WallAnchor));
    }
    slots
}

/// The rod moved along a slot.
pub fn moved(rod: &Rod, slot: Slot, by: f64) -> Rod {
    let mut rod = rod.clone();
    match slot {
        Slot::BasePosition(axis) => rod.base_position[axis.index()] += by,
        Slot::BaseRotation(axis) => {
            let turn = nalgebra::Rotation3::new(nalgebra::Vector3::ith(axis.index(), by));
            let R = turn.matrix() * nalgebra::Matrix3::from_fn(|row, col| rod.base_rotation[row][col]);
            rod.base_rotation = std::array::from_fn(|row| std::array::from_fn(|col| R[(row, col)]));
        }
        Slot::FluxDensity(axis) => rod.flux_density[axis.index()] += by,
        Slot::FieldGradient(entry) => field(&mut rod).gradient[entry.index()] += by,
        Slot::FieldOrigin(axis) => field(&mut rod).origin[axis.index()] += by,
        Slot::SourcePosition(dipole, axis) => field(&mut rod).dipoles[dipole].position[axis.index()] += by,
        Slot::SourceMoment(dipole, axis) => field(&mut rod).dipoles[dipole].moment[axis.index()] += by,
        Slot::SourceTurn(dipole, axis) => {
            let turn = nalgebra::Rotation3::new(nalgebra::Vector3::ith(axis.index(), by));
            if let SourceForm::Cuboid(cuboid) = &mut field(&mut rod).dipoles[dipole].form {
                cuboid.edges = cuboid.edges.map(|edge| (turn * nalgebra::Vector3::from(edge)).into());
            }
        }
        Slot::MapScale(map) => field(&mut rod).maps[map].scale += by,
        Slot::MapPosition(map, axis) => field(&mut rod).maps[map].position[axis.index()] += by,
        Slot::WallPosition(axis) => wall(&mut rod).position[axis.index()] += by,
        Slot::WallRotation(axis) => {
            let turn = nalgebra::Rotation3::new(nalgebra::Vector3::ith(axis.index(), by));
            let wall = wall(&mut rod);
            wall.axis = (turn * nalgebra::Vector3::from(wall.axis)).into();
        }
        Slot::WallRadius => wall(&mut rod).radius += by,
        Slot::WallTipRadius => wall(&mut rod).tip_radius += by,
        Slot::WallCompliance => wall(&mut rod).compliance += by,
        Slot::WallAnchor(axis) => wall(&mut rod).anchor[axis.index()] += by,
        Slot::TipForce(axis) => rod.tip_force[axis.index()] += by,
        Slot::TipMoment(axis) => rod.tip_moment[axis.index()] += by,
        Slot::Insertion => insert(&mut rod.segments[0], by),
        Slot::Length(j)
        | Slot::Stiffness(j, _)
        | Slot::StiffnessRise(j, _)
        | Slot::RestCurvature(j, _)
        | Slot::RestCurvatureRise(j, _)
        | Slot::Load(j, _)
        | Slot::DipolePerLength(j, _)
        | Slot::ShearCompliance(j, _)
        | Slot::Dipole(j, _)
        | Slot::Weight(j, _)
        | Slot::Couple(j, _) => move_segment(&mut rod.segments[j], slot, by),
    }
    rod
}

fn field(rod: &mut Rod) -> &mut RodField {
    rod.field.as_mut().expect("a field that varies in space")
}

fn wall(rod: &mut Rod) -> &mut RodWall {
    rod.wall.as_mut().expect("a wall")
}

/// Lengthens a flexible segment at its proximal end: what varies goes on as it does.
fn insert(segment: &mut RodSegment, by: f64) {
    let RodSegment::Flexible(segment) = segment else { panic!("insertion into a rigid segment") };
    let share = if segment.length > 0.0 { by / segment.length } else { 0.0 };
    segment.length += by;
    let FlexibleRod { stiffness, stiffness_rise, rest_curvature, rest_curvature_rise, .. } = segment;
    for (value, rise) in [(stiffness, stiffness_rise), (rest_curvature, rest_curvature_rise)] {
        for (value, rise) in value.iter_mut().zip(rise) {
            *value -= share * *rise;
            *rise *= 1.0 + share;
        }
    }
}

fn move_segment(segment: &mut RodSegment, slot: Slot, by: f64) {
    use RodSegment::{Flexible, Rigid};
    match (segment, slot) {
        (Rigid(segment), Slot::Length(_)) => segment.length += by,
        (Flexible(segment), Slot::Length(_)) => {
            // What varies goes on as it does.
            let stretch = if segment.length > 0.0 { 1.0 + by / segment.length } else { 1.0 };
            segment.length += by;
            for rise in [&mut segment.stiffness_rise, &mut segment.rest_curvature_rise] {
                rise.iter_mut().for_each(|x| *x *= stretch);
            }
        }
        (Flexible(segment), Slot::Stiffness(_, axis)) => segment.stiffness[axis.index()] += by,
        (Flexible(segment), Slot::StiffnessRise(_, axis)) => segment.stiffness_rise[axis.index()] += by,
        (Flexible(segment), Slot::RestCurvature(_, axis)) => segment.rest_curvature[axis.index()] += by,
        (Flexible(segment), Slot::RestCurvatureRise(_, axis)) => segment.rest_curvature_rise[axis.index()] += by,
        (Flexible(segment), Slot::Load(_, axis)) => segment.load[axis.index()] += by,
        (Flexible(segment), Slot::DipolePerLength(_, axis)) => segment.dipole[axis.index()] += by,
        (Flexible(segment), Slot::ShearCompliance(_, axis)) => segment.shear_compliance[axis.index()] += by,
        (Rigid(segment), Slot::Dipole(_, axis)) => segment.dipole[axis.index()] += by,
        (Rigid(segment), Slot::Weight(_, axis)) => segment.weight[axis.index()] += by,
        (Rigid(segment), Slot::Couple(_, axis)) => segment.couple[axis.index()] += by,
        (segment, slot) => panic!("{segment:?} has no {slot:?}"),
    }
}

/// Length, mean stiffness over its square, and field of a rod.
pub fn rod_units(rod: &Rod) -> Units {
    let length = rod.total_length();
    let stiffness = |segment: &RodSegment| match segment {
        RodSegment::Flexible(FlexibleRod { stiffness, .. }) => Some((stiffness[0] * stiffness[1]).sqrt()),
        RodSegment::Rigid(_) => None,
    };
    let stiffness: Vec<f64> = rod.segments.iter().filter_map(stiffness).collect();
    let stiffness = stiffness.iter().sum::<f64>() / stiffness.len() as f64;
    let field = rod.flux_density.iter().map(|b| b * b).sum::<f64>().sqrt();
    Units { length, force: stiffness / (length * length), field: if field > 0.0 { field } else { 1.0 } }
}
