//! Random scenes on the CPU engine, as `run` takes it, against the verdict of the reference.

use crate::random::RandomScenes;
use rayon::prelude::*;
use rodsweep::backend::{Backend, BackendError, Precision};
use rodsweep::lanes::Lanes;
use rodsweep::model::rotation_angle;
use rodsweep::model::{Plan, PlanOptions, Quantity, Scene, Solutions, Status, Stepper};
use rodsweep::reference::Reference;
use std::ops::Range;

/// First attempts in a precision: what `run` would take for ordinary scenes.
fn first_attempt(precision: Precision) -> PlanOptions {
    let (stepper, steps, tolerance) = match precision {
        Precision::F64 | Precision::Mixed => (Stepper::Dop853, 4, 1e-9),
        Precision::F32 => (Stepper::Tp7, 4, 2e-5),
    };
    PlanOptions { stepper, steps, tolerance, ..PlanOptions::default() }
}

/// Steps of a second attempt, in f64 by DOP853.
const SECOND_STEPS: usize = 24;
/// An error that is so many times the tolerance, and the row's own estimate, is no matter of resolution or round-off.
const WRONG: f64 = 10.0;

/// How the engine differs from the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Difference {
    /// Solved by the engine, not by the reference.
    OnlyHere,
    /// Solved by the reference, not by the engine.
    OnlyReference,
    /// Both solved; the larger of |dp| over length and the angle between the tips (rad) is more than allowed.
    Apart(f64),
}

/// A scene on which the engine and the reference disagree.
pub struct Mismatch {
    pub number: u64,
    pub difference: Difference,
    pub found: Solutions,
    pub expected: Solutions,
}

/// One precision of the engine.
#[derive(Default)]
pub struct Verdicts {
    /// Scenes that both solved, and that neither did.
    pub both: usize,
    pub neither: usize,
    /// By scene.
    pub mismatches: Vec<Mismatch>,
}

impl Verdicts {
    pub fn count(&self, is_counted: impl Fn(Difference) -> bool) -> usize {
        self.mismatches.iter().filter(|mismatch| is_counted(mismatch.difference)).count()
    }

    pub fn only_here(&self) -> usize {
        self.count(|difference| difference == Difference::OnlyHere)
    }

    pub fn only_reference(&self) -> usize {
        self.count(|difference| difference == Difference::OnlyReference)
    }

    /// What is called a fold here, and is none by the reference.
    pub fn false_folds(&self) -> usize {
        let is_fold = |mismatch: &&Mismatch| mismatch.found.status(0) == Status::Fold;
        self.mismatches.iter().filter(is_fold).filter(|of| of.difference == Difference::OnlyReference).count()
    }

    pub fn apart(&self) -> usize {
        self.count(|difference| matches!(difference, Difference::Apart(_)))
    }
}

/// Adds scenes of a seed to the verdicts of each precision. Each is planned and solved on its own.
pub fn judge(
    (scenes, seed): (RandomScenes, u64),
    numbers: Range<u64>,
    precisions: &[Precision],
    verdicts: &mut [Verdicts],
) -> Result<(), BackendError> {
    let solved: Vec<Vec<Solutions>> = numbers
        .clone()
        .into_par_iter()
        .map(|number| solve(&scenes.scene(seed, number), precisions))
        .collect::<Result<_, _>>()?;
    for (number, mut answers) in numbers.zip(solved) {
        let Some(expected) = answers.pop() else { continue };
        let length = scenes.scene(seed, number).total_length();
        for ((found, precision), verdicts) in answers.into_iter().zip(precisions).zip(verdicts.iter_mut()) {
            let tolerance = first_attempt(*precision).tolerance;
            let difference = match (found.status(0).is_success(), expected.status(0).is_success()) {
                (true, true) => {
                    let apart = distance(&found, &expected, length);
                    let allowed = WRONG * tolerance.max(found.get(0, Quantity::ErrorEstimate));
                    verdicts.both += 1;
                    (apart.is_nan() || apart > allowed).then_some(Difference::Apart(apart))
                }
                (true, false) => Some(Difference::OnlyHere),
                (false, true) => Some(Difference::OnlyReference),
                (false, false) => {
                    verdicts.neither += 1;
                    None
                }
            };
            let mismatch = |difference| Mismatch { number, difference, found, expected: expected.clone() };
            verdicts.mismatches.extend(difference.map(mismatch));
        }
    }
    Ok(())
}

/// The engine's answer in each precision, then the reference's.
fn solve(scene: &Scene, precisions: &[Precision]) -> Result<Vec<Solutions>, BackendError> {
    let plan = Plan::new(scene, &[], &[], PlanOptions::default())
        .map_err(|error| BackendError::DeviceFailed { reason: format!("{}: {error}", scene.name) })?;
    let batch = plan.batch(1, |_, _| {});
    let mut answers = Vec::with_capacity(precisions.len() + 1);
    for precision in precisions {
        let options = first_attempt(*precision);
        let first = Lanes::new(&plan.with_options(options), *precision)?.solve(&batch)?;
        let is_good = first.status(0).is_success() && first.get(0, Quantity::ErrorEstimate) <= options.tolerance;
        answers.push(match is_good {
            true => first,
            false => {
                let second = PlanOptions { stepper: Stepper::Dop853, steps: SECOND_STEPS, ..options };
                Lanes::new(&plan.with_options(second), Precision::F64)?.solve(&batch)?
            }
        });
    }
    answers.push(Reference::new(&plan).solve(&batch)?);
    Ok(answers)
}

/// The larger of |dp| over length and the angle between the tips (rad).
fn distance(found: &Solutions, expected: &Solutions, length: f64) -> f64 {
    let (p, q) = (found.vector(0, Quantity::TipPosition), expected.vector(0, Quantity::TipPosition));
    let dp = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / length;
    dp.max(rotation_angle(&found.tip_rotation(0), &expected.tip_rotation(0)))
}
