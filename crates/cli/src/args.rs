//! The arguments, as clap reads them.

pub use super::engine_args::EngineArguments;
pub use super::sensitivity_args::{EstimatorName, SensitivityArguments, WithName};
use super::share_args::{ShareArguments, StatusArguments, SubmitCommand};
use clap::{Args, Parser, Subcommand, ValueEnum};
use rodsweep::input::{Dimension, parse_quantity};
use std::path::PathBuf;

/// Batched parameter sweeps of magnetic catheters and other rod-like continuum robots.
#[derive(Debug, Parser)]
#[command(name = "rodsweep", version, propagate_version = true)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write a commented file to begin with: scene and sweep in one
    New(super::new::NewArguments),
    /// List the scenes and sweeps that the program brings along, or write one
    Examples(super::examples::ExamplesArguments),
    /// Tell everything that is wrong with a file, or what it is and what it costs
    Check(super::check::CheckArguments),
    /// List every number of a scene: name, value, unit, meaning
    Parameters(super::parameters::ParametersArguments),
    /// Solve a sweep and write its result directory
    Run(RunArguments),
    /// Solve one scene with its Jacobian
    Solve(SolveArguments),
    /// Check every engine against the reference on this machine
    Verify(VerifyArguments),
    /// Speed against error on this machine: raw data, figures, a report
    Bench(BenchArguments),
    /// Tell what this machine has and what would be used
    Doctor,
    /// Tell what of a run is done, failed and left, and who works on it
    Status(StatusArguments),
    /// Write the files by which a scheduler runs a sweep on many machines
    #[command(subcommand)]
    Submit(SubmitCommand),
    /// Draw the figures of a result directory again
    Figures {
        /// A result directory
        directory: PathBuf,
        /// Column that colours the tip cloud, for example stability.margin or coil.current.z
        #[arg(long, value_name = "COLUMN")]
        colour: Option<String>,
        /// Go on with rows that are not to be trusted; every figure says so
        #[arg(long)]
        accept_distrusted: bool,
    },
    /// Put the shards of one sweep together
    Merge {
        /// Result directories of the shards
        #[arg(required = true, value_name = "DIR")]
        directories: Vec<PathBuf>,
        /// Directory of the whole
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Exit with 0 although rows are not to be trusted
        #[arg(long)]
        accept_distrusted: bool,
    },
    /// Find the currents that drive the tip along a trajectory or to many targets
    Control(ControlArguments),
    /// Measure what can be reached: size with an error, boundary, dexterity
    Workspace(super::workspace_args::WorkspaceArguments),
    /// Fit rest curvature, stiffness and the like to observed shapes
    Fit(FitArguments),
    /// Find which input matters, how uncertain the tip is, and what to measure
    Sensitivity(SensitivityArguments),
    /// Show a rod that follows sliders, or the map of a result directory, in the browser
    View(super::view::ViewArguments),
    /// Make a scene of a catheter's parameter file, or a table of a play file
    Import(ImportArguments),
    /// Print licences and notices of the program and of everything that is built into it
    Licenses,
    /// Print a completion script for a shell
    Completions { shell: clap_complete::Shell },
}

#[derive(Debug, Args)]
pub struct RunArguments {
    /// Sweep file (TOML)
    pub sweep: PathBuf,
    /// Result directory [default: results/NAME-OF-THE-SWEEP]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub engine: EngineArguments,
    /// Solve part K of N only; `merge` puts the parts together
    #[arg(long, value_name = "K/N", default_value = "1/1")]
    pub shard: String,
    /// Go on with what the result directory holds
    #[arg(long)]
    pub resume: bool,
    /// Replace what an earlier run has left in the result directory; a file of somebody else stops it
    #[arg(long, conflicts_with_all = ["resume", "join", "dry_run"])]
    pub force: bool,
    #[command(flatten)]
    pub share: ShareArguments,
    /// Solve by the method (engine, precision, stepper, steps) of another result directory, such as another shard's
    #[arg(long, value_name = "DIR")]
    pub method_of: Option<PathBuf>,
    /// Follow the path from rest of every row a second time, by other steps; where two paths end apart the reference decides. Takes up to
    /// twice the time
    #[arg(long)]
    pub certain: bool,
    /// Say what would be done, and do nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Solve the first N samples only
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub limit: Option<u64>,
    /// Samples in a part [default: 65536, or 2048 where every equilibrium is wanted]; all shards and workers take the same
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub part_size: Option<u64>,
    /// No progress and no summary
    #[arg(long)]
    pub quiet: bool,
    /// Tell more: times of stages, processor seconds, anchors
    #[arg(long, conflicts_with = "quiet")]
    pub verbose: bool,
    /// Exit with 3 if more samples than this fail [default: as the sweep's allow_failures says]
    #[arg(long, value_name = "N")]
    pub max_failures: Option<u64>,
    /// Exit with 0 although rows are not to be trusted; what comes of them says so
    #[arg(long)]
    pub accept_distrusted: bool,
    /// Draw no figures
    #[arg(long)]
    pub no_figures: bool,
    /// Column that colours the tip cloud, for example stability.margin or coil.current.z
    #[arg(long, value_name = "COLUMN")]
    pub colour: Option<String>,
}

