//! Second attempts for samples that failed or are doubtful.

use super::options::RunOptions;
use super::second_path::apart;
use crate::backend::BackendFactory;
use crate::backend::{Backend, BackendError, LadderLine, RungCount};
use crate::model::{Batch, Plan, Quantity, Solutions, Start, Status};
use crate::spec::Sampler;
use std::time::Instant;

/// Samples of one second attempt; bounds its memory.
const MAX_BATCH: usize = 1 << 17;

/// Rows whose error estimate is larger are led from rest again: what is that far off may be another equilibrium.
const NEAR: f64 = 1e-4;

/// The rungs after the engine's own.
pub const ATTEMPTS: [LadderLine; 6] = [
    LadderLine {
        rung: "doubt settled in f64",
        samples: "rows of a GPU in f32 whose error estimate is above the tolerance",
        decides: "`refined`",
    },
    LadderLine {
        rung: "answer on finer steps",
        samples: "rows in f64 in a field that varies whose error estimate is above the tolerance, but below 1e-4: from the load at their own base",
        decides: "`refined`",
    },
    LadderLine {
        rung: "answer on finest steps",
        samples: "the same where that is not enough, and rows of second attempts",
        decides: "`refined`",
    },
    LadderLine {
        rung: "second attempt",
        samples: "rows that failed or are doubtful, but for folds whose turn was seen: all rungs again, on more steps, in f64",
        decides: "`refined`, `fold`",
    },
    LadderLine {
        rung: "reference",
        samples: "rows that have failed there, too, but for folds whose turn was seen",
        decides: "`refined`, any failure",
    },
    LadderLine {
        rung: "finer steps",
        samples: "rows of the two rungs before whose error estimate is still above the tolerance",
        decides: "`refined`",
    },
];

/// The backends of second attempts, made when first needed.
pub(crate) struct Refiners<'a> {
    settle: Option<Stage<'a>>,
    answer: Option<Stage<'a>>,
    finest_answer: Option<Stage<'a>>,
    finer: Option<Stage<'a>>,
    stages: Vec<Stage<'a>>,
    pub attempts: u64,
    pub refined: u64,
}

/// One of them.
struct Stage<'a> {
    factory: BackendFactory<'a>,
    backend: Option<Box<dyn Backend>>,
    /// What it has done so far.
    account: RungCount,
}

impl Stage<'_> {
    /// Solves some samples from rest and tells of each: its solutions, its row there, and its number in the batch.
    fn solve(
        &mut self,
        samples: &Samples,
        some: &[usize],
        tell: impl FnMut(&Solutions, usize, usize),
    ) -> Result<(), BackendError> {
        self.solve_as(samples, some, |group| samples.gathered(group), tell)
    }

    /// Solves some samples as `batch` gathers them, and tells as [`Stage::solve`] does.
    fn solve_as(
        &mut self,
        samples: &Samples,
        some: &[usize],
        batch: impl Fn(&[usize]) -> Batch,
        mut tell: impl FnMut(&Solutions, usize, usize),
    ) -> Result<(), BackendError> {
        let begin = Instant::now();
        self.account.samples += some.len() as u64;
        for group in some.chunks(MAX_BATCH) {
            let made = match self.backend.take() {
                Some(made) => made,
                None => (self.factory)(samples.plan)?,
            };
            let again = self.backend.insert(made).solve(&batch(group))?;
            self.account.left += (0..group.len()).filter(|row| !again.status(*row).is_success()).count() as u64;
            group.iter().enumerate().for_each(|(from, to)| tell(&again, from, *to));
        }
        self.account.seconds += begin.elapsed().as_secs_f64();
        Ok(())
    }
}

/// Replaces a row by what solved its sample again.
fn take_refined(solutions: &mut Solutions, to: usize, again: &Solutions, from: usize) {
    solutions.copy_row(to, again, from);
    solutions.set_status(to, Status::Refined);
}

/// The samples of a batch, as second attempts see them.
struct Samples<'a> {
    plan: &'a Plan,
    sampler: &'a Sampler,
    batch: &'a Batch,
    index: &'a (dyn Fn(usize) -> u64 + Sync),
}

impl Samples<'_> {
    /// Whether the error estimate of a row is above the tolerance.
    fn is_doubtful(&self, solutions: &Solutions, row: usize) -> bool {
        let estimate = solutions.get(row, Quantity::ErrorEstimate);
        estimate > self.plan.options.tolerance || estimate.is_nan()
    }

    /// Samples to which this applies, without values that make no rod and anchors beyond its reach.
    fn those(&self, solutions: &Solutions, applies: impl Fn(usize) -> bool) -> Vec<usize> {
        let is_hopeless = |at: usize| matches!(solutions.status(at), Status::BadParameter | Status::OutOfReach);
        let is_tried = |at: usize| !self.batch.bad[at] && !is_hopeless(at);
        (0..self.batch.sample_count()).filter(|at| is_tried(*at) && applies(*at)).collect()
    }

    fn gathered(&self, group: &[usize]) -> Batch {
        self.plan.batch(group.len(), |at, row| {
            if let Some(at) = group.get(at) {
                self.sampler.values((self.index)(*at), row);
            }
        })
    }
}

