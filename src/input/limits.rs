//! `NAME=LIMIT` and `NAME=LOW..HIGH`: what may be commanded, within which limits.

use super::units::{Dimension, QuantityError, parse_quantity};
use crate::model::{Parameter, ParameterError, Scene, SceneError, short_number};
use crate::spec::ControlInput;

/// Why a text names no inputs of a controller.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LimitsError {
    /// Text without `=`.
    #[error("write NAME=LIMIT or NAME=LOW..HIGH, such as coil.current=0.3 or \"insertion=85 mm..100 mm\"")]
    NoEquals,
    /// A name that the scene has not.
    #[error("{0}")]
    Parameter(#[from] ParameterError),
    /// A limit that is no quantity of this kind.
    #[error("{0}")]
    Quantity(#[from] QuantityError),
    /// Limits in the wrong order.
    #[error("the lower limit must be below the upper")]
    Order,
    /// A length below zero.
    #[error("{} is no length: give limits from 0 on, such as \"85 mm..100 mm\"", short_number(*low))]
    Negative {
        /// The lower limit, SI.
        low: f64,
    },
    /// A length that no rod of this scene has.
    #[error("{} m is more than {most:.3} m, a hundred times the rod's length: give limits that a rod can have", short_number(*high))]
    TooLong {
        /// The upper limit (m).
        high: f64,
        /// The most that is possible (m).
        most: f64,
    },
    /// A limit with which the scene makes no rod.
    #[error("at its {} limit {problem}", if *is_upper { "upper" } else { "lower" })]
    Scene {
        /// Whether it is the upper limit.
        is_upper: bool,
        /// The scene's reason to refuse the value.
        problem: SceneError,
    },
    /// An input that is there already.
    #[error("{name} is an input already")]
    Twice {
        /// Of the input.
        name: String,
    },
}

/// Reads `coil.current=0.3` (either sign) or `insertion=85 mm..100 mm`. A group gives one input for each component.
///
/// # Errors
///
/// Text that says no such thing.
pub fn parse_limits(scene: &Scene, text: &str) -> Result<Vec<ControlInput>, LimitsError> {
    let (name, limits) = text.split_once('=').ok_or(LimitsError::NoEquals)?;
    let input = |parameter: Parameter| {
        let quantity = |text: &str| parse_quantity(text.trim(), Dimension::of(parameter.unit()));
        let (low, high) = match limits.split_once("..") {
            Some((low, high)) => (quantity(low)?, quantity(high)?),
            None => (-quantity(limits)?, quantity(limits)?),
        };
        if low >= high {
            return Err(LimitsError::Order);
        }
        check_limits(scene, parameter, [low, high])?;
        Ok(ControlInput::new(parameter, low, high))
    };
    Parameter::parse(scene, name.trim())?.into_iter().map(input).collect()
}

/// Refuses limits with which the scene makes no rod. A length may go down to 0, where the search finds no equilibrium, but not
/// far beyond the rod's own, where every equilibrium would take its time.
pub(super) fn check_limits(scene: &Scene, parameter: Parameter, [low, high]: [f64; 2]) -> Result<(), LimitsError> {
    let is_length = match parameter {
        Parameter::Insertion => true,
        Parameter::Segment(..) => parameter.unit() == "m",
        _ => false,
    };
    if is_length {
        if low < 0.0 {
            return Err(LimitsError::Negative { low });
        }
        let most = 100.0 * scene.total_length();
        return if high > most { Err(LimitsError::TooLong { high, most }) } else { Ok(()) };
    }
    for (is_upper, limit) in [(false, low), (true, high)] {
        let mut at_limit = scene.clone();
        parameter.set(&mut at_limit, limit)?;
        at_limit.validate().map_err(|problem| LimitsError::Scene { is_upper, problem })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::parse_limits;
    use crate::input::parse_scene;

    const SCENE: &str = "[[segment]]\nname = \"tube\"\nkind = \"flexible\"\nlength = 0.08\nyoungs_modulus = 5e6\n\
                         shear_modulus = 2e6\ntube = { inner_radius = 0.0005, outer_radius = 0.001 }\n\
                         rest_curvature = [{ at = 0, value = [0, 0, 0] }, { at = 0.07, value = [1, 0, 0] }]\n";

    #[test]
    fn a_limit_that_the_scene_refuses_is_refused() {
        let scene = parse_scene("scene.toml".as_ref(), SCENE).expect("a scene");
        let told = |text: &str| parse_limits(&scene, text).map(|_| ()).map_err(|error| error.to_string());
        for (text, words) in [
            (
                "tube.youngs_modulus=-1..1e9",
                "at its lower limit `tube.youngs_modulus` is -1: it must be finite and greater than zero",
            ),
            ("tube.shear_modulus=1e-70..1", "is 1e-70: it must be at least 1e-60"),
            ("tube.stiffness.torsion=1..2", "follows from `tube`"),
            ("insertion=-0.1..0.1", "is no length"),
        ] {
            let error = told(text).expect_err(text);
            assert!(error.contains(words), "{error}");
        }
        for text in ["tube.youngs_modulus=1..1e9", "insertion=0..0.1", "tube.length=0.05..0.1", "loads.tip_force=2"] {
            told(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        }
    }
}
