//! Parameters by name: sweep axes, `--set`, differentiation variables and columns all use these.
//!
//! A parameter is a path into the scene. `chain` says by how much it moves the numbers of the rod, so that every
//! parameter that can be swept can be differentiated by.

use super::message::{short_list, short_name};
use super::segment_chain::{load_chain, rotation_jacobian, weight_chain};
use super::segment_parameter::SegmentParameter;
use super::{
    Density, Flexible, GradientEntry, LoadPlace, MagnetParameter, Scene, SegmentKind, Slot, Stiffness, Vector,
    WallParameter, field_parameter, inner_load, segment_chain,
};
use std::collections::BTreeMap;

/// One of three axes, of the world or of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Axis {
    /// First axis; in the body frame a principal axis of bending.
    X,
    /// Second axis; in the body frame the other principal axis of bending.
    Y,
    /// Third axis; in the body frame along the rod, from base to tip.
    Z,
}

impl Axis {
    /// x, y, z.
    pub const ALL: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

    /// Place in a [`Vector`]: 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The letter in names of parameters.
    pub fn name(self) -> &'static str {
        ["x", "y", "z"][self.index()]
    }
}

/// A stiffness of a flexible segment (N·m²).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StiffnessAxis {
    /// Both bending stiffnesses together.
    Bending,
    /// About body x.
    BendingX,
    /// About body y.
    BendingY,
    /// About body z.
    Torsion,
}

/// A number of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// Length of the whole rod (m): more is pushed in at the base of the first segment.
    Insertion,
    /// Component of the position of the base (m).
    BasePosition(Axis),
    /// Component of the rotation vector of the base (rad).
    BaseRotation(Axis),
    /// Component of the uniform flux density (T).
    FluxDensity(Axis),
    /// Entry of the gradient of the field (T/m).
    FieldGradient(GradientEntry),
    /// Component of the point where the gradient adds nothing (m).
    FieldOrigin(Axis),
    /// A number of an external magnet, by its index.
    Magnet(usize, MagnetParameter),
    /// Current of a coil of an array of coils, both by their index (A).
    ArrayCurrent(usize, usize),
    /// Factor of a field sampled on a grid, by its index.
    MapScale(usize),
    /// Component of where such a field is put (m).
    MapPosition(usize, Axis),
    /// Component of the dead force at the tip (N).
    TipForce(Axis),
    /// Component of the dead couple at the tip (N·m).
    TipMoment(Axis),
    /// Component of the acceleration of gravity (m/s²).
    Gravity(Axis),
    /// Component of the force per length along the rod (N/m).
    DistributedForce(Axis),
    /// Density of the fluid around the rod (kg/m³).
    FluidDensity,
    /// Component of a force inside of the rod, by its index among such loads (N).
    InnerForce(usize, Axis),
    /// Component of a couple inside of the rod, by its index among the same (N·m).
    InnerMoment(usize, Axis),
    /// Component of a dead force along a segment, by its index among the same (N/m).
    ForceAlong(usize, Axis),
    /// A number of the wall.
    Wall(WallParameter),
    /// A number of one segment, by its index from the base.
    Segment(usize, SegmentParameter),
}

/// Why a name or a value is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParameterError {
    /// The scene has no parameter or group of this name.
    #[error("no parameter is named `{}`{}", short_name(name), remedy(suggestion, heads))]
    Unknown {
        /// As the user wrote it.
        name: String,
        /// The nearest name that there is, if one is near.
        suggestion: Option<String>,
        /// First words of the names that there are.
        heads: Vec<String>,
    },
    /// The scene computes this number from others.
    #[error(
        "`{name}` follows from `tube` and moduli in this scene: sweep `youngs_modulus`, or give `stiffness` instead of the tube"
    )]
    Derived {
        /// Path of the parameter.
        name: String,
    },
}

