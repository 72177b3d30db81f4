//! Parameters by name: sweep axes, `--set`, differentiation variables and columns all use these.
//!
//! A parameter is a path into the scene. `chain` says by how much it moves the numbers of the rod, so that every
//! parameter that can be swept can be differentiated by.

use super::scene::{multiply, rotation_matrix};
use super::{
    CoilWinding, Density, Flexible, Matrix, Rigid, Scene, Segment, SegmentKind, ShearElasticity, Slot, Stiffness,
    Vector,
};
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    pub const ALL: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

    pub fn index(self) -> usize {
        self as usize
    }

    pub fn name(self) -> &'static str {
        ["x", "y", "z"][self.index()]
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StiffnessAxis {
    /// Both bending stiffnesses together.
    Bending,
    BendingX,
    BendingY,
    Torsion,
}

/// A number of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Parameter {
    Insertion,
    BasePosition(Axis),
    BaseRotation(Axis),
    FluxDensity(Axis),
    TipForce(Axis),
    TipMoment(Axis),
    Gravity(Axis),
    DistributedForce(Axis),
    FluidDensity,
    /// A number of one segment, by its index from the base.
    Segment(usize, SegmentParameter),
}

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

#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParameterError {
    #[error("no parameter is named `{name}`{}", suggestion.as_ref().map(|s| format!(": did you mean `{s}`?")).unwrap_or_default())]
    Unknown { name: String, suggestion: Option<String> },
    #[error(
        "`{name}` follows from `tube` and moduli in this scene: sweep `youngs_modulus`, or give `stiffness` instead of the tube"
    )]
    Derived { name: String },
}

use Parameter as P;
use SegmentParameter as S;

impl Parameter {
    /// Every parameter of a scene, in the scene's order.
    pub fn all(scene: &Scene) -> Vec<Parameter> {
        let mut all = vec![P::Insertion];
        let vectors: [fn(Axis) -> Parameter; 7] = [
            P::BasePosition,
            P::BaseRotation,
            P::FluxDensity,
            P::TipForce,
            P::TipMoment,
            P::Gravity,
            P::DistributedForce,
        ];
        all.extend(vectors.iter().flat_map(|vector| Axis::ALL.map(vector)));
        all.push(P::FluidDensity);
        for (index, segment) in scene.segments.iter().enumerate() {
            all.extend(SegmentParameter::all(segment).into_iter().map(|parameter| P::Segment(index, parameter)));
        }
        all
    }

    /// Parameters meant by a name; a group (`coil.current`) stands for its components.
    pub fn parse(scene: &Scene, name: &str) -> Result<Vec<Parameter>, ParameterError> {
        let all = Self::all(scene);
        if let Some(exact) = all.iter().find(|parameter| parameter.name(scene) == name) {
            return Ok(vec![*exact]);
        }
        let group: Vec<_> = all.iter().copied().filter(|p| p.group_name(scene).as_deref() == Some(name)).collect();
        if !group.is_empty() {
            return Ok(group);
        }
        let mut names: Vec<String> = all.iter().map(|parameter| parameter.name(scene)).collect();
        names.extend(all.iter().filter_map(|parameter| parameter.group_name(scene)));
        Err(ParameterError::Unknown { name: name.into(), suggestion: closest(name, names.iter().map(String::as_str)) })
    }

    /// The path that names this parameter.
    pub fn name(&self, scene: &Scene) -> String {
        match self.group_and_component(scene) {
            (group, Some(component)) => format!("{group}.{component}"),
            (group, None) => group,
        }
    }

    /// The name of the group this is a component of. `stiffness.bending` is in none: it is two components at once.
    pub fn group_name(&self, scene: &Scene) -> Option<String> {
        match self {
            P::Segment(_, S::Stiffness(StiffnessAxis::Bending)) => None,
            _ => match self.group_and_component(scene) {
                (group, Some(_)) => Some(group),
                _ => None,
            },
        }
    }

