//! What can be wrong with a result directory.

use crate::input::InputError;
use crate::table::TableError;
use std::path::{Path, PathBuf};

/// Why a result directory cannot be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResultsError {
    /// The sweep that lies in the directory.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The system refuses to read or write.
    #[error("{}: {action}: {reason}", path.display())]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// What was tried, such as `reading`.
        action: &'static str,
        /// What the system says.
        reason: String,
    },
    /// The address of an object store is not understood.
    #[error("`{}`: {reason}", url.display())]
    Address {
        /// As it was given.
        url: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// An object store does not answer as it should.
    #[error("{}: {remedy} (the store: {reason})", url.display())]
    Unreachable {
        /// Its address.
        url: PathBuf,
        /// What came back.
        reason: String,
        /// What would help.
        remedy: &'static str,
    },
    /// The directory holds a run, and none was to be resumed.
    #[error("{} already holds a run; resume it, or choose another directory", dir.display())]
    Exists {
        /// The directory.
        dir: PathBuf,
    },
    /// The directory holds files that are not of a run.
    #[error("{} is not empty and holds no run of rodsweep; choose an empty or a new directory", dir.display())]
    Foreign {
        /// The directory.
        dir: PathBuf,
    },
    /// The directory holds the run of another scene or sweep.
    #[error("{} holds another run: {}; choose another directory", dir.display(), changes.join("; "))]
    Changed {
        /// The directory.
        dir: PathBuf,
        /// What is otherwise now, a line each, in the words of the files.
        changes: Vec<String>,
    },
    /// What lies in the directory must not be removed.
    #[error("{} is left as it is: {}; choose another directory", dir.display(), not_ours(foreign))]
    NotOnlyOurs {
        /// The directory.
        dir: PathBuf,
        /// Names that no run and no study writes; none where there is no run.
        foreign: Vec<String>,
    },
    /// The directory holds a run that differs from the one that was to be resumed.
    #[error("{} holds another run: its {what} is {theirs}, here it is {ours}; choose another directory", dir.display())]
    Mismatch {
        /// The directory.
        dir: PathBuf,
        /// What differs, such as `chunk size`.
        what: &'static str,
        /// Of the run that is there.
        theirs: String,
        /// Of the run that was asked for.
        ours: String,
    },
    /// Workers cannot share a run that writes no rows.
    #[error("{}: workers share a run by its parts, and one without rows has none; run shards of it, and merge them", dir.display())]
    SharedWithoutRows {
        /// The directory.
        dir: PathBuf,
    },
    /// The directory is not that of a run.
    #[error("{} holds no run of rodsweep (no run.json)", dir.display())]
    NoRun {
        /// The directory.
        dir: PathBuf,
    },
    /// The identity of the run is not what was written.
    #[error("{} is no identity of a run: {reason}; bring back the file as it was written, or begin another run", path.display())]
    Identity {
        /// `run.json`
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The run was stopped between its identity and its sweep.
    #[error("{} holds a run that was stopped before it wrote its sweep.toml; resume it", dir.display())]
    NotBegun {
        /// The directory.
        dir: PathBuf,
    },
    /// The run has not been finished.
    #[error("{count} of {total} parts are missing, the first is part {first}; resume the shards to finish them")]
    MissingParts {
        /// How many are missing.
        count: u64,
        /// Parts of the whole run.
        total: u64,
        /// Number of the first that is missing, from 0.
        first: u64,
    },
    /// A shard that cannot be put together with the others.
    #[error("{} cannot be merged: {reason}", dir.display())]
    Unmergeable {
        /// The directory.
        dir: PathBuf,
        /// Why not, and what to do.
        reason: String,
    },
    /// A file of the run is not what was written.
    #[error("{} is damaged: {reason}; remove it and resume the run", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A table of the run, or one that was to be written.
    #[error("{} {problem}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: TableError,
    },
    /// The run has no such column.
    #[error("no column `{name}` in {}{}", dir.display(), suggestion.as_ref().map(|name| format!(": did you mean `{name}`?")).unwrap_or_default())]
    NoColumn {
        /// The directory.
        dir: PathBuf,
        /// What was asked for.
        name: String,
        /// The column that is spelled nearly so.
        suggestion: Option<String>,
    },
}

impl ResultsError {
    /// Whether the caller's choice of directory or column is at fault rather than what lies there.
    pub fn is_usage(&self) -> bool {
        !matches!(
            self,
            ResultsError::Io { .. }
                | ResultsError::Unreachable { .. }
                | ResultsError::NotBegun { .. }
                | ResultsError::Identity { .. }
                | ResultsError::MissingParts { .. }
                | ResultsError::Unmergeable { .. }
                | ResultsError::Damaged { .. }
                | ResultsError::Table { .. }
        )
    }

    /// Of a table of a run; one that is damaged can be made again.
    pub(crate) fn table(path: &Path) -> impl FnOnce(TableError) -> ResultsError {
        let path = path.to_owned();
        move |problem| match problem {
            TableError::Damaged { reason, .. } => ResultsError::Damaged { path, reason },
            TableError::Io(error) => ResultsError::io(&path, "reading")(error),
            problem => ResultsError::Table { path, problem },
        }
    }

    /// Of a table that cannot be written as this file.
    pub fn of_table(path: std::path::PathBuf) -> impl FnOnce(TableError) -> ResultsError {
        move |problem| ResultsError::Table { path, problem }
    }

    pub(crate) fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> ResultsError {
        let path = path.to_owned();
        move |error| ResultsError::Io { path, action, reason: error.to_string() }
    }
}

fn not_ours(foreign: &[String]) -> String {
    match foreign {
        [] => "it holds no run of rodsweep".into(),
        [name] => format!("`{name}` is not of rodsweep"),
        [name, rest @ ..] => format!("`{name}` and {} more are not of rodsweep", rest.len()),
    }
}
