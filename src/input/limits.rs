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
        if low < high { Ok(ControlInput::new(parameter, low, high)) } else { Err(LimitsError::Order) }
    };
    Parameter::parse(scene, name.trim())?.into_iter().map(input).collect()
}