    fn group_and_component(&self, scene: &Scene) -> (String, Option<&'static str>) {
        match *self {
            P::Insertion => ("insertion".into(), None),
            P::BasePosition(axis) => ("base.position".into(), Some(axis.name())),
            P::BaseRotation(axis) => ("base.rotation".into(), Some(axis.name())),
            P::FluxDensity(axis) => ("field.flux_density".into(), Some(axis.name())),
            P::TipForce(axis) => ("loads.tip_force".into(), Some(axis.name())),
            P::TipMoment(axis) => ("loads.tip_moment".into(), Some(axis.name())),
            P::Gravity(axis) => ("loads.gravity".into(), Some(axis.name())),
            P::DistributedForce(axis) => ("loads.distributed_force".into(), Some(axis.name())),
            P::FluidDensity => ("loads.fluid_density".into(), None),
            P::Segment(index, parameter) => {
                let (group, component) = parameter.group_and_component();
                (format!("{}.{group}", scene.segments[index].name), component)
            }
        }
    }

    /// SI unit of the parameter; empty for a pure number.
    pub fn unit(&self) -> &'static str {
        match self {
            P::Insertion | P::BasePosition(_) => "m",
            P::BaseRotation(_) => "rad",
            P::FluxDensity(_) => "T",
            P::TipForce(_) => "N",
            P::TipMoment(_) => "N·m",
            P::Gravity(_) => "m/s²",
            P::DistributedForce(_) => "N/m",
            P::FluidDensity => "kg/m³",
            P::Segment(_, parameter) => parameter.unit(),
        }
    }

    /// Value in a scene, SI.
    pub fn get(&self, scene: &Scene) -> f64 {
        let component = |vector: Option<Vector>, axis: Axis| vector.unwrap_or_default()[axis.index()];
        match *self {
            P::Insertion => scene.total_length(),
            P::BasePosition(axis) => scene.base.position[axis.index()],
            P::BaseRotation(axis) => scene.base.rotation[axis.index()],
            P::FluxDensity(axis) => scene.flux_density[axis.index()],
            P::TipForce(axis) => component(scene.loads.tip_force, axis),
            P::TipMoment(axis) => component(scene.loads.tip_moment, axis),
            P::Gravity(axis) => component(scene.loads.gravity, axis),
            P::DistributedForce(axis) => component(scene.loads.distributed_force, axis),
            P::FluidDensity => scene.loads.fluid_density.unwrap_or(0.0),
            P::Segment(index, parameter) => parameter.get(&scene.segments[index]),
        }
    }

    /// Sets the value, SI. Insertion sets the first segment's length; set other lengths before it.
    pub fn set(&self, scene: &mut Scene, value: f64) -> Result<(), ParameterError> {
        let set = |vector: &mut Option<Vector>, axis: Axis| vector.get_or_insert([0.0; 3])[axis.index()] = value;
        match *self {
            P::Insertion => {
                let others: f64 = scene.segments[1..].iter().map(|segment| segment.length).sum();
                scene.segments[0].length = value - others;
            }
            P::BasePosition(axis) => scene.base.position[axis.index()] = value,
            P::BaseRotation(axis) => scene.base.rotation[axis.index()] = value,
            P::FluxDensity(axis) => scene.flux_density[axis.index()] = value,
            P::TipForce(axis) => set(&mut scene.loads.tip_force, axis),
            P::TipMoment(axis) => set(&mut scene.loads.tip_moment, axis),
            P::Gravity(axis) => set(&mut scene.loads.gravity, axis),
            P::DistributedForce(axis) => set(&mut scene.loads.distributed_force, axis),
            P::FluidDensity => scene.loads.fluid_density = Some(value),
            P::Segment(index, parameter) => {
                let name = || self.name(scene);
                if let (S::Stiffness(_), SegmentKind::Flexible(Flexible { stiffness: Stiffness::Tube { .. }, .. })) =
                    (parameter, &scene.segments[index].kind)
                {
                    return Err(ParameterError::Derived { name: name() });
                }
                parameter.set(&mut scene.segments[index], value);
            }
        }
        Ok(())
    }

    /// Derivative of the rod by this parameter: slots and their rates, at the scene's values.
    pub fn chain(&self, scene: &Scene) -> Vec<(Slot, f64)> {
        match *self {
            P::Insertion => vec![(Slot::Insertion, 1.0)],
            P::BasePosition(axis) => vec![(Slot::BasePosition(axis), 1.0)],
            P::BaseRotation(axis) => {
                let jacobian = rotation_jacobian(scene.base.rotation);
                Axis::ALL.map(|row| (Slot::BaseRotation(row), jacobian[row.index()][axis.index()])).to_vec()
            }
            P::FluxDensity(axis) => vec![(Slot::FluxDensity(axis), 1.0)],
            P::TipForce(axis) => vec![(Slot::TipForce(axis), 1.0)],
            P::TipMoment(axis) => vec![(Slot::TipMoment(axis), 1.0)],
            P::Gravity(axis) => {
                let rate = |(index, segment)| (Slot::Load(index, axis), scene.linear_density(segment));
                scene.segments.iter().enumerate().map(rate).collect()
            }
            P::DistributedForce(axis) => (0..scene.segments.len()).map(|i| (Slot::Load(i, axis), 1.0)).collect(),
            P::FluidDensity => {
                let mut chain = Vec::new();
                for (index, segment) in scene.segments.iter().enumerate() {
                    if let SegmentKind::Flexible(Flexible { density: Some(Density::Volume(_)), stiffness, .. }) =
                        &segment.kind
                    {
                        chain.extend(weight_chain(scene, index, -stiffness.cross_section().unwrap_or(0.0)));
                    }
                }
                chain
            }
            P::Segment(index, parameter) => parameter.chain(scene, index),
        }
    }
}

