//! The library's errors in the words of the command line: they name the flag to change.

use super::{CommandError, say};
use rodsweep::backend::{BackendError, BackendKind};
use rodsweep::figures::RunFiguresError;
use rodsweep::files;
use rodsweep::input::{Dimension, parse_quantity};
use rodsweep::results::ResultsError;
use rodsweep::study::sensitivity::SensitivityError;
use rodsweep::study::{ControlError, FitError, SolveError};
use rodsweep::sweep::SweepError;
use std::path::Path;

/// Message for an error of one scene.
pub fn of_solve(error: SolveError) -> CommandError {
    match error {
        SolveError::Tolerance { tolerance } => {
            CommandError::Usage(format!("`--tolerance {tolerance}`: give a number between 0 and 1, such as 1e-9"))
        }
        SolveError::Derivative(error) => CommandError::Usage(format!("`--wrt`: {error}")),
        SolveError::Plan(error) => error.into(),
        SolveError::Backend(error) => error.into(),
        error => CommandError::Usage(format!("`--shape`: {error}")),
    }
}

/// Message for an error of control, with the flag that helps.
impl From<ControlError> for CommandError {
    fn from(error: ControlError) -> CommandError {
        match error {
            ControlError::Backend(error) => error.into(),
            ControlError::NoInputs => CommandError::Usage(format!("{error} with `--input NAME=LOW..HIGH`")),
            error => CommandError::Control(error),
        }
    }
}

/// Message for an error of a fit, with the flag that helps.
impl From<FitError> for CommandError {
    fn from(error: FitError) -> CommandError {
        match error {
            FitError::Backend(error) => error.into(),
            FitError::Parameter(_) | FitError::NamedTwice(_) | FitError::FreeAndKnown(_) => {
                CommandError::Usage(format!("`--free`: {error}"))
            }
            error => CommandError::Fit(error),
        }
    }
}

/// Message for an error of a study of sensitivity, with the flag that helps.
impl From<SensitivityError> for CommandError {
    fn from(error: SensitivityError) -> CommandError {
        use SensitivityError as E;
        let flag = match &error {
            E::UnknownOutput { .. } => "--outputs",
            E::UnknownInput { .. } | E::Parameter(_) | E::NothingToIdentify => "--inputs",
            E::NeedsDesign { .. } => "--estimator",
            E::NoNominal => "--propagate",
            E::TooFewCandidates { .. } => "--choose",
            E::Number { what: "the confidence", .. } => "--confidence",
            E::Number { what: "the degree", .. } => "--degree",
            E::Number { what: "the least margin", .. } => "--minimum-margin",
            E::Number { what: "the number of measurements", .. } => "--choose",
            E::Number { .. } => "--noise",
            _ => "",
        };
        match error {
            E::Results(error) => error.into(),
            E::Sweep(error) => error.into(),
            E::Plan(error) => error.into(),
            E::Backend(error) => error.into(),
            E::Solve(error) => of_solve(error),
            error if !flag.is_empty() => CommandError::Usage(format!("`{flag}`: {error}")),
            error => CommandError::Sensitivity(error),
        }
    }
}

/// Message for an error of an engine, with the flag that helps.
pub fn of_backend(error: &BackendError) -> String {
    let on_the_cpu = "use `--backend cpu`";
    match error {
        BackendError::Unsupported { backend: backend @ BackendKind::Reference, what, .. } if what == "f32" => {
            format!("the {backend} backend does not model {what}: leave `--precision` out")
        }
        BackendError::Unsupported { backend: backend @ BackendKind::Reference, what, .. } => {
            format!("the {backend} backend does not model {what}: {on_the_cpu}")
        }
        BackendError::NoDevice { reason } => format!("no usable GPU: {reason}; {on_the_cpu}"),
        BackendError::OutOfMemory { reason } => format!("the GPU has too little memory: {reason}; {on_the_cpu}"),
        other => other.to_string(),
    }
}

/// Message for an error of a run's figures, with the flag that helps.
pub fn of_run_figures(error: &RunFiguresError) -> String {
    match error {
        RunFiguresError::Colour { name, known, .. } => {
            format!("`--colour {name}`: no such column; use one of: {}", known.join(", "))
        }
        RunFiguresError::Results(error) => of_results(error),
        other => other.to_string(),
    }
}

