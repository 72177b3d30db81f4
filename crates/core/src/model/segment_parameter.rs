//! Numbers of one segment: their names, reading, setting. How each moves the rod is in `segment_chain.rs`.

use super::{
    Axis, Body, CoilWinding, Density, Flexible, MagnetMaterial, MagnetQuantity, Node, Profile, Rigid, Segment,
    SegmentKind, ShearElasticity, Stiffness, StiffnessAxis, Vector,
};
use SegmentParameter as S;

/// A number of one segment; nodes are given by their index from the proximal end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SegmentParameter {
    /// Its own length, without what is inserted (m).
    Length,
    /// Rest curvature of a segment without nodes (1/m).
    RestCurvature(Axis),
    /// Rest curvature at a node (1/m).
    RestCurvatureNode(usize, Axis),
    /// Stiffness of a segment without nodes (N·m²).
    Stiffness(StiffnessAxis),
    /// Stiffness at a node (N·m²).
    StiffnessNode(usize, StiffnessAxis),
    /// Stiffness against shear (N).
    StiffnessShear(ShearAxis),
    /// Stiffness against stretch (N).
    StiffnessAxial,
    /// Of a tube (Pa).
    YoungsModulus,
    /// Of a tube (Pa).
    ShearModulus,
    /// Of a tube, in place of the shear modulus.
    PoissonRatio,
    /// Of a tube (m).
    InnerRadius,
    /// Of a tube (m).
    OuterRadius,
    /// Of the material of a tube (kg/m³).
    Density,
    /// Mass per length of a flexible segment, taken as given, without buoyancy (kg/m).
    LinearDensity,
    /// Of a permanent magnet, body frame (A·m).
    DipolePerLength(Axis),
    /// Remanence of the material; `None`: along the tangent (T).
    Remanence(Option<Axis>),
    /// Magnetisation of the material; `None`: along the tangent (A/m).
    Magnetization(Option<Axis>),
    /// Share of a composite's volume that is magnetic.
    VolumeFraction,
    /// Outer diameter of a rigid segment (m).
    Diameter,
    /// Of a rigid segment (kg).
    Mass,
    /// Of a coil of a rigid segment (A).
    Current(Axis),
    /// Turns of the coil about a body axis.
    Turns(Axis),
    /// Area of one turn of the coil about a body axis (m²).
    Area(Axis),
    /// Dipole along the first axis per ampere of the second's current (m²).
    TurnsArea(Axis, Axis),
    /// Component of the rotation vector applied to the coils' dipole (rad).
    Alignment(Axis),
}

/// A stiffness of a flexible segment against shear (N).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ShearAxis {
    /// Along body x and y together.
    Both,
    /// Along body x.
    X,
    /// Along body y.
    Y,
}

impl StiffnessAxis {
    /// In the order of a scene's parameters.
    pub const ALL: [StiffnessAxis; 4] =
        [StiffnessAxis::Bending, StiffnessAxis::BendingX, StiffnessAxis::BendingY, StiffnessAxis::Torsion];

    fn name(self) -> &'static str {
        match self {
            StiffnessAxis::Bending => "bending",
            StiffnessAxis::BendingX => "bending_x",
            StiffnessAxis::BendingY => "bending_y",
            StiffnessAxis::Torsion => "torsion",
        }
    }

    /// The principal stiffnesses meant.
    pub fn axes(self) -> &'static [Axis] {
        match self {
            StiffnessAxis::Bending => &[Axis::X, Axis::Y],
            StiffnessAxis::BendingX => &[Axis::X],
            StiffnessAxis::BendingY => &[Axis::Y],
            StiffnessAxis::Torsion => &[Axis::Z],
        }
    }
}

impl ShearAxis {
    /// In the order of a scene's parameters.
    pub const ALL: [ShearAxis; 3] = [ShearAxis::Both, ShearAxis::X, ShearAxis::Y];

    /// The axes meant: x and y are 0 and 1.
    pub fn axes(self) -> &'static [Axis] {
        match self {
            ShearAxis::Both => &[Axis::X, Axis::Y],
            ShearAxis::X => &[Axis::X],
            ShearAxis::Y => &[Axis::Y],
        }
    }
}

