//! Which numbers of a scene can be moved, within which limits, and the units in which they read well.

use rodsweep::model::{Axis, MagnetParameter, Parameter, Scene, SegmentKind, SegmentParameter, WallParameter};
use rodsweep::spec::AxisSpec;
use rodsweep::study::CURRENT_LIMIT;
use serde::Serialize;

/// Field that a component may at least have (T).
const FLUX_DENSITY: f64 = 3.0;
/// Standard deviations of a normal law on either side.
const DEVIATIONS: f64 = 3.0;

/// Where limits come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LimitSource {
    /// The sweep.
    Sweep,
    /// The kind of the parameter.
    Kind,
}

/// A number of the scene that can be moved. Values are in SI.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slider {
    /// Path of the parameter, as for `--set`.
    pub name: String,
    /// Heading under which it stands.
    pub group: String,
    /// SI unit; empty for none.
    pub unit: &'static str,
    /// Unit in which it is shown.
    pub shown_unit: &'static str,
    /// Of the shown unit in SI.
    pub factor: f64,
    /// In the scene.
    pub value: f64,
    /// Lower limit.
    pub low: f64,
    /// Upper limit.
    pub high: f64,
    /// Where the limits come from.
    pub limits: LimitSource,
    /// Whether a robot commands it: a current, the insertion, or an axis of the sweep.
    pub is_input: bool,
}

/// Every number of a scene that can be set, what is commanded first.
pub fn sliders(scene: &Scene, axes: &[AxisSpec]) -> Vec<Slider> {
    let scale = Scale::of(scene);
    let mut all: Vec<Slider> = Parameter::all(scene)
        .into_iter()
        .filter(|parameter| can_be_set(scene, *parameter))
        .map(|parameter| slider(scene, axes, &scale, parameter))
        .collect();
    // The order of the scene within each kind.
    all.sort_by_key(|slider| (!slider.is_input, rank(&slider.group)));
    all
}

/// Whether it is a number of its own: the stiffness of a tube follows from others.
fn can_be_set(scene: &Scene, parameter: Parameter) -> bool {
    let value = parameter.get(scene);
    let is_rigid = scene.segments.first().is_none_or(|first| matches!(first.kind, SegmentKind::Rigid(_)));
    value.is_finite()
        && !(parameter == Parameter::Insertion && is_rigid)
        && parameter.set(&mut scene.clone(), value).is_ok()
}

fn slider(scene: &Scene, axes: &[AxisSpec], scale: &Scale, parameter: Parameter) -> Slider {
    let (value, unit) = (parameter.get(scene), parameter.unit());
    let swept = axes.iter().find(|axis| axis.parameters.contains(&parameter));
    let limits =
        swept.map(|axis| swept_limits(scene, axis, parameter)).unwrap_or_else(|| scale.limits(parameter, value));
    let (low, high) = (limits.0.min(limits.1).min(value), limits.0.max(limits.1).max(value));
    let (shown_unit, factor) = shown_unit(unit, low.abs().max(high.abs()));
    let is_current = matches!(parameter, Parameter::Segment(_, SegmentParameter::Current(_)));
    Slider {
        name: parameter.name(scene),
        group: group(scene, parameter),
        unit,
        shown_unit,
        factor,
        value,
        low,
        high,
        limits: if swept.is_some() { LimitSource::Sweep } else { LimitSource::Kind },
        is_input: swept.is_some() || is_current || parameter == Parameter::Insertion,
    }
}

fn swept_limits(scene: &Scene, axis: &AxisSpec, parameter: Parameter) -> (f64, f64) {
    let rate = if axis.scales { parameter.get(scene) } else { 1.0 };
    let law = &axis.distribution;
    let (low, high) = law.limits().unwrap_or_else(|| law.range(DEVIATIONS));
    (rate * low, rate * high)
}

