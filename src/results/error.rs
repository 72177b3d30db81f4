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
    #[error("{}: {action}: {reason}", path.display())]
    Io { path: PathBuf, action: &'static str, reason: String },
    #[error("{} already holds a run; resume it, or choose another directory", dir.display())]
    Exists { dir: PathBuf },
    #[error("{} is not empty and holds no run of rodsweep; choose an empty or a new directory", dir.display())]
    Foreign { dir: PathBuf },
    #[error("{} holds another run: its {what} is {theirs}, here it is {ours}; choose another directory", dir.display())]
    Mismatch { dir: PathBuf, what: &'static str, theirs: String, ours: String },
    #[error("{} holds no run of rodsweep (no run.json)", dir.display())]
    NoRun { dir: PathBuf },
    #[error("{count} of {total} parts are missing, the first is part {first}; resume the shards to finish them")]
    MissingParts { count: u64, total: u64, first: u64 },
    #[error("{} is damaged: {reason}; remove it and resume the run", path.display())]
    Damaged { path: PathBuf, reason: String },
    /// A table of the run, or one that was to be written.
    #[error("{} {problem}", path.display())]
    Table { path: PathBuf, problem: TableError },
    #[error("no column `{name}` in {}{}", dir.display(), suggestion.as_ref().map(|name| format!(": did you mean `{name}`?")).unwrap_or_default())]
    NoColumn { dir: PathBuf, name: String, suggestion: Option<String> },
}

impl ResultsError {
    /// Whether the caller's choice of directory or column is at fault rather than what lies there.
    pub fn is_usage(&self) -> bool {
        !matches!(
            self,
            ResultsError::Io { .. }
                | ResultsError::MissingParts { .. }
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

    pub(crate) fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> ResultsError {
        let path = path.to_owned();
        move |error| ResultsError::Io { path, action, reason: error.to_string() }
    }
}
