//! What is asked for, as plain data: a sweep, its samples by index, a table of inputs.

mod input_table;
mod sampling;
mod selection;
mod shard;
mod solution_method;
mod sweep;

pub use input_table::InputTable;
pub use sampling::{MAX_SOBOL_DIMENSIONS, Sampler};
pub(crate) use selection::Selection;
pub use shard::{Shard, ShardError};
pub use solution_method::SolutionMethod;
pub(crate) use solution_method::stepper_name;
pub use sweep::{
    AxisSpec, BRANCH_CHUNK, BranchChoice, CHUNK, Format, MAX_ROWS, MAX_SAMPLES, Method, OutputQuantity, RESOLVED_TABLE,
    SweepSpec,
};
