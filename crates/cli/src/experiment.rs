//! `rodsweep control --experiment`: the paper's experiment, simulated, beside what it measured.

use super::control_job::{ControlArguments, Outputs, job};
use super::{CommandError, Exit, print, say, say_notes};
use rodsweep::draw;
use rodsweep::figures::ExperimentFigure;
use rodsweep::model::Scene;
use rodsweep::results::ResultsError;
use rodsweep::study::Experiment;

pub fn experiment(scene: Scene, arguments: &ControlArguments) -> Result<Exit, CommandError> {
    let experiment = Experiment::new(job(scene.clone(), arguments)?)?;
    let outputs = Outputs::new(arguments, "control-experiment", "experiment")?;
    say_notes(&scene);
    let found = experiment.catheters(arguments.catheters).seed(arguments.seed).run()?;
    outputs.make_directory()?;
    found.write(&outputs.table)?;
    let page = outputs.dir.join("experiment.md");
    let io =
        |error: std::io::Error| ResultsError::Io { path: page.clone(), action: "writing", reason: error.to_string() };
    rodsweep::files::replace(&page, found.markdown().as_bytes()).map_err(io)?;
    if !arguments.json {
        print(&found.text())?;
    }
    say(&format!("results: {}, {}", outputs.table.display(), page.display()));
    if !arguments.no_figures {
        let path = outputs.dir.join("experiment.png");
        draw::write(&ExperimentFigure(&found), &path)?;
        let seed = found.seeds[found.median_catheter()];
        say(&format!("figure: {}, the catheter of seed {seed}, the median by RMSE", path.display()));
    }
    if arguments.json {
        print(&(serde_json::to_string_pretty(&found.to_json()).unwrap_or_default() + "\n"))?;
    }
    Ok(Exit::Done)
}
