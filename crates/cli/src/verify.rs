//! `rodsweep verify`: every engine of this machine against the reference, or on the hard cases.

use crate::{CommandError, Exit, print, say};
use clap::{Args, ValueEnum};
use rodsweep::backend::BackendKind;
use rodsweep_bench::BenchError;
use rodsweep_bench::random::RandomScenes;
use rodsweep_bench::verify::{SearchOptions, VerifyOptions, search_disagreements, search_estimates, verify_hard};
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

#[derive(Debug, Args)]
pub struct VerifyArguments {
    /// The hard cases instead: folds, flips, many equilibria, extreme units
    #[arg(long, conflicts_with_all = ["samples", "seed"])]
    pub hard: bool,
    /// Look for disagreement instead: so many random scenes, with every combination of terms, on the CPU engine and on
    /// the reference; where they differ a third judge decides
    #[arg(long, value_name = "N", conflicts_with_all = ["hard", "samples"])]
    pub random: Option<u64>,
    /// These scenes with gradients, magnets and coils around the rod
    #[arg(long, requires = "random", conflicts_with_all = ["designs", "limp"])]
    pub varying_fields: bool,
    /// Catheters that people build in their place: tubes of real materials, sets of three windings, magnets
    #[arg(long, requires = "random", conflicts_with = "limp")]
    pub designs: bool,
    /// Limp and taut rods in their place
    #[arg(long, requires = "random")]
    pub limp: bool,
    /// Rods in fields that are sampled on a grid in their place
    #[arg(long, requires = "random", conflicts_with_all = ["designs", "limp", "varying_fields"])]
    pub sampled_fields: bool,
    /// Rods beside a wall in the way of their tip in their place
    #[arg(long, requires = "random", conflicts_with_all = ["designs", "limp", "varying_fields", "sampled_fields"])]
    pub walls: bool,
    /// Around each random scene a box of N samples, solved as a sweep
    #[arg(long, value_name = "N", requires = "random", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub around: Option<u64>,
    /// Number of the first random scene, or sweep with --estimates: to repeat one of them
    #[arg(long, value_name = "K", default_value_t = 0, requires = "random")]
    pub first: u64,
    /// Look for rows that are off by more than their estimates instead: random sweeps of N rods, with short tapers and kinks,
    /// on the CPU engine at loose and at tight tolerances or on a GPU, against grids that are refined until they agree
    #[arg(long, requires = "random", conflicts_with_all = ["around", "judge"])]
    pub estimates: bool,
    /// Ask the judge about every random scene, not only where engine and reference differ
    #[arg(long, requires = "random")]
    pub judge: bool,
    /// Engines that solve random scenes: the CPU, or a GPU beside it (with --estimates in its place). Without --random, `gpu` checks a GPU that is software, too
    #[arg(long, value_enum)]
    pub backend: Option<VerifyBackend>,
    /// Check a GPU that is software, too, which takes minutes
    #[arg(long, conflicts_with = "random")]
    pub software: bool,
    /// Random scenes beside the built-in ones
    #[arg(long, value_name = "N", default_value_t = 200)]
    pub samples: usize,
    /// Seed of the random scenes [default: 1, with --random a new one, which is printed]
    #[arg(long)]
    pub seed: Option<u64>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Where the worst sample of a row beyond its limit is written, as a scene
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
}

/// Engines of `verify`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum VerifyBackend {
    Cpu,
    Gpu,
}

pub fn verify(arguments: &VerifyArguments) -> Result<Exit, CommandError> {
    if let Some(scenes) = arguments.random {
        return random(arguments, scenes);
    }
    let (good, skipped) = if arguments.hard { hard(arguments)? } else { chain(arguments)? };
    let refused = skipped && std::env::var("RODSWEEP_GPU").is_ok_and(|value| value == "require");
    if refused {
        say("error: an engine was skipped, and RODSWEEP_GPU=require asks for all; install a driver or unset it");
    }
    Ok(if good && !refused { Exit::Done } else { Exit::Failed })
}

/// Random scenes on the engines and on the reference; where they differ a third judge decides.
fn random(arguments: &VerifyArguments, scenes: u64) -> Result<Exit, CommandError> {
    let kind = match arguments {
        VerifyArguments { varying_fields: true, .. } => RandomScenes::Varying,
        VerifyArguments { designs: true, .. } => RandomScenes::Designs,
        VerifyArguments { limp: true, .. } => RandomScenes::Limp,
        VerifyArguments { sampled_fields: true, .. } => RandomScenes::Sampled,
        VerifyArguments { walls: true, .. } => RandomScenes::Walls,
        _ => RandomScenes::Uniform,
    };
    let seed = arguments.seed.unwrap_or_else(seed_of_the_clock);
    // Before anything is solved: a search that is interrupted can be repeated.
    say(&format!("seed {seed}"));
    if arguments.estimates {
        let backend = if arguments.backend == Some(VerifyBackend::Gpu) { BackendKind::Gpu } else { BackendKind::Cpu };
        let found = search_estimates(kind, (scenes, arguments.first), seed, backend, &mut say)?;
        print(&if arguments.json { found.json() } else { found.text() })?;
        let files = found.write_figure(&arguments.out).map_err(unwritten)?;
        say(&format!("figure: {}", files[0].display()));
        for sweep in found.write_replays(&arguments.out).map_err(unwritten)? {
            say(&format!("repeat with: rodsweep run {} --limit 16", sweep.display()));
        }
        return Ok(if found.is_right() { Exit::Done } else { Exit::Failed });
    }
    let options = SearchOptions::new(kind, seed, scenes)
        .first(arguments.first)
        .around(arguments.around)
        .gpu(arguments.backend == Some(VerifyBackend::Gpu))
        .judge_all(arguments.judge);
    let mut found = search_disagreements(&options, &mut say)?;
    found.write_replays(&arguments.out).map_err(unwritten)?;
    print(&if arguments.json { found.json() } else { found.text() })?;
    Ok(if found.is_right() { Exit::Done } else { Exit::Failed })
}

/// Six digits or more that nobody has chosen.
fn seed_of_the_clock() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    now.as_secs().wrapping_mul(1_000).wrapping_add(u64::from(now.subsec_millis())) % 1_000_000_000_000
}

/// Whether a GPU that is software is checked: where the user asks for it, or for every engine.
fn takes_software(arguments: &VerifyArguments) -> bool {
    let is_required = std::env::var("RODSWEEP_GPU").is_ok_and(|value| value == "require");
    arguments.software || arguments.backend == Some(VerifyBackend::Gpu) || is_required
}

/// Whether all is within its limits, and whether an engine was skipped.
fn chain(arguments: &VerifyArguments) -> Result<(bool, bool), CommandError> {
    let options = VerifyOptions::new().samples(arguments.samples).seed(arguments.seed.unwrap_or(1));
    let options = options.software(takes_software(arguments));
    let mut found = rodsweep_bench::verify::verify(&options, &mut say)?;
    found.write_replays(&arguments.out).map_err(unwritten)?;
    print(&if arguments.json { found.json() } else { found.text() })?;
    Ok((found.is_within_limits(), found.is_any_skipped()))
}

/// Whether nothing is wrong, and whether an engine was skipped.
fn hard(arguments: &VerifyArguments) -> Result<(bool, bool), CommandError> {
    let found = verify_hard(takes_software(arguments), &mut say);
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
