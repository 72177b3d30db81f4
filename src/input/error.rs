//! What can be wrong with an input file.

use super::units::QuantityError;
use crate::model::{ParameterError, PlanError, SceneError};
use std::fmt;
use std::path::PathBuf;

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
