//! Every number of a scene that can be set, swept or differentiated by: name, value, unit, meaning.

use super::quantity_text::quantity_text;
use crate::model::{
    Axis, Frame, GradientEntry, InnerLoad, LoadPlace, MagnetParameter, Parameter, Scene, SegmentParameter, ShearAxis,
    StiffnessAxis, WallParameter,
};
use MagnetParameter as M;
use Parameter as P;
use SegmentParameter as S;

/// A parameter of a scene, as a user reads it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ParameterRow {
    /// The name that files and commands know.
    pub name: String,
    /// Value in the scene, SI.
    pub value: f64,
    /// SI unit; empty for a pure number.
    pub unit: &'static str,
    /// What it is, in a few words.
    pub meaning: String,
    /// Whether it can be set and swept; a number that follows from others can only be differentiated by.
    pub is_free: bool,
}

impl ParameterRow {
    /// The value with a unit that reads well, as a file takes it.
    pub fn value_text(&self) -> String {
        quantity_text(self.value, self.unit)
    }
}

/// A name that stands for several parameters.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ParameterGroup {
    /// The name, such as `coil.current`.
    pub name: String,
    /// What it stands for.
    pub members: Vec<String>,
}

/// Every parameter of a scene, in the scene's order.
pub fn parameter_rows(scene: &Scene) -> Vec<ParameterRow> {
    let row = |parameter: Parameter| {
        let value = parameter.get(scene);
        ParameterRow {
            name: parameter.name(scene),
            value,
            unit: parameter.unit(),
            meaning: meaning(scene, parameter),
            is_free: parameter.set(&mut scene.clone(), value).is_ok(),
        }
    };
    Parameter::all(scene).into_iter().map(row).collect()
}

/// Every group of a scene's parameters, in the scene's order.
pub fn parameter_groups(scene: &Scene) -> Vec<ParameterGroup> {
    let mut groups: Vec<ParameterGroup> = Vec::new();
    for parameter in Parameter::all(scene) {
        for name in parameter.groups(scene) {
            match groups.iter_mut().find(|group| group.name == name) {
                Some(group) => group.members.push(parameter.name(scene)),
                None => groups.push(ParameterGroup { name, members: vec![parameter.name(scene)] }),
            }
        }
    }
    groups
}

/// Describes a component of a force or a moment inside of the rod, or at its tip.
fn of_load(kind: &str, load: &InnerLoad, axis: Axis) -> String {
    let place = if load.place == LoadPlace::Tip { "at the tip".into() } else { format!("`{}`", load.name) };
    match load.frame {
        Frame::World => format!("{kind} {place}, along {} of the world", axis.name()),
        Frame::Body => format!("{kind} {place}, turns with the rod, along {} of its frame there", axis.name()),
    }
}

/// What a parameter is.
fn meaning(scene: &Scene, parameter: Parameter) -> String {
    let along = |what: &str, axis: Axis| format!("{what}, along {} of the world", axis.name());
    match parameter {
        P::Insertion => "length of the rod past the entry point; changes the first segment".into(),
        P::BasePosition(axis) => along("position of the base", axis),
        P::BaseRotation(axis) => along("rotation vector of the base", axis),
        P::FluxDensity(axis) => along("uniform field", axis),
        P::FieldGradient(entry) => format!("gradient of the field, {}", gradient(entry)),
        P::FieldOrigin(axis) => along("point where the gradient adds nothing", axis),
        P::Magnet(magnet, number) => {
            let name = &scene.sources.magnets[magnet].name;
            match number {
                M::Position(axis) => along(&format!("position of the magnet `{name}`"), axis),
                M::Moment(axis) => format!("moment of the magnet `{name}`, along its own {}", axis.name()),
                M::Rotation(axis) => along(&format!("rotation vector of the magnet `{name}`"), axis),
                M::Strength => format!("factor of the moment of the magnet `{name}`"),
            }
        }
        P::ArrayCurrent(array, coil) => {
            format!("current of coil {} of the array `{}`", coil + 1, scene.sources.arrays[array].name)
        }
        P::MapScale(map) => format!("factor of the sampled field `{}`", scene.sources.maps[map].name),
        P::MapPosition(map, axis) => {
            along(&format!("where the sampled field `{}` is put", scene.sources.maps[map].name), axis)
        }
        P::TipForce(axis) => along("force at the tip, keeps its direction", axis),
        P::TipMoment(axis) => along("moment at the tip, keeps its direction", axis),
        P::Gravity(axis) => along("acceleration of gravity", axis),
        P::DistributedForce(axis) => along("force per length on the whole rod", axis),
        P::FluidDensity => "density of the fluid around the rod".into(),
        P::InnerMoment(load, axis) => of_load("moment", &scene.inner_loads[load], axis),
        P::InnerForce(load, axis) => of_load("force", &scene.inner_loads[load], axis),
        P::ForceAlong(force, axis) => along(&format!("force per length `{}`", scene.inner_loads[force].name), axis),
        P::Wall(number) => of_wall(number),
        P::Segment(_, number) => of_segment(number),
    }
}