#[derive(Debug, Args)]
pub struct SolveArguments {
    /// Scene file (TOML)
    pub scene: PathBuf,
    /// Set a parameter, for example coil.current.x=0.2 or insertion="90 mm"
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Parameters to differentiate by, separated by commas; groups such as coil.current are welcome
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub wrt: Option<Vec<String>>,
    #[command(flatten)]
    pub engine: EngineArguments,
    /// Target error of tip position over rod length and of tip rotation (rad)
    #[arg(long, default_value_t = 1e-9)]
    pub tolerance: f64,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Print every equilibrium that can be found, lowest energy first
    #[arg(long)]
    pub all_branches: bool,
    /// Print the shape: a number of points, or arc lengths such as "10 mm, 20 mm"; derivatives with --json
    #[arg(long, value_name = "POINTS")]
    pub shape: Option<String>,
    /// Print the plan that the scene compiles to, with its operation count
    #[arg(long)]
    pub explain: bool,
    /// Draw the rod's shape (.png or .svg)
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// Overwrite what is there
    #[arg(long, requires = "plot")]
    pub force: bool,
}

#[derive(Debug, Args)]
pub struct VerifyArguments {
    /// The hard cases instead: folds, flips, many equilibria, extreme units
    #[arg(long, conflicts_with_all = ["samples", "seed"])]
    pub hard: bool,
    /// Look for disagreement instead: so many random scenes, with every combination of terms, on the CPU engine and on
    /// the reference; where they differ a third judge decides
    #[arg(long, value_name = "N", conflicts_with_all = ["hard", "samples"])]
    pub random: Option<u64>,
    /// These scenes with gradients, magnets and coils around the rod
    #[arg(long, requires = "random", conflicts_with_all = ["designs", "limp"])]
    pub varying_fields: bool,
    /// Catheters that people build in their place: tubes of real materials, sets of three windings, magnets
    #[arg(long, requires = "random", conflicts_with = "limp")]
    pub designs: bool,
    /// Limp and taut rods in their place
    #[arg(long, requires = "random")]
    pub limp: bool,
    /// Around each random scene a box of N samples, solved as a sweep
    #[arg(long, value_name = "N", requires = "random", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub around: Option<u64>,
    /// Number of the first random scene: to repeat one of them
    #[arg(long, value_name = "K", default_value_t = 0, requires = "random")]
    pub first: u64,
    /// Look for rows that are off by more than their estimates instead: random sweeps of N rods, with short tapers and kinks,
    /// on the CPU engine at loose and at tight tolerances, against grids that are refined until they agree
    #[arg(long, requires = "random", conflicts_with_all = ["around", "judge", "first"])]
    pub estimates: bool,
    /// Ask the judge about every random scene, not only where engine and reference differ
    #[arg(long, requires = "random")]
    pub judge: bool,
    /// Engines that solve random scenes: the CPU, or a GPU beside it. Without --random, `gpu` checks a GPU that is software, too
    #[arg(long, value_enum)]
    pub backend: Option<VerifyBackend>,
    /// Check a GPU that is software, too, which takes minutes
    #[arg(long, conflicts_with = "random")]
    pub software: bool,
    /// Random scenes beside the built-in ones
    #[arg(long, value_name = "N", default_value_t = 200)]
    pub samples: usize,
    /// Seed of the random scenes [default: 1, with --random a new one, which is printed]
    #[arg(long)]
    pub seed: Option<u64>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Where the worst sample of a row beyond its limit is written, as a scene
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
}

/// Engines of `verify`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum VerifyBackend {
    Cpu,
    Gpu,
}

