//! `rodsweep control`: the currents that drive the tip along a trajectory, or to many targets at once.

use super::args::{ControlArguments, EngineArguments, RedundancyName};
use super::control_output::{Outputs, draw, print_summary, value};
use super::engine::{Engine, F32_TOLERANCE, cpu_f64};
use super::{CommandError, Exit, experiment, print, replay, say, simulate};
use rodsweep::backend::{Backend, BackendError, BackendKind, Precision};
use rodsweep::lanes::{InstructionSet, Lanes};
use rodsweep::model::{Parameter, Plan, Scene, SegmentParameter, Stepper};
use rodsweep::study::{Control, ControlInput, ControlOptions, Controlled, Outcome, Redundancy, Target, TargetOptions};
use rodsweep::sweep::{
    Dimension, Trajectory, TrajectoryPoint, parse_coordinates, parse_quantity, read_scene, read_trajectory, scene_notes,
};

/// Currents may have either sign up to this, unless something is said about them [A].
const CURRENT_LIMIT: f64 = 0.3;

/// What was asked for, and what came out.
pub struct Driven {
    pub scene: Scene,
    pub trajectory: Trajectory,
    pub inputs: Vec<ControlInput>,
    pub options: ControlOptions,
    pub points: Vec<Controlled>,
    /// Of the engine, for a person.
    pub engine: String,
    /// All targets at once.
    pub batch: bool,
    /// Time of a step where each target is known only when the last is reached [s].
    pub step_alone: Option<f64>,
}

/// Points that are followed once more, one at a time, to tell what a step alone takes.
const ALONE: usize = 200;

pub fn control(arguments: &ControlArguments) -> Result<Exit, CommandError> {
    let scene = read_scene(&arguments.scene)?;
    if arguments.experiment {
        return experiment::experiment(scene, arguments);
    }
    if let Some(currents) = &arguments.replay {
        return replay::replay(&scene, currents, arguments);
    }
    let file = arguments.trajectory.as_ref().or(arguments.targets.as_ref());
    let file = file.ok_or_else(|| CommandError::Usage("give a trajectory or `--targets FILE`".into()))?;
    let trajectory = read_trajectory(file, &scene)?;
    let outputs = Outputs::new(arguments, &format!("control-{}", trajectory.name), "control")?;
    say_notes(&scene);
    let driven = drive(scene, trajectory, arguments)?;
    outputs.write(&driven)?;
    print_summary(&driven);
    say(&format!("results: {}", outputs.table.display()));
    if !arguments.no_figures {
        for path in draw(&driven, &outputs.dir)? {
            say(&format!("figure: {}", path.display()));
        }
    }
    let mut answer = value(&driven);
    if arguments.simulate {
        answer["simulation"] = simulate::simulate(&driven, arguments, &outputs.dir)?;
    }
    if arguments.json {
        print(&(serde_json::to_string_pretty(&answer).unwrap_or_default() + "\n"))?;
    }
    let failed = driven.points.iter().filter(|point| point.outcome != Outcome::Reached).count() as u64;
    Ok(match arguments.max_failures {
        Some(most) if failed > most => {
            say(&format!("error: {failed} targets are not reached; --max-failures allows {most}"));
            Exit::TooManyFailures
        }
        _ => Exit::Done,
    })
}

/// What is odd about a scene.
pub fn say_notes(scene: &Scene) {
    scene_notes(scene).iter().for_each(|note| say(&format!("note: {note}")));
}

/// Finds the inputs for every point of a trajectory.
pub fn drive(scene: Scene, trajectory: Trajectory, arguments: &ControlArguments) -> Result<Driven, CommandError> {
    let inputs = inputs(arguments, &scene, &trajectory)?;
    let options = options(arguments, &trajectory)?;
    let targets: Vec<Target> = trajectory.points.iter().map(target).collect();
    let batch = arguments.targets.is_some();
    let Answer { points, engine, options, step_alone } = match batch {
        true => reach(&scene, &inputs, options, &targets, &arguments.engine)?,
        false => follow(&scene, &inputs, options, &targets, &arguments.engine)?,
    };
    Ok(Driven { scene, trajectory, inputs, options, points, engine, batch, step_alone })
}

