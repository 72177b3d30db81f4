//! What makes the field vary, along the way of a rod that is commanded.

use crate::draw::{FieldSource, Surroundings};
use crate::model::Scene;
use crate::study::ControlRun;

/// What stays where it is; no lines where an input moves the field.
pub(crate) fn still(run: &ControlRun) -> Option<Surroundings> {
    let inputs = run.inputs().iter();
    let mut around = inputs.fold(Surroundings::of(run.scene())?, |around, input| around.swept(input.parameter));
    around.sources.retain(|source| source.is_coil() || !source.is_swept);
    Some(around)
}

/// The magnets that inputs move, in a scene with their values.
pub(crate) fn moved(run: &ControlRun, scene: &Scene) -> Vec<FieldSource> {
    let Some(around) = Surroundings::of(scene) else { return Vec::new() };
    let around = run.inputs().iter().fold(around, |around, input| around.swept(input.parameter));
    around.sources.into_iter().filter(|source| !source.is_coil() && source.is_swept).collect()
}
