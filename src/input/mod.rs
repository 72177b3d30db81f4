//! From text to specification, and back: scene, sweep, trajectory and shape files, tables of inputs, units, imports.
//!
//! Every mistake is an [`InputError`] with file, line, key and remedy.

mod array_sweep;
mod assign;
mod error;
mod field_file;
mod file_check;
mod force_file;
mod import;
mod limits;
mod magnet_note;
mod map;
mod number_table;
mod parameter_table;
mod quantity_text;
mod scene_file;
mod scene_text;
mod scene_value;
mod segment_file;
mod shape_file;
mod sweep_axes;
mod sweep_distribution;
mod sweep_file;
mod sweep_samples;
mod sweep_text;
mod table_file;
mod text_table;
mod tip_file;
pub mod toml;
mod toml_spans;
mod trajectory_file;
mod units;
mod wall_file;
mod words;

pub use array_sweep::{sweep_of_rows, sweep_of_table};
pub use assign::{AssignError, assign, read_scene_with};
pub use error::{InputError, Problem};
pub use file_check::{FileCheck, FileContent, FileKind};
pub use import::{Import, ImportKind, ImportOptions, import};
pub use limits::{LimitsError, parse_limits};
pub use parameter_table::{ParameterGroup, ParameterRow, parameter_groups, parameter_rows};
pub use quantity_text::quantity_text;
pub use scene_file::{parse_scene, read_scene, read_text, scene_notes};
pub use scene_text::write_scene;
pub use shape_file::{read_shapes, read_shapes_with};
pub use sweep_file::{BuiltIn, sweep_of};
pub use table_file::read_input_table;
pub use tip_file::read_observed_tips;
pub use trajectory_file::{parse_coordinates, parse_trajectory, read_trajectory};
pub use units::{Dimension, LARGEST, QuantityError, parse_quantity};
pub use words::{choice, one_of, parameters};
