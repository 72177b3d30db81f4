//! Why a rod cannot be controlled, or commands not be played.

use super::inputs::MOST_INPUTS;
use crate::backend::BackendError;
use crate::model::PlanError;

/// Why a rod cannot be controlled, or commands not be played on it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ControlError {
    /// The scene and its inputs make no plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// An engine cannot be used, or failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// Nothing is said about the inputs, and the scene has no current that could be one.
    #[error("the scene has no coil: name what is commanded")]
    NoInputs,
    /// No input, or more than [`MOST_INPUTS`].
    #[error("{0} inputs; at least 1 and at most {MOST_INPUTS} are possible: name the ones to control with")]
    InputCount(usize),
    /// Limits that are not finite or in the wrong order.
    #[error("`{name}` may lie between {low} and {high}: give a lower and a higher limit")]
    Limits {
        /// Of the input.
        name: String,
        /// Lower limit, SI.
        low: f64,
        /// Upper limit, SI.
        high: f64,
    },
    /// The force is controlled, and a target has none.
    #[error("target {target} has no normal force: give it one, or leave `normal_force` out of the coordinates")]
    NoForce {
        /// From 0.
        target: usize,
    },
    /// A target has a force, and the scene has no wall.
    #[error("the scene has no wall that the tip could press on: add [wall] to it, or leave out normal_force")]
    NoWall,
    /// A force that no sliding wall exerts.
    #[error(
        "target {target} has a normal force of {force} N: a wall on which the tip slides does not pull, give a force from 0 on"
    )]
    Pulls {
        /// From 0.
        target: usize,
        /// Along the normal of the wall (N).
        force: f64,
    },
    /// A tolerance that is not positive (m).
    #[error("a target is never reached to {0} m: give a positive tolerance")]
    Tolerance(f64),
    /// The rod has no stable equilibrium where a trajectory begins.
    #[error(
        "no stable equilibrium is reached from rest with the first inputs ({status}); change the limits or the scene"
    )]
    NoStart {
        /// How its solution ended.
        status: &'static str,
    },
    /// The rod has no stable equilibrium anywhere.
    #[error("none of {0} inputs within the limits gives a stable equilibrium: change the limits or the scene")]
    NoTable(usize),
    /// No row of a replay gives a rod with a stable equilibrium.
    #[error("no row gives a rod with a stable equilibrium from rest; check the values and the scene")]
    NothingPlayed,
    /// No observed tip belongs to a row with a stable equilibrium.
    #[error("no observed tip belongs to a state with a stable equilibrium; check the scene and the currents")]
    NothingToCompare,
}
