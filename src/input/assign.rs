//! `NAME=VALUE` on a command line: sets parameters of a scene, values with units.

use super::units::{Dimension, QuantityError, parse_quantity};
use crate::model::{Parameter, ParameterError, PlanError, Scene, SceneError, SegmentKind};

/// Why a scene cannot be changed so.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AssignError {
    /// Text without `=`.
    #[error("`{text}` has no `=`; write NAME=VALUE, such as coil.current.x=0.2 or insertion=\"90 mm\"")]
    NoEquals {
        /// As it was given.
        text: String,
    },
    /// A name that the scene has not, or a value that it cannot take.
    #[error("{0}")]
    Parameter(#[from] ParameterError),
    /// A value that is no quantity of this kind.
    #[error("`{name}`: {problem}")]
    Value {
        /// Of the parameter.
        name: String,
        /// What is wrong with the value.
        problem: QuantityError,
    },
    /// A change that cannot be computed.
    #[error("{0}")]
    Plan(#[from] PlanError),
    /// A scene that makes no rod any more.
    #[error("{0}")]
    Scene(#[from] SceneError),
}

/// Sets parameters in order, insertion last, then checks the scene. A group sets all its components.
///
/// # Errors
///
/// Text that is no assignment, a value that a parameter cannot take, or a scene that makes no rod any more.
pub fn assign(scene: &mut Scene, assignments: &[impl AsRef<str>]) -> Result<(), AssignError> {
    let mut values = Vec::new();
    for text in assignments.iter().map(AsRef::as_ref) {
        let (name, value) = text.split_once('=').ok_or_else(|| AssignError::NoEquals { text: text.into() })?;
        for parameter in Parameter::parse(scene, name.trim())? {
            let value = parse_quantity(value, Dimension::of(parameter.unit()));
            let value = value.map_err(|problem| AssignError::Value { name: name.trim().into(), problem })?;
            values.push((parameter, value));
        }
    }
    Parameter::set_all(scene, values.iter().copied())?;
    let inserts = values.iter().any(|(parameter, _)| *parameter == Parameter::Insertion);
    if inserts && matches!(scene.segments[0].kind, SegmentKind::Rigid(_)) {
        return Err(PlanError::InsertionIntoRigid(scene.segments[0].name.clone()).into());
    }
    scene.absorb_insertion();
    scene.cut_nodes();
    Ok(scene.validate()?)
}
