//! By which law an axis or an uncertain number of a sweep file varies.

use super::error::{InputError, Problem};
use super::toml::Reader;
use super::words::choice;
use crate::model::{Parameter, Scene, short_number};
use crate::spec::Distribution;

/// Keys of the blocks `[[axis]]` and `[[uncertain]]`.
pub(super) const KEYS: [&str; 13] = [
    "parameter",
    "parameters",
    "from",
    "to",
    "points",
    "relative",
    "scale",
    "spacing",
    "distribution",
    "mean",
    "standard_deviation",
    "mode",
    "values",
];

/// Numbers of laws.
const NUMBERS: [&str; 5] = ["from", "to", "mean", "standard_deviation", "mode"];

/// Least share of a normal law that a truncated one keeps: below it quantiles lose their digits.
const LEAST_KEPT: f64 = 1e-9;

/// A law, and whether its values are factors.
pub(super) struct Law {
    pub distribution: Distribution,
    pub scales: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Shape {
    Uniform,
    LogUniform,
    Triangular,
    Normal,
    TruncatedNormal,
    LogNormal,
}

impl Shape {
    const ALL: [Shape; 6] =
        [Shape::Uniform, Shape::LogUniform, Shape::Triangular, Shape::Normal, Shape::TruncatedNormal, Shape::LogNormal];

    fn name(self) -> &'static str {
        match self {
            Shape::Uniform => "uniform",
            Shape::LogUniform => "log-uniform",
            Shape::Triangular => "triangular",
            Shape::Normal => "normal",
            Shape::TruncatedNormal => "truncated-normal",
            Shape::LogNormal => "lognormal",
        }
    }

    /// The numbers that say it.
    fn numbers(self) -> &'static [&'static str] {
        match self {
            Shape::Uniform | Shape::LogUniform => &["from", "to"],
            Shape::Triangular => &["from", "mode", "to"],
            Shape::Normal | Shape::LogNormal => &["mean", "standard_deviation"],
            Shape::TruncatedNormal => &["mean", "standard_deviation", "from", "to"],
        }
    }
}

/// The law of a block that drives these parameters, `first` and others.
///
/// One parameter has a law of its own values, however the file says it. Several may have a law of their common factor.
pub(super) fn law(reader: &Reader, scene: &Scene, first: &Parameter, driven: &[Parameter]) -> Result<Law, InputError> {
    let shape = shape(reader)?;
    let relative = relative(reader, shape)?;
    let scales = scales(reader, relative.is_some(), driven.len())?;
    if !scales {
        check_units(reader, scene, first, driven)?;
    }
    let given = |unit: &str, usual: &dyn Fn() -> Result<f64, InputError>| match listed(reader, unit)? {
        Some(values) => Ok(values),
        None => absolute(reader, shape, unit, usual),
    };
    if let (true, [_, _, ..]) = (scales, driven) {
        driven.iter().try_for_each(|parameter| nominal(reader, scene, parameter).map(|_| ()))?;
        let distribution = match relative {
            Some(share) => around(shape, 1.0, share),
            None => given("", &|| Ok(1.0))?,
        };
        return Ok(Law { distribution, scales: true });
    }
    let distribution = match relative {
        Some(share) => around(shape, nominal(reader, scene, first)?, share),
        None if scales => {
            let nominal = nominal(reader, scene, first)?;
            given("", &|| Ok(1.0))?.times(nominal)
        }
        None => given(first.unit(), &|| finite(reader, scene, first))?,
    };
    Ok(Law { distribution, scales: false })
}

/// The word of `distribution`, or what `spacing` means.
fn shape(reader: &Reader) -> Result<Shape, InputError> {
    let shape = choice(reader, "distribution", &Shape::ALL, Shape::name)?;
    let is_log = choice(reader, "spacing", &[false, true], |is_log| if is_log { "log" } else { "linear" })?;
    match (shape, is_log) {
        (None | Some(Shape::Uniform | Shape::LogUniform), Some(true)) => Ok(Shape::LogUniform),
        (None | Some(Shape::Uniform), Some(false)) => Ok(Shape::Uniform),
        (Some(shape), Some(_)) => {
            let remedy = "`spacing` says how values between two ends are spread: keep one of the two".into();
            let with = format!("distribution = {}", shape.name());
            Err(reader.error("spacing", Problem::Conflict { with, remedy }))
        }
        (shape, None) => Ok(shape.unwrap_or(Shape::Uniform)),
    }
}