#[derive(Debug, Args)]
pub struct BenchArguments {
    /// Less of everything, in less than a minute
    #[arg(long)]
    pub quick: bool,
    /// Parts or scenes, separated by commas [default: all]; a wrong name prints the list
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Engines that are measured
    #[arg(long, value_enum, default_value = "all", conflicts_with_all = ["paper", "render"])]
    pub backend: BenchBackend,
    /// Directory of bench files (TOML) [default: those of sweeps/bench, built in]
    #[arg(long, value_name = "DIR")]
    pub files: Option<PathBuf>,
    /// Where the report is written [default: sweeps/reports/DATE-DEVICE]; with --paper, where paper.csv and paper.md are
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Overwrite a report that is there
    #[arg(long)]
    pub force: bool,
    /// Measure nothing: write the report and the figures of a directory again, from its raw.csv and manifest.json
    #[arg(long, value_name = "DIR", conflicts_with_all = ["quick", "only", "files", "out", "force", "paper"])]
    pub render: Option<PathBuf>,
    /// The paper's comparison: its analytic Jacobian, finite differences and a chain of links, beside the CPU engine
    #[arg(long, conflicts_with_all = ["quick", "only", "files", "force"])]
    pub paper: bool,
    /// Scene file (TOML), with --paper [default: sweeps/scenes/p6.toml, built in]
    #[arg(long, value_name = "FILE", requires = "paper")]
    pub scene: Option<PathBuf>,
    /// Random configurations, with --paper
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = some, requires = "paper")]
    pub samples: usize,
    /// How often each is timed, with --paper
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = some, requires = "paper")]
    pub repeats: usize,
    /// Seed of the configurations, with --paper
    #[arg(long, default_value_t = 1, requires = "paper")]
    pub seed: u64,
    /// Print JSON, with --paper
    #[arg(long, requires = "paper")]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BenchBackend {
    All,
    Cpu,
    Gpu,
}

/// More would take days.
const MOST: usize = 100_000;

fn some(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(number @ 1..=MOST) => Ok(number),
        _ => Err(format!("give a number from 1 to {MOST}")),
    }
}

/// A length (m) that an argument must give; `example` is one.
pub fn positive_length(flag: &str, text: &str, example: &str) -> Result<f64, String> {
    positive(flag, text, ("m", "length"), example)
}

/// An angle (rad) that an argument must give; `example` is one.
pub fn positive_angle(flag: &str, text: &str, example: &str) -> Result<f64, String> {
    positive(flag, text, ("rad", "angle"), example)
}

fn positive(flag: &str, text: &str, (unit, what): (&'static str, &str), example: &str) -> Result<f64, String> {
    let wrong = |why: String| format!("`{flag} {text}`: {why}");
    let value = parse_quantity(text, Dimension::of(unit)).map_err(|error| wrong(error.to_string()))?;
    if value > 0.0 { Ok(value) } else { Err(wrong(format!("give a positive {what}, such as \"{example}\""))) }
}

#[derive(Debug, Args)]
pub struct ImportArguments {
    /// Parameter file (lines such as `CatheterConfig F A F`) or play file (lines `channel,mA,ms`)
    pub file: PathBuf,
    /// Where the scene or table is written [default: NAME-OF-THE-FILE.toml or .csv, here]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Overwrite what is there
    #[arg(long)]
    pub force: bool,
    /// Spatial configuration with field, gravity and base pose, for a parameter file
    #[arg(long, value_name = "FILE")]
    pub spatial: Option<PathBuf>,
    /// Segment that channels 1 to 3 of a play file drive, and 4 to 6 [default: coil; coil_1,coil_2]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub coil: Vec<String>,
    /// Change the sign of a play file's axial currents
    #[arg(long)]
    pub negate_axial: bool,
}

#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("where").required(true).args(["trajectory", "targets", "experiment", "replay"]))]
pub struct ControlArguments {
    /// Scene file (TOML)
    pub scene: PathBuf,
    /// Trajectory (TOML), or its points (CSV or Parquet with columns x, y, z, tx, ty, tz)
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
    /// Coordinates of the tip that are controlled; the others are free [default: those given]
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

#[derive(Debug, Args)]
pub struct FitArguments {
    /// Scene to start from (TOML)
    pub scene: PathBuf,
    /// Observed points (CSV or Parquet): x, y, z; s, the arc length, empty for the tip; known parameters such as
    /// coil.current.x. Rows with the same known values are one shape
    pub shapes: PathBuf,
    /// What is fitted, separated by commas; names joined by + keep their ratio [default: rest curvature about x and y]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub free: Option<Vec<String>>,
    /// Standard deviation of an observed coordinate, such as "0.2 mm" [default: estimated from the residuals]
    #[arg(long, value_name = "LENGTH")]
    pub noise: Option<String>,
    /// Where the scene with the fitted values is written
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Overwrite what is there
    #[arg(long)]
    pub force: bool,
    /// Draw observed points and fitted shapes (.png or .svg)
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// Exit with 0 although the reference contradicts fitted rods; what is drawn says so
    #[arg(long)]
    pub accept_distrusted: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}
