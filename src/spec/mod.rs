//! What is asked for and what was seen, as plain data: a sweep, its samples by index, a table of inputs, targets,
//! trajectories, observed shapes.

mod axis;
mod distribution;
mod input_table;
// Coefficients stand as they were printed.
#[allow(clippy::excessive_precision)]
mod normal;
mod observed;
mod precision;
mod sampling;
mod selection;
mod shard;
mod solution_method;
mod sweep;
mod target;
mod words;

pub use axis::AxisSpec;
pub use distribution::Distribution;
pub use input_table::InputTable;
pub use observed::{ObservedPoint, ObservedShape, ObservedShapes, ObservedTip};
pub use precision::{MIXED, MIXED_NOTE, PrecisionChoice};
pub use sampling::permute;
pub use sampling::{
    DesignKind, Face, MAX_SOBOL_DIMENSIONS, SaltelliDesign, Sampler, Skeleton, SkeletonError, SkeletonSampling,
    SobolNet,
};
pub(crate) use sampling::{hash, unit_interval};
pub(crate) use selection::Selection;
pub use shard::{Shard, ShardError};
pub use solution_method::SolutionMethod;
pub(crate) use solution_method::{ScaleNumbers, stepper_name};
pub use sweep::{
    BRANCH_CHUNK, BranchChoice, CHUNK, Format, MAX_ROWS, MAX_SAMPLES, Method, OutputQuantity, RESOLVED_TABLE,
    SweepSpec, WorkspaceOptions,
};
pub use target::{ControlInput, Coordinates, Redundancy, Target, Trajectory};
pub(crate) use words::grouped;
