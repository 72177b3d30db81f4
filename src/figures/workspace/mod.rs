//! Figures of a workspace: its voxels in slices and projections, and curves of its size.

mod curves;
mod draw;
mod outline;
mod sheets;
mod summary;
mod voxels;

pub use draw::draw_workspace;
pub use sheets::WorkspaceFigures;
pub use summary::{DesignStudy, Method, MethodPoint, WorkspaceSummary};