impl SegmentParameter {
    pub(super) fn all(segment: &Segment) -> Vec<SegmentParameter> {
        let mut all = vec![S::Length];
        let magnet = |magnet: &Option<Vector>| magnet.iter().flat_map(|_| Axis::ALL.map(S::DipolePerLength)).collect();
        match &segment.kind {
            SegmentKind::Flexible(flexible) => {
                all.extend(of_profile(&flexible.rest_curvature, &Axis::ALL, S::RestCurvature, S::RestCurvatureNode));
                let stiffness = flexible.stiffness.profile();
                all.extend(of_profile(&stiffness, &StiffnessAxis::ALL, S::Stiffness, S::StiffnessNode));
                if let Stiffness::Tube { shear, .. } = &flexible.stiffness {
                    all.push(S::YoungsModulus);
                    all.push(match shear {
                        ShearElasticity::Modulus(_) => S::ShearModulus,
                        ShearElasticity::PoissonRatio(_) => S::PoissonRatio,
                    });
                    all.extend([S::InnerRadius, S::OuterRadius]);
                }
                if flexible.stiffness_shear.is_some() {
                    all.extend(ShearAxis::ALL.map(S::StiffnessShear));
                }
                if flexible.stiffness_axial.is_some() {
                    all.push(S::StiffnessAxial);
                }
                match flexible.density {
                    Some(Density::Volume(_)) => all.push(S::Density),
                    Some(Density::Linear(_)) => all.push(S::LinearDensity),
                    None => {}
                }
                all.extend::<Vec<_>>(magnet(&flexible.dipole_per_length));
                all.extend(flexible.magnet.iter().flat_map(of_material));
            }
            SegmentKind::Rigid(rigid) => {
                if rigid.mass.is_some() {
                    all.push(S::Mass);
                }
                all.extend::<Vec<_>>(magnet(&rigid.dipole_per_length));
                if let Some(Body { density, .. }) = rigid.body {
                    all.extend([S::InnerRadius, S::OuterRadius, S::Diameter]);
                    all.extend(density.map(|_| S::Density));
                }
                all.extend(rigid.magnet.iter().flat_map(of_material));
                if let Some(coil) = &rigid.coil {
                    all.extend(Axis::ALL.map(S::Current));
                    match coil.winding {
                        CoilWinding::Axes { .. } => {
                            all.extend(Axis::ALL.map(S::Turns));
                            all.extend(Axis::ALL.map(S::Area));
                        }
                        CoilWinding::Matrix(_) => {
                            all.extend(Axis::ALL.iter().flat_map(|row| Axis::ALL.map(|col| S::TurnsArea(*row, col))));
                        }
                    }
                    all.extend(Axis::ALL.map(S::Alignment));
                }
            }
        }
        all
    }

    /// Path after the segment's name.
    pub(super) fn path(&self) -> String {
        match *self {
            S::Length => "length".into(),
            S::RestCurvature(axis) => format!("rest_curvature.{}", axis.name()),
            S::RestCurvatureNode(node, axis) => format!("rest_curvature.node_{}.{}", node + 1, axis.name()),
            S::Stiffness(axis) => format!("stiffness.{}", axis.name()),
            S::StiffnessNode(node, axis) => format!("stiffness.node_{}.{}", node + 1, axis.name()),
            S::StiffnessShear(ShearAxis::Both) => "stiffness_shear".into(),
            S::StiffnessShear(ShearAxis::X) => "stiffness_shear.x".into(),
            S::StiffnessShear(ShearAxis::Y) => "stiffness_shear.y".into(),
            S::StiffnessAxial => "stiffness_axial".into(),
            S::YoungsModulus => "youngs_modulus".into(),
            S::ShearModulus => "shear_modulus".into(),
            S::PoissonRatio => "poisson_ratio".into(),
            S::InnerRadius => "tube.inner_radius".into(),
            S::OuterRadius => "tube.outer_radius".into(),
            S::Density => "density".into(),
            S::LinearDensity => "linear_density".into(),
            S::DipolePerLength(axis) => format!("dipole_per_length.{}", axis.name()),
            S::Remanence(axis) => of_axis("remanence", axis),
            S::Magnetization(axis) => of_axis("magnetization", axis),
            S::VolumeFraction => "volume_fraction".into(),
            S::Diameter => "diameter".into(),
            S::Mass => "mass".into(),
            S::Current(axis) => format!("current.{}", axis.name()),
            S::Turns(axis) => format!("turns.{}", axis.name()),
            S::Area(axis) => format!("area.{}", axis.name()),
            S::TurnsArea(row, column) => format!("turns_area.{}{}", row.name(), column.name()),
            S::Alignment(axis) => format!("alignment.{}", axis.name()),
        }
    }

    /// Whether it drives several numbers that are parameters themselves.
    pub(super) fn is_joint(&self) -> bool {
        use StiffnessAxis::Bending;
        matches!(self, S::Stiffness(Bending) | S::StiffnessNode(_, Bending) | S::StiffnessShear(ShearAxis::Both))
    }

