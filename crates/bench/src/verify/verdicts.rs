//! Random scenes on every engine that is asked for, as `run` takes it, against the verdict of the reference.

use super::answer::{Answer, Blame, Difference, Verdict, ask, compare};
use super::search::{Contender, SearchOptions};
use crate::judge::Word;
use rayon::prelude::*;
use rodsweep::backend::{BackendError, BackendKind};
use rodsweep::engines::{Engine, second_attempt, witness};
use rodsweep::model::{Plan, PlanOptions, Scene, Solutions, Stepper};
use std::ops::Range;

/// A scene on which an engine, the reference and the judge do not agree.
pub struct Mismatch {
    pub number: u64,
    /// Of a box around the scene.
    pub sample: Option<u64>,
    pub difference: Difference,
    pub found: Answer,
    pub expected: Answer,
    pub word: Word,
    pub blame: Blame,
    /// The scene itself.
    pub scene: Scene,
    /// The sweep file of its box.
    pub sweep: Option<String>,
}

/// What came of one engine.
#[derive(Default)]
pub struct Verdicts {
    /// Scenes that both solved, and that neither did.
    pub both: usize,
    pub neither: usize,
    /// Boxes that started from anchors.
    pub anchored: usize,
    /// Rods solved here that the judge was asked about, and those of them on which it is not sure.
    pub judged: usize,
    pub unsure: usize,
    /// By scene.
    pub mismatches: Vec<Mismatch>,
}

impl Verdicts {
    pub fn count(&self, is_counted: impl Fn(&Mismatch) -> bool) -> usize {
        self.mismatches.iter().filter(|mismatch| is_counted(mismatch)).count()
    }

    /// Answers that were compared.
    pub fn answers(&self) -> usize {
        self.both + self.neither + self.only_here() + self.only_reference()
    }

    pub fn only_here(&self) -> usize {
        self.count(|of| of.difference == Difference::OnlyHere)
    }

    pub fn only_reference(&self) -> usize {
        self.count(|of| of.difference == Difference::OnlyReference)
    }

    /// What is called a fold here, and is none by the reference.
    pub fn false_folds(&self) -> usize {
        self.count(|of| of.difference == Difference::OnlyReference && of.found.claims_fold())
    }

    pub fn apart(&self) -> usize {
        self.count(|of| matches!(of.difference, Difference::Apart(_)))
    }

    pub fn blamed(&self, blame: Blame) -> usize {
        self.count(|of| of.blame == blame)
    }

    /// Adds one scene, or one sample of a box; whether they agree.
    pub fn add(&mut self, found: Answer, expected: &Answer, tolerance: f64, always: bool, place: Place) -> bool {
        match (found.status.is_success(), expected.status.is_success()) {
            (true, true) => self.both += 1,
            (false, false) => self.neither += 1,
            _ => {}
        }
        let Some(word) = ask(&found, expected, tolerance, place.scene, always) else { return true };
        if found.status.is_success() {
            self.judged += 1;
            self.unsure += usize::from(word == Word::Unsure);
        }
        let Some(Verdict { difference, word, blame }) = compare(&found, expected, tolerance, place.scene, word) else {
            return true;
        };
        self.mismatches.push(Mismatch {
            number: place.number,
            sample: place.sample,
            difference,
            found,
            expected: expected.clone(),
            word,
            blame,
            scene: place.scene.clone(),
            sweep: None,
        });
        false
    }
}

/// Which scene an answer is to.
#[derive(Clone, Copy)]
pub struct Place<'a> {
    pub number: u64,
    pub sample: Option<u64>,
    pub scene: &'a Scene,
}

/// Adds scenes of a seed to the verdicts of each engine. Each is planned and solved on its own.
pub fn judge_scenes(
    options: &SearchOptions,
    numbers: Range<u64>,
    contenders: &[Contender],
    verdicts: &mut [Verdicts],
) -> Result<(), BackendError> {
    let on_cpu: Vec<Contender> = contenders.iter().copied().filter(|of| of.backend == BackendKind::Cpu).collect();
    let judged: Vec<Vec<Verdicts>> = numbers
        .clone()
        .into_par_iter()
        .map(|number| {
            let scene = options.kind.scene(options.seed, number);
            let plan = plan(&scene)?;
            let expected = answer_of(&plan, &witness(&plan).solve(&plan.batch(1, |_, _| {}))?);
            let place = Place { number, sample: None, scene: &scene };
            // One word on a scene that all agree on is enough.
            let mut always = options.judge_all;
            let mut each = Vec::new();
            for contender in &on_cpu {
                let mut verdicts = Verdicts::default();
                let found = answer_of(&plan, &solve(&plan, contender)?);
                verdicts.add(found, &expected, contender.tolerance(), always, place);
                always = false;
                each.push(verdicts);
            }
            Ok(each)
        })
        .collect::<Result<_, BackendError>>()?;
    for each in judged {
        for (sum, one) in verdicts.iter_mut().zip(each) {
            sum.both += one.both;
            sum.neither += one.neither;
            sum.judged += one.judged;
            sum.unsure += one.unsure;
            sum.mismatches.extend(one.mismatches);
        }
    }
    // A GPU takes one scene at a time.
    for (contender, verdicts) in contenders.iter().zip(verdicts).skip(on_cpu.len()) {
        for number in numbers.clone() {
            let scene = options.kind.scene(options.seed, number);
            let plan = plan(&scene)?;
            let expected = answer_of(&plan, &witness(&plan).solve(&plan.batch(1, |_, _| {}))?);
            let found = answer_of(&plan, &solve(&plan, contender)?);
            verdicts.add(found, &expected, contender.tolerance(), false, Place { number, sample: None, scene: &scene });
        }
    }
    Ok(())
}

/// A share of what bends the rod, below which forces of a wall are compared by their difference.
const LITTLE_FORCE: f64 = 0.1;

fn answer_of(plan: &Plan, solutions: &Solutions) -> Answer {
    Answer { least_force: LITTLE_FORCE * plan.units.force, ..Answer::of_solution(solutions, 0) }
}

fn plan(scene: &Scene) -> Result<Plan, BackendError> {
    Plan::new(scene, &[], &[], PlanOptions::default())
        .map_err(|error| BackendError::DeviceFailed { reason: format!("{}: {error}", scene.name) })
}

/// A first attempt in a precision, as `run` would take it for ordinary scenes; where it is not good a second on the CPU.
fn solve(plan: &Plan, contender: &Contender) -> Result<Solutions, BackendError> {
    let engine = Engine::new(contender.backend, contender.precision, "");
    let (stepper, tolerance) = (engine.steppers()[0], contender.tolerance());
    let steps = match stepper {
        Stepper::Rk4 => 24,
        Stepper::Tp6 | Stepper::Tp7 | Stepper::Dop853 => 4,
    };
    let plan = plan.with_options(PlanOptions { stepper, steps, tolerance, ..PlanOptions::default() });
    let batch = plan.batch(1, |_, _| {});
    let first = engine.make(&plan)?.solve(&batch)?;
    let answer = Answer::of_solution(&first, 0);
    match answer.status.is_success() && answer.estimate <= tolerance {
        true => Ok(first),
        false => second_attempt(&plan)?.solve(&batch),
    }
}
