//! `rodsweep control`: the currents that drive the tip along a trajectory, or to many targets at once.

use super::control_job::{ControlArguments, Outputs, job};
use super::{CommandError, Exit, experiment, print_lines, replay, say, say_notes, simulate, verdict};
use rodsweep::figures::draw_control;
use rodsweep::input::{read_scene, read_trajectory};

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
        let drawn = draw_control(&run, &outputs.dir)?;
        drawn.left_out.iter().for_each(|note| say(&format!("note: {note}")));
        for path in drawn {
            say(&format!("figure: {}", path.display()));
        }
    }
    let simulation = match arguments.simulate {
        true => Some(simulate::simulate(&run, arguments, &outputs.dir)?),
        false => None,
    };
    if arguments.json {
        print_lines(|to| run.write_json(simulation.as_ref(), to))?;
    }
    let trusted = verdict::of_study(run.mark(), arguments.accept_distrusted);
    let missed = run.missed_count() as u64;
    let Some(most) = arguments.max_failures.filter(|most| missed > *most) else { return Ok(trusted) };
    say(&format!("error: {missed} targets are not reached; --max-failures allows {most}"));
    // Doubts about the answers outweigh the number of missed targets.
    Ok(if matches!(trusted, Exit::Done) { Exit::TooManyFailures } else { trusted })
}
