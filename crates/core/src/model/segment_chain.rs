//! How the numbers of one segment move the rod: slots and their rates.

use super::inner_load::length_chain;
use super::rotation::{multiply, rotation_matrix};
use super::segment_parameter::{SegmentParameter, ShearAxis};
use super::{
    Axis, Body, Coil, CoilWinding, Density, Flexible, MagnetMaterial, Matrix, Profile, Rigid, Scene, SegmentKind,
    ShearElasticity, Slot, Stiffness, StiffnessAxis, Vector,
};
use SegmentParameter as S;
use std::f64::consts::PI;

type Chain = Vec<(Slot, f64)>;

/// Slots and rates of a segment's parameter at the scene's values. Which slots must not depend on values: a sweep's
/// samples give their rates in this order.
pub(super) fn chain(parameter: SegmentParameter, scene: &Scene, index: usize) -> Chain {
    match &scene.segments[index].kind {
        SegmentKind::Flexible(flexible) => flexible_chain(parameter, scene, index, flexible),
        SegmentKind::Rigid(rigid) => rigid_chain(parameter, scene, index, rigid),
    }
}

fn flexible_chain(parameter: SegmentParameter, scene: &Scene, index: usize, flexible: &Flexible) -> Chain {
    let pieces = scene.own_pieces(index);
    let along = |slot: fn(usize, Axis) -> Slot, axis: Axis, rate: f64| -> Chain {
        pieces.iter().map(|(piece, _)| (slot(*piece, axis), rate)).collect()
    };
    let stiffness = |rates: Vector| -> Chain {
        Axis::ALL.into_iter().flat_map(|axis| along(Slot::Stiffness, axis, rates[axis.index()])).collect()
    };
    let node = |profile: &Profile, k: usize, value: fn(usize, Axis) -> Slot, rise: fn(usize, Axis) -> Slot, axis| {
        let mut chain = Chain::new();
        for (index, piece) in &pieces {
            let (share, share_rise) = profile.share(k, piece);
            chain.extend([(value(*index, axis), share), (rise(*index, axis), share_rise)]);
        }
        chain
    };
    match parameter {
        S::Length => pieces.last().map(|(piece, _)| (Slot::Length(*piece), 1.0)).into_iter().collect(),
        S::RestCurvature(axis) => along(Slot::RestCurvature, axis, 1.0),
        S::RestCurvatureNode(k, axis) => {
            node(&flexible.rest_curvature, k, Slot::RestCurvature, Slot::RestCurvatureRise, axis)
        }
        S::Stiffness(axis) => stiffness(unit_rates(axis)),
        S::StiffnessNode(k, axis) => {
            let profile = flexible.stiffness.profile();
            let of = |axis: &Axis| node(&profile, k, Slot::Stiffness, Slot::StiffnessRise, *axis);
            axis.axes().iter().flat_map(of).collect()
        }
        S::StiffnessShear(axis) => {
            let shear = flexible.stiffness_shear.unwrap_or([f64::INFINITY; 2]);
            let of = |axis: &Axis| along(Slot::ShearCompliance, *axis, -shear[axis.index()].powi(-2));
            ShearAxis::axes(axis).iter().flat_map(of).collect()
        }
        S::StiffnessAxial => {
            let axial = flexible.stiffness_axial.unwrap_or(f64::INFINITY);
            along(Slot::ShearCompliance, Axis::Z, -axial.powi(-2))
        }
        S::DipolePerLength(axis) => along(Slot::DipolePerLength, axis, 1.0),
        S::Remanence(_) | S::Magnetization(_) | S::VolumeFraction => {
            let area = flexible.stiffness.cross_section().unwrap_or(0.0);
            let rates = flexible.magnet.map_or([0.0; 3], |magnet| material_rates(parameter, &magnet));
            Axis::ALL
                .into_iter()
                .flat_map(|axis| along(Slot::DipolePerLength, axis, area * rates[axis.index()]))
                .collect()
        }
        S::LinearDensity => weight_chain(scene, index, 1.0),
        S::Density => weight_chain(scene, index, flexible.stiffness.cross_section().unwrap_or(0.0)),
        _ => {
            let mut chain = stiffness(tube_stiffness_rates(&flexible.stiffness, parameter));
            // A larger radius also changes the dipole of a magnetic material.
            if let (Some(magnet), Some(rate)) = (flexible.magnet, area_rate(flexible, parameter)) {
                let of = |axis: Axis| along(Slot::DipolePerLength, axis, magnet.magnetization()[axis.index()] * rate);
                chain.extend(Axis::ALL.into_iter().flat_map(of));
            }
            // A larger radius also changes weight, where the density is of the material.
            if let (Some(Density::Volume(density)), Some(rate)) = (flexible.density, area_rate(flexible, parameter)) {
                let net = density - scene.loads.fluid_density.unwrap_or(0.0);
                chain.extend(weight_chain(scene, index, net * rate));
            }
            chain
        }
    }
}

