//! Where `rodsweep control` writes, and the summary that it prints.

use super::args::{ControlArguments, TableFormat};
use super::{CommandError, say};
use rodsweep::report::{count, engineering};
use rodsweep::results::ResultsError;
use rodsweep::spec::Redundancy;
use rodsweep::study::{ControlRun, ControlSummary};
use std::path::PathBuf;

/// Where results go.
pub struct Outputs {
    pub dir: PathBuf,
    pub table: PathBuf,
}

impl Outputs {
    /// Refuses to overwrite, before anything is solved: `results/NAME/TABLE.csv`, unless told otherwise.
    pub fn new(arguments: &ControlArguments, name: &str, table: &str) -> Result<Outputs, CommandError> {
        let default = || PathBuf::from("results").join(name);
        let dir = arguments.out.clone().unwrap_or_else(default);
        let table = dir.join(match arguments.format {
            TableFormat::Csv => format!("{table}.csv"),
            TableFormat::Parquet => format!("{table}.parquet"),
        });
        if table.exists() && !arguments.force {
            return Err(CommandError::Usage(format!(
                "{} is already there: overwrite it with `--force`, or choose another directory with `--out`",
                table.display()
            )));
        }
        Ok(Outputs { dir, table })
    }

    pub fn make_directory(&self) -> Result<(), ResultsError> {
        let io = |error: std::io::Error| ResultsError::Io {
            path: self.dir.clone(),
            action: "making the directory",
            reason: error.to_string(),
        };
        std::fs::create_dir_all(&self.dir).map_err(io)
    }
}

pub fn say_summary(run: &ControlRun) {
    let summary = run.summary();
    let words: Vec<String> = summary
        .counts
        .iter()
        .map(|(outcome, number)| format!("{} {}", count(*number as u64), outcome.name()))
        .collect();
    say(&format!("{} targets on {}: {}", count(run.results().len() as u64), run.engine(), words.join(", ")));
    say(&format!(
        "tip error where reached: at most {} m; of the integration about {} m; least stability margin {:.3}",
        engineering(summary.largest_error),
        engineering(summary.largest_integration_error),
        summary.least_margin
    ));
    if let Some(worst) = summary.farthest_missed {
        say(&format!("where not reached the nearest permitted points are given; the farthest is off by {worst:.3e} m"));
    }
    if summary.not_from_rest > 0 {
        let others = summary.not_from_rest;
        say(&format!("warning: {others} equilibria are not those that the loads lead to from rest (column from_rest)"));
    }
    say_times(run, &summary);
}

/// A step is an equilibrium with its Jacobian and what becomes of the inputs.
fn say_times(run: &ControlRun, summary: &ControlSummary) {
    let mut text = format!("time: {:.2} steps a target (equilibrium, Jacobian, update), ", summary.steps_a_target);
    if run.is_in_order() {
        let each = summary.median_seconds_a_step;
        let how = match run.options().redundancy {
            Redundancy::LeastCurrent => "one target after another",
            _ => "several targets together where one follows from another",
        };
        text += &format!("each {:.1} us (median; one thread, {how})", 1e6 * each);
    } else {
        text += &format!("each {:.1} us (mean; in batches, all threads)", 1e6 * summary.mean_seconds_a_step);
    }
    if let Some(alone) = run.seconds_of_a_lone_step() {
        text += &format!("; {:.1} us where a target is known when the last is reached", 1e6 * alone);
    }
    say(&text);
}
