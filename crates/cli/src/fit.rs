//! `rodsweep fit`: numbers of a scene from observed shapes, with intervals, and what cannot be told apart.

use super::args::{FitArguments, positive_length};
use super::{CommandError, Exit, flags, print, say, say_notes, verdict};
use rodsweep::input::{read_scene, read_shapes_with, write_scene};
use rodsweep::report::{self, ImageFormat};
use rodsweep::results::ResultsError;
use rodsweep::study::FitJob;
use rodsweep::{figures, files};

pub fn fit(arguments: &FitArguments) -> Result<Exit, CommandError> {
    if let Some(path) = &arguments.plot {
        ImageFormat::of(path)?;
    }
    for (path, flag) in [(&arguments.out, "--out"), (&arguments.plot, "--plot")] {
        if let Some(path) = path {
            flags::refuse_to_overwrite(path, arguments.force, &format!("name with `{flag}`"))?;
        }
    }
    let scene = read_scene(&arguments.scene)?;
    let mut notes = Vec::new();
    let observed = read_shapes_with(&arguments.shapes, &scene, &mut notes)?;
    let mut job = FitJob::new(scene, observed);
    if let Some(names) = &arguments.free {
        job = job.free(names)?;
    }
    job.check()?;
    say_notes(job.scene());
    notes.iter().for_each(|note| say(&format!("note: {note}")));
    if let Some(text) = &arguments.noise {
        job = job.noise(positive_length("--noise", text, "0.2 mm").map_err(CommandError::Usage)?);
    }
    let fit = job.run()?;
    let json = || serde_json::to_string_pretty(&fit.to_json()).unwrap_or_default() + "\n";
    print(&if arguments.json { json() } else { fit.text(&job) })?;
    if let Some(path) = &arguments.out {
        let io = |error: std::io::Error| ResultsError::Io {
            path: path.clone(),
            action: "writing",
            reason: error.to_string(),
        };
        files::replace(path, write_scene(&fit.scene).as_bytes()).map_err(io)?;
        say(&format!("scene: {}", path.display()));
    }
    if let Some(path) = &arguments.plot {
        report::write_marked(&figures::fit(&fit, &job), path, fit.mark())?;
        say(&format!("figure: {}", path.display()));
    }
    let trusted = match &fit.check.mark {
        Some(mark) => verdict::of_study(Some(mark), arguments.accept_distrusted),
        None => verdict::of_misfit(fit.misfit.as_deref(), arguments.accept_distrusted),
    };
    Ok(if fit.converged { trusted } else { Exit::Failed })
}