/// The list of `values`, where the block has one.
fn listed(reader: &Reader, unit: &str) -> Result<Option<Distribution>, InputError> {
    let Some(values) = reader.quantities("values", unit)? else { return Ok(None) };
    let others = NUMBERS.into_iter().chain(["relative", "spacing", "distribution"]);
    if let Some(other) = others.into_iter().find(|other| reader.has(other)) {
        let remedy = "the list says every value: keep one of the two".into();
        return Err(reader.error("values", Problem::Conflict { with: other.into(), remedy }));
    }
    if values.is_empty() {
        let expected = "at least one value".into();
        return Err(reader.error("values", Problem::Range { value: "an empty list".into(), expected }));
    }
    Ok(Some(Distribution::Values(values.into())))
}

/// The share by which values lie around the scene's, where the block has one.
fn relative(reader: &Reader, shape: Shape) -> Result<Option<f64>, InputError> {
    let Some(share) = reader.quantity("relative", "")? else { return Ok(None) };
    for other in NUMBERS.into_iter().chain(["values"]) {
        if reader.has(other) {
            let remedy = "`relative` says it around the scene's value: keep one of the two".into();
            return Err(reader.error(other, Problem::Conflict { with: "relative".into(), remedy }));
        }
    }
    if shape == Shape::TruncatedNormal {
        let remedy = "a truncated law needs its ends: give mean, standard_deviation, from and to".into();
        let with = format!("distribution = {}", shape.name());
        return Err(reader.error("relative", Problem::Conflict { with, remedy }));
    }
    if share > 0.0 && share <= 1.0 {
        return Ok(Some(share));
    }
    let expected =
        format!("a share above 0 and up to 1, such as \"10 %\"; else write {}", shape.numbers().join(" and "));
    Err(reader.error("relative", Problem::Range { value: short_number(share), expected }))
}

/// Whether the numbers of the block are factors of the scene's values.
fn scales(reader: &Reader, is_relative: bool, count: usize) -> Result<bool, InputError> {
    match reader.boolean("scale")? {
        Some(false) if is_relative && count > 1 => {
            let remedy = "several parameters keep their ratio: remove `scale`, or write from and to".into();
            Err(reader.error("scale", Problem::Conflict { with: "relative".into(), remedy }))
        }
        Some(scales) => Ok(scales),
        None => Ok(is_relative && count > 1),
    }
}

fn check_units(reader: &Reader, scene: &Scene, first: &Parameter, driven: &[Parameter]) -> Result<(), InputError> {
    let unit = first.unit();
    let Some(other) = driven.iter().find(|other| other.unit() != unit) else { return Ok(()) };
    let remedy = format!("they are measured in {unit} and {}: give each its own axis", other.unit());
    Err(reader.error("parameters", Problem::Conflict { with: other.name(scene), remedy }))
}

/// A law by the numbers of the block, all of one unit.
fn absolute(
    reader: &Reader,
    shape: Shape,
    unit: &str,
    usual: &dyn Fn() -> Result<f64, InputError>,
) -> Result<Distribution, InputError> {
    if let Some(key) = NUMBERS.into_iter().find(|key| reader.has(key) && !shape.numbers().contains(key)) {
        let remedy = match shape {
            Shape::Uniform => {
                "a uniform axis runs from `from` to `to`: write distribution = \"normal\", or remove it".into()
            }
            Shape::Normal => "a normal distribution has no ends: give mean and standard_deviation instead".into(),
            _ => format!("this law has {}: remove the other", shape.numbers().join(", ")),
        };
        let with = format!("distribution = {}", shape.name());
        return Err(reader.error(key, Problem::Conflict { with, remedy }));
    }
    let given = |name: &str| reader.quantity(name, unit);
    let end = |name: &str| -> Result<f64, InputError> {
        let remedy = "an axis runs from `from` to `to`, or is `relative`, or has `values`";
        given(name)?.ok_or_else(|| reader.missing(name, remedy))
    };
    let centre = |name: &str| given(name)?.map_or_else(usual, Ok);
    let deviation = || -> Result<f64, InputError> {
        let remedy = format!("a {} distribution needs it, or `relative` as a share of the scene's value", shape.name());
        let deviation = given("standard_deviation")?.ok_or_else(|| reader.missing("standard_deviation", remedy))?;
        within(reader, "standard_deviation", deviation, deviation > 0.0, "a value greater than zero")?;
        Ok(deviation)
    };
    match shape {
        Shape::Uniform => Ok(Distribution::Uniform { from: end("from")?, to: end("to")? }),
        Shape::LogUniform => {
            let (from, to) = (end("from")?, end("to")?);
            within(reader, "from", from, from != 0.0, "a value other than zero, which has no logarithm")?;
            let is_beside = to != 0.0 && (to > 0.0) == (from > 0.0);
            within(reader, "to", to, is_beside, "a value of the sign of `from`: no logarithm passes through zero")?;
            Ok(Distribution::LogUniform { from, to })
        }
        Shape::Triangular => {
            let (from, to) = (end("from")?, end("to")?);
            within(reader, "to", to, to > from, "a value above `from`")?;
            let mode = centre("mode")?;
            let key = if reader.has("mode") { "mode" } else { "from" };
            let expected = "a mode between the ends; if `mode` is left out, it is the scene's value";
            within(reader, key, mode, (from..=to).contains(&mode), expected)?;
            Ok(Distribution::Triangular { from, mode, to })
        }
        Shape::Normal => Ok(Distribution::Normal { mean: centre("mean")?, standard_deviation: deviation()? }),
        Shape::TruncatedNormal => {
            let (from, to) = (end("from")?, end("to")?);
            within(reader, "to", to, to > from, "a value above `from`")?;
            let (mean, standard_deviation) = (centre("mean")?, deviation()?);
            let law = Distribution::TruncatedNormal { mean, standard_deviation, from, to };
            let expected = "ends that leave at least 1e-9 of the normal law between them";
            within(reader, "from", from, law.kept_share() >= LEAST_KEPT, expected)?;
            Ok(law)
        }
        Shape::LogNormal => {
            let (mean, standard_deviation) = (centre("mean")?, deviation()?);
            let key = if reader.has("mean") { "mean" } else { "distribution" };
            let expected = "a mean other than zero; if `mean` is left out, it is the scene's value";
            within(reader, key, mean, mean != 0.0, expected)?;
            Ok(Distribution::LogNormal { mean, standard_deviation })
        }
    }
}

