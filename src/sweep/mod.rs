//! Sweeps: scene and sweep files, sample index to parameters, runs in chunks, result directories.
//!
//! Knows the model, tables and the `Backend` trait only.

mod assign;
mod bench_file;
mod branches;
mod check;
mod directory;
mod error;
mod fallback;
mod import;
mod layout;
mod manifest;
mod number_table;
mod pilot;
mod pipeline;
mod read;
mod reduce;
mod reduced;
mod refine;
mod rotation;
mod run;
mod sampling;
mod scene_file;
mod scene_text;
mod segment_file;
mod selection;
mod shape_file;
mod sink;
mod spec;
mod sweep_file;
mod table_file;
mod tip_file;
mod toml;
mod trajectory_file;
mod units;

pub use assign::{AssignError, assign};
pub use bench_file::{BenchSpec, Sets, Work};
pub use branches::{Branch, BranchSearch, BranchTools, Branches, Energy, Equilibria};
pub use check::{ErrorDistribution, SpotCheck, SpotCheckOptions};
pub use directory::RunRecord;
pub use error::{InputError, Problem, SweepError};
pub use fallback::{Fallback, run_with_fallback};
pub use import::{Import, ImportKind, ImportOptions, import};
pub use manifest::{TIPS_FILE, WORKSPACE_FILE, WORST_FILE};
pub use pilot::{PilotChoice, STEPS, choose_method, choose_steps};
pub use read::{
    DirectoryStatus, directory_status, for_each_part, merge, read_columns, read_manifest, read_parquet_table,
    read_spec, reduce_directory,
};
pub use reduce::{BranchCounts, MAX_TIPS, Reduction};
pub use reduced::SampleOrigin;
pub use rotation::{rotation_angle, rotation_vector};
pub use run::{BRANCH_CHUNK, BackendFactory, CHUNK, Progress, RunOptions, Shard, Summary, Timings, run};
pub use sampling::{MAX_SOBOL_DIMENSIONS, Sampler};
pub use scene_file::{parse_scene, read_scene, scene_notes};
pub use scene_text::write_scene;
pub use shape_file::{ShapeRows, read_shapes};
pub use sink::write_table;
pub use spec::{
    AxisSpec, BranchChoice, Format, MAX_ROWS, MAX_SAMPLES, Method, OutputQuantity, RESOLVED_TABLE, SweepSpec,
};
pub use table_file::{InputTable, read_input_table};
pub use tip_file::read_observed_tips;
pub use trajectory_file::{
    REDUNDANCIES, Trajectory, TrajectoryInput, TrajectoryPoint, parse_coordinates, parse_trajectory, read_trajectory,
};
pub use units::{Dimension, QuantityError, parse_quantity};
