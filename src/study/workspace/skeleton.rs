//! The dimension of a skeleton, where the sweep leaves it open.

use super::dimension::Dimension;
use super::engine_map::{EngineMap, MapOptions};
use super::error::WorkspaceError;
use super::inputs::{base_scene, workspace_inputs};
use super::seeds::net_points;
use super::tip_map::{Tip, TipMap};
use crate::backend::BackendKind;
use crate::engines::EngineRequest;
use crate::spec::SweepSpec;

/// Samples whose Jacobians tell the dimension.
const PILOT: u64 = 256;

/// A sweep of the faces of a box on which as many inputs vary as the set of tips has dimensions, found by a pilot. Other
/// sweeps, those that say the dimension, and those with axes that cannot be commanded are left as they are.
///
/// # Errors
///
/// An engine that fails, or no usable equilibrium.
pub fn with_measured_dimension(spec: SweepSpec) -> Result<SweepSpec, WorkspaceError> {
    let is_open = spec.skeleton.is_some_and(|skeleton| skeleton.dimension.is_none());
    if !is_open {
        return Ok(spec);
    }
    // The tip's dimension is that of its inputs; other axes leave the usual one.
    let Ok((inputs, _)) = workspace_inputs(&spec) else { return Ok(spec) };
    if inputs.len() != spec.axes.len() {
        return Ok(spec);
    }
    let engine = EngineRequest::of(BackendKind::Cpu).choose(spec.tolerance)?;
    let options = MapOptions { engine, tolerance: spec.tolerance, steps: spec.steps };
    let mut map = EngineMap::new(&base_scene(&spec), &inputs, &options)?;
    let tips = map.solve_from_rest(&net_points(inputs.len(), PILOT, spec.seed))?;
    let usable: Vec<Tip> = tips.into_iter().filter(|tip| tip.usable).collect();
    if usable.is_empty() {
        return Err(WorkspaceError::NoUsableRows { samples: PILOT as usize, minimum_margin: 0.0 });
    }
    let rank = Dimension::of(&usable, inputs.len(), spec.workspace.voxel).rank.clamp(1, spec.axes.len());
    spec.with_skeleton_dimension(rank).map_err(|error| WorkspaceError::Designs(error.to_string()))
}
