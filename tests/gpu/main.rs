//! The GPU engine: its shaders, its device, what follows when it fails.

#[path = "../common/mod.rs"]
mod common;

mod anchors;
mod emit;
mod faults;
mod fields;
mod fleet;
mod host;
mod languages;
mod limp;
mod reduce;
mod shaders;
mod solve;