fn remedy(suggestion: &Option<String>, heads: &[String]) -> String {
    match suggestion {
        Some(name) => format!(": did you mean `{name}`?"),
        None => format!("; names in this scene begin with: {}", short_list(heads.iter().cloned())),
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
        // At the tip a load that turns with it has the name of one that does not.
        let is_taken = |parameter: &Parameter| match parameter {
            P::TipForce(_) => scene.tip_load("tip_force").is_some(),
            P::TipMoment(_) => scene.tip_load("tip_moment").is_some(),
            _ => false,
        };
        all.retain(|parameter| !is_taken(parameter));
        all.push(P::FluidDensity);
        all.extend(inner_load::all(scene));
        all.extend(field_parameter::all(&scene.sources));
        all.extend(scene.wall.iter().flat_map(WallParameter::all).map(P::Wall));
        for (index, segment) in scene.segments.iter().enumerate() {
            all.extend(SegmentParameter::all(segment).into_iter().map(|parameter| P::Segment(index, parameter)));
        }
        all
    }

    /// Parameters meant by a name; a group (`coil.current`) stands for its components. Who asks for many names asks
    /// [`ParameterNames`].
    ///
    /// # Errors
    ///
    /// The scene has no such parameter.
    pub fn parse(scene: &Scene, name: &str) -> Result<Vec<Parameter>, ParameterError> {
        ParameterNames::of(scene).parse(name)
    }

    /// The path that names this parameter.
    pub fn name(&self, scene: &Scene) -> String {
        match *self {
            P::Insertion => "insertion".into(),
            P::BasePosition(axis) => format!("base.position.{}", axis.name()),
            P::BaseRotation(axis) => format!("base.rotation.{}", axis.name()),
            P::FluxDensity(axis) => format!("field.flux_density.{}", axis.name()),
            P::FieldGradient(entry) => format!("field.gradient.{}", entry.name()),
            P::FieldOrigin(axis) => format!("field.origin.{}", axis.name()),
            P::Magnet(index, parameter) => {
                format!("magnets.{}.{}", scene.sources.magnets[index].name, parameter.path())
            }
            P::ArrayCurrent(array, coil) => format!("{}.current.{}", scene.sources.arrays[array].name, coil + 1),
            P::MapScale(map) => format!("maps.{}.scale", scene.sources.maps[map].name),
            P::MapPosition(map, axis) => format!("maps.{}.position.{}", scene.sources.maps[map].name, axis.name()),
            P::TipForce(axis) => format!("loads.tip_force.{}", axis.name()),
            P::TipMoment(axis) => format!("loads.tip_moment.{}", axis.name()),
            P::Gravity(axis) => format!("loads.gravity.{}", axis.name()),
            P::DistributedForce(axis) => format!("loads.distributed_force.{}", axis.name()),
            P::FluidDensity => "loads.fluid_density".into(),
            P::InnerForce(load, axis) | P::InnerMoment(load, axis)
                if scene.inner_loads[load].place == LoadPlace::Tip =>
            {
                format!("loads.{}.{}", scene.inner_loads[load].name, axis.name())
            }
            P::InnerForce(force, axis) => format!("loads.{}.force.{}", scene.inner_loads[force].name, axis.name()),
            P::InnerMoment(load, axis) => format!("loads.{}.moment.{}", scene.inner_loads[load].name, axis.name()),
            P::ForceAlong(force, axis) => {
                format!("loads.{}.force_per_length.{}", scene.inner_loads[force].name, axis.name())
            }
            P::Wall(parameter) => format!("wall.{}", parameter.path()),
            P::Segment(index, parameter) => format!("{}.{}", scene.segments[index].name, parameter.path()),
        }
    }

    /// Names of the groups this is a component of: its path, cut short. A parameter such as `stiffness.bending` is
    /// in none, for it is two components at once.
    pub fn groups(&self, scene: &Scene) -> Vec<String> {
        let is_joint = matches!(self, P::Segment(_, parameter) if parameter.is_joint());
        let name = self.name(scene);
        // A magnet's or a map's name is the second word of its parameters.
        let words = if matches!(self, P::Magnet(..) | P::MapScale(_) | P::MapPosition(..)) { 2 } else { 1 };
        let cuts = name.match_indices('.').skip(words).filter(|_| !is_joint);
        cuts.map(|(at, _)| name[..at].to_owned()).collect()
    }

    /// SI unit of the parameter; empty for a pure number.
    pub fn unit(&self) -> &'static str {
        match self {
            P::Insertion | P::BasePosition(_) => "m",
            P::BaseRotation(_) => "rad",
            P::FluxDensity(_) => "T",
            P::FieldGradient(_) => "T/m",
            P::FieldOrigin(_) | P::MapPosition(..) => "m",
            P::MapScale(_) => "",
            P::Magnet(_, parameter) => parameter.unit(),
            P::ArrayCurrent(..) => "A",
            P::TipForce(_) | P::InnerForce(..) => "N",
            P::TipMoment(_) | P::InnerMoment(..) => "N·m",
            P::Gravity(_) => "m/s²",
            P::DistributedForce(_) | P::ForceAlong(..) => "N/m",
            P::FluidDensity => "kg/m³",
            P::Wall(parameter) => parameter.unit(),
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
            P::InnerForce(force, axis) | P::ForceAlong(force, axis) => scene.inner_loads[force].force[axis.index()],
            P::InnerMoment(load, axis) => component(scene.inner_loads[load].moment, axis),
            P::FieldGradient(_)
            | P::FieldOrigin(_)
            | P::Magnet(..)
            | P::ArrayCurrent(..)
            | P::MapScale(_)
            | P::MapPosition(..) => {
                let mut sources = scene.sources.clone();
                field_parameter::number(*self, &mut sources).map_or(f64::NAN, |number| *number)
            }
            P::Wall(parameter) => scene.wall.as_ref().map_or(f64::NAN, |wall| parameter.get(wall)),
            P::Segment(index, parameter) => parameter.get(&scene.segments[index]),
        }
    }

    /// Sets the value, SI. Insertion depends on the segments' own lengths: see [`Parameter::set_all`].
    ///
    /// # Errors
    ///
    /// The stiffness of a tube, which follows from its radii and moduli.
    pub fn set(&self, scene: &mut Scene, value: f64) -> Result<(), ParameterError> {
        let set = |vector: &mut Option<Vector>, axis: Axis| vector.get_or_insert([0.0; 3])[axis.index()] = value;
        match *self {
            P::Insertion => {
                let own: f64 = scene.segments.iter().map(|segment| segment.length).sum();
                scene.inserted = value - own;
            }
            P::BasePosition(axis) => scene.base.position[axis.index()] = value,
            P::BaseRotation(axis) => scene.base.rotation[axis.index()] = value,
            P::FluxDensity(axis) => scene.flux_density[axis.index()] = value,
            P::TipForce(axis) => set(&mut scene.loads.tip_force, axis),
            P::TipMoment(axis) => set(&mut scene.loads.tip_moment, axis),
            P::Gravity(axis) => set(&mut scene.loads.gravity, axis),
            P::DistributedForce(axis) => set(&mut scene.loads.distributed_force, axis),
            P::FluidDensity => scene.loads.fluid_density = Some(value),
            P::InnerForce(force, axis) | P::ForceAlong(force, axis) => {
                scene.inner_loads[force].force[axis.index()] = value;
            }
            P::InnerMoment(load, axis) => set(&mut scene.inner_loads[load].moment, axis),
            P::FieldGradient(_)
            | P::FieldOrigin(_)
            | P::Magnet(..)
            | P::ArrayCurrent(..)
            | P::MapScale(_)
            | P::MapPosition(..) => {
                field_parameter::number(*self, &mut scene.sources).into_iter().for_each(|number| *number = value);
            }
            P::Wall(parameter) => scene.wall.iter_mut().for_each(|wall| parameter.set(wall, value)),
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
    ///
    /// # Errors
    ///
    /// As [`Parameter::set`]; values before the refused one are set.
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
            P::Gravity(axis) => on_all(scene, axis, |segment| match &scene.segments[segment].kind {
                SegmentKind::Flexible(flexible) => scene.linear_density(flexible),
                SegmentKind::Rigid(rigid) => scene.mass(rigid, scene.segment_length(segment)),
            }),
            P::DistributedForce(axis) => on_all(scene, axis, |segment| match &scene.segments[segment].kind {
                SegmentKind::Flexible(_) => 1.0,
                SegmentKind::Rigid(_) => scene.segment_length(segment),
            }),
            P::FluidDensity => {
                let displaces = |segment: &usize| match &scene.segments[*segment].kind {
                    SegmentKind::Flexible(flexible) => matches!(flexible.density, Some(Density::Volume(_))),
                    SegmentKind::Rigid(rigid) => rigid.body.is_some_and(|body| body.density.is_some()),
                };
                let area = |segment: usize| match &scene.segments[segment].kind {
                    SegmentKind::Flexible(flexible) => flexible.stiffness.cross_section().unwrap_or(0.0),
                    SegmentKind::Rigid(rigid) => {
                        rigid.body.map_or(0.0, |body| body.cross_section()) * scene.segment_length(segment)
                    }
                };
                let segments = (0..scene.segments.len()).filter(displaces);
                segments.flat_map(|segment| weight_chain(scene, segment, -area(segment))).collect()
            }
            P::InnerForce(force, axis) | P::ForceAlong(force, axis) => inner_load::chain(scene, force, axis),
            P::InnerMoment(load, axis) => inner_load::moment_chain(scene, load, axis),
            P::FieldGradient(_)
            | P::FieldOrigin(_)
            | P::Magnet(..)
            | P::ArrayCurrent(..)
            | P::MapScale(_)
            | P::MapPosition(..) => field_parameter::chain(*self, scene),
            P::Wall(parameter) => scene.wall.as_ref().map_or(Vec::new(), |wall| parameter.chain(wall)),
            P::Segment(index, parameter) => segment_chain::chain(parameter, scene, index),
        }
    }
}

