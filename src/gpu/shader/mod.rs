//! Sources of the kernels: pieces of WGSL and a plan become one checked text. Nothing here needs a GPU.
//!
//! For tests and trials of kernels; engines make their own.

mod anchors;
mod check;
mod derivative_terms;
mod emit;
mod generator;
mod kernel;
mod nodes;
mod record;
mod segments;
mod settings;
mod slots;
mod sources;
mod specialise;
mod substitute;
mod tableaux;
mod terms;
mod varying;
mod voxel_request;

pub use check::{Reflection, ShaderError, check};
pub use emit::{EmitError, EmitErrorKind, Source, emit};
pub use generator::Generator;
pub use kernel::{KERNELS, Kernel, KernelEntry, Part, Stages};
pub use settings::{WORKGROUP_SIZE, settings_members};
pub use specialise::{Piece, Specialisation, Value};
pub use terms::{Form, specialisation};
pub use voxel_request::{REQUEST_FLOATS, REQUEST_WORDS};

pub(super) use anchors::{anchor_numbers, has_anchors};
pub(super) use nodes::{interval_bound, most_intervals, most_turns, node_bytes};
pub(super) use record::{constants, input_units};
pub(super) use segments::integrated;
pub(super) use settings::{HANDOVER_COUNT, LANES, Settings, float_bytes};
pub(super) use terms::pass_limit;
pub(super) use varying::{fits, most_turns as most_varying_turns, varying_bytes};
pub(super) use voxel_request::{Bounds, HEADER, Request, VoxelGrid};
