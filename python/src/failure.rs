//! Errors of the library as Python exceptions, in one place.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use rodsweep::backend::BackendError;
use rodsweep::draw::ReportError;
use rodsweep::figures::RunFiguresError;
use rodsweep::input::{AssignError, InputError, LimitsError, Problem};
use rodsweep::model::{ParameterError, PlanError};
use rodsweep::results::{ResultsError, is_url};
use rodsweep::study::contact::ContactError;
use rodsweep::study::sensitivity::SensitivityError;
use rodsweep::study::workspace::WorkspaceError;
use rodsweep::study::{ControlError, FitError, SolveError};
use rodsweep::sweep::SweepError;
use rodsweep_view::ViewError;
use std::fmt::Display;
use std::path::Path;

/// Which exception it becomes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `InputError`, a `ValueError`.
    Input,
    /// `EngineError`.
    Engine,
    /// `ResultsError`.
    Results,
    /// `MissingFileError`: both of these, and a `FileNotFoundError`.
    Missing,
    /// `RodsweepError`.
    Other,
}

/// What went wrong, to be raised once the GIL is held again.
#[derive(Clone, Debug)]
pub struct Failure {
    kind: Kind,
    text: String,
    key: Option<String>,
    file: Option<String>,
    line: Option<usize>,
}

impl Failure {
    /// Wrong input, at no key.
    pub fn input(text: impl Display) -> Failure {
        Failure::new(Kind::Input, text)
    }

    /// Wrong input at a key.
    pub fn at(key: &str, text: impl Display) -> Failure {
        Failure { key: Some(key.into()), ..Failure::input(format!("`{key}`: {text}")) }
    }

    /// Of a directory that was to be read: missing, where nothing lies at its place.
    pub fn reading(self, path: &Path) -> Failure {
        let is_missing = self.kind == Kind::Results && !is_url(path) && !path.exists();
        match is_missing {
            true => Failure { kind: Kind::Missing, file: Some(path.display().to_string()), ..self },
            false => self,
        }
    }

    /// Of a kind.
    pub fn new(kind: Kind, text: impl Display) -> Failure {
        Failure { kind, text: text.to_string(), key: None, file: None, line: None }
    }
}

static INPUT: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static ENGINE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static MISSING: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static RESULTS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static OTHER: PyOnceLock<Py<PyType>> = PyOnceLock::new();

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> PyErr {
        let Failure { kind, text, key, file, line } = failure;
        // Names of users stand in it, and terminals obey what they hold.
        let text = rodsweep::text::terminal(&text).into_owned();
        let (lock, name) = match kind {
            Kind::Input => (&INPUT, "InputError"),
            Kind::Engine => (&ENGINE, "EngineError"),
            Kind::Results => (&RESULTS, "ResultsError"),
            Kind::Missing => (&MISSING, "MissingFileError"),
            Kind::Other => (&OTHER, "RodsweepError"),
        };
        Python::attach(|py| match lock.import(py, "rodsweep._errors", name) {
            Ok(class) if matches!(kind, Kind::Input | Kind::Missing) => {
                PyErr::from_type(class.clone(), (text, key, file, line))
            }
            Ok(class) => PyErr::from_type(class.clone(), (text,)),
            Err(error) => error,
        })
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Failure {
        let kind = if matches!(*error.problem, Problem::Unreadable(_)) { Kind::Results } else { Kind::Input };
        // A scene from a dictionary has no file, and no line that anyone has seen.
        let given = |error: &InputError| !error.file.to_string_lossy().starts_with('<');
        let (file, line) = match given(&error) && !error.file.as_os_str().is_empty() {
            true => (Some(error.file.display().to_string()), error.line),
            false => (None, None),
        };
        let mut shown = error.clone();
        if !given(&error) {
            (shown.file, shown.line) = (Default::default(), None);
        }
        let key = (!error.key.is_empty()).then(|| error.key.clone());
        let kind = if file.is_none() { Kind::Input } else { kind };
        // As the reader of a file says it, of that file or of one that is named in it.
        let absent = ["(os error 2)", " is no file; "];
        let is_missing = |reason: &String| absent.iter().any(|words| reason.contains(words));
        let kind = match &*error.problem {
            Problem::Unreadable(reason) if is_missing(reason) => Kind::Missing,
            _ => kind,
        };
        Failure { kind, text: shown.to_string(), key, file, line }
    }
}

impl From<ParameterError> for Failure {
    fn from(error: ParameterError) -> Failure {
        let key = match &error {
            ParameterError::Unknown { name, .. } | ParameterError::Derived { name } => name.clone(),
        };
        Failure { key: Some(key), ..Failure::input(error) }
    }
}

