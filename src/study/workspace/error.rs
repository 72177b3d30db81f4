//! Why a workspace cannot be measured.

use super::tip_map::MOST_INPUTS;
use crate::backend::BackendError;
use crate::input::InputError;
use crate::model::{PlanError, short_number};
use crate::results::ResultsError;
use std::path::PathBuf;

/// Why a workspace cannot be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WorkspaceError {
    /// A file that cannot be read, or says what it should not.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The scene and its inputs make no plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// An engine cannot be used, or failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// A result directory cannot be read.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// Nothing that is swept can be commanded.
    #[error(
        "{}: no axis can be commanded, so there is no workspace; add an [[axis]] of a current, `insertion`, the field or the base, and move numbers of the design to [[uncertain]]",
        file.display()
    )]
    NoInputs {
        /// The sweep.
        file: PathBuf,
    },
    /// More than [`MOST_INPUTS`].
    #[error("{count} inputs; at most {MOST_INPUTS} are possible")]
    TooManyInputs {
        /// How many there are.
        count: usize,
    },
    /// Rows without tips.
    #[error(
        "{} has no column `{column}`: run the sweep with [output] quantities = [\"tip_position\", \"stability\"]",
        dir.display()
    )]
    NoColumn {
        /// The directory.
        dir: PathBuf,
        /// What is missing.
        column: String,
    },
    /// No sample gives an equilibrium that can be used.
    #[error(
        "none of {samples} samples gives a stable equilibrium with a margin of at least {minimum_margin}; check the scene and the limits"
    )]
    NoUsableRows {
        /// Samples looked at.
        samples: usize,
        /// Least margin that was asked for.
        minimum_margin: f64,
    },
    /// Tips on a wall make a surface, others before it a body.
    #[error(
        "{touching} samples touch the wall and move on it, {before} do not and fill a body before it: a map is one or the other; move the wall (`wall.position`) or narrow the inputs so that every tip touches it, or leave `[wall]` out and see the body"
    )]
    OnAndBeforeWall {
        /// Samples whose tip is on the wall.
        touching: usize,
        /// Samples whose tip moves in all directions.
        before: usize,
    },
    /// The lattice would take too much memory.
    #[error("voxels of {:.3} mm make {cells:.1e} cells within reach, more than {most:.0e}; take voxels of at least {:.3} mm", 1e3 * voxel, 1e3 * fits)]
    TooManyVoxels {
        /// Edge asked for (m).
        voxel: f64,
        /// Cells within reach of the rod.
        cells: f64,
        /// Largest permitted number of cells.
        most: f64,
        /// Edge that fits (m).
        fits: f64,
    },
    /// An edge that is no length.
    #[error("a voxel of {} m is no length: give one from 1e-12 m to 1e60 m", short_number(*.0))]
    Voxel(f64),
    /// A margin that no equilibrium has.
    #[error("a minimum margin of {} makes no sense: give a number from 0 to below 1", short_number(*.0))]
    Margin(f64),
    /// A query that is no point.
    #[error("{place}: {problem}")]
    Query {
        /// Which row or argument.
        place: String,
        /// What is wrong and what would help.
        problem: String,
    },
    /// A design study or robust set cannot be made.
    #[error("{0}")]
    Designs(String),
    /// Another workspace that this one cannot be compared with.
    #[error("{}: {problem}", path.display())]
    Compare {
        /// Its table.
        path: PathBuf,
        /// What is wrong and what would help.
        problem: String,
    },
    /// The caller wanted it ended.
    #[error("interrupted; nothing was written")]
    Interrupted,
}