    pub(super) fn unit(&self) -> &'static str {
        match self {
            S::Length | S::InnerRadius | S::OuterRadius | S::Diameter => "m",
            S::RestCurvature(_) | S::RestCurvatureNode(..) => "1/m",
            S::Stiffness(_) | S::StiffnessNode(..) => "N·m²",
            S::StiffnessShear(_) | S::StiffnessAxial => "N",
            S::YoungsModulus | S::ShearModulus => "Pa",
            S::PoissonRatio | S::Turns(_) | S::VolumeFraction => "",
            S::Remanence(_) => "T",
            S::Magnetization(_) => "A/m",
            S::Density => "kg/m³",
            S::LinearDensity => "kg/m",
            S::DipolePerLength(_) => "A·m",
            S::Mass => "kg",
            S::Current(_) => "A",
            S::Area(_) | S::TurnsArea(..) => "m²",
            S::Alignment(_) => "rad",
        }
    }

    pub(super) fn get(&self, segment: &Segment) -> f64 {
        let mut segment = segment.clone();
        let mean = |values: &[&mut f64]| values.iter().map(|value| **value).sum::<f64>() / values.len() as f64;
        match (&mut segment.kind, *self) {
            (SegmentKind::Flexible(flexible), S::Stiffness(axis)) => {
                let stiffness = flexible.stiffness.principal();
                axis.axes().iter().map(|axis| stiffness[axis.index()]).sum::<f64>() / axis.axes().len() as f64
            }
            (SegmentKind::Rigid(Rigid { body: Some(body), .. }), S::Diameter) => 2.0 * body.outer_radius,
            _ => {
                let numbers = self.numbers(&mut segment);
                if numbers.is_empty() { self.absent() } else { mean(&numbers) }
            }
        }
    }

    /// The value of what the scene leaves out.
    fn absent(&self) -> f64 {
        match self {
            S::Density | S::LinearDensity | S::Mass | S::DipolePerLength(_) => 0.0,
            S::StiffnessShear(_) | S::StiffnessAxial => f64::INFINITY,
            _ => f64::NAN,
        }
    }

    pub(super) fn set(&self, segment: &mut Segment, value: f64) {
        match (&mut segment.kind, self) {
            (SegmentKind::Flexible(flexible), S::Density) => flexible.density = Some(Density::Volume(value)),
            (SegmentKind::Flexible(flexible), S::LinearDensity) => flexible.density = Some(Density::Linear(value)),
            (SegmentKind::Rigid(rigid), S::Mass) => rigid.mass = Some(value),
            (SegmentKind::Rigid(Rigid { body: Some(body), .. }), S::Diameter) => body.outer_radius = 0.5 * value,
            _ => self.numbers(segment).into_iter().for_each(|number| *number = value),
        }
    }

    /// The numbers of the scene that the parameter drives; none where the segment has no such parameter.
    fn numbers<'a>(&self, segment: &'a mut Segment) -> Vec<&'a mut f64> {
        if let S::Length = self {
            return vec![&mut segment.length];
        }
        let number = match (&mut segment.kind, *self) {
            (SegmentKind::Flexible(flexible), parameter) => return flexible_numbers(flexible, parameter),
            (SegmentKind::Rigid(Rigid { mass, .. }), S::Mass) => mass.as_mut(),
            (SegmentKind::Rigid(Rigid { dipole_per_length, .. }), S::DipolePerLength(axis)) => {
                dipole_per_length.as_mut().map(|dipole| &mut dipole[axis.index()])
            }
            (SegmentKind::Rigid(Rigid { body: Some(body), .. }), S::InnerRadius) => Some(&mut body.inner_radius),
            (SegmentKind::Rigid(Rigid { body: Some(body), .. }), S::OuterRadius) => Some(&mut body.outer_radius),
            (SegmentKind::Rigid(Rigid { body: Some(body), .. }), S::Density) => body.density.as_mut(),
            (SegmentKind::Rigid(Rigid { magnet: Some(magnet), .. }), S::Remanence(axis) | S::Magnetization(axis)) => {
                Some(magnet.number(axis))
            }
            (SegmentKind::Rigid(Rigid { magnet: Some(magnet), .. }), S::VolumeFraction) => {
                magnet.volume_fraction.as_mut()
            }
            (SegmentKind::Rigid(Rigid { coil: Some(coil), .. }), parameter) => match (parameter, &mut coil.winding) {
                (S::Current(axis), _) => Some(&mut coil.current[axis.index()]),
                (S::Alignment(axis), _) => Some(&mut coil.alignment[axis.index()]),
                (S::Turns(axis), CoilWinding::Axes { turns, .. }) => Some(&mut turns[axis.index()]),
                (S::Area(axis), CoilWinding::Axes { area, .. }) => Some(&mut area[axis.index()]),
                (S::TurnsArea(row, column), CoilWinding::Matrix(rows)) => Some(&mut rows[row.index()][column.index()]),
                _ => None,
            },
            _ => None,
        };
        number.into_iter().collect()
    }
}

