//! The arguments of `control`, the job that they make, and the directory of its output.

use super::engine_args::EngineArguments;
use super::flags::{self, positive_length, some};
use super::{CommandError, say};
use clap::{Args, ValueEnum};
use rodsweep::input::parse_coordinates;
use rodsweep::model::{Scene, short_name};
use rodsweep::results::{ResultsError, make_directory};
use rodsweep::spec::Redundancy;
use rodsweep::study::{ControlEvent, ControlJob};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("where").required(true).args(["trajectory", "targets", "experiment", "replay"]))]
pub struct ControlArguments {
    /// Scene file (TOML)
    pub scene: PathBuf,
    /// Trajectory (TOML), or its points (CSV or Parquet with columns x, y, z, tx, ty, tz, normal_force)
    pub trajectory: Option<PathBuf>,
    /// Targets in no particular order, all solved together (CSV or Parquet, the same columns)
    #[arg(long, value_name = "FILE")]
    pub targets: Option<PathBuf>,
    /// The paper's experiment, simulated: the four shipped trajectories on catheters that differ from the scene
    #[arg(long)]
    pub experiment: bool,
    /// Play recorded currents through the model instead (CSV or Parquet, columns such as coil.current.x)
    #[arg(long, value_name = "FILE")]
    pub replay: Option<PathBuf>,
    /// Observed tips to compare with (CSV or Parquet: x, y, z; point, the row of the currents from 0, unless in order)
    #[arg(long, value_name = "FILE", requires = "replay", conflicts_with_all = ["trajectory", "targets", "experiment"])]
    pub observed: Option<PathBuf>,
    /// Result directory [default: results/control-NAME]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Overwrite what is there
    #[arg(long)]
    pub force: bool,
    /// Format of the table
    #[arg(long, value_enum, default_value = "csv")]
    pub format: TableFormat,
    /// What is commanded and its limits: coil.current=0.3 (both signs), or "insertion=85 mm..100 mm"
    #[arg(long = "input", value_name = "NAME=LIMITS")]
    pub input: Vec<String>,
    /// Controlled coordinates: x, y, z of the tip, normal_force on the scene's wall; the others are free [default: those given]
    #[arg(long, value_name = "x,y,z", value_delimiter = ',')]
    pub coordinates: Option<Vec<String>>,
    /// What may be left of a target, for example "0.1 um" [default: 10 nm]
    #[arg(long, value_name = "LENGTH")]
    pub tolerance: Option<String>,
    /// What becomes of currents that the tip does not need
    #[arg(long, value_enum)]
    pub redundancy: Option<RedundancyName>,
    #[command(flatten)]
    pub engine: EngineArguments,
    /// Play the currents on simulated catheters that differ from the scene: ten trials, errors, repeatability
    #[arg(long, conflicts_with_all = ["targets", "experiment", "replay"])]
    pub simulate: bool,
    /// Simulated catheters of the experiment
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = some)]
    pub catheters: usize,
    /// Seed of the first simulated catheter
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Exit with 3 if more targets than this are not reached [default: any number may]
    #[arg(long, value_name = "N")]
    pub max_failures: Option<u64>,
    /// Exit with 0 although the reference contradicts results; what comes of them says so
    #[arg(long)]
    pub accept_distrusted: bool,
    /// Draw no figures
    #[arg(long)]
    pub no_figures: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TableFormat {
    Csv,
    Parquet,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RedundancyName {
    /// They change as little as possible
    LeastChange,
    /// They relax towards zero: less heat
    LeastCurrent,
}

/// The job that the arguments describe.
pub fn job(scene: Scene, arguments: &ControlArguments) -> Result<ControlJob, CommandError> {
    let mut job = ControlJob::new(scene).engine(arguments.engine.request()).on_event(say_event);
    for text in &arguments.input {
        job =
            job.input(text).map_err(|error| CommandError::Usage(format!("`--input {}`: {error}", short_name(text))))?;
    }
    if let Some(names) = &arguments.coordinates {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let coordinates = parse_coordinates(&names);
        let wrong = |error| CommandError::Usage(format!("`--coordinates`: {error}"));
        job = job.coordinates(coordinates.map_err(wrong)?);
    }
    if let Some(text) = &arguments.tolerance {
        job = job.tolerance(positive_length("--tolerance", text, "0.1 um").map_err(CommandError::Usage)?);
    }
    match arguments.redundancy {
        Some(RedundancyName::LeastChange) => job = job.redundancy(Redundancy::LeastChange),
        Some(RedundancyName::LeastCurrent) => job = job.redundancy(Redundancy::LeastCurrent),
        None => {}
    }
    Ok(job)
}

fn say_event(event: &ControlEvent) {
    match event {
        ControlEvent::EveryCurrent { limit } => {
            say(&format!("note: every current is commanded, within ±{limit} A; `--input` says otherwise"));
        }
        ControlEvent::Ended { ended, targets } => say(&format!("{ended} of {targets} targets ended")),
        ControlEvent::Played { name } => say(&format!("{name}: played")),
        _ => {}
    }
}

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
        flags::refuse_to_overwrite(&table, arguments.force, "directory with `--out`")?;
        Ok(Outputs { dir, table })
    }

    pub fn make_directory(&self) -> Result<(), ResultsError> {
        make_directory(&self.dir)
    }
}
