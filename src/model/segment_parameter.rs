//! Numbers of one segment: reading, setting, and how each moves the rod.

use super::scene::{multiply, rotation_matrix};
use super::{
    Axis, CoilWinding, Density, Flexible, Matrix, Rigid, Scene, Segment, SegmentKind, ShearElasticity, Slot, Stiffness,
    StiffnessAxis, Vector,
};
use SegmentParameter as S;
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SegmentParameter {
    Length,
    RestCurvature(Axis),
    Stiffness(StiffnessAxis),
    YoungsModulus,
    ShearModulus,
    PoissonRatio,
    InnerRadius,
    OuterRadius,
    Density,
    LinearDensity,
    Mass,
    Current(Axis),
    Turns(Axis),
    Area(Axis),
    Alignment(Axis),
}

impl SegmentParameter {
    pub(super) fn all(segment: &Segment) -> Vec<SegmentParameter> {
        let mut all = vec![S::Length];
        match &segment.kind {
            SegmentKind::Flexible(Flexible { stiffness, density, .. }) => {
                all.extend(Axis::ALL.map(S::RestCurvature));
                use StiffnessAxis as A;
                all.extend([A::Bending, A::BendingX, A::BendingY, A::Torsion].map(S::Stiffness));
                if let Stiffness::Tube { shear, .. } = stiffness {
                    all.push(S::YoungsModulus);
                    all.push(match shear {
                        ShearElasticity::Modulus(_) => S::ShearModulus,
                        ShearElasticity::PoissonRatio(_) => S::PoissonRatio,
                    });
                    all.extend([S::InnerRadius, S::OuterRadius]);
                }
                match density {
                    Some(Density::Volume(_)) => all.push(S::Density),
                    Some(Density::Linear(_)) => all.push(S::LinearDensity),
                    None => {}
                }
            }
            SegmentKind::Rigid(Rigid { mass, coil }) => {
                if mass.is_some() {
                    all.push(S::Mass);
                }
                if let Some(coil) = coil {
                    all.extend(Axis::ALL.map(S::Current));
                    if let CoilWinding::Axes { .. } = coil.winding {
                        all.extend(Axis::ALL.map(S::Turns));
                        all.extend(Axis::ALL.map(S::Area));
                    }
                    all.extend(Axis::ALL.map(S::Alignment));
                }
            }
        }
        all
    }

    pub(super) fn group_and_component(&self) -> (&'static str, Option<&'static str>) {
        match *self {
            S::Length => ("length", None),
            S::RestCurvature(axis) => ("rest_curvature", Some(axis.name())),
            S::Stiffness(axis) => {
                let component = match axis {
                    StiffnessAxis::Bending => "bending",
                    StiffnessAxis::BendingX => "bending_x",
                    StiffnessAxis::BendingY => "bending_y",
                    StiffnessAxis::Torsion => "torsion",
                };
                ("stiffness", Some(component))
            }
            S::YoungsModulus => ("youngs_modulus", None),
            S::ShearModulus => ("shear_modulus", None),
            S::PoissonRatio => ("poisson_ratio", None),
            S::InnerRadius => ("tube", Some("inner_radius")),
            S::OuterRadius => ("tube", Some("outer_radius")),
            S::Density => ("density", None),
            S::LinearDensity => ("linear_density", None),
            S::Mass => ("mass", None),
            S::Current(axis) => ("current", Some(axis.name())),
            S::Turns(axis) => ("turns", Some(axis.name())),
            S::Area(axis) => ("area", Some(axis.name())),
            S::Alignment(axis) => ("alignment", Some(axis.name())),
        }
    }

