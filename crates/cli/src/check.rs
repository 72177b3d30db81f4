//! `rodsweep check`: everything that is wrong with a file, else what it is and what it costs.

use super::progress::duration;
use super::{CommandError, Exit, print, say};
use clap::Args;
use rodsweep::draw::count;
use rodsweep::input::{FileCheck, FileContent, parameter_rows, read_scene, scene_notes};
use rodsweep::model::Scene;
use rodsweep::spec::{BranchChoice, Format, SweepSpec, Trajectory};
use rodsweep::study::Solve;
use rodsweep::sweep::{Memory, SweepJob};
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use std::time::{Duration, Instant};

#[derive(Debug, Args)]
pub struct CheckArguments {
    /// Scene, sweep or trajectory (TOML)
    pub file: PathBuf,
    /// Scene that a trajectory is for
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Only read the file: no engine is opened, nothing is solved
    #[arg(long)]
    pub no_cost: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// The content of a sound file: lines for a person to read, and the same facts by key for a program.
#[derive(Default)]
struct Told {
    lines: Vec<String>,
    values: Map<String, Value>,
}

impl Told {
    fn add(&mut self, key: &str, value: impl Into<Value>, line: String) {
        self.values.insert(key.into(), value.into());
        self.lines.push(line);
    }
}

pub fn check(arguments: &CheckArguments) -> Result<Exit, CommandError> {
    let extension = arguments.file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if ["csv", "parquet", "npz"].contains(&extension.as_str()) {
        let why = "a table is checked with the sweep or the trajectory that names it";
        return Err(CommandError::Usage(format!("{}: {why}", arguments.file.display())));
    }
    let scene = arguments.scene.as_deref().map(read_scene).transpose()?;
    let found = FileCheck::read(&arguments.file, scene.as_ref())?;
    let kind = found.kind.name();
    let Some(content) = &found.content else {
        wrong(&found, arguments)?;
        return Ok(Exit::Usage);
    };
    let mut told = Told::default();
    match content {
        FileContent::Scene(scene) => of_scene(scene, arguments, &mut told)?,
        FileContent::Sweep(spec) => of_sweep(spec, arguments, &mut told)?,
        FileContent::Trajectory(trajectory) => of_trajectory(trajectory, &mut told),
        _ => {}
    }
    if arguments.json {
        let mut value = json!({ "file": arguments.file.display().to_string(), "sound": true, "kind": kind });
        value.as_object_mut().into_iter().for_each(|object| object.append(&mut told.values));
        print(&format!("{value:#}\n"))?;
    } else {
        print(&format!("{}: {kind}, nothing is wrong\n{}\n", arguments.file.display(), told.lines.join("\n")))?;
    }
    Ok(Exit::Done)
}

/// Prints every mistake.
fn wrong(found: &FileCheck, arguments: &CheckArguments) -> Result<(), CommandError> {
    if arguments.json {
        let error = |error: &rodsweep::input::InputError| {
            json!({
                "file": error.file.display().to_string(), "line": error.line, "key": error.key,
                "problem": error.problem.to_string(),
            })
        };
        let errors: Vec<Value> = found.errors.iter().map(error).collect();
        let value = json!({
            "file": arguments.file.display().to_string(), "sound": false, "kind": found.kind.name(),
            "errors": errors, "complete": found.is_complete,
        });
        print(&format!("{value:#}\n"))?;
    }
    found.errors.iter().for_each(|error| say(&format!("error: {error}")));
    let mistakes = match found.errors.len() {
        1 => "1 mistake".into(),
        more => format!("{more} mistakes"),
    };
    let rest = if found.is_complete { "" } else { "; there may be more behind the last one" };
    say(&format!("{mistakes}{rest}"));
    Ok(())
}

fn notes(notes: &[String], told: &mut Told) {
    told.values.insert("notes".into(), notes.into());
    told.lines.extend(notes.iter().map(|note| format!("note: {note}")));
}

fn of_scene(scene: &Scene, arguments: &CheckArguments, told: &mut Told) -> Result<(), CommandError> {
    let (segments, length) = (scene.segments.len(), scene.total_length());
    told.add("segments", segments, format!("segments: {segments}, {:.2} mm together", 1e3 * length));
    told.values.insert("length".into(), length.into());
    let parameters = parameter_rows(scene).len();
    told.add("parameters", parameters, format!("parameters: {parameters}; `rodsweep parameters` lists them"));
    notes(&scene_notes(scene), told);
    if !arguments.no_cost {
        let start = Instant::now();
        let solved = Solve::new(scene.clone()).run().map_err(super::flags::of_solve)?;
        let status = solved.status().name();
        let time = duration(start.elapsed());
        told.add("status", status, format!("solved as it stands: {status}, in {time} with everything around it"));
    }
    Ok(())
}

fn of_sweep(spec: &SweepSpec, arguments: &CheckArguments, told: &mut Told) -> Result<(), CommandError> {
    let samples = spec.sample_count;
    told.add("samples", samples, format!("samples: {} by {}", count(samples), spec.method.name()));
    let axes: Vec<String> = spec.axes.iter().map(|axis| axis.name(&spec.scene)).collect();
    told.add("axes", axes.clone(), format!("axes: {}", axes.join(", ")));
    notes(&spec.notes, told);
    if arguments.no_cost {
        return Ok(());
    }
    let mut sweep = SweepJob::new(spec.clone()).prepare(&Memory::new())?;
    let engine = format!("{} {}", sweep.engine().kind(), sweep.engine().precision());
    told.add("engine", engine.clone(), format!("engine: {engine} ({})", sweep.engine().reason()));
    let method = sweep.method().to_string();
    told.add("method", method.clone(), format!("method: {method}"));
    let cost = sweep.measure_cost()?;
    let each = 1e6 * cost.seconds_each;
    let all = cost.seconds_each * samples as f64;
    let more = match spec.branch {
        BranchChoice::All => "; the search for every equilibrium takes many times longer",
        BranchChoice::FromRest => "; second attempts, second paths and files come on top",
    };
    told.values.insert("seconds_per_sample".into(), cost.seconds_each.into());
    told.values.insert("samples_tried".into(), cost.tried.into());
    told.add(
        "seconds",
        all,
        format!(
            "cost: about {} to solve, {each:.1} us a sample on this machine, by {} samples of it{more}",
            duration(Duration::from_secs_f64(all.min(1e9))),
            count(cost.tried)
        ),
    );
    let check = cost.check_seconds_each * cost.checked as f64;
    told.values.insert("samples_checked".into(), cost.checked.into());
    told.add(
        "check_seconds",
        check,
        format!(
            "check: {} samples again by the reference, about {} on one thread",
            count(cost.checked),
            duration(Duration::from_secs_f64(check.min(1e9)))
        ),
    );
    let share = 100.0 * cost.solved as f64 / cost.tried.max(1) as f64;
    told.add("usable_share", 0.01 * share, format!("usable: {share:.0} % of these have an equilibrium from rest"));
    let columns: usize = 24 + axes.len() + sweep.plan().rows() * sweep.plan().derivatives.len();
    if spec.format != Format::None {
        let bytes = 8.0 * columns as f64 * samples as f64;
        told.add("bytes", bytes, format!("files: at most about {:.1} kB", bytes / 1e3));
    }
    Ok(())
}

fn of_trajectory(trajectory: &Trajectory, told: &mut Told) {
    let points = trajectory.targets.len();
    told.add("points", points, format!("points: {}", count(points as u64)));
}
