//! What was measured, as the sections of the report look at it.

use crate::record::Record;
use serde_json::Value;

/// What was measured, and where.
pub struct Report {
    pub(super) records: Vec<Record>,
    pub(super) manifest: Value,
}

/// Kinds of work and the words for them.
pub(super) const WORK: [(&str, &str); 5] = [
    ("given", "from a known base moment, few columns"),
    ("tip", "tip + few columns, from rest"),
    ("cold", "equilibrium + Jacobian, from rest"),
    ("sweep", "equilibrium + Jacobian, in a sweep"),
    ("warm", "equilibrium + Jacobian, warm"),
];

/// Of the samples so many may fail or be elsewhere, and the rest still counts as solved.
const MOST_LOST: f64 = 0.02;

impl Report {
    pub(super) fn part<'a>(&'a self, part: &'a str) -> impl Iterator<Item = &'a Record> + Clone {
        self.records.iter().filter(move |record| record.part == part)
    }

    /// Measurements of a scene.
    pub(super) fn points<'a>(&'a self, case: &'a str, work: &'a str) -> impl Iterator<Item = &'a Record> + Clone {
        self.part("precision").filter(move |record| record.case == case && record.work == work)
    }

    /// This program's, with the best instructions.
    pub(super) fn ours<'a>(
        &'a self,
        case: &'a str,
        work: &'a str,
        precision: &'a str,
    ) -> impl Iterator<Item = &'a Record> + Clone {
        let best = self.best_set();
        self.points(case, work).filter(move |record| record.engine == best && record.precision == precision)
    }

    /// Instruction sets of the CPU, the best first.
    pub(super) fn sets(&self) -> Vec<String> {
        let list = self.manifest["instruction_sets"].as_array().cloned().unwrap_or_default();
        list.iter().filter_map(|set| set.as_str().map(str::to_owned)).collect()
    }

    pub(super) fn best_set(&self) -> String {
        self.sets().into_iter().next().unwrap_or_default()
    }

    pub(super) fn steppers(&self) -> Vec<String> {
        let list = self.manifest["steppers"].as_array().cloned().unwrap_or_default();
        list.iter().filter_map(|stepper| stepper["name"].as_str().map(str::to_owned)).collect()
    }

    /// Name and title of each scene.
    pub(super) fn scenes(&self) -> Vec<(String, String)> {
        let list = self.manifest["scenes"].as_array().cloned().unwrap_or_default();
        let word = |scene: &Value, key: &str| scene[key].as_str().unwrap_or_default().to_owned();
        list.iter().map(|scene| (word(scene, "name"), word(scene, "title"))).collect()
    }

    /// The scene that targets are stated for.
    pub(super) fn first_scene(&self) -> String {
        self.scenes().into_iter().next().map(|(name, _)| name).unwrap_or_default()
    }
}

impl Record {
    /// Method, and steps or tolerance.
    pub(super) fn settings(&self) -> String {
        match self.size {
            size if size.is_nan() => self.method.clone(),
            size if size < 1.0 => format!("{} to {size:.0e}", self.method),
            size => format!("{}, {size} steps", self.method),
        }
    }

    /// Whether it solved nearly all samples.
    pub(super) fn is_sound(&self) -> bool {
        self.failed + self.elsewhere <= MOST_LOST * self.samples
    }

    pub(super) fn is_literature(&self) -> bool {
        self.engine.starts_with("literature")
    }

    /// Measured by `benches/peers`.
    pub(super) fn is_peer(&self) -> bool {
        self.part == "peers"
    }

    pub(super) fn is_gpu(&self) -> bool {
        self.engine.starts_with("GPU")
    }
}

/// The fastest whose tips are, for 95 % of the samples, as near as asked.
pub(super) fn fastest<'a>(records: impl Iterator<Item = &'a Record>, asked: f64) -> Option<&'a Record> {
    let meets = |record: &&Record| record.is_sound() && record.tip[1] <= asked;
    records.filter(meets).min_by(|a, b| a.seconds.total_cmp(&b.seconds))
}