    pub(super) fn unit(&self) -> &'static str {
        match self {
            S::Length | S::InnerRadius | S::OuterRadius => "m",
            S::RestCurvature(_) => "1/m",
            S::Stiffness(_) => "N·m²",
            S::YoungsModulus | S::ShearModulus => "Pa",
            S::PoissonRatio | S::Turns(_) => "",
            S::Density => "kg/m³",
            S::LinearDensity => "kg/m",
            S::Mass => "kg",
            S::Current(_) => "A",
            S::Area(_) => "m²",
            S::Alignment(_) => "rad",
        }
    }

    pub(super) fn get(&self, segment: &Segment) -> f64 {
        match (&segment.kind, *self) {
            (_, S::Length) => segment.length,
            (SegmentKind::Flexible(flexible), S::RestCurvature(axis)) => flexible.rest_curvature[axis.index()],
            (SegmentKind::Flexible(flexible), S::Stiffness(axis)) => {
                let [x, y, z] = flexible.stiffness.principal();
                match axis {
                    StiffnessAxis::Bending => 0.5 * (x + y),
                    StiffnessAxis::BendingX => x,
                    StiffnessAxis::BendingY => y,
                    StiffnessAxis::Torsion => z,
                }
            }
            (
                SegmentKind::Flexible(Flexible {
                    stiffness: Stiffness::Tube { inner_radius, outer_radius, youngs_modulus, shear },
                    ..
                }),
                parameter,
            ) => match (parameter, *shear) {
                (S::InnerRadius, _) => *inner_radius,
                (S::OuterRadius, _) => *outer_radius,
                (S::YoungsModulus, _) => *youngs_modulus,
                (S::ShearModulus, ShearElasticity::Modulus(modulus)) => modulus,
                (S::PoissonRatio, ShearElasticity::PoissonRatio(ratio)) => ratio,
                (S::Density | S::LinearDensity, _) => density_value(segment),
                _ => f64::NAN,
            },
            (SegmentKind::Flexible(_), S::Density | S::LinearDensity) => density_value(segment),
            (SegmentKind::Rigid(Rigid { mass, .. }), S::Mass) => mass.unwrap_or(0.0),
            (SegmentKind::Rigid(Rigid { coil: Some(coil), .. }), parameter) => match (parameter, coil.winding) {
                (S::Current(axis), _) => coil.current[axis.index()],
                (S::Alignment(axis), _) => coil.alignment[axis.index()],
                (S::Turns(axis), CoilWinding::Axes { turns, .. }) => turns[axis.index()],
                (S::Area(axis), CoilWinding::Axes { area, .. }) => area[axis.index()],
                _ => f64::NAN,
            },
            _ => f64::NAN,
        }
    }

    pub(super) fn set(&self, segment: &mut Segment, value: f64) {
        if let S::Length = self {
            segment.length = value;
            return;
        }
        match (&mut segment.kind, *self) {
            (SegmentKind::Flexible(flexible), S::RestCurvature(axis)) => flexible.rest_curvature[axis.index()] = value,
            (SegmentKind::Flexible(flexible), S::Density) => flexible.density = Some(Density::Volume(value)),
            (SegmentKind::Flexible(flexible), S::LinearDensity) => flexible.density = Some(Density::Linear(value)),
            (SegmentKind::Flexible(flexible), parameter) => match (&mut flexible.stiffness, parameter) {
                (Stiffness::Direct { bending_x, bending_y, torsion }, S::Stiffness(axis)) => match axis {
                    StiffnessAxis::Bending => (*bending_x, *bending_y) = (value, value),
                    StiffnessAxis::BendingX => *bending_x = value,
                    StiffnessAxis::BendingY => *bending_y = value,
                    StiffnessAxis::Torsion => *torsion = value,
                },
                (Stiffness::Tube { inner_radius, .. }, S::InnerRadius) => *inner_radius = value,
                (Stiffness::Tube { outer_radius, .. }, S::OuterRadius) => *outer_radius = value,
                (Stiffness::Tube { youngs_modulus, .. }, S::YoungsModulus) => *youngs_modulus = value,
                (Stiffness::Tube { shear, .. }, S::ShearModulus) => *shear = ShearElasticity::Modulus(value),
                (Stiffness::Tube { shear, .. }, S::PoissonRatio) => *shear = ShearElasticity::PoissonRatio(value),
                _ => {}
            },
            (SegmentKind::Rigid(rigid), S::Mass) => rigid.mass = Some(value),
            (SegmentKind::Rigid(Rigid { coil: Some(coil), .. }), parameter) => match (parameter, &mut coil.winding) {
                (S::Current(axis), _) => coil.current[axis.index()] = value,
                (S::Alignment(axis), _) => coil.alignment[axis.index()] = value,
                (S::Turns(axis), CoilWinding::Axes { turns, .. }) => turns[axis.index()] = value,
                (S::Area(axis), CoilWinding::Axes { area, .. }) => area[axis.index()] = value,
                _ => {}
            },
            _ => {}
        }
    }

    pub(super) fn chain(&self, scene: &Scene, index: usize) -> Vec<(Slot, f64)> {
        let segment = &scene.segments[index];
        let stiffness = |rates: Vector| -> Vec<(Slot, f64)> {
            let used = Axis::ALL.into_iter().filter(|axis| rates[axis.index()] != 0.0);
            used.map(|axis| (Slot::Stiffness(index, axis), rates[axis.index()])).collect()
        };
        let dipole = |rates: Vector| Axis::ALL.map(|axis| (Slot::Dipole(index, axis), rates[axis.index()])).to_vec();
        match (&segment.kind, *self) {
            (SegmentKind::Rigid(Rigid { mass: Some(mass), .. }), S::Length) if segment.length > 0.0 => {
                let mut chain = vec![(Slot::Length(index), 1.0)];
                chain.extend(weight_chain(scene, index, -mass / segment.length.powi(2)));
                chain
            }
            (_, S::Length) => vec![(Slot::Length(index), 1.0)],
            (_, S::RestCurvature(axis)) => vec![(Slot::RestCurvature(index, axis), 1.0)],
            (_, S::Stiffness(axis)) => stiffness(match axis {
                StiffnessAxis::Bending => [1.0, 1.0, 0.0],
                StiffnessAxis::BendingX => [1.0, 0.0, 0.0],
                StiffnessAxis::BendingY => [0.0, 1.0, 0.0],
                StiffnessAxis::Torsion => [0.0, 0.0, 1.0],
            }),
            (_, S::LinearDensity) => weight_chain(scene, index, 1.0),
            (_, S::Mass) => weight_chain(scene, index, if segment.length > 0.0 { 1.0 / segment.length } else { 0.0 }),
            (SegmentKind::Flexible(flexible), S::Density) => {
                weight_chain(scene, index, flexible.stiffness.cross_section().unwrap_or(0.0))
            }
            (
                SegmentKind::Flexible(Flexible {
                    stiffness: tube @ Stiffness::Tube { inner_radius, outer_radius, youngs_modulus, shear },
                    density,
                    ..
                }),
                _,
            ) => {
                let second_moment = PI / 4.0 * (outer_radius.powi(4) - inner_radius.powi(4));
                let shear_modulus = tube.shear_modulus().unwrap_or(0.0);
                // A larger radius changes stiffness and, where the density is of the material, weight.
                let radius = |radius: f64, sign: f64| {
                    let second_moment_rate = sign * PI * radius.powi(3);
                    let bending = youngs_modulus * second_moment_rate;
                    let mut chain = stiffness([bending, bending, 2.0 * shear_modulus * second_moment_rate]);
                    if let Some(Density::Volume(density)) = density {
                        let net = density - scene.loads.fluid_density.unwrap_or(0.0);
                        chain.extend(weight_chain(scene, index, net * sign * 2.0 * PI * radius));
                    }
                    chain
                };
                match *self {
                    S::YoungsModulus => {
                        let torsion = match shear {
                            ShearElasticity::Modulus(_) => 0.0,
                            ShearElasticity::PoissonRatio(ratio) => second_moment / (1.0 + ratio),
                        };
                        stiffness([second_moment, second_moment, torsion])
                    }
                    S::ShearModulus => stiffness([0.0, 0.0, 2.0 * second_moment]),
                    S::PoissonRatio => {
                        let ratio = youngs_modulus / (2.0 * shear_modulus);
                        stiffness([0.0, 0.0, -youngs_modulus * second_moment / (ratio * ratio)])
                    }
                    S::InnerRadius => radius(*inner_radius, -1.0),
                    S::OuterRadius => radius(*outer_radius, 1.0),
                    _ => Vec::new(),
                }
            }
            (SegmentKind::Rigid(Rigid { coil: Some(coil), .. }), parameter) => match (parameter, coil.winding) {
                (S::Current(axis), _) => {
                    let per_ampere = coil.dipole_per_ampere();
                    dipole(std::array::from_fn(|row| per_ampere[row][axis.index()]))
                }
                (S::Turns(axis), CoilWinding::Axes { area, .. }) => {
                    let rate = area[axis.index()] * coil.current[axis.index()];
                    dipole(column(&rotation_matrix(coil.alignment), axis).map(|x| x * rate))
                }
                (S::Area(axis), CoilWinding::Axes { turns, .. }) => {
                    let rate = turns[axis.index()] * coil.current[axis.index()];
                    dipole(column(&rotation_matrix(coil.alignment), axis).map(|x| x * rate))
                }
                (S::Alignment(axis), _) => {
                    let w = column(&rotation_jacobian(coil.alignment), axis);
                    let mu = coil.dipole();
                    dipole([w[1] * mu[2] - w[2] * mu[1], w[2] * mu[0] - w[0] * mu[2], w[0] * mu[1] - w[1] * mu[0]])
                }
                _ => Vec::new(),
            },
            _ => Vec::new(),
        }
    }
}

fn density_value(segment: &Segment) -> f64 {
    match &segment.kind {
        SegmentKind::Flexible(Flexible { density: Some(Density::Volume(value) | Density::Linear(value)), .. }) => {
            *value
        }
        _ => 0.0,
    }
}

/// Load of a segment by a number whose rate of linear density is `rate`.
pub(super) fn weight_chain(scene: &Scene, index: usize, rate: f64) -> Vec<(Slot, f64)> {
    let gravity = scene.loads.gravity.unwrap_or_default();
    Axis::ALL.map(|axis| (Slot::Load(index, axis), rate * gravity[axis.index()])).to_vec()
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