fn unit_rates(axis: StiffnessAxis) -> Vector {
    let mut rates = [0.0; 3];
    axis.axes().iter().for_each(|axis| rates[axis.index()] = 1.0);
    rates
}

/// d(EIx, EIy, GJ) of a tube by one of its numbers.
fn tube_stiffness_rates(stiffness: &Stiffness, parameter: SegmentParameter) -> Vector {
    let Stiffness::Tube { inner_radius, outer_radius, youngs_modulus, shear } = *stiffness else { return [0.0; 3] };
    let second_moment = PI / 4.0 * (outer_radius.powi(4) - inner_radius.powi(4));
    let shear_modulus = stiffness.shear_modulus().unwrap_or(0.0);
    let radius = |second_moment_rate: f64| {
        let bending = youngs_modulus * second_moment_rate;
        [bending, bending, 2.0 * shear_modulus * second_moment_rate]
    };
    match parameter {
        S::YoungsModulus => {
            let torsion = match shear {
                ShearElasticity::Modulus(_) => 0.0,
                ShearElasticity::PoissonRatio(ratio) => second_moment / (1.0 + ratio),
            };
            [second_moment, second_moment, torsion]
        }
        S::ShearModulus => [0.0, 0.0, 2.0 * second_moment],
        S::PoissonRatio => {
            let ratio = youngs_modulus / (2.0 * shear_modulus);
            [0.0, 0.0, -youngs_modulus * second_moment / (ratio * ratio)]
        }
        S::InnerRadius => radius(-PI * inner_radius.powi(3)),
        S::OuterRadius => radius(PI * outer_radius.powi(3)),
        _ => [0.0; 3],
    }
}

/// d(area of the wall) by a radius.
fn area_rate(flexible: &Flexible, parameter: SegmentParameter) -> Option<f64> {
    match (&flexible.stiffness, parameter) {
        (Stiffness::Tube { inner_radius, .. }, S::InnerRadius) => Some(-2.0 * PI * inner_radius),
        (Stiffness::Tube { outer_radius, .. }, S::OuterRadius) => Some(2.0 * PI * outer_radius),
        _ => None,
    }
}

fn rigid_chain(parameter: SegmentParameter, scene: &Scene, index: usize, rigid: &Rigid) -> Chain {
    let piece = scene.piece_indices(index).start;
    let length = scene.segment_length(index);
    let dipole = |rates: Vector| Axis::ALL.map(|axis| (Slot::Dipole(piece, axis), rates[axis.index()])).to_vec();
    match (parameter, &rigid.coil) {
        (S::Length, _) => {
            let mut chain = vec![(Slot::Length(piece), 1.0)];
            let load = scene.force_per_length(index);
            let weight = match rigid.body {
                Some(Body { density: Some(_), .. }) if rigid.mass.is_none() => {
                    let gravity = scene.loads.gravity.unwrap_or_default();
                    std::array::from_fn(|axis| load[axis] + scene.body_density(rigid) * gravity[axis])
                }
                _ => load,
            };
            chain.extend(Axis::ALL.map(|axis| (Slot::Weight(piece, axis), weight[axis.index()])));
            chain.extend(length_chain(scene, index));
            if rigid.is_magnet() {
                chain.extend(dipole(rigid.magnet_dipole_per_length()));
            }
            chain
        }
        (S::Density, _) => weight_chain(scene, index, rigid.body.map_or(0.0, |body| body.cross_section()) * length),
        (S::InnerRadius | S::OuterRadius | S::Diameter, _) => {
            let rate = rigid.body.map_or(0.0, |body| match parameter {
                S::InnerRadius => -2.0 * PI * body.inner_radius,
                S::OuterRadius => 2.0 * PI * body.outer_radius,
                _ => PI * body.outer_radius,
            });
            let mut chain = Chain::new();
            if let Some(density) = rigid.body.and_then(|body| body.density) {
                let net = density - scene.loads.fluid_density.unwrap_or(0.0);
                chain.extend(weight_chain(scene, index, net * rate * length));
            }
            if let Some(magnet) = rigid.magnet {
                chain.extend(dipole(magnet.magnetization().map(|x| x * rate * length)));
            }
            chain
        }
        (S::Remanence(_) | S::Magnetization(_) | S::VolumeFraction, _) => {
            let volume = rigid.body.map_or(0.0, |body| body.cross_section()) * length;
            let rates = rigid.magnet.map_or([0.0; 3], |magnet| material_rates(parameter, &magnet));
            dipole(rates.map(|rate| rate * volume))
        }
        (S::Mass, _) => weight_chain(scene, index, 1.0),
        (S::DipolePerLength(axis), _) => vec![(Slot::Dipole(piece, axis), scene.segment_length(index))],
        (_, Some(coil)) => dipole(dipole_rates(parameter, coil)),
        _ => Chain::new(),
    }
}

