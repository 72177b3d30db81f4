//! `rodsweep control --simulate`: the computed currents on catheters that are not quite those of the model.

use super::control_job::ControlArguments;
use super::{CommandError, say};
use rodsweep::study::{ControlRun, Imperfection, MEASURED, TRIALS};
use rodsweep::{draw, figures};
use serde_json::Value;
use std::path::Path;

/// Plays, prints, writes `simulation.csv` and `simulation.png`; what was found, as JSON.
pub fn simulate(run: &ControlRun, arguments: &ControlArguments, dir: &Path) -> Result<Value, CommandError> {
    let found = run.simulate(&Imperfection::default(), TRIALS, arguments.seed)?;
    found.write(&dir.join("simulation.csv"))?;
    say(&format!(
        "SIMULATION, no measurement: {TRIALS} trials with a catheter (seed {}) {}",
        arguments.seed,
        found.imperfection.in_words()
    ));
    let [rmse, aligned, repeatability] = [found.rmse, found.aligned_rmse, found.repeatability].map(|x| 1e3 * x);
    // The paper's circle.
    let (paper, paper_aligned) = (MEASURED[0].rmse[0], MEASURED[0].aligned_rmse.unwrap_or(f64::NAN));
    say(&format!(
        "simulated: RMSE {rmse:.2} mm, {aligned:.2} mm after rigid alignment, repeatability {repeatability:.2} mm, {} tips lost; \
         the paper measured {paper:.2} and {paper_aligned:.2} mm on its own prototype; simulated tips were not checked against \
         the reference",
        found.lost,
    ));
    if !arguments.no_figures {
        let path = dir.join("simulation.png");
        draw::write_marked(&figures::simulation(&found, run), &path, run.mark())?;
        say(&format!("figure: {}", path.display()));
    }
    Ok(found.to_json())
}