/// Refuses a number that is not as a law needs it.
fn within(reader: &Reader, key: &str, value: f64, is_good: bool, expected: &str) -> Result<(), InputError> {
    if is_good {
        return Ok(());
    }
    Err(reader.error(key, Problem::Range { value: short_number(value), expected: expected.into() }))
}

/// A law around a value, by a share of it.
fn around(shape: Shape, value: f64, share: f64) -> Distribution {
    let width = share * value.abs();
    match shape {
        Shape::Uniform => Distribution::Uniform { from: value - width, to: value + width },
        Shape::LogUniform => Distribution::LogUniform { from: value / (1.0 + share), to: value * (1.0 + share) },
        Shape::Triangular => Distribution::Triangular { from: value - width, mode: value, to: value + width },
        Shape::Normal => Distribution::Normal { mean: value, standard_deviation: width },
        Shape::LogNormal => Distribution::LogNormal { mean: value, standard_deviation: width },
        Shape::TruncatedNormal => unreachable!("a truncated law takes no share"),
    }
}

/// The scene's value of a parameter, where a share of it says something.
fn nominal(reader: &Reader, scene: &Scene, parameter: &Parameter) -> Result<f64, InputError> {
    let value = finite(reader, scene, parameter)?;
    if value == 0.0 {
        return Err(no_share(reader, scene, parameter, "it is 0 in the scene"));
    }
    // A name that stands for several numbers, such as a bending stiffness about two axes.
    let mut probe = scene.clone();
    let is_set = parameter.set(&mut probe, value).is_ok();
    let moves = |other: &Parameter| {
        let (before, after) = (other.get(scene), other.get(&probe));
        (after - before).abs() > 1e-9 * before.abs()
    };
    if is_set && Parameter::all(scene).iter().any(moves) {
        return Err(no_share(reader, scene, parameter, "it stands for several numbers that differ"));
    }
    Ok(value)
}

fn no_share(reader: &Reader, scene: &Scene, parameter: &Parameter, why: &str) -> InputError {
    let key = if reader.has("relative") { "relative" } else { "scale" };
    let remedy = format!("{why}: name others, or give from and to instead");
    reader.error(key, Problem::Conflict { with: parameter.name(scene), remedy })
}

/// The scene's value of a parameter.
fn finite(reader: &Reader, scene: &Scene, parameter: &Parameter) -> Result<f64, InputError> {
    let value = parameter.get(scene);
    if value.is_finite() {
        return Ok(value);
    }
    let key = ["relative", "scale"].into_iter().find(|key| reader.has(key)).unwrap_or("mean");
    let remedy = "the scene does not give it: write it there, or give numbers here".into();
    Err(reader.error(key, Problem::Conflict { with: parameter.name(scene), remedy }))
}
