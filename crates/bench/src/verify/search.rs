//! What a search for disagreements is asked for.

use crate::random::RandomScenes;
use rodsweep::backend::{BackendKind, Precision};
use rodsweep::engines::F32_TOLERANCE;

/// Which scenes, and how they are solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SearchOptions {
    pub(super) kind: RandomScenes,
    pub(super) seed: u64,
    pub(super) first: u64,
    pub(super) scenes: u64,
    pub(super) around: Option<u64>,
    pub(super) gpu: bool,
    pub(super) judge_all: bool,
}

impl SearchOptions {
    /// So many scenes of a seed, each solved alone on the CPU.
    pub fn new(kind: RandomScenes, seed: u64, scenes: u64) -> SearchOptions {
        SearchOptions { kind, seed, first: 0, scenes, around: None, gpu: false, judge_all: false }
    }

    /// Number of the first scene: with one scene a search is repeated for that alone.
    pub fn first(self, first: u64) -> SearchOptions {
        SearchOptions { first, ..self }
    }

    /// Solves a box of so many samples around each scene as a sweep in place of the scene.
    pub fn around(self, samples: Option<u64>) -> SearchOptions {
        SearchOptions { around: samples, ..self }
    }

    /// The GPU in f32, too.
    pub fn gpu(self, gpu: bool) -> SearchOptions {
        SearchOptions { gpu, ..self }
    }

    /// Asks the judge about every scene, not only where engine and reference differ.
    pub fn judge_all(self, judge_all: bool) -> SearchOptions {
        SearchOptions { judge_all, ..self }
    }

    /// What is held against the reference.
    pub(super) fn contenders(&self) -> Vec<Contender> {
        let contender = |backend, precision, anchors| Contender { backend, precision, anchors };
        let mut all = Vec::new();
        for precision in [Precision::F64, Precision::F32] {
            all.push(contender(BackendKind::Cpu, precision, true));
            if self.around.is_some() {
                all.push(contender(BackendKind::Cpu, precision, false));
            }
        }
        if self.gpu {
            all.push(contender(BackendKind::Gpu, Precision::F32, true));
        }
        all
    }

    /// The command that repeats one scene.
    pub(super) fn replay(&self, number: u64) -> String {
        let mut command = format!("rodsweep verify --random 1 --first {number} --seed {}", self.seed);
        let around = self.around.map_or(String::new(), |samples| format!("--around {samples}"));
        let gpu = if self.gpu { "--backend gpu" } else { "" };
        let judge = if self.judge_all { "--judge" } else { "" };
        for option in [self.kind.option(), &around, gpu, judge].into_iter().filter(|option| !option.is_empty()) {
            command += " ";
            command += option;
        }
        command
    }
}

/// An engine, and for sweeps whether samples may start from anchors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contender {
    pub backend: BackendKind,
    pub precision: Precision,
    pub anchors: bool,
}

impl Contender {
    /// Target error of tips.
    pub fn tolerance(&self) -> f64 {
        match self.precision {
            Precision::F64 => 1e-9,
            Precision::F32 => F32_TOLERANCE,
        }
    }

    /// As tables show it.
    pub fn name(&self, around: bool) -> String {
        let anchors = match (around, self.anchors) {
            (false, _) => "",
            (true, true) => ", sweep",
            (true, false) => ", sweep without anchors",
        };
        format!("{} {}{anchors}", self.backend, self.precision)
    }
}
