//! `rodsweep sensitivity`: which input matters, how uncertain the tip is, what to measure.

use super::engine_args::EngineArguments;
use super::flags::{positive_angle, positive_length};
use super::{CommandError, Exit, print, run, say, verdict};
use clap::{Args, ValueEnum};
use rodsweep::figures::draw_sensitivity;
use rodsweep::model::Parameter;
use rodsweep::results::{Results, is_place, make_directory};
use rodsweep::spec::SweepSpec;
use rodsweep::study::sensitivity::{Estimator, EstimatorChoice, Sensitivity, SensitivityJob};
use std::path::{Path, PathBuf};

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

pub fn sensitivity(arguments: &SensitivityArguments) -> Result<Exit, CommandError> {
    let tell = |line: &str| {
        if !arguments.quiet {
            say(line);
        }
    };
    let (job, out) = if is_place(&arguments.source) {
        let results = Results::open(&arguments.source)?;
        if let Some(exit) = verdict::of_results(&results, arguments.accept_distrusted)? {
            return Ok(exit);
        }
        let job = with_options(SensitivityJob::of_results(results), arguments)?;
        (job, arguments.out.clone().unwrap_or_else(|| arguments.source.clone()))
    } else {
        let spec = SweepSpec::read(&arguments.source)?;
        let usual = run::default_directory(&spec);
        let job = with_options(SensitivityJob::of_sweep(spec), arguments)?;
        job.check()?;
        let rows = match arguments.out {
            Some(_) => Rows::Missing,
            None => rows_of_a_run(&job.sweep(), arguments, &usual),
        };
        let out = match rows {
            Rows::Missing => arguments.out.clone().unwrap_or(usual),
            Rows::Enough => {
                tell(&format!("rows: those of {}", usual.display()));
                let results = Results::open(&usual)?;
                if let Some(exit) = verdict::of_results(&results, arguments.accept_distrusted)? {
                    return Ok(exit);
                }
                return finish(&with_options(SensitivityJob::of_results(results), arguments)?, &usual, arguments);
            }
            Rows::Lack(what) => {
                let beside = beside(&usual);
                tell(&format!("note: {} lacks {what}; solving into {}", usual.display(), beside.display()));
                beside
            }
        };
        let SensitivityArguments { ref engine, limit, force, quiet, verbose, accept_distrusted, .. } = *arguments;
        let needed = run::StudyRun { engine, limit, force, quiet, verbose, accept_distrusted };
        if let Some(exit) = run::run_for_study(job.sweep(), needed, &out)? {
            return Ok(exit);
        }
        (job.with_results(Results::open(&out)?), out)
    };
    finish(&job, &out, arguments)
}

/// What the run of a sweep has for a study of it.
enum Rows {
    /// There is no run of this sweep.
    Missing,
    /// Every row and every column.
    Enough,
    /// The same samples without some columns, or not all of the samples.
    Lack(String),
}

/// Looks whether a directory holds the rows of a sweep that a study needs.
fn rows_of_a_run(needed: &SweepSpec, arguments: &SensitivityArguments, directory: &Path) -> Rows {
    let Ok(results) = Results::open(directory) else { return Rows::Missing };
    let there = results.spec();
    // The engine may hold a run to a coarser tolerance; which columns are written changes no row.
    let SweepSpec { wrt, quantities, single_derivatives, format, rows_in_folder, tolerance, .. } = there.clone();
    let same = SweepSpec { wrt, quantities, single_derivatives, format, rows_in_folder, tolerance, ..needed.clone() };
    if same.to_toml() != there.to_toml() || needed.table != there.table {
        return Rows::Missing;
    }
    let name = |parameter: &Parameter| parameter.name(&there.scene);
    let columns: Vec<String> = needed.wrt.iter().filter(|wanted| !there.wrt.contains(wanted)).map(name).collect();
    let quantities: Vec<&str> =
        needed.quantities.iter().filter(|wanted| !there.quantities.contains(wanted)).map(|q| q.name()).collect();
    let samples = arguments.limit.unwrap_or(u64::MAX).min(needed.sample_count);
    let is_whole =
        results.record().sample_count == samples && results.status().is_ok_and(|status| status.is_complete());
    match () {
        () if !results.has_rows() => Rows::Lack("rows".into()),
        () if !columns.is_empty() => Rows::Lack(format!("derivatives by {}", columns.join(", "))),
        () if !quantities.is_empty() => Rows::Lack(quantities.join(", ")),
        () if !is_whole => Rows::Lack("some of the samples".into()),
        () => Rows::Enough,
    }
}

