//! `rodsweep verify --hard`: every engine on cases where a wrong answer is easily found.

mod show;
pub mod suite;

use super::{Exit, engine};
use crate::cli::args::VerifyArguments;
use crate::cli::{BenchError, print, say};
use rodsweep::backend::{BackendError, BackendKind};
use rodsweep::gpu::adapters;
use rodsweep::sweep::write_scene;
use suite::{Answer, Case, Outcome, Setup, Verdict};

/// What one engine made of all cases, in order.
struct Column {
    setup: Setup,
    cells: Vec<Cell>,
}

enum Cell {
    Solved(Outcome),
    /// Why.
    Skipped(String),
    /// Why.
    Failed(String),
}

pub fn verify_hard(arguments: &VerifyArguments) -> Result<Exit, BenchError> {
    let cases = suite::cases();
    let answers: Vec<Answer> = cases.iter().map(Case::answer).collect();
    let mut setups = vec![Setup::REFERENCE, Setup::CPU_F64, Setup::CPU_F32, Setup::GPU_F32];
    if adapters().first().is_some_and(|adapter| adapter.has_f64) {
        setups.push(Setup::GPU_F64);
    }
    let columns: Vec<Column> = setups.into_iter().map(|setup| column(setup, &cases, &answers)).collect();
    let text = if arguments.json { show::json_text(&cases, &columns) } else { show::describe(&cases, &columns) };
    print(&text)?;
    for column in &columns {
        write_wrong(column, &cases, &arguments.out)?;
    }
    let required = std::env::var("RODSWEEP_GPU").is_ok_and(|value| value == "require");
    // A case may need more steps than a driver runs.
    let is_skipped = |column: &Column| column.cells.iter().all(|cell| matches!(cell, Cell::Skipped(_)));
    let skipped = columns.iter().any(is_skipped);
    if required && skipped {
        say("error: an engine was skipped, and RODSWEEP_GPU=require asks for all; install a driver or unset it");
    }
    let good = columns.iter().all(Column::is_right) && !(required && skipped);
    Ok(if good { Exit::Done } else { Exit::Failed })
}

fn column(setup: Setup, cases: &[Case], answers: &[Answer]) -> Column {
    let mut no_device = None;
    let cell = |(case, answer): (&Case, &Answer)| {
        if let Some(reason) = &no_device {
            return Cell::Skipped(String::clone(reason));
        }
        if setup.kind == BackendKind::Gpu {
            // Compiling may take a while on a software adapter.
            say(&format!("{}: {}", setup.name(), case.name()));
        }
        match setup.solve(case, answer, |plan| engine(setup.kind, setup.precision).make(plan)) {
            Ok(outcome) => Cell::Solved(outcome),
            Err(error @ (BackendError::DeviceFailed { .. } | BackendError::OutOfMemory { .. })) => {
                Cell::Failed(error.to_string())
            }
            Err(error @ BackendError::Unsupported { .. }) => Cell::Skipped(error.to_string()),
            Err(error @ BackendError::NoDevice { .. }) => {
                no_device = Some(error.to_string());
                Cell::Skipped(error.to_string())
            }
        }
    };
    Column { setup, cells: cases.iter().zip(answers).map(cell).collect() }
}

impl Column {
    fn is_right(&self) -> bool {
        let is_failed = |cell: &Cell| matches!(cell, Cell::Failed(_));
        !self.cells.iter().any(is_failed) && self.wrong().next().is_none()
    }

    /// Indices of the cases with a wrong answer.
    fn wrong(&self) -> impl Iterator<Item = usize> {
        let is_wrong = |cell: &Cell| matches!(cell, Cell::Solved(Outcome { verdict: Verdict::Wrong, .. }));
        self.cells.iter().enumerate().filter(move |(_, cell)| is_wrong(cell)).map(|(index, _)| index)
    }
}

/// Writes the scenes with wrong answers, for `solve`.
fn write_wrong(column: &Column, cases: &[Case], out: &std::path::Path) -> Result<(), BenchError> {
    for index in column.wrong() {
        let path = out.join(format!("verify-hard-{}.toml", cases[index].name()));
        let written =
            std::fs::create_dir_all(out).and_then(|()| std::fs::write(&path, write_scene(&cases[index].scene)));
        written
            .map_err(|error| BenchError::Usage(format!("cannot write {}: {error}; choose --out", path.display())))?;
        say(&format!("WRONG: {} in {}; replay: {}", column.setup.name(), cases[index].name(), path.display()));
    }
    Ok(())
}