/// The names of the parameters and groups of a scene, to look up many.
#[derive(Clone, Debug)]
pub struct ParameterNames(BTreeMap<String, Vec<Parameter>>);

impl ParameterNames {
    /// The names of the parameters and groups of a scene.
    pub fn of(scene: &Scene) -> ParameterNames {
        let all = Parameter::all(scene);
        let mut found: BTreeMap<String, Vec<Parameter>> = BTreeMap::new();
        for parameter in &all {
            parameter.groups(scene).into_iter().for_each(|group| found.entry(group).or_default().push(*parameter));
        }
        // A parameter wins over a group of its name, and the first of two parameters.
        found.extend(all.iter().rev().map(|parameter| (parameter.name(scene), vec![*parameter])));
        ParameterNames(found)
    }

    /// Parameters meant by a name; `None` where there are none.
    pub fn find(&self, name: &str) -> Option<&[Parameter]> {
        self.0.get(name).map(Vec::as_slice)
    }

    /// Parameters meant by a name.
    ///
    /// # Errors
    ///
    /// The scene has no such parameter; the error suggests another name.
    pub fn parse(&self, name: &str) -> Result<Vec<Parameter>, ParameterError> {
        if let Some(found) = self.find(name) {
            return Ok(found.to_vec());
        }
        let names = || self.0.keys().map(String::as_str);
        let mut heads: Vec<String> = names().filter_map(|name| name.split('.').next()).map(String::from).collect();
        heads.sort();
        heads.dedup();
        Err(ParameterError::Unknown { name: name.into(), suggestion: closest(name, names()), heads })
    }
}

