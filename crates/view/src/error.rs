//! Why there is nothing to view, or why a request is refused.

use rodsweep::input::InputError;
use rodsweep::results::ResultsError;
use std::path::PathBuf;

/// Why something cannot be viewed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// The scene cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The results cannot be read.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// The rows have no tips.
    #[error("{} has no tip positions: add \"tip_position\" to [output] quantities and run it again", dir.display())]
    NoTips {
        /// The result directory.
        dir: PathBuf,
    },
    /// The system gives no port on the loopback.
    #[error("cannot listen on the loopback: {0}")]
    Listen(#[source] std::io::Error),
    /// The system gives no random numbers, so no address would be secret.
    #[error("the system gives no random numbers for a secret address: {0}")]
    Random(#[source] getrandom::Error),
    /// The page cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// What is drawn from the results cannot be put on the wire.
    #[error("{0}")]
    Refused(#[from] Refusal),
}

impl ViewError {
    /// Whether the question was wrong; else the machine could not answer it.
    pub fn is_usage(&self) -> bool {
        match self {
            ViewError::Input(_) | ViewError::NoTips { .. } => true,
            ViewError::Results(error) => error.is_usage(),
            _ => false,
        }
    }
}

/// Why a request has no answer: a status of HTTP and words for a person.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Refusal {
    /// Such as 404.
    pub status: u16,
    /// What is wrong, and the remedy.
    pub message: String,
}

impl Refusal {
    /// The request means nothing.
    pub fn wrong(message: impl ToString) -> Refusal {
        Refusal { status: 400, message: message.to_string() }
    }

    /// There is no such thing.
    pub fn absent(message: impl ToString) -> Refusal {
        Refusal { status: 404, message: message.to_string() }
    }

    /// The request may be right, the machine could not answer it.
    pub fn failed(message: impl ToString) -> Refusal {
        Refusal { status: 500, message: message.to_string() }
    }
}
