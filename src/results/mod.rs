//! Results: the columns of a run's rows, parts on disk, the directory and its identity, and reading all of it again.

pub(crate) mod directory;
mod error;
pub(crate) mod layout;
pub(crate) mod parts;
mod read;
mod reduce;

pub use directory::{RunRecord, TIPS_FILE, WORKSPACE_FILE, WORST_FILE};
pub use error::ResultsError;
pub(crate) use layout::{BranchCells, Layout, Rows};
pub use read::{
    DirectoryStatus, directory_status, for_each_part, merge, read_columns, read_manifest, read_parquet_table,
    read_spec, reduce_directory,
};
pub use reduce::{BranchCounts, MAX_TIPS, Reduction};