impl From<PlanError> for Failure {
    fn from(error: PlanError) -> Failure {
        match error {
            PlanError::Parameter(error) => error.into(),
            error @ PlanError::InsertionIntoRigid(_) => Failure::at("insertion", error),
            error @ PlanError::RigidWall => Failure::at("wall.stiffness", error),
            error @ PlanError::FrictionChangesNothing => Failure::at("wall.friction", error),
            error => Failure::input(error),
        }
    }
}

impl From<BackendError> for Failure {
    fn from(error: BackendError) -> Failure {
        Failure::new(Kind::Engine, error)
    }
}

impl From<ResultsError> for Failure {
    fn from(error: ResultsError) -> Failure {
        match error {
            ResultsError::Input(error) => error.into(),
            ResultsError::NoColumn { ref name, .. } => {
                let key = Some(name.clone());
                Failure { key, ..Failure::input(error) }
            }
            error => Failure::new(Kind::Results, error),
        }
    }
}

impl From<SweepError> for Failure {
    fn from(error: SweepError) -> Failure {
        match error {
            SweepError::Input(error) => error.into(),
            SweepError::Plan(error) => error.into(),
            SweepError::Backend(error) => error.into(),
            SweepError::Results(error) => error.into(),
            error if error.is_usage() => Failure::input(error),
            error => Failure::new(Kind::Other, error),
        }
    }
}

impl From<AssignError> for Failure {
    fn from(error: AssignError) -> Failure {
        match error {
            AssignError::Parameter(error) => error.into(),
            AssignError::Plan(error) => error.into(),
            AssignError::Value { ref name, .. } => {
                let key = Some(name.clone());
                Failure { key, ..Failure::input(error) }
            }
            error => Failure::input(error),
        }
    }
}

impl From<LimitsError> for Failure {
    fn from(error: LimitsError) -> Failure {
        match error {
            LimitsError::Parameter(error) => error.into(),
            error => Failure::input(error),
        }
    }
}

impl From<SolveError> for Failure {
    fn from(error: SolveError) -> Failure {
        match error {
            SolveError::Backend(error) => error.into(),
            SolveError::Plan(error) => error.into(),
            SolveError::Derivative(error) => error.into(),
            error => Failure::input(error),
        }
    }
}

impl From<WorkspaceError> for Failure {
    fn from(error: WorkspaceError) -> Failure {
        match error {
            WorkspaceError::Input(error) => error.into(),
            WorkspaceError::Plan(error) => error.into(),
            WorkspaceError::Backend(error) => error.into(),
            WorkspaceError::Results(error) => error.into(),
            error => Failure::input(error),
        }
    }
}

impl From<ContactError> for Failure {
    fn from(error: ContactError) -> Failure {
        match error {
            ContactError::Inputs(error) => error.into(),
            ContactError::Plan(error) => error.into(),
            ContactError::Backend(error) => error.into(),
            ContactError::Results(error) => error.into(),
            error => match error.option() {
                Some(key) => Failure::at(key, error),
                None => Failure::input(error),
            },
        }
    }
}

impl From<SensitivityError> for Failure {
    fn from(error: SensitivityError) -> Failure {
        match error {
            SensitivityError::Results(error) => error.into(),
            SensitivityError::Sweep(error) => error.into(),
            SensitivityError::Plan(error) => error.into(),
            SensitivityError::Backend(error) => error.into(),
            SensitivityError::Solve(error) => error.into(),
            SensitivityError::Parameter(error) => error.into(),
            error => Failure::input(error),
        }
    }
}

impl From<ControlError> for Failure {
    fn from(error: ControlError) -> Failure {
        match error {
            ControlError::Plan(error) => error.into(),
            ControlError::Backend(error) => error.into(),
            error => Failure::input(error),
        }
    }
}

impl From<FitError> for Failure {
    fn from(error: FitError) -> Failure {
        match error {
            FitError::Plan(error) => error.into(),
            FitError::Backend(error) => error.into(),
            FitError::Parameter(error) => error.into(),
            error => Failure::input(error),
        }
    }
}

impl From<ViewError> for Failure {
    fn from(error: ViewError) -> Failure {
        match error {
            ViewError::Input(error) => error.into(),
            ViewError::Results(error) => error.into(),
            error if error.is_usage() => Failure::input(error),
            error => Failure::new(Kind::Other, error),
        }
    }
}

impl From<ReportError> for Failure {
    fn from(error: ReportError) -> Failure {
        Failure::new(Kind::Other, error)
    }
}

impl From<RunFiguresError> for Failure {
    fn from(error: RunFiguresError) -> Failure {
        match error {
            RunFiguresError::Results(error) => error.into(),
            RunFiguresError::Report(error) => error.into(),
            error => Failure::input(error),
        }
    }
}