/// Message for an error of a result directory, with the flag that helps.
pub fn of_results(error: &ResultsError) -> String {
    match error {
        ResultsError::Exists { dir } => format!(
            "{} already holds a run; add `--resume` to go on with it, `--force` to replace it, or choose another directory",
            dir.display()
        ),
        ResultsError::Changed { dir, changes } => format!(
            "{} holds another run: {}; `--force` replaces it, `--out DIR` keeps both",
            dir.display(),
            changes.join("; ")
        ),
        ResultsError::NotBegun { dir } => {
            format!(
                "{} holds a run that was stopped before it wrote its sweep.toml; run it again with `--resume`",
                dir.display()
            )
        }
        ResultsError::Damaged { path, reason } => {
            format!("{} is damaged: {reason}; remove it and run with `--resume`", path.display())
        }
        ResultsError::MissingParts { count, total, first } => format!(
            "{count} of {total} parts are missing, the first is part {first}; finish the shards with `--resume`"
        ),
        ResultsError::Mismatch { what, .. } if ["engine", "precision", "stepper", "number of steps"].contains(what) => {
            format!("{error}; for a shard, solve it by the method of the others with `--method-of DIR`")
        }
        ResultsError::Mismatch { .. } => {
            let text = error.to_string();
            let text = text.strip_suffix("; choose another directory").unwrap_or(&text);
            format!("{text}; `--force` replaces it, `--out DIR` keeps both")
        }
        other => other.to_string(),
    }
}

/// Message for an error that stopped a run, with the flag that helps.
pub fn of_sweep(error: &SweepError) -> String {
    match error {
        SweepError::Results(error) => of_results(error),
        SweepError::Backend(error) => of_backend(error),
        SweepError::OtherMethod { what, settled, asked } => {
            let flag = match *what {
                "engine" => "leave `--backend` out",
                "precision" => "leave `--precision` out",
                _ => "leave it to the run",
            };
            format!("the run is solved with {what} {settled}, asked for is {asked}; {flag}, or begin another run")
        }
        other => other.to_string(),
    }
}

/// Writes a text that `--out` names, and says so.
pub fn write_text(path: &Path, text: &str) -> Result<(), CommandError> {
    files::replace(path, text.as_bytes()).map_err(|error| unwritten(path, &error))?;
    say(&format!("written: {}", path.display()));
    Ok(())
}

/// Message for a file of `--out` that cannot be written.
pub fn unwritten(path: &Path, error: &std::io::Error) -> CommandError {
    CommandError::Usage(format!("cannot write {}: {error}; choose another `--out`", path.display()))
}

/// Refuses a file whose name is taken; `other` says what else to choose.
pub fn refuse_to_overwrite(path: &Path, force: bool, other: &str) -> Result<(), CommandError> {
    if force || !rodsweep::files::is_taken(path) {
        return Ok(());
    }
    let path = path.display();
    Err(CommandError::Usage(format!("{path} is already there: overwrite it with `--force`, or choose another {other}")))
}

/// A length (m) that an argument must give; `example` is one.
pub fn positive_length(flag: &str, text: &str, example: &str) -> Result<f64, String> {
    positive(flag, text, ("m", "length"), example)
}

/// A force (N) that an argument must give; `example` is one.
pub fn positive_force(flag: &str, text: &str, example: &str) -> Result<f64, String> {
    positive(flag, text, ("N", "force"), example)
}

/// An angle (rad) that an argument must give; `example` is one.
pub fn positive_angle(flag: &str, text: &str, example: &str) -> Result<f64, String> {
    positive(flag, text, ("rad", "angle"), example)
}

fn positive(flag: &str, text: &str, (unit, what): (&'static str, &str), example: &str) -> Result<f64, String> {
    let wrong = |why: String| format!("`{flag} {text}`: {why}");
    let value = parse_quantity(text, Dimension::of(unit)).map_err(|error| wrong(error.to_string()))?;
    if value > 0.0 { Ok(value) } else { Err(wrong(format!("give a positive {what}, such as \"{example}\""))) }
}

/// More would take days.
const MOST: usize = 100_000;

/// A number of repeats or samples that an argument gives.
pub fn some(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(number @ 1..=MOST) => Ok(number),
        _ => Err(format!("give a number from 1 to {MOST}")),
    }
}
