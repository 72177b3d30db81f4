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

impl WorkspaceStage {
    /// A line of progress.
    pub fn words(&self) -> String {
        match self {
            WorkspaceStage::Seeds => "looking for places to begin".into(),
            WorkspaceStage::Growing(reached) => format!("{reached} voxels reached"),
            WorkspaceStage::Checking => "computing the independent value".into(),
            WorkspaceStage::Voxels(count) => format!("dexterity and compliance of {count} voxels"),
            WorkspaceStage::Designs(done, all) => format!("{done} of {all} designs"),
        }
    }
}