/// `results/NAME-sensitivity` beside `results/NAME`.
fn beside(directory: &Path) -> PathBuf {
    let name = directory.file_name().unwrap_or_default().to_string_lossy();
    directory.with_file_name(format!("{name}-sensitivity"))
}

/// Finds everything, writes and prints it.
fn finish(job: &SensitivityJob, out: &Path, arguments: &SensitivityArguments) -> Result<Exit, CommandError> {
    let tell = |line: &str| {
        if !arguments.quiet {
            say(line);
        }
    };
    let found = job.run()?;
    let mut files = Vec::new();
    // `--json` of results that are there reads them only, unless a place for files is named.
    if !arguments.json || arguments.out.is_some() || !is_place(&arguments.source) {
        make_directory(out)?;
        files = found.write(out)?;
        if !arguments.no_figures {
            let drawn = draw_sensitivity(&found, out)?;
            drawn.left_out.iter().for_each(|note| tell(&format!("note: {note}")));
            files.extend(drawn);
        }
    }
    if arguments.json {
        print(&(serde_json::to_string_pretty(&found.to_json()).unwrap_or_default() + "\n"))?;
    } else if arguments.quiet {
        print(&(found.headline() + "\n"))?;
    } else {
        print(&found.text())?;
    }
    files.iter().for_each(|file| tell(&format!("written: {}", file.display())));
    Ok(judge(&found, arguments.max_failures))
}

/// The job with the options of the arguments.
fn with_options(job: SensitivityJob, arguments: &SensitivityArguments) -> Result<SensitivityJob, CommandError> {
    let estimator = match arguments.estimator {
        EstimatorName::Auto => EstimatorChoice::Auto,
        EstimatorName::Azzini => EstimatorChoice::PickFreeze(Estimator::Azzini),
        EstimatorName::Jansen => EstimatorChoice::PickFreeze(Estimator::Jansen),
        EstimatorName::Saltelli => EstimatorChoice::PickFreeze(Estimator::Saltelli),
        EstimatorName::Janon => EstimatorChoice::PickFreeze(Estimator::Janon),
        EstimatorName::Chaos => EstimatorChoice::Chaos,
        EstimatorName::Slopes => EstimatorChoice::Slopes,
    };
    let noise = match &arguments.noise {
        Some(text) => Some(positive_length("--noise", text, "0.5 mm").map_err(CommandError::Usage)?),
        None => None,
    };
    let tangent_noise = match &arguments.tangent_noise {
        Some(text) => Some(positive_angle("--tangent-noise", text, "2 deg").map_err(CommandError::Usage)?),
        None => None,
    };
    Ok(job
        .outputs(&arguments.outputs)
        .inputs(&arguments.inputs)
        .estimator(estimator)
        .confidence(arguments.confidence)
        .degree(arguments.degree)
        .with_unstable(arguments.with == Some(WithName::Unstable))
        .propagate(arguments.propagate)
        .choose(arguments.choose)
        .noise(noise)
        .tangent_noise(tangent_noise)
        .minimum_margin(arguments.minimum_margin)
        .limit(arguments.limit))
}

fn judge(found: &Sensitivity, max_failures: Option<u64>) -> Exit {
    let failed = found.rows - found.usable;
    match max_failures {
        Some(most) if failed > most => {
            say(&format!("error: {failed} rows failed; --max-failures allows {most}"));
            Exit::TooManyFailures
        }
        _ => Exit::Done,
    }
}
