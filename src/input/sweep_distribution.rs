//! By which law an axis or an uncertain number of a sweep file varies.

use super::error::{InputError, Problem};
use super::toml::Reader;
use super::words::choice;
use crate::model::{Parameter, Scene};
use crate::spec::Distribution;

/// Keys of the blocks `[[axis]]` and `[[uncertain]]`.
pub(super) const KEYS: [&str; 10] = [
    "parameter",
    "parameters",
    "from",
    "to",
    "points",
    "relative",
    "scale",
    "distribution",
    "mean",
    "standard_deviation",
];

/// A law, and whether its values are factors.
pub(super) struct Law {
    pub distribution: Distribution,
    pub scales: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Shape {
    Uniform,
    Normal,
}

impl Shape {
    const ALL: [Shape; 2] = [Shape::Uniform, Shape::Normal];

    fn name(self) -> &'static str {
        match self {
            Shape::Uniform => "uniform",
            Shape::Normal => "normal",
        }
    }
}

/// The law of a block that drives these parameters, `first` and others.
///
/// One parameter has a law of its own values, however the file says it. Several may have a law of their common factor.
pub(super) fn law(reader: &Reader, scene: &Scene, first: &Parameter, driven: &[Parameter]) -> Result<Law, InputError> {
    let shape = choice(reader, "distribution", &Shape::ALL, Shape::name)?.unwrap_or(Shape::Uniform);
    let relative = relative(reader, shape)?;
    let scales = scales(reader, relative.is_some(), driven.len())?;
    if !scales {
        check_units(reader, scene, first, driven)?;
    }
    if let (true, [_, _, ..]) = (scales, driven) {
        driven.iter().try_for_each(|parameter| nominal(reader, scene, parameter).map(|_| ()))?;
        let distribution = match relative {
            Some(share) => around(shape, 1.0, share),
            None => absolute(reader, shape, "", || Ok(1.0))?,
        };
        return Ok(Law { distribution, scales: true });
    }
    let distribution = match relative {
        Some(share) => around(shape, nominal(reader, scene, first)?, share),
        None if scales => {
            let nominal = nominal(reader, scene, first)?;
            scaled(absolute(reader, shape, "", || Ok(1.0))?, nominal)
        }
        None => absolute(reader, shape, first.unit(), || finite(reader, scene, first))?,
    };
    Ok(Law { distribution, scales: false })
}

/// The share by which values lie around the scene's, where the block has one.
fn relative(reader: &Reader, shape: Shape) -> Result<Option<f64>, InputError> {
    let Some(share) = reader.quantity("relative", "")? else { return Ok(None) };
    for other in ["from", "to", "mean", "standard_deviation"] {
        if reader.has(other) {
            let remedy = "`relative` says it around the scene's value: keep one of the two".into();
            return Err(reader.error(other, Problem::Conflict { with: "relative".into(), remedy }));
        }
    }
    if share > 0.0 && share <= 1.0 {
        return Ok(Some(share));
    }
    let expected = match shape {
        Shape::Uniform => "a share above 0 and up to 1, such as \"10 %\"; else write from and to",
        Shape::Normal => "a share above 0 and up to 1, such as \"10 %\"; else write mean and standard_deviation",
    };
    Err(reader.error("relative", Problem::Range { value: share.to_string(), expected: expected.into() }))
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
    usual_mean: impl Fn() -> Result<f64, InputError>,
) -> Result<Distribution, InputError> {
    let refused: [&str; 2] = match shape {
        Shape::Uniform => ["mean", "standard_deviation"],
        Shape::Normal => ["from", "to"],
    };
    if let Some(key) = refused.into_iter().find(|key| reader.has(key)) {
        let remedy = match shape {
            Shape::Uniform => "a uniform axis runs from `from` to `to`: write distribution = \"normal\", or remove it",
            Shape::Normal => "a normal distribution has no ends: give mean and standard_deviation instead",
        };
        let with = format!("distribution = {}", shape.name());
        return Err(reader.error(key, Problem::Conflict { with, remedy: remedy.into() }));
    }
    match shape {
        Shape::Uniform => {
            let end = |name: &str| -> Result<f64, InputError> {
                let value = reader.quantity(name, unit)?;
                value.ok_or_else(|| reader.missing(name, "an axis runs from `from` to `to`, or is `relative`"))
            };
            Ok(Distribution::Uniform { from: end("from")?, to: end("to")? })
        }
        Shape::Normal => {
            let mean = match reader.quantity("mean", unit)? {
                Some(mean) => mean,
                None => usual_mean()?,
            };
            let remedy = "a normal distribution needs it, or `relative` as a share of the scene's value";
            let standard_deviation = reader.quantity("standard_deviation", unit)?;
            let standard_deviation = standard_deviation.ok_or_else(|| reader.missing("standard_deviation", remedy))?;
            if standard_deviation > 0.0 {
                return Ok(Distribution::Normal { mean, standard_deviation });
            }
            let (value, expected) = (standard_deviation.to_string(), "a value greater than zero".into());
            Err(reader.error("standard_deviation", Problem::Range { value, expected }))
        }
    }
}

/// A law around a value, by a share of it.
fn around(shape: Shape, value: f64, share: f64) -> Distribution {
    let width = share * value.abs();
    match shape {
        Shape::Uniform => Distribution::Uniform { from: value - width, to: value + width },
        Shape::Normal => Distribution::Normal { mean: value, standard_deviation: width },
    }
}

/// The law of a value times a factor that has a law.
fn scaled(law: Distribution, value: f64) -> Distribution {
    match law {
        Distribution::Uniform { from, to } => Distribution::Uniform { from: from * value, to: to * value },
        Distribution::Normal { mean, standard_deviation } => {
            Distribution::Normal { mean: mean * value, standard_deviation: standard_deviation * value.abs() }
        }
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
