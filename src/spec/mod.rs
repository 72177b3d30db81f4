//! What is asked for and what was seen, as plain data: a sweep, its samples by index, a table of inputs, targets,
//! trajectories, observed shapes.

mod input_table;
mod observed;
mod sampling;
mod selection;
mod shard;
mod solution_method;
mod sweep;
mod target;

pub use input_table::InputTable;
pub use observed::{ObservedPoint, ObservedShape, ObservedShapes, ObservedTip};
pub use sampling::{MAX_SOBOL_DIMENSIONS, Sampler};
pub(crate) use sampling::hash;
pub(crate) use selection::Selection;
pub use shard::{Shard, ShardError};
pub use solution_method::SolutionMethod;
pub(crate) use solution_method::stepper_name;
pub use sweep::{
    AxisSpec, BRANCH_CHUNK, BranchChoice, CHUNK, Format, MAX_ROWS, MAX_SAMPLES, Method, OutputQuantity, RESOLVED_TABLE,
    SweepSpec,
};
pub use target::{ControlInput, Redundancy, Target, Trajectory};
