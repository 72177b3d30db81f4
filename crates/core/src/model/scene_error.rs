//! What is wrong with a scene.

use super::message::short_number;

/// Why a scene describes no rod. Each names the parameter and the remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// It has no segments.
    #[error("the scene has no [[segment]]: a rod needs at least one flexible segment")]
    NoSegment,
    /// It has no flexible segment.
    #[error("every segment is rigid: a rod needs at least one flexible segment")]
    NoFlexible,
    /// A number lies outside its range.
    #[error("`{name}` is {}: it must be {requirement}", short_number(*value))]
    OutOfRange {
        /// Path of the number in the scene.
        name: String,
        /// The number, SI.
        value: f64,
        /// What holds for a good value, in words.
        requirement: &'static str,
    },
    /// A flexible segment magnetised along its length in a field sampled on a grid.
    #[error(
        "`{segment}` is magnetised along its length: the force of a sampled field on it has a kink at every face of a cell, which steps along the rod do not resolve. Make it of rigid segments, or the field of magnets, coils or a gradient"
    )]
    MagnetisedInMap {
        /// Name of the segment.
        segment: String,
    },
    /// Two magnets, arrays or segments share this name.
    #[error("`{0}` is the name of two sources of the field, or of one and a segment: give each its own name")]
    DuplicateSource(String),
    /// An array of coils whose currents do not match them.
    #[error("`{name}` has {coils} coils and {currents} currents: give one current for each coil")]
    CurrentsOfCoils {
        /// Name of the array.
        name: String,
        /// How many coils it has.
        coils: usize,
        /// How many currents it has.
        currents: usize,
    },
    /// Two segments share this name.
    #[error("two segments are named `{0}`: give each its own name")]
    DuplicateName(String),
    /// Two forces inside of the rod share this name, or it is that of another load.
    #[error("`{0}` is the name of two loads: give each its own name")]
    DuplicateForce(String),
    /// A force inside of the rod whose place does not suit its segment.
    #[error(
        "the force `{name}` has no such place: a flexible segment takes it at a distance `at` from its proximal end, a rigid one at its middle"
    )]
    MisplacedForce {
        /// Name of the force.
        name: String,
    },
    /// A couple, or a force that turns with the rod, beside a wall.
    #[error(
        "a moment, and a force that turns with the rod, have no energy, so stability with a wall is not known: leave them out, or `[wall]`"
    )]
    NoEnergyBesideWall,
    /// The published balance beside a wall.
    #[error(
        "the published balance (`rigid_force_arm = false`) has no energy, so stability with a wall is not known: use the complete balance, or leave out `[wall]`"
    )]
    WallWithoutForceArm,
    /// A density of the material where no cross-section is known.
    #[error("`{segment}.density` needs a `tube` to know the cross-section: give `linear_density` instead")]
    DensityWithoutTube {
        /// Name of the segment.
        segment: String,
    },
    /// Gravity, but no segment has a mass.
    #[error("`loads.gravity` acts on nothing: give a segment `density`, `linear_density` or `mass`, or remove gravity")]
    GravityWithoutMass,
}
