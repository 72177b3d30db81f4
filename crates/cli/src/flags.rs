//! The library's errors in the words of the command line: they name the flag to change.

use super::CommandError;
use rodsweep::backend::{BackendError, BackendKind};
use rodsweep::study::SolveError;

/// What went wrong with one scene.
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

/// What an engine says, with the flag that helps.
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
