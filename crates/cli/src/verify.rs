//! `rodsweep verify`: every engine of this machine against the reference, or on the hard cases.

use crate::args::VerifyArguments;
use crate::{CommandError, Exit, print, say};
use rodsweep_bench::BenchError;
use rodsweep_bench::random::RandomScenes;
use rodsweep_bench::verify::{VerifyOptions, search_disagreements, search_estimates, verify_hard};

pub fn verify(arguments: &VerifyArguments) -> Result<Exit, CommandError> {
    if let Some(scenes) = arguments.random {
        return random(arguments, scenes);
    }
    if let Some(rods) = arguments.estimates {
        return estimates(arguments, rods);
    }
    if arguments.varying_fields {
        return Err(CommandError::Usage("`--varying-fields` goes with `--random N` or `--estimates N`".into()));
    }
    let (good, skipped) = if arguments.hard { hard(arguments)? } else { chain(arguments)? };
    let refused = skipped && std::env::var("RODSWEEP_GPU").is_ok_and(|value| value == "require");
    if refused {
        say("error: an engine was skipped, and RODSWEEP_GPU=require asks for all; install a driver or unset it");
    }
    Ok(if good && !refused { Exit::Done } else { Exit::Failed })
}

/// Random scenes with every combination of terms, on the CPU engine and on the reference.
fn random(arguments: &VerifyArguments, scenes: u64) -> Result<Exit, CommandError> {
    let kind = if arguments.varying_fields { RandomScenes::Varying } else { RandomScenes::Uniform };
    let mut found = search_disagreements(kind, scenes, arguments.seed, &mut say)?;
    found.write_replays(&arguments.out).map_err(unwritten)?;
    print(&if arguments.json { found.json() } else { found.text() })?;
    Ok(if found.is_right() { Exit::Done } else { Exit::Failed })
}

/// Random sweeps with short stretches, every row against the truth.
fn estimates(arguments: &VerifyArguments, rods: u64) -> Result<Exit, CommandError> {
    let kind = if arguments.varying_fields { RandomScenes::Varying } else { RandomScenes::Uniform };
    let found = search_estimates(kind, rods, arguments.seed, &mut say)?;
    print(&if arguments.json { found.json() } else { found.text() })?;
    Ok(if found.is_right() { Exit::Done } else { Exit::Failed })
}

/// Whether all is within its limits, and whether an engine was skipped.
fn chain(arguments: &VerifyArguments) -> Result<(bool, bool), CommandError> {
    let options = VerifyOptions::new().samples(arguments.samples).seed(arguments.seed);
    let mut found = rodsweep_bench::verify::verify(&options, &mut say)?;
    found.write_replays(&arguments.out).map_err(unwritten)?;
    print(&if arguments.json { found.json() } else { found.text() })?;
    Ok((found.is_within_limits(), found.is_any_skipped()))
}

/// Whether nothing is wrong, and whether an engine was skipped.
fn hard(arguments: &VerifyArguments) -> Result<(bool, bool), CommandError> {
    let found = verify_hard(&mut say);
    print(&if arguments.json { found.json() } else { found.text() })?;
    found.write_wrong(&arguments.out, &mut say).map_err(unwritten)?;
    Ok((found.is_right(), found.is_any_skipped()))
}

/// A scene that could not be written: another directory may do.
fn unwritten(error: BenchError) -> CommandError {
    match error {
        BenchError::Write { path, source } => {
            CommandError::Usage(format!("cannot write {}: {source}; choose --out", path.display()))
        }
        error => error.into(),
    }
}
