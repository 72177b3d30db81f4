//! What can be wrong with an input file, and what can stop a run.

use super::units::QuantityError;
use crate::backend::BackendError;
use crate::model::{ParameterError, PlanError, SceneError};
use crate::table::TableError;
use std::fmt;
use std::path::{Path, PathBuf};

/// A mistake in an input file: where it is, what it is, what to do.
#[derive(Clone, Debug, PartialEq)]
pub struct InputError {
    pub file: PathBuf,
    pub line: Option<usize>,
    /// Path into the file, such as `segment[1].length`; empty where the whole file is meant.
    pub key: String,
    pub problem: Box<Problem>,
}

#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Problem {
    #[error("cannot be read: {0}")]
    Unreadable(String),
    #[error("{0}")]
    Table(String),
    #[error("is not valid TOML: {0}")]
    Syntax(String),
    #[error("is not a key here{}; known keys: {}", did_you_mean(.suggestion), .known.join(", "))]
    UnknownKey { suggestion: Option<String>, known: Vec<&'static str> },
    #[error("is missing: {remedy}")]
    Missing { remedy: String },
    #[error("is {found}; give {expected}")]
    Type { expected: String, found: &'static str },
    #[error("{0}")]
    Quantity(#[from] QuantityError),
    #[error("is {value}; give {expected}")]
    Range { value: String, expected: String },
    #[error("\"{found}\" is not known{}; use one of: {allowed}", did_you_mean(.suggestion))]
    Choice { found: String, suggestion: Option<String>, allowed: String },
    #[error("cannot stand beside `{with}`; {remedy}")]
    Conflict { with: String, remedy: String },
    #[error("{0}")]
    Scene(SceneError),
    #[error("{0}")]
    Parameter(#[from] ParameterError),
    #[error("{0}")]
    Plan(PlanError),
    #[error("{what} {count}; at most {limit} are possible: {remedy}")]
    TooMany { what: &'static str, count: String, limit: String, remedy: &'static str },
    #[error("the other segments alone are {others} m long; give more than that")]
    InsertionTooShort { others: f64 },
    #[error("has {found} columns where the first line has {expected}; mend the line")]
    Columns { found: usize, expected: usize },
}

fn did_you_mean(suggestion: &Option<String>) -> String {
    suggestion.as_ref().map(|name| format!(": did you mean `{name}`?")).unwrap_or_default()
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        f.write_str(":")?;
        if !self.key.is_empty() {
            write!(f, " `{}`:", self.key)?;
        }
        write!(f, " {}", self.problem)
    }
}

impl std::error::Error for InputError {}

/// Why a run could not start or go on.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    #[error(transparent)]
    Input(#[from] InputError),
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error(transparent)]
    Backend(#[from] BackendError),
    #[error("{}: {action}: {reason}", path.display())]
    Io { path: PathBuf, action: &'static str, reason: String },
    #[error("{} already holds a run; add `--resume` to go on with it, or choose another directory", dir.display())]
    Exists { dir: PathBuf },
    #[error("{} is not empty and holds no run of rodsweep; choose an empty or a new directory", dir.display())]
    Foreign { dir: PathBuf },
    #[error("{} holds another run: its {what} is {theirs}, here it is {ours}; choose another directory", dir.display())]
    Mismatch { dir: PathBuf, what: &'static str, theirs: String, ours: String },
    #[error("{} holds no run of rodsweep (no run.json)", dir.display())]
    NoRun { dir: PathBuf },
    #[error("`--shard {text}`: {reason}; write K/N with K from 1 to N, such as 2/8")]
    Shard { text: String, reason: &'static str },
    #[error("{count} of {total} parts are missing, the first is part {first}; finish the shards with `--resume`")]
    MissingParts { count: u64, total: u64, first: u64 },
    #[error("{} is damaged: {reason}; remove it and run with `--resume`", path.display())]
    Damaged { path: PathBuf, reason: String },
    #[error("{} {problem}", path.display())]
    Table { path: PathBuf, problem: TableError },
    #[error("the backend was prepared for another plan: {what} differ")]
    WrongPlan { what: &'static str },
    #[error("the sweep asks for every equilibrium, and the run was given nothing to search with")]
    NoSearch,
    #[error("no column `{name}` in {}{}", dir.display(), did_you_mean(.suggestion))]
    NoColumn { dir: PathBuf, name: String, suggestion: Option<String> },
}

impl SweepError {
    /// Whether the user's input or command is at fault (exit code 2) rather than the run (exit code 1).
    pub fn is_usage(&self) -> bool {
        matches!(
            self,
            SweepError::Input(_)
                | SweepError::Plan(_)
                | SweepError::Exists { .. }
                | SweepError::Foreign { .. }
                | SweepError::Mismatch { .. }
                | SweepError::NoRun { .. }
                | SweepError::Shard { .. }
                | SweepError::NoColumn { .. }
                | SweepError::Backend(BackendError::Unsupported { .. })
        )
    }

    /// Of a table of a run; one that is damaged can be made again.
    pub(super) fn table(path: &Path) -> impl FnOnce(TableError) -> SweepError {
        let path = path.to_owned();
        move |problem| match problem {
            TableError::Damaged { reason, .. } => SweepError::Damaged { path, reason },
            TableError::Io(error) => SweepError::io(&path, "reading")(error),
            problem => SweepError::Table { path, problem },
        }
    }

    pub(super) fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> SweepError {
        let path = path.to_owned();
        move |error| SweepError::Io { path, action, reason: error.to_string() }
    }
}
