//! One answer of an engine, whether from a batch or from the rows of a sweep, and how two of them differ.

use crate::judge::{OTHER_FORCE, OTHER_PLACE, OTHER_TURN, Word, judge};
use rodsweep::model::{
    ContactColumn, Matrix, Quantity, Scene, Solutions, Status, Vector, rotation_angle, rotation_matrix,
};
use rodsweep::table::Table;

/// An error that is so many times the tolerance, and the row's own estimate, is no matter of resolution or round-off.
const WRONG: f64 = 10.0;

/// The answer of an engine to a scene.
#[derive(Clone, Debug)]
pub struct Answer {
    pub status: Status,
    pub position: Vector,
    pub rotation: Matrix,
    pub margin: f64,
    /// Share of the load that was reached.
    pub load: f64,
    pub estimate: f64,
    /// Contact force of the wall on the tip, world frame (N); NaN where the scene has no wall.
    pub force: Vector,
    /// Estimated error of that (N).
    pub force_error: f64,
    /// Contact forces below this are compared by their difference (N).
    pub least_force: f64,
    /// A path that has ended without a turn of its load having been seen: a sweep asks the reference.
    pub is_doubt: bool,
}

/// How an engine differs from the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Difference {
    /// Solved by the engine, not by the reference.
    OnlyHere,
    /// Solved by the reference, not by the engine.
    OnlyReference,
    /// Both solved; the larger of |dp| over length and the angle between the tips (rad) is more than allowed.
    Apart(f64),
    /// Both say the same, and the judge says otherwise.
    Judged,
}

/// The side that the third judge finds wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blame {
    Engine,
    Reference,
    Both,
    /// Both are on one branch, further apart than the engine's error estimate allows.
    Estimate,
    /// The engine has no answer and claims none; the branch goes on, or nobody knows.
    Unsolved,
    /// The judge is not sure.
    Undecided,
}

impl Blame {
    pub const ALL: [Blame; 6] =
        [Blame::Engine, Blame::Reference, Blame::Both, Blame::Estimate, Blame::Unsolved, Blame::Undecided];

    /// The word in texts.
    pub fn name(self) -> &'static str {
        match self {
            Blame::Engine => "engine",
            Blame::Reference => "reference",
            Blame::Both => "both",
            Blame::Estimate => "estimate",
            Blame::Unsolved => "unsolved",
            Blame::Undecided => "undecided",
        }
    }

    /// Whether the engine is, or may be, wrong.
    pub fn is_failure(self) -> bool {
        matches!(self, Blame::Engine | Blame::Both | Blame::Estimate | Blame::Undecided)
    }
}

impl Answer {
    /// From a batch.
    pub fn of_solution(solutions: &Solutions, sample: usize) -> Answer {
        Answer {
            status: solutions.status(sample),
            position: solutions.vector(sample, Quantity::TipPosition),
            rotation: solutions.tip_rotation(sample),
            margin: solutions.get(sample, Quantity::StabilityMargin),
            load: solutions.get(sample, Quantity::LoadFraction),
            estimate: solutions.get(sample, Quantity::ErrorEstimate),
            force: solutions.contact_vector(sample, ContactColumn::Force),
            force_error: solutions.contact(sample, ContactColumn::ForceError),
            least_force: 0.0,
            is_doubt: solutions.status(sample) == Status::Fold && !solutions.is_seen_fold(sample),
        }
    }

    /// From a row of a sweep that writes all quantities.
    pub fn of_row(rows: &Table, row: usize) -> Answer {
        let number = |name: &str| rows.column(name).map_or(f64::NAN, |column| column.values.number(row));
        let vector = |name: &str| ["x", "y", "z"].map(|axis| number(&format!("{name}.{axis}")));
        Answer {
            status: rows.statuses()[row],
            position: vector("tip.position"),
            rotation: rotation_matrix(vector("tip.rotation")),
            margin: number("stability.margin"),
            load: number("load_fraction"),
            estimate: number("error_estimate"),
            force: vector("contact.force"),
            force_error: number("contact.force_error"),
            least_force: 0.0,
            is_doubt: false,
        }
    }

    /// The larger of |dp| over length and the angle between the tips (rad).
    pub fn apart(&self, other: &Answer, length: f64) -> f64 {
        let dp = (0..3).map(|k| (self.position[k] - other.position[k]).powi(2)).sum::<f64>().sqrt() / length;
        dp.max(rotation_angle(&self.rotation, &other.rotation))
    }

