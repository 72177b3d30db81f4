//! The arguments of `rodsweep sensitivity`.

use super::engine_args::EngineArguments;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct SensitivityArguments {
    /// A result directory, or a sweep file (TOML): it is run first, with the derivatives that are needed
    #[arg(value_name = "DIR|SWEEP")]
    pub source: PathBuf,
    /// Where the files are written [default: the result directory, or results/NAME-OF-THE-SWEEP]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Outputs: columns, vectors such as tip.position, tip.distance, tip.pose, shape, shape:20 (points along the rod)
    /// [default: tip.position,tip.distance,stability.margin]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub outputs: Vec<String>,
    /// Inputs that are told of [default: every axis]; with --noise what is to be found, names joined by + keep their
    /// ratio [default: what is uncertain, else what has derivatives and is no axis]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub inputs: Vec<String>,
    /// Estimator that is read first
    #[arg(long, value_enum, default_value = "auto")]
    pub estimator: EstimatorName,
    /// Confidence level of the intervals
    #[arg(long, value_name = "SHARE", default_value_t = 0.95)]
    pub confidence: f64,
    /// Largest total degree of polynomials, 1 to 4
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub degree: usize,
    /// Take rows that are otherwise left out
    #[arg(long, value_enum, value_name = "ROWS")]
    pub with: Option<WithName>,
    /// Insist on the first order beside the rows: fail where there is none
    #[arg(long)]
    pub propagate: bool,
    /// Choose N rows as measurements of the tip
    #[arg(long, value_name = "N", requires = "noise")]
    pub choose: Option<usize>,
    /// Standard deviation of a measured coordinate, such as "0.5 mm": what all rows would tell
    #[arg(long, value_name = "LENGTH")]
    pub noise: Option<String>,
    /// Measure the tip's tangent, too: standard deviation about either axis across it, such as "2 deg"
    #[arg(long, value_name = "ANGLE", requires = "noise")]
    pub tangent_noise: Option<String>,
    /// Least stability margin of a measurement, and the limit of the indicator of low margins
    #[arg(long, value_name = "MARGIN", default_value_t = 0.3)]
    pub minimum_margin: f64,
    #[command(flatten)]
    pub engine: EngineArguments,
    /// Run the first N samples of a sweep only
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub limit: Option<u64>,
    /// Go on with rows that are not to be trusted; what comes of them says so
    #[arg(long)]
    pub accept_distrusted: bool,
    /// Exit with 3 if more rows than this fail [default: any number may]
    #[arg(long, value_name = "N")]
    pub max_failures: Option<u64>,
    /// Draw no figures
    #[arg(long)]
    pub no_figures: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Replace what an earlier run of another sweep has left in the directory of a sweep; a file of somebody else stops it
    #[arg(long)]
    pub force: bool,
    /// Tell more of the run: times of stages, processor seconds, anchors
    #[arg(long, conflicts_with = "quiet")]
    pub verbose: bool,
    /// Only the headline: no progress, no summary, no tables
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EstimatorName {
    /// Chosen to suit the design
    Auto,
    /// Azzini, Mara, Rosati; of a saltelli design
    Azzini,
    /// Jansen; of a saltelli design
    Jansen,
    /// Saltelli 2010; of a saltelli design
    Saltelli,
    /// Janon; of a saltelli design
    Janon,
    /// Polynomials of values and slopes
    Chaos,
    /// Cosines of values and slopes, first order only
    Slopes,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WithName {
    /// Unstable equilibria
    Unstable,
}
