//! Why it cannot be told what a tip can press where.

use crate::backend::BackendError;
use crate::model::{PlanError, short_number};
use crate::results::ResultsError;
use crate::study::workspace::WorkspaceError;
use std::path::PathBuf;

/// Why it cannot be told what a tip can press where.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ContactError {
    /// The scene and its inputs make no plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// An engine cannot be used, or failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// A file that cannot be written.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// Inputs that cannot be used.
    #[error(transparent)]
    Inputs(WorkspaceError),
    /// A scene without a wall.
    #[error(
        "{}: the scene has no wall to press on; add a table [wall], such as kind = \"plane\", position = [0, 0, \"80 mm\"], normal = [0, 0, -1], friction = 0.3",
        file.display()
    )]
    NoWall {
        /// The sweep.
        file: PathBuf,
    },
    /// A wall that does not say what holds a tip.
    #[error(
        "{}: `wall.friction` is missing, so it is not known what holds the tip; add friction = 0.3 to [wall], or ask for the coefficient that a force needs",
        file.display()
    )]
    NoFriction {
        /// The sweep.
        file: PathBuf,
    },
    /// Nothing that is swept can be commanded.
    #[error(
        "{}: no axis can be commanded, so nothing presses the tip; add an [[axis]] of a current, `insertion`, the field or the base",
        file.display()
    )]
    NoInputs {
        /// The sweep.
        file: PathBuf,
    },
    /// A spacing that is no length.
    #[error("points {} m apart make no lattice: give a length from 1e-12 m to 1e60 m", short_number(*.0))]
    Spacing(f64),
    /// An extent that is no length.
    #[error("an extent of {} m is no length: give one greater than zero", short_number(*.0))]
    Extent(f64),
    /// A force that is none.
    #[error("a normal force of {} N makes no sense: give one greater than zero", short_number(*.0))]
    Force(f64),
    /// A margin that no equilibrium has.
    #[error("a minimum margin of {} makes no sense: give a number from 0 to below 1", short_number(*.0))]
    Margin(f64),
    /// The lattice would take too long.
    #[error("points {:.3} mm apart make {count:.1e} points of the wall within reach, more than {most:.0e}; take {:.3} mm at least, or a smaller extent", 1e3 * spacing, 1e3 * fits)]
    TooManyPoints {
        /// Distance asked for (m).
        spacing: f64,
        /// Points on the wall.
        count: f64,
        /// Largest permitted number of points.
        most: f64,
        /// Distance that fits (m).
        fits: f64,
    },
    /// No point of the wall is near the rod.
    #[error("no point of the wall is within reach of the rod, {:.1} mm from its base; check `wall.position` and the direction of the rod", 1e3 * reach)]
    OutOfReach {
        /// Length of the rod and travel of its base (m).
        reach: f64,
    },
    /// Designs are asked for beside a force.
    #[error("a share of designs is told of the range of forces: ask for designs without a force")]
    RobustForce,
    /// The caller wanted it ended.
    #[error("interrupted; nothing was written")]
    Interrupted,
}

impl ContactError {
    /// The option that is to be changed, where it is one.
    pub fn option(&self) -> Option<&'static str> {
        match self {
            ContactError::Spacing(_) | ContactError::TooManyPoints { .. } => Some("voxel"),
            ContactError::Extent(_) => Some("extent"),
            ContactError::Force(_) => Some("force"),
            ContactError::Margin(_) => Some("minimum_margin"),
            ContactError::RobustForce => Some("designs"),
            _ => None,
        }
    }
}

impl From<WorkspaceError> for ContactError {
    fn from(error: WorkspaceError) -> ContactError {
        match error {
            WorkspaceError::NoInputs { file } => ContactError::NoInputs { file },
            WorkspaceError::Plan(error) => error.into(),
            WorkspaceError::Backend(error) => error.into(),
            error => ContactError::Inputs(error),
        }
    }
}
