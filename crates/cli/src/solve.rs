//! `rodsweep solve`: one equilibrium with its Jacobian.

use super::engine_args::EngineArguments;
use super::{CommandError, Exit, flags, print, say, say_notes};
use clap::Args;
use rodsweep::draw::ImageFormat;
use rodsweep::input::{Dimension, parse_quantity, read_scene_with};
use rodsweep::study::{Solve, SolveError, Solved, check_tolerance, evenly_spaced};
use rodsweep::{draw, figures};
use std::path::PathBuf;

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

/// Points of a shape that is printed.
const MOST_POINTS: usize = 1_000_000;

pub fn solve(arguments: &SolveArguments) -> Result<Exit, CommandError> {
    check_tolerance(arguments.tolerance).map_err(flags::of_solve)?;
    if let Some(path) = &arguments.plot {
        ImageFormat::of(path)?;
        flags::refuse_to_overwrite(path, arguments.force, "name with `--plot`")?;
    }
    let scene = read_scene_with(&arguments.scene, &arguments.set)?;
    let points = match &arguments.shape {
        Some(text) => Some(arc_lengths(text, scene.total_length())?),
        None => None,
    };
    say_notes(&scene);
    let mut task = Solve::new(scene).tolerance(arguments.tolerance).engine(arguments.engine.request());
    if let Some(names) = &arguments.wrt {
        task = task.wrt(names);
    }
    let solved = task.run().map_err(flags::of_solve)?;
    let text = match arguments.all_branches {
        true => all_branches(&solved, arguments.json)?,
        false => answer(&solved, points.as_deref(), arguments)?,
    };
    print(&text)?;
    if let Some(path) = &arguments.plot {
        let figure = figures::rod_shape(&solved);
        let figure = figure.map_err(|nothing| CommandError::Usage(format!("`--plot`: {nothing}")))?;
        draw::write(&figure, path)?;
        say(&format!("figure: {}", path.display()));
    }
    Ok(if solved.is_converged() { Exit::Done } else { Exit::Failed })
}

/// All that is asked for, as text or as JSON.
fn answer(solved: &Solved, points: Option<&[f64]>, arguments: &SolveArguments) -> Result<String, CommandError> {
    let shape = match points.filter(|_| solved.is_equilibrium()) {
        Some(points) => Some(solved.shape(points).map_err(flags::of_solve)?),
        None => None,
    };
    let plan = if arguments.explain { Some(solved.explain().map_err(flags::of_solve)?) } else { None };
    if !arguments.json {
        let shape = shape.map(|shape| shape.to_string()).unwrap_or_default();
        let plan = plan.map(|plan| plan.to_string()).unwrap_or_default();
        return Ok(format!("{solved}{shape}{plan}"));
    }
    let mut value = solved.to_json();
    if let Some(shape) = shape {
        value["shape"] = shape.to_json();
    }
    if let Some(plan) = plan {
        value["plan"] = plan.to_json();
    }
    Ok(format!("{value:#}\n"))
}

/// Every equilibrium, as text or as JSON.
fn all_branches(solved: &Solved, as_json: bool) -> Result<String, CommandError> {
    let all = solved.all_branches().map_err(flags::of_solve)?;
    if !all.is_balanced() {
        say(&format!(
            "note: of {} searches {} equilibria came out, whose signs do not add up: some are missing",
            all.search_count(),
            all.branches().len()
        ));
    }
    Ok(if as_json { format!("{:#}\n", all.to_json()) } else { all.to_string() })
}

/// The arc lengths (m) that `--shape` means: a number of points from base to tip, or a list of lengths.
fn arc_lengths(text: &str, length: f64) -> Result<Vec<f64>, CommandError> {
    let wrong = |why: String| CommandError::Usage(format!("`--shape {text}`: {why}"));
    if let Ok(count) = text.trim().parse::<usize>() {
        if count > MOST_POINTS {
            return Err(wrong("give at most 1,000,000 points".into()));
        }
        let few = |_: SolveError| wrong("give at least 2 points, or lengths such as \"10 mm, 20 mm\"".into());
        return evenly_spaced(length, count).map_err(few);
    }
    let parse = |part: &str| {
        let at = parse_quantity(part.trim(), Dimension::of("m")).map_err(|error| wrong(error.to_string()))?;
        if at < 0.0 || at > length * (1.0 + 1e-12) {
            return Err(wrong(format!("{part} is not on the rod, which is {length} m long")));
        }
        Ok(at)
    };
    text.split(',').map(parse).collect()
}
