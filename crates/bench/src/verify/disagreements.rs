//! Looks for random scenes on which engines and the reference disagree, and says who was wrong.

use super::answer::{Blame, Difference};
use super::around::judge_box;
use super::search::{Contender, SearchOptions};
use super::verdicts::{Mismatch, Verdicts, judge_scenes};
use crate::error::BenchError;
use crate::files::write_in_directory;
use rodsweep::input::write_scene;
use std::path::{Path, PathBuf};

/// Scenes that are solved before what came of them is looked at.
const ROUND: u64 = 1024;
const SAY_EACH: u64 = 16 * ROUND;
const SAY_EACH_BOX: u64 = 64;
/// Scenes of an engine that are named and written, the worst first.
pub(super) const MOST_NAMED: usize = 20;

/// What came of a search.
pub struct Disagreements {
    pub(super) options: SearchOptions,
    pub(super) contenders: Vec<Contender>,
    pub(super) verdicts: Vec<Verdicts>,
    /// Boxes that had nothing to vary.
    pub(super) skipped: u64,
    /// Where the worst scenes were written: engine, scene, sample of its box, path.
    pub(super) replays: Vec<(usize, u64, Option<u64>, PathBuf)>,
}

/// Solves random scenes of a seed, or boxes around them, on the engines that are asked for, as `run` does, and on the
/// reference. Where they differ the third judge is asked.
///
/// # Errors
///
/// An engine that fails as a whole.
pub fn search_disagreements(
    options: &SearchOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<Disagreements, BenchError> {
    let contenders = options.contenders();
    let mut verdicts: Vec<Verdicts> = contenders.iter().map(|_| Verdicts::default()).collect();
    let mut skipped = 0;
    let last = options.first.saturating_add(options.scenes);
    let (mut at, step) = (options.first, if options.around.is_some() { 1 } else { ROUND });
    while at < last {
        let end = last.min(at + step);
        match options.around {
            Some(_) => skipped += u64::from(!judge_box(options, at, &contenders, &mut verdicts)?),
            None => judge_scenes(options, at..end, &contenders, &mut verdicts)?,
        }
        at = end;
        let done = at - options.first;
        let say_each = if options.around.is_some() { SAY_EACH_BOX } else { SAY_EACH };
        if done.is_multiple_of(say_each) {
            let wrong: usize = verdicts.iter().map(failures).sum();
            progress(&format!("{done} scenes of {}; {wrong} answers that are or may be wrong", options.scenes));
        }
    }
    for verdicts in &mut verdicts {
        verdicts.mismatches.sort_by(|a, b| badness(b).total_cmp(&badness(a)));
    }
    Ok(Disagreements { options: *options, contenders, verdicts, skipped, replays: Vec::new() })
}

/// Answers of an engine that are wrong, or may be.
fn failures(verdicts: &Verdicts) -> usize {
    verdicts.count(|mismatch| mismatch.blame.is_failure())
}

/// A wrong engine is worst, then what is not decided; of these what is solved here alone, the surer the worse; then tips apart;
/// then what is not solved here.
fn badness(mismatch: &Mismatch) -> f64 {
    let by_blame = match mismatch.blame {
        Blame::Engine | Blame::Both | Blame::Estimate => 1e5,
        Blame::Undecided => 5e4,
        Blame::Reference => 2e4,
        Blame::Unsolved => 0.0,
    };
    by_blame
        + match mismatch.difference {
            Difference::OnlyHere | Difference::Judged => 2e3 + mismatch.found.margin.clamp(0.0, 1e3),
            Difference::Apart(apart) if apart.is_finite() => 1e3 + apart.min(1e2),
            Difference::Apart(_) => 1.9e3,
            Difference::OnlyReference => mismatch.expected.margin.clamp(0.0, 1e2),
        }
}

impl Disagreements {
    /// Whether no answer of an engine is wrong, or may be: nothing is solved past a fold or on another branch, and no fold is none.
    /// A wrong reference and an answer that is missing are no fault of the kind.
    pub fn is_right(&self) -> bool {
        self.verdicts.iter().all(|verdicts| failures(verdicts) == 0)
    }

    /// Scenes of an engine, the worst, on which nobody can say who is wrong; `None` where an engine is known to be.
    pub fn undecided(&self) -> Option<usize> {
        let undecided = |verdicts: &Verdicts| verdicts.count(|mismatch| mismatch.blame == Blame::Undecided);
        let is_wrong = |verdicts: &Verdicts| failures(verdicts) > undecided(verdicts);
        if self.verdicts.iter().any(is_wrong) { None } else { self.verdicts.iter().map(undecided).max() }
    }

    /// Writes the worst scenes into a folder, for `solve`, and the sweeps of boxes beside them, for `run`.
    ///
    /// # Errors
    ///
    /// A folder or file that cannot be written.
    pub fn write_replays(&mut self, folder: &Path) -> Result<(), BenchError> {
        for (engine, verdicts) in self.verdicts.iter().enumerate() {
            for mismatch in verdicts.mismatches.iter().take(MOST_NAMED) {
                let kind = self.options.kind.option().trim_start_matches('-');
                let kind = if kind.is_empty() { "random" } else { kind };
                let box_of = format!("{kind}-{}-{}", self.options.seed, mismatch.number);
                let name = mismatch.sample.map_or(box_of.clone(), |sample| format!("{box_of}-{sample}"));
                let path = folder.join(format!("{name}.toml"));
                write_in_directory(&path, &write_scene(&mismatch.scene).replace("digest = \"\"\n", ""))?;
                for (name, text) in self.options.kind.files(self.options.seed, mismatch.number) {
                    write_in_directory(&folder.join(name), &text)?;
                }
                if let Some(sweep) = &mismatch.sweep {
                    write_in_directory(&folder.join(format!("{box_of}.sweep.toml")), sweep)?;
                }
                self.replays.push((engine, mismatch.number, mismatch.sample, path));
            }
        }
        Ok(())
    }

    /// Where a scene was written.
    pub(super) fn replay_of(&self, engine: usize, mismatch: &Mismatch) -> Option<&Path> {
        let is_this =
            |of: &&(usize, u64, Option<u64>, PathBuf)| (of.0, of.1, of.2) == (engine, mismatch.number, mismatch.sample);
        self.replays.iter().find(is_this).map(|(.., path)| path.as_path())
    }
}
