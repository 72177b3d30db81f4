//! Questions to a rod: one equilibrium, a trajectory, a shape that was measured; and their figures.

#[path = "../common/mod.rs"]
mod common;

mod cables;
mod calibration;
mod contact;
mod control;
mod control_windows;
mod controllers;
mod estimators;
mod field_figures;
mod fields;
mod figures;
mod fit;
mod limp;
mod lines;
mod mesh;
mod sensitivity;
mod sensitivity_shape;
mod solve;
mod study_rows;
mod targets;
mod variance_shares;
mod voxel_panels;
mod wall_control;
mod wall_figures;
mod wall_fit;
mod wall_sensitivity;
mod wall_workspace;
mod workspace_fields;
mod workspace_figures;
mod workspace_golden;
mod workspace_shapes;