    /// How far the forces of a wall are apart and the estimated error of this, over the larger force, or over `least_force`; else 0.
    fn force_apart(&self, force: Vector) -> [f64; 2] {
        if [self.force, force].as_flattened().iter().all(|x| x.is_nan()) {
            return [0.0; 2];
        }
        let size = |v: Vector| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let apart = size(std::array::from_fn(|k| self.force[k] - force[k]));
        let scale = size(self.force).max(size(force)).max(self.least_force);
        if scale > 0.0 { [apart / scale, self.force_error / scale] } else { [0.0; 2] }
    }

    /// How this differs from the reference's answer, at the engine's tolerance.
    pub fn difference(&self, expected: &Answer, tolerance: f64, length: f64) -> Option<Difference> {
        match (self.status.is_success(), expected.status.is_success()) {
            (true, true) => {
                let pose = [self.apart(expected, length), self.estimate];
                let is_wrong =
                    |[apart, estimate]: &[f64; 2]| apart.is_nan() || *apart > WRONG * tolerance.max(*estimate);
                let [apart, _] = [pose, self.force_apart(expected.force)].into_iter().find(is_wrong)?;
                Some(Difference::Apart(apart))
            }
            (true, false) => Some(Difference::OnlyHere),
            (false, true) => Some(Difference::OnlyReference),
            (false, false) => None,
        }
    }

    /// Whether it says that the path ends in a fold, with evidence.
    pub fn claims_fold(&self) -> bool {
        self.status == Status::Fold && !self.is_doubt
    }

    fn is_branch_of(&self, other: &Answer, length: f64) -> bool {
        let dp = (0..3).map(|k| (self.position[k] - other.position[k]).powi(2)).sum::<f64>().sqrt();
        dp <= OTHER_PLACE * length && rotation_angle(&self.rotation, &other.rotation) <= OTHER_TURN
    }

    /// Whether the judge bears this out: a tip on its branch, or a fold where its path ends. `None`: neither says.
    fn is_right(&self, word: &Word, length: f64) -> Option<bool> {
        match (word, self.status) {
            (Word::Unsure, _) => None,
            (Word::Arrives { force, .. }, status)
                if status.is_success() && self.force_apart(*force)[0] > OTHER_FORCE =>
            {
                Some(false)
            }
            (_, status) if status.is_success() => word.agrees_with(self.position, &self.rotation, length),
            (Word::Arrives { .. }, Status::Fold) => Some(false),
            (Word::Ends { .. }, _) => Some(true),
            (Word::Arrives { .. }, _) => None,
        }
    }
}

/// A difference with the judge's word on it.
pub struct Verdict {
    pub difference: Difference,
    pub word: Word,
    pub blame: Blame,
}

/// The word of the judge on two answers to a scene, where they differ, or `always`.
pub fn ask(found: &Answer, expected: &Answer, tolerance: f64, scene: &Scene, always: bool) -> Option<Word> {
    let difference = found.difference(expected, tolerance, scene.total_length());
    (difference.is_some() || always).then(|| judge(&scene.rod()))
}

/// Compares an engine's answer with the reference's by the judge's word.
pub fn compare(found: &Answer, expected: &Answer, tolerance: f64, scene: &Scene, word: Word) -> Option<Verdict> {
    let length = scene.total_length();
    let difference = found.difference(expected, tolerance, length);
    let mut right = [found, expected].map(|of| of.is_right(&word, length));
    if found.is_doubt && right[0] == Some(false) {
        right[0] = None;
    }
    match difference {
        None => {
            let blame = match right {
                [Some(false), Some(false)] => Blame::Both,
                [None, Some(false)] => Blame::Reference,
                _ => return None,
            };
            Some(Verdict { difference: Difference::Judged, word, blame })
        }
        Some(difference) => {
            let is_same = matches!(difference, Difference::Apart(_)) && found.is_branch_of(expected, length);
            let is_silent = difference == Difference::OnlyReference && !found.claims_fold();
            let blame = match right {
                _ if is_same => Blame::Estimate,
                [_, Some(false)] if is_silent => Blame::Reference,
                _ if is_silent => Blame::Unsolved,
                [Some(false), Some(false)] => Blame::Both,
                [Some(false), _] => Blame::Engine,
                [Some(true), _] => Blame::Reference,
                [None, _] => Blame::Undecided,
            };
            Some(Verdict { difference, word, blame })
        }
    }
}
