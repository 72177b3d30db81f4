//! Files that are read and written: scenes, sweeps, tables, result directories.

#[path = "../common/mod.rs"]
mod common;

mod arc;
mod bad_input;
mod branch_sweeps;
mod calibrations;
mod claims;
mod estimates;
mod faults;
mod field_maps;
mod fields;
mod foreign_tables;
mod fuzz;
mod inner_loads;
mod input_tables;
mod integrity;
mod laws;
mod magnet_sheets;
mod map_layouts;
mod markers;
mod mending;
mod method;
mod rows_folder;
mod same_rows;
mod scenes;
mod second_path;
mod shipped;
mod sinks;
mod spot_check;
mod stage_times;
mod stores;
mod surfaces;
mod sweeps;
mod table;
mod verdict;
mod walls;

use common::root;

/// A place in memory: there is none without object stores. `crates/stores/tests` runs the same tests with them.
fn in_memory(_: &str) -> Option<std::path::PathBuf> {
    None
}
