//! Questions to a rod: one equilibrium, a trajectory, a shape that was measured; and their figures.

#[path = "../common/mod.rs"]
mod common;

mod control;
mod control_windows;
mod controllers;
mod figures;
mod fit;
mod mesh;
mod solve;
mod targets;
mod voxel_panels;
mod workspace_figures;
mod workspace_golden;
mod workspace_shapes;
