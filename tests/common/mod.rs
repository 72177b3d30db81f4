//! What tests share. Each binary compiles it for itself and uses some of it.
#![allow(dead_code, non_snake_case)]

pub mod boxes;
pub mod check;
pub mod day;
pub mod fields;
pub mod golden;
pub mod limp;
pub mod runs;
pub mod scenes;
pub mod strategy;
pub mod table;
pub mod texts;
pub mod walls;

use std::path::Path;

/// Root of the repository.
pub fn root() -> &'static Path {
    let is_root = |folder: &&Path| folder.join("sweeps/workspace.toml").is_file();
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().find(is_root).expect("a package within the repository")
}
