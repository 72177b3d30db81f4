//! The workspace: what can be reached, how surely, with what margin.

mod dimension;
mod engine_map;
mod error;
mod growth;
mod inputs;
mod lattice;
mod search;
mod section;
mod seeds;
mod step;
mod tip_map;

pub use dimension::Dimension;
pub use engine_map::{EngineMap, MapOptions};
pub use error::WorkspaceError;
pub use growth::{Grown, Voxel};
pub use inputs::{WorkspaceInput, base_scene, reserve, workspace_inputs};
pub use lattice::{Cell, Lattice, neighbours};
pub use search::End;
pub use seeds::{net, net_points};
pub use tip_map::{Branch, Inputs, MOST_INPUTS, Tip, TipMap};
