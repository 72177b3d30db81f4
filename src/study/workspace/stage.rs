//! What a measurement is at, for progress.

/// What a job is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WorkspaceStage {
    /// Reads rows or solves a net.
    Seeds,
    /// Looks for voxels; so many are reached.
    Growing(usize),
    /// Computes the independent value.
    Checking,
    /// Solves every voxel for its Jacobian and compliance.
    Voxels(usize),
    /// Designs done and wanted.
    Designs(usize, usize),
}
