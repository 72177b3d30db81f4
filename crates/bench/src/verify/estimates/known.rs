//! The rows of a run whose truth is known.

use super::truth::{ROWS, Truth};
use rodsweep::sweep::{Found, Memory, RowSink, RunEnd, RunHeader, SweepError};
use rodsweep::table::Table;
use std::collections::BTreeSet;

/// Keeps rows in memory. Samples without an answer to compare with count as there: each would be asked of every rung.
/// Its parts are single samples then.
pub struct KnownRows {
    /// Samples with an answer, in order.
    samples: Vec<usize>,
    unknown: BTreeSet<u64>,
    rows: Memory,
}

impl KnownRows {
    pub fn of(truth: &Truth) -> KnownRows {
        let (known, unknown): (Vec<u64>, _) =
            (0..ROWS).partition(|at| truth.solutions.status(*at as usize).is_success());
        let samples = known.into_iter().map(|at| at as usize).collect();
        KnownRows { samples, unknown: BTreeSet::from_iter(unknown), rows: Memory::new() }
    }

    /// Samples of a part.
    pub fn part_size(&self) -> u64 {
        if self.unknown.is_empty() { ROWS } else { 1 }
    }

    /// Samples with an answer, and their rows.
    pub fn into_rows(self) -> (Vec<usize>, Table) {
        (self.samples, self.rows.into_table())
    }
}

impl RowSink for KnownRows {
    fn open(&mut self, run: &RunHeader<'_>, seen: &mut dyn FnMut(&Table)) -> Result<Found, SweepError> {
        let mut found = self.rows.open(run, seen)?;
        found.done.clone_from(&self.unknown);
        Ok(found)
    }

    fn write(&mut self, part: u64, rows: &Table) -> Result<(), SweepError> {
        self.rows.write(part, rows)
    }

    fn close(&mut self, end: &RunEnd<'_>) -> Result<(), SweepError> {
        self.rows.close(end)
    }
}
