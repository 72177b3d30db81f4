//! Contact: which force the tip can press where on a wall, within the limits of the inputs and held by friction.

mod error;
mod files;
mod job;
mod lattice;
mod map;
mod programme;
mod robust;
mod rows;
mod search;

pub use error::ContactError;
pub use files::{ACCOUNT_FILE, DESIGNS_FILE, TABLE_FILE};
pub use job::{ContactJob, ContactStage};
pub use lattice::WallLattice;
pub use map::{Answer, Cause, ContactAccount, ContactMap, Outstanding, PointResult};
pub use robust::{ContactDesign, RobustAccount, RobustContact};
