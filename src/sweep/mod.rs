//! Sweeps: scene and sweep files, sample index to parameters, runs in chunks, result directories.
//!
//! Knows the model and the `Backend` trait only.

mod columns;
mod error;
mod sampling;
mod scene_file;
mod scene_text;
mod sink;
mod spec;
mod sweep_file;
mod table_file;
mod toml;
mod units;

pub use columns::{Column, Table, Values, base_curvature, rotation_angle, rotation_vector};
pub use error::{InputError, Problem, SweepError};
pub use sampling::{MAX_SOBOL_DIMENSIONS, Sampler};
pub use scene_file::{parse_scene, read_scene, scene_notes};
pub use scene_text::write_scene;
pub use spec::{AxisSpec, Format, MAX_ROWS, MAX_SAMPLES, Method, OutputQuantity, RESOLVED_TABLE, SweepSpec};
pub use table_file::InputTable;
pub use units::{Dimension, QuantityError, parse_quantity};
