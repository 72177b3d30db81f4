//! `NAME=LIMIT` and `NAME=LOW..HIGH`: what may be commanded, within which limits.

use super::units::{Dimension, QuantityError, parse_quantity};
use crate::model::{Parameter, ParameterError, Scene};
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
    #[error("{low} is no length: give limits from 0 on, such as \"85 mm..100 mm\"")]
    Negative {
        /// The lower limit, SI.
        low: f64,
    },
    /// A length that no rod of this scene has.
    #[error("{high} m is more than {most:.3} m, a hundred times the rod's length: give limits that a rod can have")]
    TooLong {
        /// The upper limit (m).
        high: f64,
        /// The most that is possible (m).
        most: f64,
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

/// Refuses limits of lengths that no rod of the scene has: every equilibrium of a search would take its time.
pub(super) fn check_limits(scene: &Scene, parameter: Parameter, [low, high]: [f64; 2]) -> Result<(), LimitsError> {
    let is_length = match parameter {
        Parameter::Insertion => true,
        Parameter::Segment(..) => parameter.unit() == "m",
        _ => false,
    };
    if !is_length {
        return Ok(());
    }
    if low < 0.0 {
        return Err(LimitsError::Negative { low });
    }
    let most = 100.0 * scene.total_length();
    if high > most { Err(LimitsError::TooLong { high, most }) } else { Ok(()) }
}
