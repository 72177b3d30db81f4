//! What can be wrong with an input file.

use super::units::QuantityError;
use crate::model::{ParameterError, PlanError, SceneError, short_name, short_number};
use std::fmt;
use std::path::{Path, PathBuf};

/// A mistake in an input file: where it is, what it is, what to do.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct InputError {
    /// The file, as it was named to be read; empty where there is none.
    pub file: PathBuf,
    /// From 1; `None` where the whole file is meant.
    pub line: Option<usize>,
    /// Path into the file, such as `segment[1].length`; empty where the whole file is meant.
    pub key: String,
    /// What is wrong.
    pub problem: Box<Problem>,
}

/// What is wrong at a place in an input file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The file, or one that it names, cannot be read: why.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// A table of numbers (CSV or Parquet) is not as it should be: how.
    #[error("{0}")]
    Table(String),
    /// The text is no TOML: what the parser says.
    #[error("is not valid TOML: {0}")]
    Syntax(String),
    /// A key that has no meaning at this place.
    #[error("is not a key here{}; known keys: {}", did_you_mean(.suggestion), .known.join(", "))]
    UnknownKey {
        /// The known key that is spelled nearly so.
        suggestion: Option<String>,
        /// Every key that may stand here.
        known: Vec<&'static str>,
    },
    /// A key that has to be there.
    #[error("is missing: {remedy}")]
    Missing {
        /// What to write.
        remedy: String,
    },
    /// A value of another type.
    #[error("is {found}; give {expected}")]
    Type {
        /// What may stand here.
        expected: String,
        /// What stands here.
        found: &'static str,
    },
    /// A text that is no quantity of the dimension that is needed.
    #[error("{0}")]
    Quantity(#[from] QuantityError),
    /// A value beyond what is possible.
    #[error("is {value}; give {expected}")]
    Range {
        /// What stands here.
        value: String,
        /// What may stand here.
        expected: String,
    },
    /// A word that is none of a fixed list.
    #[error("\"{}\" is not known{}; use one of: {allowed}", short_name(.found), did_you_mean(.suggestion))]
    Choice {
        /// The word.
        found: String,
        /// The known word that is spelled nearly so.
        suggestion: Option<String>,
        /// The list, with commas.
        allowed: String,
    },
    /// Two entries that exclude each other.
    #[error("cannot stand beside `{}`; {remedy}", short_name(.with))]
    Conflict {
        /// The other key or parameter.
        with: String,
        /// What to do.
        remedy: String,
    },
    /// The values make no scene.
    #[error("{0}")]
    Scene(SceneError),
    /// A parameter's name that the scene does not have, or that cannot be set.
    #[error("{0}")]
    Parameter(#[from] ParameterError),
    /// A column of a sweep's table that is no parameter.
    #[error("{0}; to pass over such columns, write extra_columns = \"ignore\" under [sampling]")]
    Column(ParameterError),
    /// The sweep makes no plan.
    #[error("{0}")]
    Plan(PlanError),
    /// More than the library can do.
    #[error("{what} {count}; at most {limit} are possible: {remedy}")]
    TooMany {
        /// The verb of the message, such as `asks for`.
        what: &'static str,
        /// How many, and of what.
        count: String,
        /// The most that are possible.
        limit: String,
        /// What to do.
        remedy: &'static str,
    },
    /// An insertion that leaves the first segment no length.
    #[error("the other segments alone are {} m long; give more than that", short_number(*.others))]
    InsertionTooShort {
        /// Length of the other segments (m).
        others: f64,
    },
    /// A line of a table that is longer or shorter than the first.
    #[error("has {found} columns where the first line has {expected}; mend the line")]
    Columns {
        /// Columns of the line.
        found: usize,
        /// Columns of the first line.
        expected: usize,
    },
}

fn did_you_mean(suggestion: &Option<String>) -> String {
    suggestion.as_ref().map(|name| format!(": did you mean `{name}`?")).unwrap_or_default()
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.file.as_os_str().is_empty() {
            write!(f, "{}", self.file.display())?;
            if let Some(line) = self.line {
                write!(f, ":{line}")?;
            }
            f.write_str(": ")?;
        }
        if !self.key.is_empty() {
            write!(f, "`{}`: ", short_name(&self.key))?;
        }
        write!(f, "{}", self.problem)
    }
}

impl std::error::Error for InputError {}

/// A mistake in a table: its line, and the column as the key.
pub(crate) fn table_error(file: &Path, line: Option<usize>, key: &str, problem: Problem) -> InputError {
    InputError { file: file.into(), line, key: key.into(), problem: problem.into() }
}
