//! `rodsweep fit`: numbers of a scene from observed shapes, with intervals, and what cannot be told apart.

use super::flags::{positive_force, positive_length};
use super::{CommandError, Exit, flags, print, say, say_notes, verdict};
use clap::Args;
use rodsweep::draw::{self, ImageFormat};
use rodsweep::input::{read_scene, read_shapes_with, write_scene};
use rodsweep::results::ResultsError;
use rodsweep::study::FitJob;
use rodsweep::{figures, files};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct FitArguments {
    /// Scene to start from (TOML)
    pub scene: PathBuf,
    /// Observed points (CSV or Parquet): x, y, z; s, the arc length, empty for the tip; normal_force, measured at the scene's
    /// wall; known parameters such as coil.current.x. Rows with the same known values are one shape
    pub shapes: PathBuf,
    /// What is fitted, separated by commas; names joined by + keep their ratio [default: rest curvature about x and y]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub free: Option<Vec<String>>,
    /// Standard deviation of an observed coordinate, such as "0.2 mm" [default: estimated from the residuals]
    #[arg(long, value_name = "LENGTH")]
    pub noise: Option<String>,
    /// Standard deviation of a measured force, such as "1 mN" [default: what pushes the rod aside by the noise of a coordinate]
    #[arg(long, value_name = "FORCE")]
    pub force_noise: Option<String>,
    /// Where the scene with the fitted values is written
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Overwrite what is there
    #[arg(long)]
    pub force: bool,
    /// Draw observed points and fitted shapes (.png or .svg)
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// Exit with 0 although the reference contradicts fitted rods; what is drawn says so
    #[arg(long)]
    pub accept_distrusted: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

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
    if let Some(text) = &arguments.force_noise {
        job = job.force_noise(positive_force("--force-noise", text, "1 mN").map_err(CommandError::Usage)?);
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
        draw::write_marked(&figures::fit(&fit, &job), path, fit.mark())?;
        say(&format!("figure: {}", path.display()));
    }
    let trusted = match &fit.check.mark {
        Some(mark) => verdict::of_study(Some(mark), arguments.accept_distrusted),
        None => verdict::of_misfit(fit.misfit.as_deref(), arguments.accept_distrusted),
    };
    Ok(if fit.converged { trusted } else { Exit::Failed })
}
