//! `rodsweep workspace`: what can be reached, how surely, with what margin.

use super::engine_args::EngineArguments;
use super::{CommandError, Exit, force, print, say, signals, verdict};
use clap::{Args, ValueEnum};
use rodsweep::figures::draw_workspace;
use rodsweep::input::{Dimension, parse_quantity, read_trajectory};
use rodsweep::results::{Results, is_place};
use rodsweep::spec::{SweepSpec, Target};
use rodsweep::study::workspace::{
    Preference, Variation, Workspace, WorkspaceError, WorkspaceExtras, WorkspaceJob, WorkspaceStage, workspace_mark,
};
use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

#[derive(Debug, Args)]
pub struct WorkspaceArguments {
    /// A result directory, or a sweep file (TOML) that need not have been run
    pub source: PathBuf,
    /// Go on with rows that are not to be trusted; what comes of them says so
    #[arg(long)]
    pub accept_distrusted: bool,
    /// Where files go [default: the result directory, or results/NAME-OF-THE-SWEEP-workspace]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// First remove what an earlier workspace or run has left where files go; a file of somebody else stops it
    #[arg(long)]
    pub force: bool,
    /// Edge of a voxel, such as 1mm
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub voxel: Option<f64>,
    /// Least stability margin that counts, from 0 to 1
    #[arg(long, value_name = "MARGIN")]
    pub minimum_margin: Option<f64>,
    /// Count every stable equilibrium that continues one from rest, not only those from rest
    #[arg(long)]
    pub any_stable: bool,
    /// Only paint the voxels near rows: quick, and no voxel is proven
    #[arg(long)]
    pub fast: bool,
    /// Seed of the lattice and of all nets
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Can the tip be there? A table with columns x, y, z and perhaps tx, ty, tz, or "10 mm,-40 mm,80 mm"
    #[arg(long, value_name = "FILE|X,Y,Z", allow_hyphen_values = true)]
    pub reach: Option<String>,
    /// Which of several solutions answers a query
    #[arg(long, value_enum, default_value = "margin")]
    pub prefer: PreferenceName,
    /// What remains reachable for the designs that [[uncertain]] in the sweep describes
    #[arg(long)]
    pub robust: bool,
    /// Designs of --robust; 59 are the fewest that can show 95 % with a confidence of 95 %
    #[arg(long, value_name = "N", default_value = "64", requires = "robust")]
    pub designs: usize,
    /// A number of the design and its range, such as tube.youngs_modulus=-10%..10%:5
    #[arg(long, value_name = "NAME+NAME=LOW..HIGH:COUNT")]
    pub vary: Option<String>,
    /// Another directory with a workspace of the same voxel and seed
    #[arg(long, value_name = "DIR")]
    pub compare: Option<PathBuf>,
    /// Length by which rotations are multiplied beside positions [default: the last flexible segment]
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub length: Option<f64>,
    #[command(flatten)]
    pub engine: EngineArguments,
    /// Write the voxels as a dense grid for ParaView, too
    #[arg(long)]
    pub vtk: bool,
    /// Draw nothing
    #[arg(long)]
    pub no_figures: bool,
    /// Print workspace.json and nothing else on the standard output
    #[arg(long)]
    pub json: bool,
    /// Only the size: nothing on the way, no account
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PreferenceName {
    /// The largest stability margin
    Margin,
    /// The farthest from the limits of the inputs
    Reserve,
    /// The smallest currents
    LeastCurrent,
}

/// A positive length (m), for clap.
fn length(text: &str) -> Result<f64, String> {
    match parse_quantity(text, Dimension::of("m")) {
        Ok(length) if length > 0.0 => Ok(length),
        Ok(_) => Err("give a length greater than zero, such as 1mm".into()),
        Err(error) => Err(error.to_string()),
    }
}

/// A line of progress at most this often.
const INTERVAL: Duration = Duration::from_secs(2);

pub fn workspace(arguments: &WorkspaceArguments) -> Result<Exit, CommandError> {
    let interrupted = signals::listen();
    let results = match is_place(&arguments.source) {
        true => Some(Results::open(&arguments.source)?),
        false => None,
    };
    if let Some(results) = &results
        && let Some(exit) = verdict::of_results(results, arguments.accept_distrusted)?
    {
        return Ok(exit);
    }
    if let Some(dir) = &arguments.compare
        && let Some(exit) = verdict::of_other(dir, workspace_mark(dir)?.as_deref(), arguments.accept_distrusted)
    {
        return Ok(exit);
    }
    let read;
    let spec = match &results {
        Some(results) => results.spec(),
        None => {
            read = SweepSpec::read(&arguments.source)?;
            &read
        }
    };
    let teller = Teller::new(arguments.quiet);
    let tell = |stage: WorkspaceStage| teller.tell(stage);
    let job = results.as_ref().map_or_else(|| WorkspaceJob::of_sweep(spec), WorkspaceJob::of_results);
    let job = job
        .engine(arguments.engine.request())
        .voxel(arguments.voxel.unwrap_or(spec.workspace.voxel))
        .minimum_margin(arguments.minimum_margin.unwrap_or(spec.workspace.minimum_margin))
        .seed(arguments.seed.unwrap_or(spec.workspace.seed))
        .length(arguments.length.or(spec.workspace.length))
        .any_stable(arguments.any_stable)
        .fast(arguments.fast)
        .interrupt(interrupted)
        .progress(Some(&tell));
    // Files and values of the arguments are read before anything is solved.
    let targets = arguments.reach.as_deref().map(|text| targets(text, spec)).transpose()?;
    let variation = arguments.vary.as_deref().map(|text| Variation::parse(&spec.scene, text)).transpose()?;
    let found = job.run()?;
    let mut extras = WorkspaceExtras::default();
    if arguments.robust {
        extras.robust = Some(job.robust(&found, arguments.designs)?);
    }
    if let Some(targets) = &targets {
        let mut map = job.map(&found.inputs)?;
        extras.reach = found.reach(&mut map, targets, preference(arguments.prefer), found.usual_tolerance())?;
        if let Some(robust) = &extras.robust {
            robust.rate(&found, &mut extras.reach);
        }
    }
    extras.study = variation.as_ref().map(|variation| job.vary(&found, variation)).transpose()?;
    extras.comparison = arguments.compare.as_ref().map(|dir| found.compare(dir)).transpose()?;
    let convergence = match arguments.no_figures || arguments.fast {
        true => Vec::new(),
        false => job.convergence(&found)?,
    };
    let out = arguments.out.clone().unwrap_or_else(|| default_out(&arguments.source, results.is_some()));
    if arguments.force && out != arguments.source {
        force::clear(&out)?;
    }
    if let Some(results) = results.as_ref().filter(|results| results.directory() == out) {
        results.keep_touched_voxels()?;
    }
    let account = found.account();
    let mut files = found.write(&out, &account, &extras, arguments.vtk)?;
    if !arguments.no_figures {
        let drawn = draw_workspace(&found, &extras, &convergence, &out)?;
        drawn.left_out.iter().for_each(|note| say(&format!("note: {note}")));
        files.extend(drawn);
    }
    if arguments.json {
        print(&found.json(&account, &extras))?;
    }
    let headline = account.headline();
    if arguments.quiet && !arguments.json {
        print(&(headline.clone() + "\n"))?;
    }
    if !arguments.quiet {
        // The answer first; of rows that are not to be trusted the doubt.
        let text = account.text();
        let rest = text.lines().filter(|line| *line != headline);
        let lines: Vec<&str> = match account.distrusted {
            Some(_) => text.lines().collect(),
            None => std::iter::once(headline.as_str()).chain(rest).collect(),
        };
        let text = [lines.join("\n"), extras.text(&found)].join("\n");
        found.notes.iter().for_each(|note| say(&format!("note: {note}")));
        if arguments.json {
            say(text.trim_end())
        } else {
            print(&(text.trim_end().to_owned() + "\n"))?
        }
        files.iter().for_each(|path| say(&format!("file: {}", path.display())));
    }
    let trusted = verdict::of_study(found.check_by_reference.mark.as_deref(), arguments.accept_distrusted);
    Ok(if trusted == Exit::Done { judge(&found) } else { trusted })
}

fn judge(found: &Workspace) -> Exit {
    if !found.is_doubtful() {
        return Exit::Done;
    }
    if found.grown.reached_count() == 0 {
        say("error: no voxel's centre is reached, so the size is not known: take smaller voxels, as the note says");
        return Exit::TooManyFailures;
    }
    let undecided = 100.0 * found.ends.undecided_share();
    match found.check {
        Some(check) if !check.agrees => say(&format!(
            "error: the two values differ by {:.1} of their errors; take smaller voxels or another seed",
            check.deviation.abs()
        )),
        _ => say(&format!("error: {undecided:.1} % of the voxels are undecided; take smaller voxels")),
    }
    Exit::TooManyFailures
}

fn preference(name: PreferenceName) -> Preference {
    match name {
        PreferenceName::Margin => Preference::Margin,
        PreferenceName::Reserve => Preference::Reserve,
        PreferenceName::LeastCurrent => Preference::LeastCurrent,
    }
}

/// A point, a point with a tangent, or a table of them.
fn targets(text: &str, spec: &SweepSpec) -> Result<Vec<Target>, CommandError> {
    if Path::new(text).is_file() {
        return Ok(read_trajectory(Path::new(text), &spec.scene)?.targets);
    }
    let numbers: Vec<&str> = text.split(',').collect();
    let usage = |problem: String| {
        let form = "give three lengths such as \"10 mm,-40 mm,80 mm\", or a table with columns x, y, z";
        CommandError::Usage(format!("`--reach {text}`: {problem}; {form}"))
    };
    if numbers.len() != 3 && numbers.len() != 6 {
        return Err(usage("that is neither a file nor a point".into()));
    }
    let mut values = Vec::new();
    for (number, part) in numbers.iter().enumerate() {
        let dimension = if number < 3 { Dimension::of("m") } else { Dimension::NUMBER };
        values.push(parse_quantity(part, dimension).map_err(|error| usage(error.to_string()))?);
    }
    let target = Target::at([values[0], values[1], values[2]]);
    let Some(tangent) = values.get(3..) else { return Ok(vec![target]) };
    let length = tangent.iter().map(|x| x * x).sum::<f64>().sqrt();
    match (tangent, length > 0.0) {
        ([x, y, z], true) => Ok(vec![target.along([x / length, y / length, z / length])]),
        ([], _) => Ok(vec![target]),
        _ => Err(usage("a tangent of length zero has no direction".into())),
    }
}

fn default_out(source: &Path, is_directory: bool) -> PathBuf {
    if is_directory {
        return source.into();
    }
    let name = source.file_stem().unwrap_or_default().to_string_lossy();
    PathBuf::from("results").join(format!("{name}-workspace"))
}

/// Says what a job is at, now and then.
struct Teller {
    quiet: bool,
    last: Cell<Option<Instant>>,
}

impl Teller {
    fn new(quiet: bool) -> Teller {
        Teller { quiet, last: Cell::new(None) }
    }

    fn tell(&self, stage: WorkspaceStage) {
        if self.quiet || self.last.get().is_some_and(|last| last.elapsed() < INTERVAL) {
            return;
        }
        self.last.set(Some(Instant::now()));
        say(&stage.words());
    }
}

/// Message for an error of a workspace, with the flag that helps.
impl From<WorkspaceError> for CommandError {
    fn from(error: WorkspaceError) -> CommandError {
        match error {
            WorkspaceError::Input(error) => error.into(),
            WorkspaceError::Plan(error) => error.into(),
            WorkspaceError::Backend(error) => error.into(),
            WorkspaceError::Results(error) => error.into(),
            WorkspaceError::Query { place, problem } => CommandError::Usage(format!("`--reach`: {place}: {problem}")),
            WorkspaceError::TooManyVoxels { .. } | WorkspaceError::Voxel(_) => {
                CommandError::Usage(format!("`--voxel`: {error}"))
            }
            WorkspaceError::Margin(_) => CommandError::Usage(format!("`--minimum-margin`: {error}")),
            error => CommandError::Workspace(error),
        }
    }
}