impl<'a> Refiners<'a> {
    pub fn new(options: &RunOptions<'a>) -> Refiners<'a> {
        let stage = |factory: BackendFactory<'a>, rung: &str| {
            let account = RungCount { rung: rung.into(), ..RungCount::default() };
            Stage { factory, backend: None, account }
        };
        let [settled, answered, finest_answered, second, reference, finer] = ATTEMPTS.map(|line| line.rung);
        let names = [second, reference].into_iter().chain(std::iter::repeat(reference));
        let stages = options.refiners.iter().zip(names).map(|(factory, name)| stage(*factory, name)).collect();
        let settle = options.settle.map(|factory| stage(factory, settled));
        let answer = options.answer.map(|factory| stage(factory, answered));
        let finest_answer = options.finest_answer.map(|factory| stage(factory, finest_answered));
        let finer = options.finer.map(|factory| stage(factory, finer));
        Refiners { settle, answer, finest_answer, finer, stages, attempts: 0, refined: 0 }
    }

    /// What each attempt after the engine's own has done, in order.
    pub fn rungs(&self) -> Vec<RungCount> {
        let answers = self.answer.iter().chain(&self.finest_answer);
        let stages = self.settle.iter().chain(answers).chain(&self.stages).chain(&self.finer);
        stages.map(|stage| stage.account.clone()).filter(|account| account.samples > 0).collect()
    }

    /// Solves failed and doubtful samples again. A success becomes `Refined`; another verdict replaces the first one, but
    /// an equilibrium is not replaced by none. A doubtful success that a second attempt does not find is no success; one that
    /// is doubtful still is solved on finer steps, and the smaller estimate counts. The second stage sees what the first left
    /// failing; what it solves and is doubtful is solved on finer steps, too. No stage sees a fold that was seen as a turn of the load.
    /// Returns the rows that are the reference's, in order.
    pub fn refine(
        &mut self,
        plan: &Plan,
        sampler: &Sampler,
        batch: &Batch,
        solutions: &mut Solutions,
        index: &(dyn Fn(usize) -> u64 + Sync),
    ) -> Result<Vec<usize>, BackendError> {
        let samples = Samples { plan, sampler, batch, index };
        let keeps = |again: &Solutions, from, _: f64| !samples.is_doubtful(again, from);
        let settled = relieve(&mut self.settle, &samples, solutions, |_| true, keeps)?;
        self.attempts += settled.tried;
        self.refined += settled.answered.len() as u64;
        let answered = self.answer_twice(&samples, solutions)?;
        let mut by_reference = Vec::new();
        for (number, stage) in self.stages.iter_mut().enumerate() {
            let has_failed = |at| !solutions.status(at).is_success() && !solutions.is_seen_fold(at);
            let is_doubtful = |at| number == 0 && !solutions.is_seen_fold(at) && samples.is_doubtful(solutions, at);
            let needs = |at| has_failed(at) || is_doubtful(at) && !answered.is_answered(at);
            let left = samples.those(solutions, needs);
            self.attempts += left.len() as u64;
            stage.solve(&samples, &left, |again, from, to| {
                if again.status(from).is_success() {
                    take_refined(solutions, to, again, from);
                    self.refined += 1;
                    if number > 0 {
                        by_reference.push(to);
                    }
                } else if again.is_equilibrium(from) || !solutions.is_equilibrium(to) {
                    solutions.copy_row(to, again, from);
                } else if again.is_seen_fold(from) && solutions.status(to) == Status::Fold {
                    // The equilibrium beyond the fold stays.
                    for quantity in [Quantity::Status, Quantity::LoadFraction, Quantity::LoadFractionError] {
                        solutions.set(to, quantity, again.get(from, quantity));
                    }
                } else if again.is_seen_fold(from) {
                    solutions.copy_row(to, again, from);
                } else if solutions.status(to).is_success() {
                    solutions.set_status(to, Status::NotConverged);
                }
            })?;
            let keeps = |again: &Solutions, from, before| again.get(from, Quantity::ErrorEstimate) < before;
            // The finer attempt would give rows that this stage has not solved what they have.
            let touched = |at| left.binary_search(&at).is_ok();
            let answers = answer(&mut self.finest_answer, &samples, solutions, touched)?;
            let is_left = |at| touched(at) && !answers.is_answered(at);
            let relieved = relieve(&mut self.finer, &samples, solutions, is_left, keeps)?;
            self.attempts += answers.tried + relieved.tried;
            by_reference.retain(|at| !relieved.is_answered(*at));
        }
        Ok(by_reference)
    }