/// Numbers of a magnetic material.
fn of_material(material: &MagnetMaterial) -> Vec<SegmentParameter> {
    let number = match material.quantity {
        MagnetQuantity::Remanence => S::Remanence,
        MagnetQuantity::Magnetization => S::Magnetization,
    };
    let mut all: Vec<SegmentParameter> = match material.is_along {
        true => vec![number(None)],
        false => Axis::ALL.map(|axis| number(Some(axis))).to_vec(),
    };
    all.extend(material.volume_fraction.map(|_| S::VolumeFraction));
    all
}

/// Path of a vector's component, or of one number.
fn of_axis(name: &str, axis: Option<Axis>) -> String {
    axis.map_or(name.to_owned(), |axis| format!("{name}.{}", axis.name()))
}

fn of_profile<A: Copy>(
    profile: &Profile,
    axes: &[A],
    constant: fn(A) -> SegmentParameter,
    node: fn(usize, A) -> SegmentParameter,
) -> Vec<SegmentParameter> {
    match profile {
        Profile::Constant(_) => axes.iter().map(|axis| constant(*axis)).collect(),
        Profile::Nodes(nodes) => (0..nodes.len()).flat_map(|k| axes.iter().map(move |axis| node(k, *axis))).collect(),
    }
}

fn flexible_numbers(flexible: &mut Flexible, parameter: SegmentParameter) -> Vec<&mut f64> {
    match (parameter, &mut flexible.stiffness) {
        (S::Stiffness(axis), Stiffness::Direct { bending_x, bending_y, torsion }) => match axis {
            StiffnessAxis::Bending => vec![bending_x, bending_y],
            StiffnessAxis::BendingX => vec![bending_x],
            StiffnessAxis::BendingY => vec![bending_y],
            StiffnessAxis::Torsion => vec![torsion],
        },
        (S::StiffnessNode(k, axis), Stiffness::Nodes(nodes)) => of_axes(node_value(nodes, k), axis.axes()),
        (S::InnerRadius, Stiffness::Tube { inner_radius, .. }) => vec![inner_radius],
        (S::OuterRadius, Stiffness::Tube { outer_radius, .. }) => vec![outer_radius],
        (S::YoungsModulus, Stiffness::Tube { youngs_modulus, .. }) => vec![youngs_modulus],
        (S::ShearModulus, Stiffness::Tube { shear: ShearElasticity::Modulus(modulus), .. }) => vec![modulus],
        (S::PoissonRatio, Stiffness::Tube { shear: ShearElasticity::PoissonRatio(ratio), .. }) => vec![ratio],
        (S::RestCurvature(axis), _) => match &mut flexible.rest_curvature {
            Profile::Constant(value) => of_axes(value, &[axis]),
            Profile::Nodes(_) => Vec::new(),
        },
        (S::RestCurvatureNode(k, axis), _) => match &mut flexible.rest_curvature {
            Profile::Constant(_) => Vec::new(),
            Profile::Nodes(nodes) => of_axes(node_value(nodes, k), &[axis]),
        },
        (S::StiffnessShear(axis), _) => {
            flexible.stiffness_shear.as_mut().map_or(Vec::new(), |shear| of_axes(shear, axis.axes()))
        }
        (S::StiffnessAxial, _) => flexible.stiffness_axial.as_mut().into_iter().collect(),
        (S::DipolePerLength(axis), _) => {
            flexible.dipole_per_length.as_mut().map_or(Vec::new(), |dipole| of_axes(dipole, &[axis]))
        }
        (S::Remanence(axis) | S::Magnetization(axis), _) => {
            flexible.magnet.as_mut().map(|magnet| magnet.number(axis)).into_iter().collect()
        }
        (S::VolumeFraction, _) => {
            flexible.magnet.as_mut().and_then(|magnet| magnet.volume_fraction.as_mut()).into_iter().collect()
        }
        (S::Density | S::LinearDensity, _) => match &mut flexible.density {
            Some(Density::Volume(density) | Density::Linear(density)) => vec![density],
            None => Vec::new(),
        },
        _ => Vec::new(),
    }
}

fn node_value(nodes: &mut [Node], k: usize) -> &mut [f64] {
    nodes.get_mut(k).map_or(&mut [], |node| &mut node.value)
}

/// The components along some axes, as far as there are any.
fn of_axes<'a>(values: &'a mut [f64], axes: &[Axis]) -> Vec<&'a mut f64> {
    values.iter_mut().enumerate().filter(|(k, _)| axes.iter().any(|axis| axis.index() == *k)).map(|(_, x)| x).collect()
}