/// d(dipole per volume) of a magnetic material by one of its numbers.
fn material_rates(parameter: SegmentParameter, magnet: &MagnetMaterial) -> Vector {
    let one = magnet.quantity.magnetization();
    match parameter {
        S::VolumeFraction => magnet.value.map(|x| x * one),
        S::Remanence(axis) | S::Magnetization(axis) => {
            let mut rates = [0.0; 3];
            rates[axis.unwrap_or(Axis::Z).index()] = one * magnet.volume_fraction.unwrap_or(1.0);
            rates
        }
        _ => [0.0; 3],
    }
}

/// d(dipole of a coil set) by one of its numbers.
fn dipole_rates(parameter: SegmentParameter, coil: &Coil) -> Vector {
    let aligned = |axis: Axis, rate: f64| column(&rotation_matrix(coil.alignment), axis).map(|x| x * rate);
    match (parameter, coil.winding) {
        (S::Current(axis), _) => column(&coil.dipole_per_ampere(), axis),
        (S::Turns(axis), CoilWinding::Axes { area, .. }) => {
            aligned(axis, area[axis.index()] * coil.current[axis.index()])
        }
        (S::Area(axis), CoilWinding::Axes { turns, .. }) => {
            aligned(axis, turns[axis.index()] * coil.current[axis.index()])
        }
        (S::TurnsArea(row, column), CoilWinding::Matrix(_)) => aligned(row, coil.current[column.index()]),
        (S::Alignment(axis), _) => {
            let w = column(&rotation_jacobian(coil.alignment), axis);
            let mu = coil.dipole();
            [w[1] * mu[2] - w[2] * mu[1], w[2] * mu[0] - w[0] * mu[2], w[0] * mu[1] - w[1] * mu[0]]
        }
        _ => [0.0; 3],
    }
}

/// Weight of a segment by a number whose rate of linear density (flexible) or of mass (rigid) is `rate`.
pub(super) fn weight_chain(scene: &Scene, index: usize, rate: f64) -> Chain {
    let gravity = scene.loads.gravity.unwrap_or_default();
    Axis::ALL.into_iter().flat_map(|axis| load_chain(scene, index, axis, rate * gravity[axis.index()])).collect()
}

/// Force per length on a flexible segment, force on a rigid one, along a world axis.
pub(super) fn load_chain(scene: &Scene, index: usize, axis: Axis, rate: f64) -> Chain {
    let slot = match scene.segments[index].kind {
        SegmentKind::Flexible(_) => Slot::Load,
        SegmentKind::Rigid(_) => Slot::Weight,
    };
    scene.own_pieces(index).into_iter().map(|(piece, _)| (slot(piece, axis), rate)).collect()
}

fn column(matrix: &Matrix, axis: Axis) -> Vector {
    std::array::from_fn(|row| matrix[row][axis.index()])
}

/// Left Jacobian of SO(3): w = J dv for R = exp(hat(v)), dR = hat(w) R.
pub(super) fn rotation_jacobian(vector: Vector) -> Matrix {
    let [x, y, z] = vector;
    let angle2 = x * x + y * y + z * z;
    let angle = angle2.sqrt();
    let (a, b) = if angle < 1e-2 {
        (0.5 - angle2 / 24.0 + angle2 * angle2 / 720.0, 1.0 / 6.0 - angle2 / 120.0 + angle2 * angle2 / 5040.0)
    } else {
        ((1.0 - angle.cos()) / angle2, (angle - angle.sin()) / (angle2 * angle))
    };
    let hat = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    let hat2 = multiply(&hat, &hat);
    std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c)) + a * hat[r][c] + b * hat2[r][c]))
}
