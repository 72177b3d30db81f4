//! `rodsweep control`: the currents that drive the tip along a trajectory, or to many targets at once.

use super::args::{ControlArguments, RedundancyName, positive_length};
use super::control_output::Outputs;
use super::{CommandError, Exit, experiment, print, replay, say, simulate};
use rodsweep::figures::draw_control;
use rodsweep::input::{parse_coordinates, read_scene, read_trajectory, scene_notes};
use rodsweep::model::Scene;
use rodsweep::spec::Redundancy;
use rodsweep::study::{ControlEvent, ControlJob};

pub fn control(arguments: &ControlArguments) -> Result<Exit, CommandError> {
    let scene = read_scene(&arguments.scene)?;
    if arguments.experiment {
        return experiment::experiment(scene, arguments);
    }
    if let Some(currents) = &arguments.replay {
        return replay::replay(scene, currents, arguments);
    }
    let file = arguments.trajectory.as_ref().or(arguments.targets.as_ref());
    let file = file.ok_or_else(|| CommandError::Usage("give a trajectory or `--targets FILE`".into()))?;
    let trajectory = read_trajectory(file, &scene)?;
    let outputs = Outputs::new(arguments, &format!("control-{}", trajectory.name), "control")?;
    say_notes(&scene);
    let job = job(scene, arguments)?;
    let run = match arguments.targets {
        Some(_) => job.reach(&trajectory)?,
        None => job.time_lone_steps(true).follow(&trajectory)?,
    };
    outputs.make_directory()?;
    run.write(&outputs.table)?;
    say(&run.text());
    say(&format!("results: {}", outputs.table.display()));
    if !arguments.no_figures {
        for path in draw_control(&run, &outputs.dir)? {
            say(&format!("figure: {}", path.display()));
        }
    }
    let mut answer = run.to_json();
    if arguments.simulate {
        answer["simulation"] = simulate::simulate(&run, arguments, &outputs.dir)?;
    }
    if arguments.json {
        print(&(serde_json::to_string_pretty(&answer).unwrap_or_default() + "\n"))?;
    }
    let missed = run.missed_count() as u64;
    Ok(match arguments.max_failures {
        Some(most) if missed > most => {
            say(&format!("error: {missed} targets are not reached; --max-failures allows {most}"));
            Exit::TooManyFailures
        }
        _ => Exit::Done,
    })
}

/// What is odd about a scene.
pub fn say_notes(scene: &Scene) {
    scene_notes(scene).iter().for_each(|note| say(&format!("note: {note}")));
}

/// What the arguments ask for.
pub fn job(scene: Scene, arguments: &ControlArguments) -> Result<ControlJob, CommandError> {
    let mut job = ControlJob::new(scene).engine(arguments.engine.request()).on_event(say_event);
    for text in &arguments.input {
        job = job.input(text).map_err(|error| CommandError::Usage(format!("`--input {text}`: {error}")))?;
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
