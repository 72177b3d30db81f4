//! What came of a search, as a text and for a program.

use super::answer::{Answer, Blame, Difference};
use super::disagreements::{Disagreements, MOST_NAMED};
use super::verdicts::{Mismatch, Verdicts};
use crate::judge::Word;
use rodsweep::draw::{TextTable, engineering};
use rodsweep::input::write_scene;
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Scenes that are printed whole.
const MOST_PRINTED: usize = 5;

impl Disagreements {
    /// Seed, a table of counts, a line for each of the worst scenes, and the worst ones whole.
    pub fn text(&self) -> String {
        let heads = [
            "engine",
            "both solve",
            "neither",
            "only here",
            "only reference",
            "false folds",
            "tips apart",
            "engine wrong",
            "reference wrong",
            "undecided",
        ];
        let mut table = TextTable::new(heads);
        let mut lines = String::new();
        for (at, (verdicts, contender)) in self.verdicts.iter().zip(&self.contenders).enumerate() {
            // Without anchors either way, a box is one run.
            if !contender.anchors && verdicts.answers() == 0 {
                continue;
            }
            let name = contender.name(self.options.around.is_some());
            let counts = [
                verdicts.both,
                verdicts.neither,
                verdicts.only_here(),
                verdicts.only_reference(),
                verdicts.false_folds(),
                verdicts.apart(),
                [Blame::Engine, Blame::Both, Blame::Estimate].map(|of| verdicts.blamed(of)).iter().sum(),
                verdicts.blamed(Blame::Reference) + verdicts.blamed(Blame::Both),
                verdicts.blamed(Blame::Undecided),
            ];
            table.row(std::iter::once(name.clone()).chain(counts.map(|count| count.to_string())));
            for mismatch in verdicts.mismatches.iter().take(MOST_NAMED) {
                let replay = self.replay_of(at, mismatch);
                let replay = replay.map_or(String::new(), |path| format!("; replay: {}", path.display()));
                lines += &format!("{name}, {}{replay}\n", describe(mismatch));
            }
        }
        let head = format!("seed {}, {} scenes{}", self.options.seed, self.options.scenes, self.of_kind());
        format!("{head}\n\n{table}\n{lines}{}", self.scenes())
    }

    fn of_kind(&self) -> String {
        let mut text = String::new();
        if !self.options.kind.option().is_empty() {
            text += &format!(", {}", self.options.kind.option());
        }
        if let Some(samples) = self.options.around {
            text += &format!(", {samples} samples around each");
            let anchored: Vec<String> = self.verdicts.iter().map(|of| of.anchored.to_string()).collect();
            text += &format!(", boxes with anchors by engine: {}", anchored.join(", "));
        }
        let judged: usize = self.verdicts.iter().map(|of| of.judged).sum();
        let unsure: usize = self.verdicts.iter().map(|of| of.unsure).sum();
        if judged > 0 {
            text += &format!(", {judged} solved rods judged, of {unsure} the judge is not sure");
        }
        if self.skipped > 0 {
            text += &format!(", {} of them with nothing to vary", self.skipped);
        }
        text
    }

    /// The worst scenes that an engine is or may be wrong on, each once, with the command that replays it.
    fn scenes(&self) -> String {
        let mut text = String::new();
        let mut printed = BTreeSet::new();
        let failures = self.verdicts.iter().flat_map(|verdicts| &verdicts.mismatches);
        for mismatch in failures.filter(|mismatch| mismatch.blame.is_failure()) {
            if printed.len() < MOST_PRINTED && printed.insert((mismatch.number, mismatch.sample)) {
                let replay = self.options.replay(mismatch.number);
                text += &format!("\n# {}\n# {replay}\n{}", at(mismatch), write_scene(&mismatch.scene));
            }
        }
        text
    }

    /// The same for a program.
    pub fn json(&self) -> String {
        let engine = |(verdicts, contender): (&Verdicts, &super::search::Contender)| {
            json!({
                "engine": contender.backend.to_string(),
                "precision": contender.precision.to_string(),
                "anchors": contender.anchors,
                "anchored": verdicts.anchored,
                "judged": verdicts.judged,
                "unsure": verdicts.unsure,
                "both": verdicts.both,
                "neither": verdicts.neither,
                "only_here": verdicts.only_here(),
                "only_reference": verdicts.only_reference(),
                "false_folds": verdicts.false_folds(),
                "apart": verdicts.apart(),
                "wrong": Blame::ALL.iter().map(|of| (of.name().to_owned(), verdicts.blamed(*of).into()))
                    .collect::<serde_json::Map<String, Value>>(),
                "mismatches": verdicts.mismatches.iter().map(|of| self.mismatch(of)).collect::<Vec<_>>(),
            })
        };
        let value = json!({
            "version": rodsweep::VERSION,
            "seed": self.options.seed,
            "first": self.options.first,
            "scenes": self.options.scenes,
            "kind": self.options.kind.option(),
            "around": self.options.around,
            "skipped": self.skipped,
            "engines": self.verdicts.iter().zip(&self.contenders).map(engine).collect::<Vec<_>>(),
        });
        serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
    }

    fn mismatch(&self, mismatch: &Mismatch) -> Value {
        json!({
            "scene": mismatch.number,
            "sample": mismatch.sample,
            "status": mismatch.found.status.name(),
            "reference": mismatch.expected.status.name(),
            "apart": match mismatch.difference {
                Difference::Apart(apart) => Some(apart),
                _ => None,
            },
            "judge": word(&mismatch.word),
            "wrong": mismatch.blame.name(),
            "replay": self.options.replay(mismatch.number),
            "toml": write_scene(&mismatch.scene),
        })
    }
}

fn at(mismatch: &Mismatch) -> String {
    match mismatch.sample {
        Some(sample) => format!("scene {}, sample {sample}", mismatch.number),
        None => format!("scene {}", mismatch.number),
    }
}

fn word(word: &Word) -> String {
    match word {
        Word::Arrives { .. } => "arrives".into(),
        Word::Ends { load } => format!("ends at {:.2} % of the load", 100.0 * load),
        Word::Unsure => "unsure".into(),
    }
}

fn describe(mismatch: &Mismatch) -> String {
    let of = |answer: &Answer| {
        let (share, margin) = (100.0 * answer.load, answer.margin);
        format!("`{}` at {share:.2} % of the load, margin {margin:.3}", answer.status.name())
    };
    let how = match mismatch.difference {
        Difference::OnlyHere => "solved here, not by the reference".into(),
        Difference::OnlyReference => "not solved here, but by the reference".into(),
        Difference::Apart(apart) => format!("tips {} apart", engineering(apart)),
        Difference::Judged => "engine and reference agree, the judge does not".into(),
    };
    let who = match mismatch.blame {
        Blame::Engine => "the engine is wrong",
        Blame::Reference => "the reference is wrong",
        Blame::Both => "both are wrong",
        Blame::Estimate => "one branch, the engine's error estimate is too small",
        Blame::Unsolved => "the engine has no answer",
        Blame::Undecided => "who is wrong is not decided",
    };
    let [found, expected] = [&mismatch.found, &mismatch.expected].map(of);
    format!("{}: {how}: {found}; reference {expected}; judge: {}: {who}", at(mismatch), word(&mismatch.word))
}
