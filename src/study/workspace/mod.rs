//! The workspace: what can be reached, how surely, with what margin.

mod account;
mod check;
mod compare;
mod decide;
mod designs;
mod dimension;
mod distances;
mod engine_map;
mod error;
mod growth;
mod inputs;
mod job;
mod lattice;
mod measures;
mod paint;
mod reach;
mod search;
mod section;
mod seeds;
mod step;
mod tables;
mod tip_map;
mod voxel_values;
#[allow(clippy::module_inception)]
mod workspace;

pub use account::{CheckAccount, InputAccount, WorkspaceAccount};
pub use check::ChangeOfVariables;
pub use compare::Comparison;
pub use designs::{Design, DesignStudy, RobustWorkspace, Variation, WILKS_DESIGNS, clopper_pearson};
pub use dimension::Dimension;
pub use engine_map::{EngineMap, MapOptions};
pub use error::WorkspaceError;
pub use growth::{Grown, Voxel};
pub use inputs::{WorkspaceInput, base_scene, reserve, workspace_inputs};
pub use job::{WorkspaceJob, WorkspaceStage};
pub use lattice::{Cell, Lattice, neighbours};
pub use measures::{Ends, Estimate};
pub use reach::{Preference, Reach};
pub use search::End;
pub use tip_map::{Branch, Inputs, MOST_INPUTS, Tip, TipMap};
pub use voxel_values::{Cause, VoxelValues};
pub use workspace::{Check, Workspace};
