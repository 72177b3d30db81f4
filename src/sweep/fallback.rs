//! A run that outlives its device.

use super::branches::BranchTools;
use super::error::SweepError;
use super::options::RunOptions;
use super::run::run;
use super::sink::RowSink;
use super::summary::Summary;
use crate::backend::BackendFactory;
use crate::backend::{Backend, BackendError};
use crate::spec::{SolutionMethod, SweepSpec};

/// What goes on where a device fails.
#[derive(Clone, Copy)]
pub struct Fallback<'a> {
    /// An engine in the same precision.
    pub engine: BackendFactory<'a>,
    /// Takes the place of [`RunOptions::search`].
    pub search: Option<BranchTools<'a>>,
    /// Told before it goes on.
    pub tell: &'a dyn Fn(&BackendError),
}

/// The same as [`run`]; where the device fails, another engine solves what is left. Finished parts are kept; a run
/// without rows starts anew. So no sample is lost, and none counts twice.
///
/// # Errors
///
/// As [`run`], and a failure of the other engine.
pub fn run_with_fallback(
    spec: &SweepSpec,
    backend: &mut dyn Backend,
    options: &RunOptions,
    fallback: &Fallback,
    sink: &mut dyn RowSink,
) -> Result<Summary, SweepError> {
    let error = match run(spec, backend, options, sink) {
        Err(SweepError::Backend(error)) if error.is_of_device() => error,
        result => return result,
    };
    (fallback.tell)(&error);
    let mut options = options.clone();
    options.method.get_or_insert_with(|| SolutionMethod::of(&backend.info(), backend.plan()));
    options.search = fallback.search;
    options.settle = None;
    options.notes.extend(backend.take_notes());
    let mut engine = (fallback.engine)(backend.plan())?;
    options.notes.push(format!("{error}; {} went on", engine.info()));
    run(spec, engine.as_mut(), &options, sink)
}
