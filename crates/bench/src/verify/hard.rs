//! Every engine on cases where a wrong answer is easily found.

use super::replay::write_scene_file;
use crate::error::BenchError;
use crate::hard::{Answer, Case, Outcome, Setup, Verdict, cases};
use rodsweep::backend::{BackendError, BackendKind};
use rodsweep::gpu::adapters;
use std::path::Path;

/// What one engine made of all cases, in order.
pub struct Column {
    pub setup: Setup,
    pub cells: Vec<Cell>,
}

pub enum Cell {
    Solved(Outcome),
    /// Why it could not be had.
    Skipped(String),
    /// Why it broke down.
    Failed(String),
}

/// What every engine made of the hard cases.
pub struct HardCases {
    pub(super) cases: Vec<Case>,
    pub(super) columns: Vec<Column>,
}

/// Solves the hard cases on every engine, on a GPU that is software only where it is wanted; `progress` is told what
/// takes long.
pub fn verify_hard(software: bool, progress: &mut dyn FnMut(&str)) -> HardCases {
    let cases = cases();
    let answers: Vec<Answer> = cases.iter().map(Case::answer).collect();
    let mut setups = vec![Setup::REFERENCE, Setup::CPU_F64, Setup::CPU_F32, Setup::GPU_F32];
    if adapters().first().is_some_and(|adapter| adapter.has_f64) {
        setups.push(Setup::GPU_F64);
    }
    let skipped = super::software_gpu(software);
    let columns = setups.into_iter().map(|setup| match skipped.as_ref().filter(|_| setup.kind == BackendKind::Gpu) {
        Some(reason) => Column { setup, cells: cases.iter().map(|_| Cell::Skipped(reason.clone())).collect() },
        None => column(setup, &cases, &answers, progress),
    });
    let columns = columns.collect();
    HardCases { cases, columns }
}

impl HardCases {
    /// Whether no engine has a wrong answer or broke down.
    pub fn is_right(&self) -> bool {
        self.columns.iter().all(Column::is_right)
    }

    /// Whether an engine could not be had; a case may need more steps than a driver runs.
    pub fn is_any_skipped(&self) -> bool {
        let is_skipped = |column: &Column| column.cells.iter().all(|cell| matches!(cell, Cell::Skipped(_)));
        self.columns.iter().any(is_skipped)
    }

    /// Writes the scenes with wrong answers into a directory, and tells each.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn write_wrong(&self, directory: &Path, tell: &mut dyn FnMut(&str)) -> Result<(), BenchError> {
        for column in &self.columns {
            for case in column.wrong().map(|index| &self.cases[index]) {
                let path = directory.join(format!("verify-hard-{}.toml", case.name()));
                write_scene_file(&path, &case.scene)?;
                let engine = column.setup.name();
                tell(&format!("WRONG: {engine} in {}; replay: {}", case.name(), path.display()));
            }
        }
        Ok(())
    }
}

fn column(setup: Setup, cases: &[Case], answers: &[Answer], progress: &mut dyn FnMut(&str)) -> Column {
    let mut no_device = None;
    let cell = |(case, answer): (&Case, &Answer)| {
        if let Some(reason) = &no_device {
            return Cell::Skipped(String::clone(reason));
        }
        if setup.kind == BackendKind::Gpu {
            // Compiling may take a while on a software adapter.
            progress(&format!("{}: {}", setup.name(), case.name()));
        }
        match setup.solve(case, answer, |plan| setup.engine().make(plan)) {
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
    /// Whether it broke down nowhere and has no wrong answer.
    pub fn is_right(&self) -> bool {
        let is_failed = |cell: &Cell| matches!(cell, Cell::Failed(_));
        !self.cells.iter().any(is_failed) && self.wrong().next().is_none()
    }

    /// Indices of the cases with a wrong answer.
    fn wrong(&self) -> impl Iterator<Item = usize> {
        let is_wrong = |cell: &Cell| matches!(cell, Cell::Solved(Outcome { verdict: Verdict::Wrong, .. }));
        self.cells.iter().enumerate().filter(move |(_, cell)| is_wrong(cell)).map(|(index, _)| index)
    }
}
