//! The links of the chain: which engine is compared with which, within which limits.

use super::cases::Case;
use super::compare::{Differences, Largest, Limits};
use super::engines::Run;
use super::replay::write_scene_file;
use crate::error::BenchError;
use rodsweep::backend::Precision;
use std::path::{Path, PathBuf};

/// Limits of an f64 engine: its steps and round-off leave less.
pub const F64: Limits = Limits { pose: 1e-9, moment: 1e-9, derivative: 1e-9, small_column: 1e-3 };
/// Limits of an f32 engine: round-off of 6e-8 over some hundred stages. Small columns are measured against their
/// natural size, for f32 has no digits left for what almost cancels.
pub const F32: Limits = Limits { pose: 2e-5, moment: 2e-5, derivative: 3e-5, small_column: 1.0 };

/// A line of the table: an engine, and what it is compared with.
#[derive(Clone, Copy)]
pub struct Link {
    pub run: usize,
    pub against: Option<usize>,
    /// What a difference would come from.
    pub cause: &'static str,
}

/// A link, measured.
pub struct Row {
    pub link: Link,
    pub limits: Limits,
    pub differences: Differences,
    pub case_count: usize,
    pub sample_count: usize,
    pub converged: usize,
    /// Where the worst sample was written, if it is beyond its limit.
    pub replay: Option<PathBuf>,
}

impl Row {
    /// Compares the runs that a link names.
    pub fn new(link: Link, runs: &[Run], cases: &[Case]) -> Row {
        let run = &runs[link.run];
        let limits = match run.setup.precision {
            Precision::F64 => F64,
            Precision::F32 => F32,
        };
        let mut row = Row {
            limits,
            differences: Differences::default(),
            case_count: 0,
            sample_count: 0,
            converged: 0,
            replay: None,
            link,
        };
        for (index, (case, found)) in cases.iter().zip(&run.solutions).enumerate() {
            let Some(found) = found else { continue };
            row.case_count += 1;
            row.sample_count += case.sample_count();
            row.converged += (0..case.sample_count()).filter(|sample| found.status(*sample).is_success()).count();
            if let Some(expected) = row.link.against.and_then(|against| runs[against].solutions[index].as_ref()) {
                row.differences.add(index, case, found, expected, &limits);
            }
        }
        row
    }

    /// Whether all differences are within their limits.
    pub fn is_within(&self, runs: &[Run]) -> bool {
        runs[self.link.run].failed.is_none() && self.differences.offender(&self.limits).is_none()
    }

    /// In a word; none for what is not compared.
    pub fn verdict(&self, runs: &[Run]) -> &'static str {
        let run = &runs[self.link.run];
        match (&run.failed, &run.skipped, self.sample_count, self.link.against) {
            (Some(_), ..) => "FAILED",
            (_, Some(_), 0, _) => "skipped",
            (.., None) => "",
            _ if self.is_within(runs) => "ok",
            _ => "BEYOND",
        }
    }

    /// By what the worst derivative is taken.
    pub fn worst_parameter(&self, cases: &[Case]) -> Option<String> {
        let Largest { case, column, error, .. } = self.differences.derivative;
        let derivative = cases[case].plan.derivatives.get(column).filter(|_| error > 0.0);
        derivative.map(|derivative| derivative.name.clone())
    }

    /// None where nothing was solved.
    pub fn seconds_per_sample(&self, runs: &[Run]) -> Option<f64> {
        (self.sample_count > 0).then(|| runs[self.link.run].seconds / self.sample_count as f64)
    }

    /// Writes the worst sample, if it is beyond its limit, as a scene that can be solved alone.
    pub fn write_replay(&mut self, runs: &[Run], cases: &[Case], directory: &Path) -> Result<(), BenchError> {
        let (Some(against), Some((case, sample))) = (self.link.against, self.differences.offender(&self.limits)) else {
            return Ok(());
        };
        let name = format!("verify-{}-against-{}.toml", runs[self.link.run].setup.name(), runs[against].setup.name());
        let path = directory.join(name.replace(' ', "-"));
        write_scene_file(&path, &cases[case].scene(sample))?;
        self.replay = Some(path);
        Ok(())
    }
}