fn group(scene: &Scene, parameter: Parameter) -> String {
    match parameter {
        Parameter::Insertion => "insertion".into(),
        Parameter::FluxDensity(_) => "flux density".into(),
        Parameter::BasePosition(_) | Parameter::BaseRotation(_) => "base".into(),
        Parameter::FieldGradient(_) | Parameter::FieldOrigin(_) => "gradient".into(),
        Parameter::Magnet(index, _) => scene.sources.magnets[index].name.clone(),
        Parameter::ArrayCurrent(array, _) => format!("{} currents", scene.sources.arrays[array].name),
        Parameter::Segment(index, SegmentParameter::Current(_)) => format!("{} currents", scene.segments[index].name),
        Parameter::Segment(index, _) => scene.segments[index].name.clone(),
        Parameter::Wall(_) => "wall".into(),
        _ => "loads".into(),
    }
}

fn rank(group: &str) -> usize {
    let known = ["insertion", "flux density", "loads", "wall", "base"].iter().position(|name| *name == group);
    known.map_or(if group.ends_with(" currents") { 0 } else { 6 }, |at| at + 1)
}

/// What a load must be to bend the rod by about a radian.
struct Scale {
    length: f64,
    force: f64,
    moment: f64,
}

impl Scale {
    fn of(scene: &Scene) -> Scale {
        let length = scene.total_length();
        let flexible = scene.segments.iter().filter_map(|segment| match &segment.kind {
            SegmentKind::Flexible(flexible) => Some(flexible.stiffness.principal()[0]),
            SegmentKind::Rigid(_) => None,
        });
        let stiffness = flexible.fold(f64::INFINITY, f64::min);
        let moment = if stiffness.is_finite() { stiffness / length } else { 1.0 };
        Scale { length, force: 2.0 * moment / length, moment }
    }

    fn limits(&self, parameter: Parameter, value: f64) -> (f64, f64) {
        use SegmentParameter as S;
        let either = |least: f64| {
            let most = round_up(least.max(1.5 * value.abs()));
            (-most, most)
        };
        let around = |low: f64, high: f64| (low * value, high * value);
        match parameter {
            Parameter::Segment(_, S::Current(_)) => either(CURRENT_LIMIT),
            Parameter::Insertion => around(0.5, 1.5),
            Parameter::FluxDensity(_) => either(FLUX_DENSITY),
            Parameter::FieldGradient(_) => either(FLUX_DENSITY),
            Parameter::FieldOrigin(_) => either(self.length),
            Parameter::Magnet(_, MagnetParameter::Position(_)) => (value - self.length, value + self.length),
            Parameter::Magnet(_, MagnetParameter::Rotation(_)) => (-std::f64::consts::PI, std::f64::consts::PI),
            Parameter::Magnet(_, MagnetParameter::Moment(_)) => either(value.abs().max(1.0)),
            Parameter::Magnet(_, MagnetParameter::Strength) => (-2.0, 2.0),
            Parameter::MapScale(_) => either(2.0 * value.abs().max(1.0)),
            Parameter::MapPosition(..) => (value - self.length, value + self.length),
            Parameter::ArrayCurrent(..) => either(CURRENT_LIMIT.max(2.0 * value.abs())),
            Parameter::TipForce(_) | Parameter::InnerForce(..) => either(self.force),
            Parameter::TipMoment(_) | Parameter::InnerMoment(..) => either(self.moment),
            Parameter::Gravity(_) => either(10.0),
            Parameter::DistributedForce(_) | Parameter::ForceAlong(..) => either(3.0 * self.force / self.length),
            Parameter::BasePosition(_) => either(0.5 * self.length),
            Parameter::BaseRotation(_) | Parameter::Segment(_, S::Alignment(_)) => {
                (-std::f64::consts::PI, std::f64::consts::PI)
            }
            Parameter::Wall(WallParameter::Position(_) | WallParameter::Anchor(_)) => {
                (value - 0.5 * self.length, value + 0.5 * self.length)
            }
            Parameter::Wall(WallParameter::Rotation(_)) => (-std::f64::consts::PI, std::f64::consts::PI),
            Parameter::Wall(WallParameter::TipRadius) => (0.0, round_up((0.05 * self.length).max(1.5 * value))),
            Parameter::Wall(WallParameter::Friction) => (0.0, 1.0),
            Parameter::Wall(WallParameter::Stiffness) if value.is_infinite() => (1.0, 1e4),
            Parameter::Wall(WallParameter::Radius | WallParameter::Stiffness) => around(0.5, 2.0),
            Parameter::FluidDensity => (0.0, round_up(2000f64.max(1.5 * value))),
            Parameter::Segment(_, S::RestCurvature(axis) | S::RestCurvatureNode(_, axis)) => {
                either(if axis == Axis::Z { 1.0 } else { 2.0 } / self.length)
            }
            Parameter::Segment(_, S::PoissonRatio) => (0.0, 0.5),
            Parameter::Segment(_, S::InnerRadius) => around(0.0, 1.2),
            Parameter::Segment(_, S::OuterRadius) => around(0.8, 1.5),
            Parameter::Segment(_, S::TurnsArea(..) | S::DipolePerLength(_)) if value == 0.0 => (-1e-2, 1e-2),
            Parameter::Segment(..) if value == 0.0 => (0.0, 1.0),
            Parameter::Segment(_, S::Length) => around(0.5, 1.5),
            Parameter::Segment(..) => around(0.5, 2.0),
        }
    }
}

