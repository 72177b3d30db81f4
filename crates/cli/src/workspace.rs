//! `rodsweep workspace`: what can be reached, how surely, with what margin.

use super::workspace_args::{PreferenceName, WorkspaceArguments};
use super::{CommandError, Exit, force, print, say, signals, verdict};
use rodsweep::figures::draw_workspace;
use rodsweep::input::{Dimension, parse_quantity, read_trajectory};
use rodsweep::results::{Results, is_place};
use rodsweep::spec::{SweepSpec, Target};
use rodsweep::study::workspace::{
    Preference, Variation, Workspace, WorkspaceError, WorkspaceExtras, WorkspaceJob, WorkspaceStage,
};
use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

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
