//! From the arguments of `rodsweep control` to a job.

use super::args::{ControlArguments, RedundancyName, positive_length};
use super::{CommandError, say};
use rodsweep::input::parse_coordinates;
use rodsweep::model::Scene;
use rodsweep::spec::Redundancy;
use rodsweep::study::{ControlEvent, ControlJob};

/// The job that the arguments describe.
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