fn target(point: &TrajectoryPoint) -> Target {
    Target { position: point.position, tangent: point.tangent }
}

struct Answer {
    points: Vec<Controlled>,
    engine: String,
    options: ControlOptions,
    step_alone: Option<f64>,
}

/// The median time of a step [s]: a shared machine interrupts.
pub fn median_step(points: &[Controlled]) -> Option<f64> {
    let taken = points.iter().filter(|point| point.iterations > 0);
    let mut each: Vec<f64> = taken.map(|point| point.seconds / point.iterations as f64).collect();
    each.sort_by(f64::total_cmp);
    each.get(each.len() / 2).copied()
}

/// One point after another: `auto` is the CPU in f64.
fn follow(
    scene: &Scene,
    inputs: &[ControlInput],
    options: ControlOptions,
    targets: &[Target],
    arguments: &EngineArguments,
) -> Result<Answer, CommandError> {
    let engine = Engine::choose_for_one(arguments, options.tolerance)?;
    let mut many = |plan: &Plan| engine.make(plan);
    let mut control = Control::new(scene, inputs, options, engine.steppers()[0], &mut many)?;
    if engine.kind == BackendKind::Cpu {
        // One sample at a time leaves all but one lane of a register idle, and narrow instructions are quicker then.
        let mut single = |plan: &Plan| -> Result<Box<dyn Backend>, BackendError> {
            Ok(Box::new(Lanes::with_instruction_set(plan, engine.precision, InstructionSet::for_one())?))
        };
        control = control.for_trajectories(&mut many, &mut single)?;
    }
    let points = control.follow(targets)?;
    let step_alone = median_step(&control.follow_singly(&targets[..targets.len().min(ALONE)])?);
    Ok(Answer { points, engine: control.engine(), options: *control.options(), step_alone })
}

/// All at once; what f32 cannot reach is finished in f64.
fn reach(
    scene: &Scene,
    inputs: &[ControlInput],
    options: ControlOptions,
    targets: &[Target],
    arguments: &EngineArguments,
) -> Result<Answer, CommandError> {
    // f32 on a GPU, finished in f64.
    let engine = Engine::choose(arguments, F32_TOLERANCE)?;
    let mut make = |plan: &Plan| engine.make(plan);
    let mut control = Control::new(scene, inputs, options, engine.steppers()[0], &mut make)?;
    if engine.kind == BackendKind::Cpu {
        control = control.for_targets(&mut make)?;
    }
    let mut last = 0;
    let mut points = control.reach(targets, &TargetOptions::default(), &mut |done| {
        if done >= last + targets.len().div_ceil(10) {
            say(&format!("{done} of {} targets ended", targets.len()));
            last = done;
        }
    })?;
    let mut words = control.engine();
    if control.options().tolerance > options.tolerance && engine.precision == Precision::F32 {
        let mut fine = Control::new(scene, inputs, options, Stepper::Dop853, &mut |plan| cpu_f64(plan))?;
        fine.finish(&mut points)?;
        words += &format!(", finished on {}", fine.engine());
    }
    Ok(Answer { points, engine: words, options, step_alone: None })
}

