//! Results: the columns of a run's rows, parts on disk, the directory and its identity, and all of it opened again.

pub(crate) mod claims;
mod clear;
pub(crate) mod contact;
mod differences;
pub(crate) mod directory;
mod error;
pub(crate) mod evidence;
pub(crate) mod layout;
pub(crate) mod manifest;
pub(crate) mod merge;
mod outcome;
pub(crate) mod parts;
mod read;
mod reduce;
#[cfg(test)]
mod simulation;
mod store;
mod study_table;
pub(crate) mod verdict;
pub(crate) mod verdict_files;
mod verdict_text;
pub(crate) mod workers;

pub use clear::remove_run;
pub use contact::Contact;
pub(crate) use contact::pressed;
pub use directory::{RunRecord, TIPS_FILE, WORKSPACE_FILE, WORST_FILE};
pub use error::ResultsError;
pub use evidence::StabilityEvidence;
pub(crate) use layout::{BranchCells, Layout, Rows};
pub use manifest::{Manifest, RunAccount, RunTimings, RungAccount, SecondAttempts};
pub use merge::merge;
pub use outcome::{
    AnchorAccount, BranchCounts, ErrorDistribution, PathCheck, PilotChoice, SampleOrigin, SpotCheck, Timings,
};
pub use parts::{make_directory, read_mark, verdict_metadata, write_bytes, write_table};
pub use read::{DirectoryStatus, Results, read_parquet_table};
pub use reduce::{MAX_TIPS, Reduction};
pub use store::{Entry, OpenStore, Store, install_object_stores, is_place, is_url, store_at};
pub use study_table::{find_table, place_table};
pub use verdict::{Doubt, DoubtKind, InputRange, Verdict};
pub use verdict_text::Solved;
pub use workers::{SILENCE, Worker, WorkerReport};