    /// Answers doubtful samples on finer steps, and on finest steps those for which that is not enough. Tells of the first: a second attempt would
    /// solve what has an answer on the same steps.
    fn answer_twice(&mut self, samples: &Samples, solutions: &mut Solutions) -> Result<Answers, BackendError> {
        let finer = answer(&mut self.answer, samples, solutions, |_| true)?;
        let finest = answer(&mut self.finest_answer, samples, solutions, |at| finer.is_answered(at))?;
        self.attempts += finer.tried + finest.tried;
        self.refined += finer.answered.len() as u64;
        Ok(finer)
    }
}

/// The load at the base that a row has found, as the start of a sample's search. `None` where the row does not tell it.
pub(super) fn start_at(solutions: &Solutions, row: usize, sample: usize) -> Option<Start<'static>> {
    let n0 = solutions.base_force(row).filter(|force| force.iter().all(|x| x.is_finite()))?;
    Some(Start { sample, m0: solutions.vector(row, Quantity::BaseMoment), n0: Some(n0), known: &[] })
}

/// Samples that were solved once more, and those whose rows were replaced.
#[derive(Default)]
struct Answers {
    tried: u64,
    /// In order.
    answered: Vec<usize>,
}

impl Answers {
    fn is_answered(&self, at: usize) -> bool {
        self.answered.binary_search(&at).is_ok()
    }
}

/// Newton's method on the steps of a stage, from the load at the base that a row has found, for doubtful samples of those that it `may`. It
/// counts where its error estimate is the smaller one, both tips lie within both estimates, and both are stable or neither is.
fn answer(
    stage: &mut Option<Stage>,
    samples: &Samples,
    solutions: &mut Solutions,
    may: impl Fn(usize) -> bool,
) -> Result<Answers, BackendError> {
    let Some(stage) = stage else { return Ok(Answers::default()) };
    let is_near = |at| solutions.get(at, Quantity::ErrorEstimate) < NEAR;
    let is_doubtful = |at| solutions.status(at).is_success() && samples.is_doubtful(solutions, at);
    let needs = |at| may(at) && is_doubtful(at) && is_near(at) && start_at(solutions, at, at).is_some();
    let left = samples.those(solutions, needs);
    if left.is_empty() {
        return Ok(Answers::default());
    }
    let plan = samples.plan;
    let starts: Vec<Start> = left.iter().filter_map(|at| start_at(solutions, *at, *at)).collect();
    let batch = |group: &[usize]| {
        let starts = &starts[left.partition_point(|at| *at < group[0])..][..group.len()];
        let placed = |(sample, start): (usize, &Start<'static>)| Start { sample, ..*start };
        let starts: Vec<Start> = starts.iter().enumerate().map(placed).collect();
        plan.start_batch(&samples.gathered(group), &starts)
    };
    let mut answered = Vec::new();
    stage.solve_as(samples, &left, batch, |again, from, to| {
        let [before, now] = [(&*solutions, to), (again, from)].map(|(of, at)| of.get(at, Quantity::ErrorEstimate));
        let index = |of: &Solutions, at| of.get(at, Quantity::StabilityIndex);
        let is_close = apart(plan, (solutions, to), (again, from)) <= before + now;
        let is_same = index(solutions, to) == index(again, from) && is_close;
        if again.status(from).is_success() && now < before && is_same {
            take_refined(solutions, to, again, from);
            answered.push(to);
        }
    })?;
    Ok(Answers { tried: left.len() as u64, answered })
}

/// Solves samples, of those that it `may`, whose only doubt is their error estimate on one stage more, if there is one. Replaces rows that it `keeps`,
/// told the estimate before.
fn relieve(
    stage: &mut Option<Stage>,
    samples: &Samples,
    solutions: &mut Solutions,
    may: impl Fn(usize) -> bool,
    keeps: impl Fn(&Solutions, usize, f64) -> bool,
) -> Result<Answers, BackendError> {
    let Some(stage) = stage else { return Ok(Answers::default()) };
    let needs = |at| may(at) && solutions.status(at).is_success() && samples.is_doubtful(solutions, at);
    let left = samples.those(solutions, needs);
    let mut answered = Vec::new();
    stage.solve(samples, &left, |again, from, to| {
        let before = solutions.get(to, Quantity::ErrorEstimate);
        if again.status(from).is_success() && keeps(again, from, before) {
            take_refined(solutions, to, again, from);
            answered.push(to);
        }
    })?;
    Ok(Answers { tried: left.len() as u64, answered })
}