/// A load along a world axis on every segment, each with its own rate.
fn on_all(scene: &Scene, axis: Axis, rate: impl Fn(usize) -> f64) -> Vec<(Slot, f64)> {
    (0..scene.segments.len()).flat_map(|segment| load_chain(scene, segment, axis, rate(segment))).collect()
}

/// Characters of the names that are compared: their distance takes as many steps as their lengths multiplied.
const MOST_CHARACTERS: usize = 200;

/// The candidate nearest to a misspelt name, if one is near (edit distance at most a third of the length).
///
/// Names of more than 200 characters are near to none, and candidates whose lengths differ by too much are passed over.
pub fn closest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<String> {
    let name: Vec<char> = name.chars().take(MOST_CHARACTERS + 1).collect();
    if name.len() > MOST_CHARACTERS {
        return None;
    }
    let limit = 2.max(name.len() / 3);
    let may_be_near = |candidate: &&str| {
        let length = candidate.chars().take(MOST_CHARACTERS + 1).count();
        length <= MOST_CHARACTERS && length.abs_diff(name.len()) <= limit
    };
    candidates
        .filter(may_be_near)
        .map(|candidate| (distance(&name, candidate), candidate))
        .filter(|(distance, _)| *distance <= limit)
        .min()
        .map(|(_, candidate)| candidate.to_owned())
}

/// Characters to insert, drop or replace between two texts.
fn distance(a: &[char], b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let substitution = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = substitution.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::closest;
    use std::iter;

    #[test]
    fn a_near_name_is_suggested() {
        let known = ["coil.current.x", "insertion", "loads.tip_force.x"];
        assert_eq!(closest("coil.curent.x", known.into_iter()).as_deref(), Some("coil.current.x"));
        assert_eq!(closest("insertoin", known.into_iter()).as_deref(), Some("insertion"));
        assert_eq!(closest("temperature", known.into_iter()), None);
    }

    #[test]
    fn a_name_far_longer_than_all_others_is_near_to_none() {
        let long = "\0".repeat(3_000_000);
        // A distance of two such names would take days.
        assert_eq!(closest(&long, iter::once(long.as_str())), None);
        assert_eq!(closest("insertion", iter::repeat_n(long.as_str(), 1000)), None);
        assert_eq!(closest(&long, iter::from_fn(|| panic!("no candidate is looked at"))), None);
    }
}
