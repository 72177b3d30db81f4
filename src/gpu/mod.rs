//! Host side of the GPU engine: devices, shader sources, kernels, buffers. Only this module names wgpu.
//!
//! `Device` opens an adapter, `Kernel` turns shader pieces and a plan into one WGSL source, `Gpu` feeds batches
//! through it and is a `Backend`, `Fleet` several of them. `Faults` makes a device fail on demand.

mod adapter;
mod buffers;
mod cache;
mod check;
mod counter;
mod device;
mod emit;
mod engine;
mod faults;
mod fleet;
mod kernel;
mod pace;
mod recipe;
mod record;
mod recovery;
mod reduce;
mod require;
mod returned;
mod self_test;
mod share;
mod slots;
mod solver;
mod sources;
mod specialise;
mod substitute;
mod tally;
mod terms;
mod timings;
mod unpack;
mod wants;

pub use adapter::{AdapterKind, AdapterSummary, adapters};
pub use buffers::{Settings, settings_members};
pub use cache::cache_directory;
pub use check::{Reflection, ShaderError, check};
pub use counter::generate_inputs;
pub use device::{Device, chosen_adapters};
pub use emit::{EmitError, EmitErrorKind, Source, emit};
pub use engine::Gpu;
pub use faults::{FaultCounts, Faults, Flip};
pub use fleet::{Fleet, open};
pub use kernel::{KERNELS, Kernel, KernelEntry, Part, WORKGROUP_SIZE};
pub use recipe::Generator;
pub use record::record_functions;
pub use require::device_or_skip;
pub use self_test::{Check, SelfTest, self_test};
pub use specialise::{Piece, Specialisation, Value};
pub use tally::{REQUEST_FLOATS, REQUEST_WORDS};
pub use terms::specialisation;
pub use timings::Timings;
