//! Why a study of sensitivity is not possible.

use crate::backend::BackendError;
use crate::model::{ParameterError, PlanError};
use crate::results::ResultsError;
use crate::study::SolveError;
use crate::sweep::SweepError;

/// Why a study of sensitivity is not possible.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SensitivityError {
    /// The results cannot be read or written.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// The sweep cannot be run.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// The scene and its parameters make no plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// An engine cannot be used, or failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// The nominal scene cannot be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A name that the scene has not.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A run that wrote no rows.
    #[error("the run has written no rows: run the sweep with [output] format = \"parquet\"")]
    NoRows,
    /// A sweep with several equilibria a sample.
    #[error(
        "the run lists every equilibrium; indices need one row a sample: run it with [solver] branch = \"from_rest\""
    )]
    EveryBranch,
    /// An axis without any width.
    #[error("`{input}` does not vary: give its axis a range, or remove it")]
    Fixed {
        /// The input.
        input: String,
    },
    /// An axis so narrow that round-off hides what it does.
    #[error(
        "`{input}` varies by less than {least:.0e} of its value, which round-off hides: give its axis a wider range"
    )]
    Narrow {
        /// The input.
        input: String,
        /// The least width over the value.
        least: f64,
    },
    /// Samples on the faces of a box.
    #[error(
        "the samples lie on the faces of the box of axes and follow no law: run the sweep with [sampling] method = \"sobol\" or \"saltelli\""
    )]
    Faces,
    /// An output that the run has not.
    #[error("no output `{name}`{}; there are: {}", suggestion.as_ref().map(|name| format!(": did you mean `{name}`?")).unwrap_or_default(), known.join(", "))]
    UnknownOutput {
        /// As it was asked for.
        name: String,
        /// The output that is spelled nearly so.
        suggestion: Option<String>,
        /// What there is.
        known: Vec<String>,
    },
    /// An input that the sweep has not.
    #[error("no input `{name}`{}; the sweep varies: {}", suggestion.as_ref().map(|name| format!(": did you mean `{name}`?")).unwrap_or_default(), known.join(", "))]
    UnknownInput {
        /// As it was asked for.
        name: String,
        /// The input that is spelled nearly so.
        suggestion: Option<String>,
        /// What there is.
        known: Vec<String>,
    },
    /// Too few rows for any answer.
    #[error(
        "{usable} of {rows} rows can be used, at least {needed} are needed: raise [sampling] samples{}",
        failed_by(statuses)
    )]
    TooFewRows {
        /// Rows that can be used.
        usable: u64,
        /// Rows that there are.
        rows: u64,
        /// As many as are needed.
        needed: u64,
        /// Rows by status, without successes.
        statuses: Vec<(&'static str, u64)>,
    },
    /// An output that is measured from the nominal rod, which has no equilibrium.
    #[error(
        "`{output}` is measured from the nominal rod, with every input at its mean, which has no equilibrium from rest: leave it \
         out of the outputs, narrow the axes, or centre them elsewhere"
    )]
    NoNominalFor {
        /// The output.
        output: String,
    },
    /// An output that no input changes.
    #[error("`{output}` is {value} in every row: no input changes it; leave it out of the outputs, or widen the axes")]
    Constant {
        /// The output.
        output: String,
        /// Its value, SI.
        value: f64,
    },
    /// Inputs of a table that go together.
    #[error(
        "`{first}` and `{second}` are correlated ({correlation:.2}): indices of variance need independent inputs; sample them with [sampling] method = \"sobol\" or \"saltelli\""
    )]
    Correlated {
        /// One input.
        first: String,
        /// The other.
        second: String,
        /// Of the two.
        correlation: f64,
    },
    /// An estimator that needs another design.
    #[error(
        "{estimator} needs the design of [sampling] method = \"saltelli\"; this sweep is {method}: take chaos or slopes, or run it so"
    )]
    NeedsDesign {
        /// As it was asked for.
        estimator: &'static str,
        /// Of the sweep.
        method: &'static str,
    },
    /// What needs derivatives that the rows have not.
    #[error("{what} needs derivatives that the rows have not: add `derivatives = [{}]` to [output] and run the sweep again, or give the sweep file", names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", "))]
    NoDerivatives {
        /// What was asked for.
        what: &'static str,
        /// Parameters whose derivatives are missing.
        names: Vec<String>,
    },
    /// A shape of rows that do not tell the rods' base moments.
    #[error(
        "the shape needs base moments that the rows have not: add \"base_moment\" to `quantities` of [output] and run the sweep again, or give the sweep file"
    )]
    NoBaseMoments,
    /// The shape of a rod that a wall presses.
    #[error(
        "the shape is not told beside a wall yet, since the moment at the base does not tell the wall's force: leave `shape` out, and take outputs such as tip.position and contact.force"
    )]
    ShapeBesideWall,
    /// Tangents of rows that do not tell the tips' rotations.
    #[error(
        "tangents need rotations that the rows have not: add \"tip_rotation\" to `quantities` of [output] and run the sweep again, or give the sweep file"
    )]
    NoRotations,
    /// No number of points.
    #[error("`shape{asked}`: give a number of points from 1 to {most}, such as shape:20")]
    ShapePoints {
        /// As it was asked for.
        asked: String,
        /// As many as may be.
        most: usize,
    },
    /// No nominal sample to begin from.
    #[error(
        "the first order needs an equilibrium with every input at its mean, and a law of every input: change the axes, or leave the propagation out"
    )]
    NoNominal,
    /// Nothing is left to be found out by measuring.
    #[error(
        "there is nothing to identify: every parameter with derivatives is an axis of the sweep; name what is to be found by the inputs, or list it in [[uncertain]]"
    )]
    NothingToIdentify,
    /// More measurements than candidates.
    #[error(
        "{asked} measurements are to be chosen of {candidates} candidates: lower the number, the margin, or raise [sampling] samples"
    )]
    TooFewCandidates {
        /// As many as were asked for.
        asked: usize,
        /// Rows that can be used and have the margin.
        candidates: usize,
    },
    /// A number that makes no sense.
    #[error("{what} is {value}; give {expected}")]
    Number {
        /// The option, in words.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What may be given.
        expected: &'static str,
    },
}

impl SensitivityError {
    /// Whether the user's input or command is at fault rather than the run.
    pub fn is_usage(&self) -> bool {
        match self {
            SensitivityError::Results(error) => error.is_usage(),
            SensitivityError::Sweep(error) => error.is_usage(),
            SensitivityError::Backend(error) => matches!(error, BackendError::Unsupported { .. }),
            _ => true,
        }
    }
}

/// `; they failed: 12 fold, 3 step-limit`
fn failed_by(statuses: &[(&'static str, u64)]) -> String {
    if statuses.is_empty() {
        return String::new();
    }
    let words: Vec<String> = statuses.iter().map(|(name, count)| format!("{count} {name}")).collect();
    format!(", or mend what fails: {}", words.join(", "))
}
