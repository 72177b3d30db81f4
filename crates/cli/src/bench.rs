//! `rodsweep bench`: arguments to a measurement, a comparison or a report.

use super::flags::some;
use crate::{CommandError, Exit, print, say};
use clap::{Args, ValueEnum};
use rodsweep::draw::ReportError;
use rodsweep::input::read_scene;
use rodsweep_bench::BenchError;
use rodsweep_bench::measure::{Benchmark, Engines, MeasureOptions, built_in, read_directory};
use rodsweep_bench::paper::{PaperOptions, built_in_scene, compare};
use rodsweep_bench::report::Report;
use std::path::{Path, PathBuf};

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

pub fn bench(arguments: &BenchArguments) -> Result<Exit, CommandError> {
    if arguments.paper {
        return paper(arguments);
    }
    if let Some(directory) = &arguments.render {
        render(directory)?;
        return Ok(Exit::Done);
    }
    let specs = match &arguments.files {
        Some(directory) => read_directory(directory)?,
        None => built_in()?,
    };
    let engines = match arguments.backend {
        BenchBackend::All => Engines::All,
        BenchBackend::Cpu => Engines::Cpu,
        BenchBackend::Gpu => Engines::Gpu,
    };
    let options = MeasureOptions::new().quick(arguments.quick).only(&arguments.only).engines(engines);
    let benchmark = Benchmark::new(specs, &options)?;
    let out = arguments.out.clone().unwrap_or_else(|| match arguments.quick && !arguments.force {
        true => free_directory(benchmark.default_directory()),
        false => benchmark.default_directory(),
    });
    if Report::is_in(&out) && !arguments.force {
        let remedy = format!("{} holds a report already; give another `--out`, or `--force`", out.display());
        return Err(CommandError::Usage(remedy));
    }
    let measured = benchmark.measure(&mut say)?;
    measured.save(&out)?;
    render(&out)?;
    say(&format!("measured in {:.0} s", measured.seconds));
    Ok(Exit::Done)
}

/// The directory, or its name with the first number that makes it one without a report.
fn free_directory(directory: PathBuf) -> PathBuf {
    let numbered = |number: u32| PathBuf::from(format!("{}-{number}", directory.display()));
    match Report::is_in(&directory) {
        true => (2..).map(numbered).find(|path| !Report::is_in(path)).unwrap_or(directory),
        false => directory,
    }
}

/// Writes report and figures from what a directory holds.
fn render(directory: &Path) -> Result<(), CommandError> {
    let report = Report::open(directory)?;
    let path = report.save(directory)?;
    print(&report.readme())?;
    say(&format!("written: {}", path.display()));
    Ok(())
}

/// `--paper`
fn paper(arguments: &BenchArguments) -> Result<Exit, CommandError> {
    let (scene, name) = match &arguments.scene {
        Some(file) => (read_scene(file)?, file.display().to_string()),
        None => (built_in_scene()?, "the built-in scene".into()),
    };
    let options = PaperOptions::new().samples(arguments.samples).repeats(arguments.repeats).seed(arguments.seed);
    let comparison = compare(&scene, &name, &options)?;
    if let Some(directory) = &arguments.out {
        for path in comparison.save(directory)? {
            say(&format!("written: {}", path.display()));
        }
    }
    print(&if arguments.json { comparison.json() } else { comparison.text() })?;
    Ok(Exit::Done)
}

/// The crate's errors, with the flag to change where one is at fault.
impl From<BenchError> for CommandError {
    fn from(error: BenchError) -> CommandError {
        match error {
            BenchError::Input(error) => error.into(),
            BenchError::Plan(error) => error.into(),
            BenchError::Backend(error) => error.into(),
            BenchError::Sweep(error) => error.into(),
            BenchError::Figure(error) => error.into(),
            BenchError::Write { path, source } => ReportError::Write { path, source }.into(),
            BenchError::UnknownPart { name, known } => {
                CommandError::Usage(format!("`--only {name}`: not known; use some of {}", known.join(", ")))
            }
            error @ BenchError::NoGpu => CommandError::Usage(format!("{error}; see `rodsweep doctor`")),
            error @ BenchError::Read { .. } => CommandError::Usage(format!("{error}; give a directory of `bench`")),
            error => CommandError::Usage(error.to_string()),
        }
    }
}
