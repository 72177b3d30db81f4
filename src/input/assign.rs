//! `NAME=VALUE` on a command line: sets parameters of a scene, values with units.

use super::error::InputError;
use super::scene_file::{located, parse_scene, read_text, unjudged_scene};
use super::scene_value::value_of;
use super::toml::{Source, quoted};
use super::units::{Dimension, QuantityError, parse_quantity};
use crate::model::{Parameter, ParameterError, PlanError, Scene, SceneError, SegmentKind, short_name};
use std::path::Path;

/// Why a scene cannot be changed so.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AssignError {
    /// Text without `=`.
    #[error("`{}` has no `=`; write NAME=VALUE, such as coil.current.x=0.2 or insertion=\"90 mm\"", short_name(.text))]
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
    /// A mistake in the scene's file that the values do not mend.
    #[error("{0}")]
    Input(#[from] InputError),
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
    put(scene, assignments)?;
    Ok(scene.validate()?)
}

/// Sets parameters without a check of the scene.
fn put(scene: &mut Scene, assignments: &[impl AsRef<str>]) -> Result<(), AssignError> {
    let mut values = Vec::new();
    for text in assignments {
        let (name, value) = split(text.as_ref())?;
        for parameter in Parameter::parse(scene, name)? {
            let value = parse_quantity(value, Dimension::of(parameter.unit()));
            let value = value.map_err(|problem| AssignError::Value { name: name.into(), problem })?;
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
    Ok(())
}

fn split(text: &str) -> Result<(&str, &str), AssignError> {
    let (name, value) = text.split_once('=').ok_or_else(|| AssignError::NoEquals { text: text.into() })?;
    Ok((name.trim(), value))
}

/// Reads a scene file and sets parameters before the scene is judged, so that they may mend what is wrong with it.
///
/// # Errors
///
/// As [`assign`], or a mistake in the file that the values do not mend.
pub fn read_scene_with(file: &Path, assignments: &[impl AsRef<str>]) -> Result<Scene, AssignError> {
    let text = read_text(file)?;
    if assignments.is_empty() {
        return Ok(parse_scene(file, &text)?);
    }
    let mut source = Source::parse(file, &text)?;
    let first = unjudged_scene(&source.root());
    let mut scene = match first {
        Ok(scene) => scene,
        Err(refused) => {
            // Values that do not even read give way in the text.
            let mut text = text;
            for assignment in assignments {
                let (name, value) = split(assignment.as_ref())?;
                if let Some(place) = value_of(&source, name) {
                    text.replace_range(place, &quoted(value.trim()));
                    source = Source::parse(file, &text)?;
                }
            }
            unjudged_scene(&source.root()).map_err(|error| if error.line == refused.line { refused } else { error })?
        }
    };
    let is_sound = scene.validate().is_ok();
    put(&mut scene, assignments)?;
    let Err(error) = scene.validate() else { return Ok(scene) };
    let is_set = |name: &str| {
        let names = assignments.iter().filter_map(|text| split(text.as_ref()).ok()).map(|(name, _)| name);
        names.into_iter().any(|set| name == set || name.strip_prefix(set).is_some_and(|rest| rest.starts_with('.')))
    };
    match &error {
        SceneError::OutOfRange { name, .. } if is_set(name) => Err(error.into()),
        _ if is_sound => Err(error.into()),
        _ => Err(located(&source.root(), &scene, error).into()),
    }
}
