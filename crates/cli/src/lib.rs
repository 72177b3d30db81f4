//! The program `rodsweep`: a command parses its arguments, calls the library, prints, and picks an exit code.
//!
//! One file a command, with its arguments. What a program reads goes to stdout, everything else to stderr.

mod args;
mod bench;
mod check;
mod contact;
mod control;
mod control_job;
mod doctor;
mod engine_args;
mod examples;
mod experiment;
mod figures;
mod fit;
mod flags;
mod force;
mod help;
mod import;
mod manual;
mod merge;
mod new;
mod parameters;
mod progress;
mod replay;
mod run;
mod run_summary;
mod sensitivity;
mod signals;
mod simulate;
mod solve;
mod status;
mod submit;
mod verdict;
mod verify;
mod view;
mod workspace;

use args::Command;
use rodsweep::backend::BackendError;
use rodsweep::draw::ReportError;
use rodsweep::figures::RunFiguresError;
use rodsweep::input::{AssignError, InputError, scene_notes};
use rodsweep::model::{PlanError, Scene};
use rodsweep::results::ResultsError;
use rodsweep::study::contact::ContactError;
use rodsweep::study::sensitivity::SensitivityError;
use rodsweep::study::workspace::WorkspaceError;
use rodsweep::study::{ControlError, FitError};
use rodsweep::sweep::SweepError;
use rodsweep::text::terminal;
use rodsweep_view::ViewError;
use std::ffi::OsString;
use std::io::Write;

/// How a command ended, as the shell sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exit {
    Done = 0,
    Failed = 1,
    Usage = 2,
    TooManyFailures = 3,
    /// The rows are not to be trusted.
    Distrusted = 4,
    /// Stopped early with every begun part finished; a second start goes on.
    Unfinished = 85,
    Interrupted = 130,
}