fn of_wall(number: WallParameter) -> String {
    let along = |what: &str, axis: Axis| format!("{what}, along {} of the world", axis.name());
    match number {
        WallParameter::Position(axis) => along("position of the wall", axis),
        WallParameter::Rotation(axis) => along("rotation vector of the wall", axis),
        WallParameter::Radius => "radius of the wall".into(),
        WallParameter::TipRadius => "radius of the ball at the tip".into(),
        WallParameter::Stiffness => "stiffness of the wall's tissue; without one it is rigid".into(),
        WallParameter::Friction => "coefficient of friction, which judges whether a held tip holds".into(),
        WallParameter::Anchor(axis) => along("where on the wall the tip is held", axis),
    }
}

fn gradient(entry: GradientEntry) -> &'static str {
    match entry {
        GradientEntry::Xx => "dBx/dx",
        GradientEntry::Xy => "dBx/dy and dBy/dx",
        GradientEntry::Xz => "dBx/dz and dBz/dx",
        GradientEntry::Yy => "dBy/dy",
        GradientEntry::Yz => "dBy/dz and dBz/dy",
    }
}

fn of_segment(number: SegmentParameter) -> String {
    let about = |what: &str, axis: Axis| format!("{what}, about {} of the segment", axis.name());
    let along = |what: &str, axis: Option<Axis>| match axis {
        Some(axis) => format!("{what}, along {} of the segment", axis.name()),
        None => format!("{what}, along the segment"),
    };
    let stiffness = |axis: StiffnessAxis| match axis {
        StiffnessAxis::Bending => "bending stiffness, about x and y together",
        StiffnessAxis::BendingX => "bending stiffness, about x of the segment",
        StiffnessAxis::BendingY => "bending stiffness, about y of the segment",
        StiffnessAxis::Torsion => "torsional stiffness",
    };
    match number {
        S::Length => "length of the segment".into(),
        S::RestCurvature(axis) => about("curvature without load", axis),
        S::RestCurvatureNode(node, axis) => about(&format!("curvature without load at node {}", node + 1), axis),
        S::Stiffness(axis) => stiffness(axis).into(),
        S::StiffnessNode(node, axis) => format!("{} at node {}", stiffness(axis), node + 1),
        S::StiffnessShear(ShearAxis::Both) => "stiffness against shear, along x and y together".into(),
        S::StiffnessShear(ShearAxis::X) => "stiffness against shear, along x of the segment".into(),
        S::StiffnessShear(ShearAxis::Y) => "stiffness against shear, along y of the segment".into(),
        S::StiffnessAxial => "stiffness against stretch".into(),
        S::YoungsModulus => "Young's modulus".into(),
        S::ShearModulus => "shear modulus".into(),
        S::PoissonRatio => "Poisson's ratio".into(),
        S::InnerRadius => "inner radius".into(),
        S::OuterRadius => "outer radius".into(),
        S::Density => "density of the material".into(),
        S::LinearDensity => "mass per length".into(),
        S::DipolePerLength(axis) => along("magnetic moment per length", Some(axis)),
        S::Remanence(axis) => along("remanence", axis),
        S::Magnetization(axis) => along("magnetisation", axis),
        S::VolumeFraction => "magnetic share of the volume".into(),
        S::Diameter => "outer diameter".into(),
        S::Mass => "mass of the segment".into(),
        S::Current(axis) => about("current of the winding", axis),
        S::Turns(axis) => about("turns of the winding", axis),
        S::Area(axis) => about("area of one turn of the winding", axis),
        S::TurnsArea(row, column) => {
            format!("moment along {} per ampere of the current of {}", row.name(), column.name())
        }
        S::Alignment(axis) => format!("rotation vector of the coil in the segment, along {}", axis.name()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::{Dimension, parse_quantity, parse_scene};
    use std::path::Path;

    const P6: &str = include_str!("../../sweeps/scenes/p6.toml");
    const SCENES: [&str; 4] = [
        P6,
        include_str!("../../sweeps/scenes/arm_magnet.toml"),
        include_str!("../../sweeps/scenes/coil_array.toml"),
        include_str!("../../sweeps/scenes/tip_coil.toml"),
    ];

    #[test]
    fn values_read_back_and_names_are_known() {
        for text in SCENES {
            let scene = parse_scene(Path::new("scene.toml"), text).expect("a shipped scene");
            for row in parameter_rows(&scene) {
                let back = parse_quantity(&row.value_text(), Dimension::of(row.unit)).expect("a quantity");
                assert!((back - row.value).abs() <= 1e-5 * row.value.abs(), "{row:?}: {back}");
                assert_eq!(Parameter::parse(&scene, &row.name).expect("a parameter").len(), 1);
            }
            for group in parameter_groups(&scene) {
                let members = Parameter::parse(&scene, &group.name).expect("a group");
                assert_eq!(members.iter().map(|p| p.name(&scene)).collect::<Vec<_>>(), group.members);
            }
        }
    }

    #[test]
    fn a_number_that_follows_from_others_is_not_free() {
        let rows = parameter_rows(&parse_scene(Path::new("p6.toml"), P6).expect("a scene"));
        let is_free = |name: &str| rows.iter().find(|row| row.name == name).map(|row| row.is_free);
        assert_eq!(is_free("proximal.stiffness.bending"), Some(false));
        assert_eq!(is_free("proximal.youngs_modulus"), Some(true));
        assert_eq!(is_free("coil.current.x"), Some(true));
    }
}
