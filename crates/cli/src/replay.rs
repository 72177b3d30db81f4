//! `rodsweep control --replay`: recorded currents through the model, beside the tips that were observed.

use super::control_job::{ControlArguments, Outputs};
use super::{CommandError, Exit, print, say, say_notes, verdict};
use rodsweep::input::{read_input_table, read_observed_tips};
use rodsweep::model::Scene;
use rodsweep::study::{Agreement, ControlError, Replay, ReplayComparison};
use rodsweep::{draw, figures};
use std::path::Path;

pub fn replay(scene: Scene, currents: &Path, arguments: &ControlArguments) -> Result<Exit, CommandError> {
    let commands = read_input_table(currents, &scene)?;
    let observed =
        arguments.observed.as_ref().map(|file| read_observed_tips(file, commands.row_count())).transpose()?;
    let name = currents.file_stem().unwrap_or_default().to_string_lossy();
    let outputs = Outputs::new(arguments, &format!("replay-{name}"), "replay")?;
    say_notes(&scene);
    let replay = Replay::new(scene, commands).map_err(|error| match error {
        ControlError::NothingPlayed => CommandError::Usage(format!("{}: {error}", currents.display())),
        error => error.into(),
    })?;
    outputs.make_directory()?;
    replay.write(&outputs.table)?;
    say(&format!("{} states played, {} without a stable equilibrium from rest", replay.tips().len(), replay.lost()));
    say(&replay.check().sentence());
    say(&format!("results: {}", outputs.table.display()));
    let mut answer = replay.to_json();
    if let Some(observed) = &observed {
        let found = replay.compare(observed)?;
        let residuals = outputs.dir.join("residuals.csv");
        found.write(&residuals)?;
        say(&format!("residuals: {}", residuals.display()));
        say_agreement(&found);
        answer["observed"] = found.to_json();
        if !arguments.no_figures {
            let path = outputs.dir.join("replay.png");
            draw::write_marked(&figures::replay(&replay, &found, &name), &path, replay.check().mark.as_deref())?;
            say(&format!("figure: {}", path.display()));
        }
    }
    if arguments.json {
        print(&(serde_json::to_string_pretty(&answer).unwrap_or_default() + "\n"))?;
    }
    Ok(verdict::of_study(replay.check().mark.as_deref(), arguments.accept_distrusted))
}

/// How well some of the observed tips agree with the model.
fn say_agreement(found: &ReplayComparison) {
    let Agreement { rmse, offset, centred_rmse, aligned_rmse, .. } = found.agreement;
    let [x, y, z] = offset.map(|x| 1e3 * x);
    say(&format!(
        "{} of {} observed tips: RMSE {:.2} mm; {:.2} mm without their mean offset of ({x:.1}, {y:.1}, {z:.1}) mm; {:.2} mm \
         after rigid alignment",
        found.compared,
        found.pairs.len(),
        1e3 * rmse,
        1e3 * centred_rmse,
        1e3 * aligned_rmse
    ));
}