/// Why a command could not do its work.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CommandError {
    #[error(transparent)]
    Input(#[from] InputError),
    #[error(transparent)]
    Assign(#[from] AssignError),
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error("{}", flags::of_sweep(.0))]
    Sweep(#[from] SweepError),
    #[error("{}", flags::of_results(.0))]
    Results(#[from] ResultsError),
    #[error("{}", flags::of_backend(.0))]
    Backend(#[from] BackendError),
    #[error("{}", flags::of_run_figures(.0))]
    RunFigures(#[from] RunFiguresError),
    #[error(transparent)]
    Report(#[from] ReportError),
    #[error(transparent)]
    Control(ControlError),
    #[error(transparent)]
    Fit(FitError),
    #[error(transparent)]
    Workspace(WorkspaceError),
    #[error(transparent)]
    Contact(ContactError),
    #[error(transparent)]
    Sensitivity(SensitivityError),
    #[error(transparent)]
    View(#[from] ViewError),
    #[error("{0}")]
    Usage(String),
    #[error("cannot start threads: {0}; set RAYON_NUM_THREADS to fewer, or raise the limit of processes (ulimit -u)")]
    Threads(String),
    #[error("cannot write to the standard output: {0}")]
    Output(std::io::Error),
    #[error("{0}: {1}")]
    System(&'static str, std::io::Error),
}

impl CommandError {
    fn exit(&self) -> Exit {
        match self {
            CommandError::Input(_) | CommandError::Assign(_) | CommandError::Plan(_) | CommandError::Usage(_) => {
                Exit::Usage
            }
            CommandError::Fit(FitError::Failed(_)) => Exit::Failed,
            CommandError::Workspace(WorkspaceError::Interrupted) => Exit::Interrupted,
            CommandError::Contact(ContactError::Interrupted) => Exit::Interrupted,
            CommandError::Contact(_) => Exit::Usage,
            CommandError::Fit(_) | CommandError::Control(_) | CommandError::Workspace(_) => Exit::Usage,
            CommandError::Sensitivity(error) if error.is_usage() => Exit::Usage,
            CommandError::Sweep(error) if error.is_usage() => Exit::Usage,
            CommandError::Results(error) if error.is_usage() => Exit::Usage,
            CommandError::View(error) if error.is_usage() => Exit::Usage,
            CommandError::Backend(BackendError::Unsupported { .. }) => Exit::Usage,
            CommandError::RunFigures(RunFiguresError::Colour { .. }) => Exit::Usage,
            CommandError::Report(ReportError::Extension { .. }) => Exit::Usage,
            _ => Exit::Failed,
        }
    }
}

/// Runs the program with these arguments, the first of them its name, and gives its exit code.
///
/// It belongs into a process of its own: it starts the threads of the engines, and listens for Ctrl-C.
pub fn main_with(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    #[cfg(feature = "stores")]
    rodsweep_stores::install();
    signals::outlive_file_limits();
    option_env!("RODSWEEP_COMMIT").into_iter().for_each(rodsweep::set_commit);
    let arguments = match help::parse(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            if !error.use_stderr() {
                let _ = error.print();
                return Exit::Done as u8;
            }
            // The message quotes the command line, which may hold control characters.
            say(error.render().to_string().trim_end());
            return Exit::Usage as u8;
        }
    };
    let result = start_threads().and_then(|()| command(arguments.command));
    match result {
        Ok(exit) => exit as u8,
        Err(CommandError::Output(error)) if error.kind() == std::io::ErrorKind::BrokenPipe => Exit::Done as u8,
        Err(error) => {
            say(&format!("error: {error}"));
            error.exit() as u8
        }
    }
}

/// Starts the threads of the engines; a system that refuses threads is reported here.
fn start_threads() -> Result<(), CommandError> {
    rayon::ThreadPoolBuilder::new().build_global().map_err(|error| CommandError::Threads(error.to_string()))
}

fn command(command: Command) -> Result<Exit, CommandError> {
    match command {
        Command::New(arguments) => new::new(&arguments),
        Command::Examples(arguments) => examples::examples(&arguments),
        Command::Check(arguments) => check::check(&arguments),
        Command::Parameters(arguments) => parameters::parameters(&arguments),
        Command::Run(arguments) => run::run(&arguments),
        Command::Solve(arguments) => solve::solve(&arguments),
        Command::Verify(arguments) => verify::verify(&arguments),
        Command::Bench(arguments) => bench::bench(&arguments),
        Command::Doctor => doctor::doctor(),
        Command::Status(arguments) => status::status(&arguments),
        Command::Submit(command) => submit::submit(&command),
        Command::Figures(arguments) => figures::figures(&arguments),
        Command::Merge(arguments) => merge::merge(&arguments),
        Command::Control(arguments) => control::control(&arguments),
        Command::Workspace(arguments) => workspace::workspace(&arguments),
        Command::Contact(arguments) => contact::contact(&arguments),
        Command::Fit(arguments) => fit::fit(&arguments),
        Command::Sensitivity(arguments) => sensitivity::sensitivity(&arguments),
        Command::View(arguments) => view::view(&arguments),
        Command::Import(arguments) => import::import(&arguments),
        Command::Completions { shell } => completions(shell),
        Command::Manual(arguments) => manual::manual(help::command(), &arguments),
        Command::Licenses => {
            print(rodsweep::NOTICES)?;
            Ok(Exit::Done)
        }
    }
}

fn completions(shell: clap_complete::Shell) -> Result<Exit, CommandError> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut help::command(), "rodsweep", &mut text);
    print(&String::from_utf8_lossy(&text))?;
    Ok(Exit::Done)
}

/// Writes to the standard output.
fn print(text: &str) -> Result<(), CommandError> {
    let mut out = std::io::stdout().lock();
    out.write_all(terminal(text).as_bytes()).and_then(|()| out.flush()).map_err(CommandError::Output)
}

/// Writes to the standard output line by line what is too long for memory.
fn print_lines(write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<(), CommandError> {
    let mut lines = Lines { out: std::io::BufWriter::new(std::io::stdout().lock()), line: Vec::new() };
    let written = write(&mut lines).and_then(|()| writeln!(lines)).and_then(|()| lines.flush());
    written.map_err(CommandError::Output)
}

/// Passes whole lines on, with the characters that a terminal obeys escaped.
struct Lines<W> {
    out: W,
    line: Vec<u8>,
}

impl<W: Write> Write for Lines<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        for part in bytes.split_inclusive(|byte| *byte == b'\n') {
            self.line.extend_from_slice(part);
            if part.ends_with(b"\n") {
                self.out.write_all(terminal(&String::from_utf8_lossy(&self.line)).as_bytes())?;
                self.line.clear();
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }
}

/// Writes a line to the standard error; a closed one is no reason to stop.
fn say(line: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{}", terminal(line));
}

/// Prints notes on unusual scenes.
fn say_notes(scene: &Scene) {
    scene_notes(scene).iter().for_each(|note| say(&format!("note: {note}")));
}
