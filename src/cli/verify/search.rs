//! `rodsweep verify --random`: looks for random scenes on which the CPU engine and the reference disagree.

use super::any_scene::any_scene;
use super::verdicts::{Difference, Mismatch, Verdicts, judge};
use crate::cli::args::VerifyArguments;
use crate::cli::{CommandError, Exit, print, say};
use rodsweep::backend::Precision;
use rodsweep::model::{Quantity, Solutions};
use rodsweep::report::{Table, engineering};
use rodsweep::sweep::write_scene;
use serde_json::json;
use std::path::Path;

const PRECISIONS: [Precision; 2] = [Precision::F64, Precision::F32];
/// Scenes between two looks at the clock of whoever waits.
const ROUND: u64 = 1024;
const SAY_EACH: u64 = 16 * ROUND;
/// Scenes of a precision that are named and written, the worst first.
const MOST_NAMED: usize = 20;

pub fn verify_random(arguments: &VerifyArguments, count: u64) -> Result<Exit, CommandError> {
    let mut verdicts = PRECISIONS.map(|_| Verdicts::default());
    for start in (0..count).step_by(ROUND as usize) {
        let end = count.min(start + ROUND);
        judge(arguments.seed, start..end, &PRECISIONS, &mut verdicts)?;
        if end % SAY_EACH == 0 {
            say(&format!("{end} scenes of {count}"));
        }
    }
    let mut lines = Vec::new();
    for (verdicts, precision) in verdicts.iter_mut().zip(PRECISIONS) {
        verdicts.mismatches.sort_by(|a, b| badness(b).total_cmp(&badness(a)));
        for mismatch in verdicts.mismatches.iter().take(MOST_NAMED) {
            let replay = arguments.out.join(format!("random-{}-{}.toml", arguments.seed, mismatch.number));
            write_replay(arguments.seed, mismatch.number, &replay)?;
            lines.push(format!("cpu {precision}, {}; replay: {}\n", describe(mismatch), replay.display()));
        }
    }
    print(&if arguments.json { json_text(&verdicts, arguments, count) } else { table(&verdicts) + &lines.concat() })?;
    let good = verdicts.iter().all(|verdicts| verdicts.only_here() + verdicts.apart() == 0);
    Ok(if good { Exit::Done } else { Exit::Failed })
}

/// What is solved here alone is worst, the surer the worse; then tips apart; then what is not solved here.
fn badness(mismatch: &Mismatch) -> f64 {
    match mismatch.difference {
        Difference::OnlyHere => 2e3 + mismatch.found.get(0, Quantity::StabilityMargin).clamp(0.0, 1e3),
        Difference::Apart(apart) if apart.is_finite() => 1e3 + apart.min(1e2),
        Difference::Apart(_) => 1.9e3,
        Difference::OnlyReference => mismatch.expected.get(0, Quantity::StabilityMargin).clamp(0.0, 1e2),
    }
}

fn write_replay(seed: u64, number: u64, path: &Path) -> Result<(), CommandError> {
    let text = write_scene(&any_scene(seed, number));
    let directory = path.parent().unwrap_or(Path::new("."));
    let written = std::fs::create_dir_all(directory).and_then(|()| std::fs::write(path, text));
    written.map_err(|error| CommandError::Usage(format!("cannot write {}: {error}; choose --out", path.display())))
}

fn table(verdicts: &[Verdicts]) -> String {
    let mut table = Table::new(["engine", "both solve", "neither", "only here", "only reference", "tips apart"]);
    for (verdicts, precision) in verdicts.iter().zip(PRECISIONS) {
        let Verdicts { both, neither, .. } = verdicts;
        let counts = [*both, *neither, verdicts.only_here(), verdicts.only_reference(), verdicts.apart()];
        table.row(std::iter::once(format!("cpu {precision}")).chain(counts.map(|count| count.to_string())));
    }
    format!("{table}\n")
}

fn describe(mismatch: &Mismatch) -> String {
    let of = |solutions: &Solutions| {
        let get = |quantity| solutions.get(0, quantity);
        let share = 100.0 * get(Quantity::LoadFraction);
        let margin = get(Quantity::StabilityMargin);
        format!("`{}` at {share:.2} % of the load, margin {margin:.3}", solutions.status(0).name())
    };
    let how = match mismatch.difference {
        Difference::OnlyHere => "solved here, not by the reference".into(),
        Difference::OnlyReference => "not solved here, but by the reference".into(),
        Difference::Apart(apart) => format!("tips {} apart", engineering(apart)),
    };
    format!("scene {}: {how}: {}; reference {}", mismatch.number, of(&mismatch.found), of(&mismatch.expected))
}

fn json_text(verdicts: &[Verdicts], arguments: &VerifyArguments, count: u64) -> String {
    let mismatch = |mismatch: &Mismatch| {
        json!({
            "scene": mismatch.number,
            "status": mismatch.found.status(0).name(),
            "reference": mismatch.expected.status(0).name(),
            "apart": match mismatch.difference {
                Difference::Apart(apart) => Some(apart),
                _ => None,
            },
        })
    };
    let engine = |(verdicts, precision): (&Verdicts, Precision)| {
        json!({
            "engine": "cpu",
            "precision": precision.to_string(),
            "both": verdicts.both,
            "neither": verdicts.neither,
            "only_here": verdicts.only_here(),
            "only_reference": verdicts.only_reference(),
            "apart": verdicts.apart(),
            "mismatches": verdicts.mismatches.iter().map(mismatch).collect::<Vec<_>>(),
        })
    };
    let value = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "seed": arguments.seed,
        "scenes": count,
        "engines": verdicts.iter().zip(PRECISIONS).map(engine).collect::<Vec<_>>(),
    });
    serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
}
