//! Sample index to axis values, at random access: sample i depends only on (sweep, i).

mod hash;
mod net;
mod saltelli;
mod sampler;
mod skeleton;

pub use hash::permute;
pub(crate) use hash::{hash, unit_interval};
pub use net::{MAX_SOBOL_DIMENSIONS, SobolNet};
pub use saltelli::{DesignKind, SaltelliDesign};
pub use sampler::Sampler;
pub use skeleton::{Face, Skeleton, SkeletonError, SkeletonSampling};