/// The next of 1, 1.5, 2, 3, 5, 7, 10 times a power of ten, so that limits read well.
fn round_up(x: f64) -> f64 {
    if !(x > 0.0 && x.is_finite()) {
        return 1.0;
    }
    let power = 10f64.powf(x.log10().floor());
    let leads = [1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0];
    let lead = leads.into_iter().find(|lead| x <= lead * power * (1.0 + 1e-9)).unwrap_or(10.0);
    let rounded = lead * power;
    if (rounded - x).abs() <= 1e-9 * x { x } else { rounded }
}

/// A unit in which numbers up to `largest` (SI) read well, and its size in SI.
pub fn shown_unit(unit: &'static str, largest: f64) -> (&'static str, f64) {
    let known: &[(&'static str, f64)] = match unit {
        "m" => &[("m", 1.0), ("mm", 1e-3), ("µm", 1e-6)],
        "rad" => return ("°", std::f64::consts::PI / 180.0),
        "Pa" => &[("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3), ("Pa", 1.0)],
        "N" => &[("N", 1.0), ("mN", 1e-3), ("µN", 1e-6)],
        "N·m" => &[("N·m", 1.0), ("mN·m", 1e-3), ("µN·m", 1e-6)],
        "N/m" => &[("N/m", 1.0), ("mN/m", 1e-3)],
        "N·m²" => &[("N·m²", 1.0), ("N·mm²", 1e-6)],
        "m²" => &[("m²", 1.0), ("mm²", 1e-6)],
        "kg" => &[("kg", 1.0), ("g", 1e-3), ("mg", 1e-6)],
        "kg/m" => &[("kg/m", 1.0), ("g/m", 1e-3)],
        "A·m" => &[("A·m", 1.0), ("mA·m", 1e-3)],
        "T" => &[("T", 1.0), ("mT", 1e-3)],
        "A" => &[("A", 1.0), ("mA", 1e-3)],
        _ => return (unit, 1.0),
    };
    // A length is told in m from 2 m on, as in the figures; all else from 0.1 of its unit on.
    let least = if unit == "m" { 2.0 } else { 0.1 };
    let fits = |(_, factor): &&(&str, f64)| largest >= least * factor * (1.0 - 1e-9);
    let found = known.iter().find(fits).or(known.last());
    found.map_or((unit, 1.0), |(name, factor)| (name, *factor))
}
