//! Figures of a workspace: its voxels in slices and projections, and curves of its size.

mod curves;
mod draw;
pub(in crate::figures) mod outline;
pub(in crate::figures) mod sheets;
mod summary;
pub(in crate::figures) mod voxels;

pub use draw::draw_workspace;
pub use sheets::WorkspaceFigures;
pub use summary::{DesignStudy, Method, MethodPoint, WorkspaceSummary};
