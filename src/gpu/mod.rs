//! The GPU engine: WGSL kernels for one plan, on one device or several.
//!
//! | files | know |
//! |---|---|
//! | [`shader`] | how pieces of WGSL and a plan become the source of a kernel; no device |
//! | `adapter`, `device`, `pipeline_cache`, `self_test`, `faults` | which GPUs there are, and how one is opened, checked and watched |
//! | `bindings`, `pipelines`, `compiled_kernels`, `rounds`, `dispatch_buffers` | kernels, compiled, their order, and the buffers of one dispatch |
//! | `dispatch_size`, `dispatcher` | how much work goes to the device at once, and what follows a loss or a shortage |
//! | `solve_batch`, `conversion` | a batch cut into dispatches, and its numbers in SI |
//! | `turns` | samples that take many turns, with memory that outlasts a dispatch |
//! | `node_batch`, `growth` | samples that a single pass does not tell, solved by nodes |
//! | `varying_batch` | samples in a field that varies in space |
//! | `voxel_sweep`, `voxel_kernels`, `voxel_pilot`, `returned_rows` | a sweep without rows, counted on the device |
//! | `engine`, `fleet`, `split_by_weight`, `device_time`, `timings` | the engine as a backend, on one device or several |
//!
//! Only this module names wgpu.

mod adapter;
mod bindings;
mod compiled_kernels;
mod conversion;
mod device;
mod device_time;
mod dispatch_buffers;
mod dispatch_size;
mod dispatcher;
mod engine;
mod faults;
mod fleet;
mod growth;
mod node_batch;
mod pipeline_cache;
mod pipelines;
mod returned_rows;
mod rounds;
mod self_test;
#[doc(hidden)]
pub mod shader;
mod solve_batch;
mod split_by_weight;
#[doc(hidden)]
pub mod testing;
mod timings;
mod turns;
mod varying_batch;
mod voxel_kernels;
mod voxel_pilot;
mod voxel_sweep;

pub use adapter::{AdapterKind, AdapterSummary, adapters};
pub use device::{Device, chosen_adapters};
pub use device_time::Stage;
pub use engine::Gpu;
pub use fleet::{Fleet, open};
pub use pipeline_cache::cache_directory;
pub use self_test::{Check, SelfTest, self_test};
pub use timings::Timings;