/// Inputs and limits: those of the command line, else of the file, else every current.
fn inputs(
    arguments: &ControlArguments,
    scene: &Scene,
    trajectory: &Trajectory,
) -> Result<Vec<ControlInput>, CommandError> {
    if !arguments.input.is_empty() {
        let mut inputs: Vec<ControlInput> = Vec::new();
        for text in &arguments.input {
            for input in parse_input(scene, text)? {
                if inputs.iter().any(|other| other.parameter == input.parameter) {
                    let name = input.parameter.name(scene);
                    return Err(CommandError::Usage(format!("`--input {text}`: {name} is an input already")));
                }
                inputs.push(input);
            }
        }
        return Ok(inputs);
    }
    if !trajectory.inputs.is_empty() {
        let of_file = trajectory.inputs.iter();
        return Ok(of_file.map(|i| ControlInput { parameter: i.parameter, low: i.low, high: i.high }).collect());
    }
    let is_current = |p: &Parameter| matches!(p, Parameter::Segment(_, SegmentParameter::Current(_)));
    let currents: Vec<Parameter> = Parameter::all(scene).into_iter().filter(is_current).collect();
    if currents.is_empty() {
        let text = "the scene has no coil: name what is commanded with `--input NAME=LOW..HIGH`";
        return Err(CommandError::Usage(text.into()));
    }
    say(&format!("note: every current is commanded, within ±{CURRENT_LIMIT} A; `--input` says otherwise"));
    let input = |parameter| ControlInput { parameter, low: -CURRENT_LIMIT, high: CURRENT_LIMIT };
    Ok(currents.into_iter().map(input).collect())
}

/// `coil.current=0.3`, `insertion=85 mm..100 mm`.
fn parse_input(scene: &Scene, text: &str) -> Result<Vec<ControlInput>, CommandError> {
    let wrong = |why: String| CommandError::Usage(format!("`--input {text}`: {why}"));
    let (name, limits) = text.split_once('=').ok_or_else(|| {
        wrong("write NAME=LIMIT or NAME=LOW..HIGH, such as coil.current=0.3 or \"insertion=85 mm..100 mm\"".into())
    })?;
    let parameters = Parameter::parse(scene, name.trim()).map_err(|error| wrong(error.to_string()))?;
    let input = |parameter: Parameter| {
        let quantity = |text: &str| {
            parse_quantity(text.trim(), Dimension::of(parameter.unit())).map_err(|error| wrong(error.to_string()))
        };
        let (low, high) = match limits.split_once("..") {
            Some((low, high)) => (quantity(low)?, quantity(high)?),
            None => (-quantity(limits)?, quantity(limits)?),
        };
        match low < high {
            true => Ok(ControlInput { parameter, low, high }),
            false => Err(wrong("the lower limit must be below the upper".into())),
        }
    };
    parameters.into_iter().map(input).collect()
}

fn options(arguments: &ControlArguments, trajectory: &Trajectory) -> Result<ControlOptions, CommandError> {
    let default = ControlOptions::default();
    let mut options = ControlOptions {
        coordinates: trajectory.coordinates,
        tolerance: trajectory.tolerance.unwrap_or(default.tolerance),
        most_iterations: trajectory.iterations.unwrap_or(default.most_iterations),
        tangent_weight: trajectory.tangent_weight.unwrap_or(default.tangent_weight),
        redundancy: match trajectory.redundancy {
            Some("least-current") => Redundancy::LeastCurrent,
            _ => Redundancy::LeastChange,
        },
    };
    if let Some(names) = &arguments.coordinates {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let parsed = parse_coordinates(&names);
        options.coordinates = parsed.map_err(|error| CommandError::Usage(format!("`--coordinates`: {error}")))?;
    }
    if let Some(text) = &arguments.tolerance {
        let wrong = |why: String| CommandError::Usage(format!("`--tolerance {text}`: {why}"));
        let length = parse_quantity(text, Dimension::of("m")).map_err(|error| wrong(error.to_string()))?;
        if length <= 0.0 {
            return Err(wrong("give a positive length, such as \"0.1 um\"".into()));
        }
        options.tolerance = length;
    }
    if let Some(name) = arguments.redundancy {
        options.redundancy = match name {
            RedundancyName::LeastChange => Redundancy::LeastChange,
            RedundancyName::LeastCurrent => Redundancy::LeastCurrent,
        };
    }
    Ok(options)
}