impl SegmentParameter {
    fn all(segment: &Segment) -> Vec<SegmentParameter> {
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

    fn group_and_component(&self) -> (&'static str, Option<&'static str>) {
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

    fn unit(&self) -> &'static str {
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

    fn get(&self, segment: &Segment) -> f64 {
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

    fn set(&self, segment: &mut Segment, value: f64) {
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

    fn chain(&self, scene: &Scene, index: usize) -> Vec<(Slot, f64)> {
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
fn weight_chain(scene: &Scene, index: usize, rate: f64) -> Vec<(Slot, f64)> {
    let gravity = scene.loads.gravity.unwrap_or_default();
    Axis::ALL.map(|axis| (Slot::Load(index, axis), rate * gravity[axis.index()])).to_vec()
}

fn column(matrix: &Matrix, axis: Axis) -> Vector {
    std::array::from_fn(|row| matrix[row][axis.index()])
}

/// Left Jacobian of SO(3): w = J dv for R = exp(hat(v)), dR = hat(w) R.
fn rotation_jacobian(vector: Vector) -> Matrix {
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

/// The candidate nearest to a misspelt name, if one is near (edit distance at most a third of the length).
pub fn closest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<String> {
    let distance = |a: &str, b: &str| -> usize {
        let b: Vec<char> = b.chars().collect();
        let mut row: Vec<usize> = (0..=b.len()).collect();
        for (i, ca) in a.chars().enumerate() {
            let mut diagonal = row[0];
            row[0] = i + 1;
            for (j, cb) in b.iter().enumerate() {
                let substitution = diagonal + usize::from(ca != *cb);
                diagonal = row[j + 1];
                row[j + 1] = substitution.min(row[j] + 1).min(row[j + 1] + 1);
            }
        }
        row[b.len()]
    };
    let limit = 2.max(name.chars().count() / 3);
    candidates
        .map(|candidate| (distance(name, candidate), candidate))
        .filter(|(distance, _)| *distance <= limit)
        .min()
        .map(|(_, candidate)| candidate.to_owned())
}
