//! Parameters by name: sweep axes, `--set`, differentiation variables and columns all use these.
//!
//! A parameter is a path into the scene. `chain` says by how much it moves the numbers of the rod, so that every
//! parameter that can be swept can be differentiated by.

use super::segment_parameter::{SegmentParameter, rotation_jacobian, weight_chain};
use super::{Density, Flexible, Scene, SegmentKind, Slot, Stiffness, Vector};

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

#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParameterError {
    #[error("no parameter is named `{name}`{}", remedy(suggestion, heads))]
    Unknown {
        name: String,
        suggestion: Option<String>,
        /// First words of the names that there are.
        heads: Vec<String>,
    },
    #[error(
        "`{name}` follows from `tube` and moduli in this scene: sweep `youngs_modulus`, or give `stiffness` instead of the tube"
    )]
    Derived { name: String },
}

fn remedy(suggestion: &Option<String>, heads: &[String]) -> String {
    match suggestion {
        Some(name) => format!(": did you mean `{name}`?"),
        None => format!("; names in this scene begin with: {}", heads.join(", ")),
    }
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
        let suggestion = closest(name, names.iter().map(String::as_str));
        let mut heads: Vec<String> = names.iter().filter_map(|name| name.split('.').next()).map(String::from).collect();
        heads.sort();
        heads.dedup();
        Err(ParameterError::Unknown { name: name.into(), suggestion, heads })
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

    /// Sets the value, SI. Insertion sets the first segment's length: see [`Parameter::set_all`].
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

    /// Sets several values, SI, in order but insertion last, for it depends on the other lengths.
    pub fn set_all(
        scene: &mut Scene,
        values: impl Iterator<Item = (Parameter, f64)> + Clone,
    ) -> Result<(), ParameterError> {
        for last in [false, true] {
            for (parameter, value) in values.clone().filter(|(parameter, _)| (*parameter == P::Insertion) == last) {
                parameter.set(scene, value)?;
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
