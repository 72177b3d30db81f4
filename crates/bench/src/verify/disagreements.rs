//! Looks for random scenes, every combination of terms among them, on which the CPU engine and the reference disagree.

use super::verdicts::{Difference, Mismatch, Verdicts, judge};
use crate::error::BenchError;
use crate::random::RandomScenes;
use rodsweep::backend::Precision;
use rodsweep::input::write_scene;
use rodsweep::model::{Quantity, Solutions};
use rodsweep::report::{TextTable, engineering};
use serde_json::json;
use std::path::{Path, PathBuf};

const PRECISIONS: [Precision; 2] = [Precision::F64, Precision::F32];
/// Scenes that are solved before what came of them is looked at.
const ROUND: u64 = 1024;
const SAY_EACH: u64 = 16 * ROUND;
/// Scenes of a precision that are named and written, the worst first.
const MOST_NAMED: usize = 20;

/// What came of a search.
pub struct Disagreements {
    kind: RandomScenes,
    seed: u64,
    scenes: u64,
    verdicts: [Verdicts; 2],
    /// Where the worst scenes were written: precision, number, path.
    replays: Vec<(Precision, u64, PathBuf)>,
}

/// Solves `scenes` random scenes of a seed on the CPU engine in f64 and f32, as `run` does, and on the reference.
///
/// # Errors
///
/// An engine that fails as a whole.
pub fn search_disagreements(
    kind: RandomScenes,
    scenes: u64,
    seed: u64,
    progress: &mut dyn FnMut(&str),
) -> Result<Disagreements, BenchError> {
    let mut verdicts = PRECISIONS.map(|_| Verdicts::default());
    for start in (0..scenes).step_by(ROUND as usize) {
        let end = scenes.min(start + ROUND);
        judge((kind, seed), start..end, &PRECISIONS, &mut verdicts)?;
        if end.is_multiple_of(SAY_EACH) {
            progress(&format!("{end} scenes of {scenes}"));
        }
    }
    for verdicts in &mut verdicts {
        verdicts.mismatches.sort_by(|a, b| badness(b).total_cmp(&badness(a)));
    }
    Ok(Disagreements { kind, seed, scenes, verdicts, replays: Vec::new() })
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

impl Disagreements {
    /// Whether nothing is solved by the engine alone, no tips are apart, and no fold is none.
    pub fn is_right(&self) -> bool {
        self.verdicts.iter().all(|verdicts| verdicts.only_here() + verdicts.apart() + verdicts.false_folds() == 0)
    }

    /// Writes the worst scenes into a folder, for `solve`.
    ///
    /// # Errors
    ///
    /// A folder or file that cannot be written.
    pub fn write_replays(&mut self, folder: &Path) -> Result<(), BenchError> {
        for (verdicts, precision) in self.verdicts.iter().zip(PRECISIONS) {
            for mismatch in verdicts.mismatches.iter().take(MOST_NAMED) {
                let path = folder.join(format!("random-{}-{}.toml", self.seed, mismatch.number));
                let text = write_scene(&self.kind.scene(self.seed, mismatch.number));
                let written = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&path, text));
                written.map_err(|source| BenchError::Write { path: path.clone(), source })?;
                self.replays.push((precision, mismatch.number, path));
            }
        }
        Ok(())
    }

    /// A table of counts, and a line for each of the worst scenes.
    pub fn text(&self) -> String {
        let heads = ["engine", "both solve", "neither", "only here", "only reference", "false folds", "tips apart"];
        let mut table = TextTable::new(heads);
        let mut lines = String::new();
        for (verdicts, precision) in self.verdicts.iter().zip(PRECISIONS) {
            let Verdicts { both, neither, .. } = verdicts;
            let [only_here, only_reference] = [verdicts.only_here(), verdicts.only_reference()];
            let counts = [*both, *neither, only_here, only_reference, verdicts.false_folds(), verdicts.apart()];
            table.row(std::iter::once(format!("cpu {precision}")).chain(counts.map(|count| count.to_string())));
            for mismatch in verdicts.mismatches.iter().take(MOST_NAMED) {
                let is_this =
                    |replay: &&(Precision, u64, PathBuf)| (replay.0, replay.1) == (precision, mismatch.number);
                let replay = self.replays.iter().find(is_this);
                let replay = replay.map_or(String::new(), |(.., path)| format!("; replay: {}", path.display()));
                lines += &format!("cpu {precision}, {}{replay}\n", describe(mismatch));
            }
        }
        format!("{table}\n{lines}")
    }

    /// The same for a program.
    pub fn json(&self) -> String {
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
                "false_folds": verdicts.false_folds(),
                "apart": verdicts.apart(),
                "mismatches": verdicts.mismatches.iter().map(mismatch).collect::<Vec<_>>(),
            })
        };
        let value = json!({
            "version": rodsweep::VERSION,
            "seed": self.seed,
            "scenes": self.scenes,
            "engines": self.verdicts.iter().zip(PRECISIONS).map(engine).collect::<Vec<_>>(),
        });
        serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
    }
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
