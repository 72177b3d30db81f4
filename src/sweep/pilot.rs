//! Chooses the number of integration steps by solving a few samples at increasing resolution.

use super::check::distribution;
use super::columns::ColumnScales;
use super::refine::start_at;
use crate::backend::BackendError;
use crate::backend::BackendFactory;
use crate::engines::{answer_by, can_answer_again, for_second_attempt};
use crate::model::rotation_angle;
use crate::model::tolerances::{FOLD_EVIDENCE, limp_growth};
use crate::model::{Batch, DerivativeScale, Plan, PlanOptions, Quantity, Solutions, Start, Status, Stepper};
use crate::results::PilotChoice;
use crate::spec::Sampler;
use crate::spec::Selection;

/// Resolutions that are tried.
pub const STEPS: [usize; 13] = [2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128];
const SAMPLES: u64 = 64;
/// A resolution is tried on so many of them first: steps that do not see the rod take far longer than those that do.
const FEW: usize = 8;
/// The error of an answer is taken to be so many times the largest share of the grids' difference that the pilot has seen.
const RESERVE: f64 = 4.0;
/// That of an answer of which one on twice the steps is known, over their difference.
const TIP_RESERVE: f64 = 1.5;
/// Steps and refinements of the truth that errors are measured against. It ends where two of them agree.
const TRUTH_STEPS: usize = 8;
const TRUTH_REFINEMENTS: [usize; 5] = [1, 2, 4, 8, 16];
/// Grids without any answer, nor a fold that was seen, after which finer ones are not tried.
const HOPELESS: usize = 3;
/// Two grids agree where tips differ by less than this share of the tolerance, and columns by less than this share of theirs.
const AGREEMENT: f64 = 0.02;
/// The truth's doubt may be so much of an error of derivatives.
const MOST_DOUBT: f64 = 0.2;
/// Tips are never asked to agree better, nor is a smaller error measured.
const ROUND_OFF: f64 = 1e-12;
/// A sample whose last two grids are further apart is led from rest on the next one.
const NEAR: f64 = 1e-3;
/// The truth takes at least so many times the steps of what is measured against it.
const TRUTH_LEAD: usize = 2;
/// What is asked of it at least.
const TRUTH_TOLERANCE: f64 = 1e-12;
/// At least that share, whatever the pilot has seen.
const LEAST_SHARE: f64 = 1.0 / 64.0;
/// Error estimates of tips are at least so many times the pilot's median: along a sweep the difference between two grids may pass
/// through zero where the error does not.
const TIP_FLOOR: f64 = 2.0;
/// Error estimates of tips are at least so many times what 95 % of the pilot's samples are below, up to so many medians.
const TIP_TAIL: f64 = 1.5;
const MOST_TIP_MEDIANS: f64 = 6.0;
/// The floor of error estimates of tips is at most so much of the tolerance.
const MOST_OF_TOLERANCE: f64 = 0.75;
/// The error of derivatives is taken to be so many times the pilot's median.
const DERIVATIVE_RESERVE: f64 = 6.0;
/// Or so many times the largest share of its bare difference among samples above that: of 65,536 rows, five had more than
/// twelve times the largest share of 64, and none more than sixteen times.
const SHARE_RESERVE: f64 = 12.0;
/// And at least so many times what 95 % of its samples are below, up to so many medians: errors of columns are spread more widely
/// than those of tips, but most rows should not carry those of a few.
const DERIVATIVE_TAIL: f64 = 2.0;
const MOST_MEDIANS: f64 = 20.0;

/// Picks, of the plan's method and others, the one that meets the tolerance with the fewest stages, second attempts
/// included; if none does, the most accurate. Nodes take steps of their own: where all are solved so, no other is tried.
///
/// # Errors
///
/// As [`choose_steps`].
pub fn choose_method(
    plan: &Plan,
    sampler: &Sampler,
    others: &[Stepper],
    factory: BackendFactory,
) -> Result<PilotChoice, BackendError> {
    let batch = pilot_batch(plan, sampler);
    let mut truth = Truth::new(plan, &batch, factory);
    let mut best = choose_against(plan, &mut truth)?;
    let others: &[Stepper] = if all_by_nodes(plan, &batch) { &[] } else { others };
    for stepper in others {
        let plan = plan.with_options(PlanOptions { stepper: *stepper, ..plan.options });
        if best.reached {
            best = cheapest(&plan, &mut truth, &mut Vec::new(), best.work)?.unwrap_or(best);
            continue;
        }
        let choice = choose_against(&plan, &mut truth)?;
        if choice.reached || choice.error < best.error {
            best = choice;
        }
    }
    Ok(best)
}

/// Picks the number of steps that takes the fewest stages, among those whose answers meet the tolerances: tips within half of
/// it from the truth, and derivatives that in 95 % of the samples are within theirs. The truth is an answer on grids that are
/// refined until they agree, so that a grid on which differences mean nothing yet is found out.
/// Samples whose error estimate would be above the tolerance count with the stages of their second attempts.
///
/// Where none does, the differences have stopped falling (rounding) or 128 is too few: then the smallest number
/// within twice the least difference of tips is taken, and `reached` is false. Where no sample reaches its load, folds are compared.
///
/// # Errors
///
/// An engine that cannot be used, or fails.
pub fn choose_steps(plan: &Plan, sampler: &Sampler, factory: BackendFactory) -> Result<PilotChoice, BackendError> {
    choose_steps_for(plan, &pilot_batch(plan, sampler), factory)
}

/// The plan's options with what error estimates are made of, where its steps are given.
///
/// # Errors
///
/// As [`choose_steps`].
pub fn measure_errors(plan: &Plan, sampler: &Sampler, factory: BackendFactory) -> Result<PlanOptions, BackendError> {
    let batch = pilot_batch(plan, sampler);
    let steps = plan.options.steps;
    let mut truth = Truth::new(plan, &batch, factory);
    let trial = truth.trial_of_all(plan, steps)?;
    let error_share = if trial.compared > 0 { trial.error_share } else { plan.options.error_share };
    let Trial { error_floor, derivative_scale, .. } = trial;
    Ok(PlanOptions { error_share, error_floor, derivative_scale, ..plan.options })
}

/// Some samples of a sweep, always the same.
fn pilot_batch(plan: &Plan, sampler: &Sampler) -> Batch {
    let selection = Selection::new(sampler.sample_count(), SAMPLES, 0x9170);
    plan.batch(selection.len() as usize, |at, row| {
        if (at as u64) < selection.len() {
            sampler.values(selection.get(at as u64), row);
        }
    })
}

/// Whether every sample is so limp or so taut that it is solved by nodes at once.
fn all_by_nodes(plan: &Plan, batch: &Batch) -> bool {
    let is_limp = |sample| plan.sample_rod(batch, sample).growth() > limp_growth(f64::EPSILON);
    !plan.terms.varying_field && (0..batch.sample_count()).all(|sample| batch.bad[sample] || is_limp(sample))
}

/// Answers on grids that are refined until two of them agree.
struct Truth<'a> {
    plan: &'a Plan,
    batch: &'a Batch,
    factory: BackendFactory<'a>,
    /// On the last grid.
    solutions: Solutions,
    /// Of each sample: how far the last two are apart, by their tips and by their columns.
    doubt: Vec<(f64, f64)>,
    /// Grids so far.
    grids: usize,
}

impl<'a> Truth<'a> {
    fn new(plan: &'a Plan, batch: &'a Batch, factory: BackendFactory<'a>) -> Truth<'a> {
        let count = batch.sample_count();
        let (solutions, doubt) = (Solutions::new(plan, count), vec![(0.0, 0.0); count]);
        Truth { plan, batch, factory, solutions, doubt, grids: 0 }
    }

    /// Refines until the truth is ahead of so many steps and two grids agree, there is no finer one, or no sample arrives on any.
    fn lead(&mut self, steps: usize) -> Result<(), BackendError> {
        while !self.is_hopeless() {
            let is_ahead = self.grids > 1 && TRUTH_STEPS * TRUTH_REFINEMENTS[self.grids - 1] >= TRUTH_LEAD * steps;
            if is_ahead && self.agrees() || !self.refine()? {
                break;
            }
        }
        Ok(())
    }

    /// Whether no sample has arrived on several grids, and none has shown a fold either.
    fn is_hopeless(&self) -> bool {
        let tells = |at: usize| self.solutions.status(at).is_success() || self.solutions.is_seen_fold(at);
        self.grids >= HOPELESS && !(0..self.batch.sample_count()).any(tells)
    }

    /// Takes the next grid; false where there is no finer one.
    fn refine(&mut self) -> Result<bool, BackendError> {
        let Some(&refinement) = TRUTH_REFINEMENTS.get(self.grids) else { return Ok(false) };
        let (plan, usual) = (self.plan, self.plan.options);
        let tolerance = usual.tolerance.min(TRUTH_TOLERANCE);
        let (stepper, steps, base_force) = (Stepper::Dop853, TRUTH_STEPS, can_answer_again(plan));
        let options = PlanOptions { stepper, steps, refinement, tolerance, base_force, ..usual };
        let finer = self.next_grid(&plan.with_options(options))?;
        let coarser = std::mem::replace(&mut self.solutions, finer);
        if self.grids > 0 {
            let scales = ColumnScales::of_each(plan, &self.solutions);
            let of_sample = |at| apart(plan, self.batch, &scales, (&coarser, &self.solutions), at);
            self.doubt = (0..self.batch.sample_count()).map(of_sample).collect();
        }
        self.grids += 1;
        Ok(true)
    }

    /// All samples on the next grid. Where the grids before it were led to the same equilibrium, Newton's method starts from the last
    /// answer. It counts where it comes closer to that than these were to each other. All else is led from rest.
    fn next_grid(&self, plan: &Plan) -> Result<Solutions, BackendError> {
        let last = &self.solutions;
        let is_led = |at: &usize| self.grids > 1 && self.doubt[*at].0 < NEAR;
        let mut all = self.answers_nearby(plan, &self.known().into_iter().filter(is_led).collect::<Vec<_>>())?;
        let scales = ColumnScales::of_each(plan, last);
        let index = |of: &Solutions, at: usize| of.get(at, Quantity::StabilityIndex);
        let off = |at: usize| apart(plan, self.batch, &scales, (last, &all), at).0;
        let is_same = |at: usize| index(&all, at) == index(last, at) && off(at) <= self.doubt[at].0.max(ROUND_OFF);
        let is_answered = |at: &usize| all.status(*at).is_success() && is_same(*at);
        let left: Vec<usize> = (0..self.batch.sample_count()).filter(|at| !is_answered(at)).collect();
        self.answer_from_rest(plan, &left, &mut all)?;
        Ok(all)
    }

    /// Samples whose answers are known.
    fn known(&self) -> Vec<usize> {
        let is_known = |at: &usize| self.solutions.status(*at).is_success() && self.doubt[*at].0.is_finite();
        (0..self.batch.sample_count()).filter(is_known).collect()
    }

    /// Rows of all samples, none of them solved.
    fn pending(&self, plan: &Plan) -> Solutions {
        let mut all = Solutions::new(plan, self.batch.sample_count());
        (0..self.batch.sample_count()).for_each(|sample| all.set_status(sample, Status::Pending));
        all
    }

    /// Leads some of the samples from rest, into their own rows.
    fn answer_from_rest(&self, plan: &Plan, samples: &[usize], all: &mut Solutions) -> Result<(), BackendError> {
        if !samples.is_empty() {
            let rows = (self.factory)(plan)?.solve(&self.batch.gathered(samples))?;
            samples.iter().enumerate().for_each(|(row, sample)| all.copy_row(*sample, &rows, row));
        }
        Ok(())
    }

    /// Answers to some of the samples by Newton's method from the truth, in their own rows; others stay pending.
    fn answers_nearby(&self, plan: &Plan, samples: &[usize]) -> Result<Solutions, BackendError> {
        let mut all = self.pending(plan);
        let start = |at: &usize| start_at(&self.solutions, *at, *at);
        let starts: Vec<Start> = samples.iter().filter_map(start).collect();
        if can_answer_again(plan) && !starts.is_empty() {
            let rows = answer_by(plan)?.solve(&plan.start_batch(self.batch, &starts))?;
            starts.iter().enumerate().for_each(|(row, start)| all.copy_row(start.sample, &rows, row));
        }
        Ok(all)
    }

    /// A plan on so many steps, with estimates that are bare differences.
    fn bare(plan: &Plan, steps: usize) -> Plan {
        let derivative_scale = DerivativeScale::BARE;
        plan.with_options(PlanOptions { steps, error_share: 1.0, error_floor: 0.0, derivative_scale, ..plan.options })
    }

    /// Tries a plan on so many steps by answers near the truth, where the field varies.
    fn trial_nearby(&mut self, plan: &Plan, steps: usize) -> Result<Option<Trial>, BackendError> {
        if !can_answer_again(plan) {
            return Ok(None);
        }
        self.lead(steps)?;
        let ours = self.answers_nearby(&Truth::bare(plan, steps), &self.known())?;
        Ok(Some(Trial { extent: Extent::Nearby, ..Trial::new(plan, self.batch, steps, &ours, self) }))
    }

    /// Tries a plan on so many steps. A trial whose first few samples show that the tolerances will be missed is of those alone.
    fn trial(&mut self, plan: &Plan, steps: usize) -> Result<Trial, BackendError> {
        self.lead(steps)?;
        let mut left = self.known();
        let mut ours = self.pending(plan);
        if left.len() > FEW {
            let few: Vec<usize> = (0..FEW).map(|k| left[k * left.len() / FEW]).collect();
            self.answer_from_rest(&Truth::bare(plan, steps), &few, &mut ours)?;
            let trial = Trial::new(plan, self.batch, steps, &ours, self);
            if trial.is_hopeless(&plan.options, left.len()) {
                return Ok(Trial { extent: Extent::Few, ..trial });
            }
            left.retain(|at| !few.contains(at));
        }
        self.trial_from_rest(plan, steps, &left, ours)
    }

    /// Tries a plan on so many steps by every known sample, from rest.
    fn trial_of_all(&mut self, plan: &Plan, steps: usize) -> Result<Trial, BackendError> {
        self.lead(steps)?;
        self.trial_from_rest(plan, steps, &self.known(), self.pending(plan))
    }

    /// Leads the samples that are left from rest and measures the errors of all. The truth is refined while its doubt makes up much of them.
    fn trial_from_rest(
        &mut self,
        plan: &Plan,
        steps: usize,
        left: &[usize],
        mut ours: Solutions,
    ) -> Result<Trial, BackendError> {
        self.answer_from_rest(&Truth::bare(plan, steps), left, &mut ours)?;
        let mut trial = Trial::new(plan, self.batch, steps, &ours, self);
        while trial.meets(&plan.options) && trial.is_drowned() && self.refine()? {
            trial = Trial::new(plan, self.batch, steps, &ours, self);
        }
        Ok(trial)
    }

    /// The choice of a trial, its work with second attempts. A sample takes one if its error estimate is above the tolerance. The estimate
    /// is a bare difference times the choice's share, and terms that this leaves as they are. Where both bounds of that leave it open
    /// the sample is solved once more.
    fn choice(&self, plan: &Plan, trial: &Trial, trials: &[Trial]) -> Result<PilotChoice, BackendError> {
        let mut choice = trial.choice(plan, trials, true);
        let (tolerance, share) = (plan.options.tolerance, choice.error_share);
        let is_doubtful = |(_, bare): &&(usize, f64)| bare * share.min(1.0) > tolerance;
        let is_open = |sample: &&(usize, f64)| sample.1 * share.max(1.0) > tolerance && !is_doubtful(sample);
        let open: Vec<usize> = trial.bare_estimates.iter().filter(is_open).map(|(at, _)| *at).collect();
        let chosen = plan.with_options(choice.options(plan));
        let mut rows = self.answers_nearby(&chosen, &open)?;
        let is_solved = |rows: &Solutions, at: &usize| rows.status(*at).is_success();
        let left: Vec<usize> = open.iter().copied().filter(|at| !is_solved(&rows, at)).collect();
        self.answer_from_rest(&chosen, &left, &mut rows)?;
        let is_above = |at: &&usize| is_solved(&rows, at) && rows.get(**at, Quantity::ErrorEstimate) > tolerance;
        let doubtful = trial.bare_estimates.iter().filter(is_doubtful).count() + open.iter().filter(is_above).count();
        let share = doubtful as f64 / trial.bare_estimates.len().max(1) as f64;
        choice.work += stages(&for_second_attempt(plan)) as f64 * share;
        Ok(choice)
    }

    fn agrees(&self) -> bool {
        let PlanOptions { tolerance, derivative_tolerance, .. } = self.plan.options;
        let is_sure = |(tip, columns): &(f64, f64)| {
            *tip <= (AGREEMENT * tolerance).max(ROUND_OFF) && *columns <= AGREEMENT * derivative_tolerance
        };
        // Grids on which no sample arrives agree on nothing.
        (0..self.doubt.len()).any(|at| self.solutions.status(at).is_success()) && self.doubt.iter().all(is_sure)
    }
}

/// How far two answers to a sample are apart: by the tip, over the rod's length or in radians, and by the worst column over its
/// norm. Nothing where both failed, infinitely where one has.
fn apart(plan: &Plan, batch: &Batch, scales: &ColumnScales, (a, b): (&Solutions, &Solutions), at: usize) -> (f64, f64) {
    match (a.status(at).is_success(), b.status(at).is_success()) {
        (true, true) => {}
        (false, false) => return (0.0, 0.0),
        _ => return (f64::INFINITY, f64::INFINITY),
    }
    let length = plan.sample_rod(batch, at).total_length();
    let (p, q) = (a.vector(at, Quantity::TipPosition), b.vector(at, Quantity::TipPosition));
    let dp = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt() / length;
    let tip = dp.max(rotation_angle(&a.tip_rotation(at), &b.tip_rotation(at)));
    (tip, scales.worst_error((a, b), at, length).0)
}

/// Stages of a pass over the rod.
fn stages(plan: &Plan) -> usize {
    plan.options.stepper.stage_count() * plan.step_count()
}

/// Estimated errors of the tip and of the derivatives of a batch of one, from a solution on twice the steps; `None` where that
/// has failed.
pub fn estimates_from(plan: &Plan, batch: &Batch, (ours, fine): (&Solutions, &Solutions)) -> Option<(f64, f64)> {
    let (tip, columns) = apart(plan, batch, &ColumnScales::of_each(plan, fine), (ours, fine), 0);
    fine.status(0).is_success().then_some((TIP_RESERVE * tip, DERIVATIVE_RESERVE * columns))
}

/// The same for given samples.
///
/// # Errors
///
/// As [`choose_steps`].
pub fn choose_steps_for(plan: &Plan, batch: &Batch, factory: BackendFactory) -> Result<PilotChoice, BackendError> {
    choose_against(plan, &mut Truth::new(plan, batch, factory))
}

/// The same against a truth that is known, perhaps of another method.
fn choose_against(plan: &Plan, truth: &mut Truth) -> Result<PilotChoice, BackendError> {
    truth.lead(STEPS[0])?;
    if truth.known().is_empty() {
        return choose_by_folds(plan, truth);
    }
    let mut trials: Vec<Trial> = Vec::new();
    if let Some(best) = cheapest(plan, truth, &mut trials, f64::INFINITY)? {
        return Ok(best);
    }
    for trial in trials.iter_mut().filter(|trial| trial.extent == Extent::Few) {
        *trial = truth.trial_of_all(plan, trial.steps)?;
    }
    let known = || trials.iter().filter(|trial| trial.compared > 0);
    let least = known().map(|trial| trial.error).fold(f64::INFINITY, f64::min);
    let least_of_columns = known().map(|trial| trial.derivative_error).fold(f64::INFINITY, f64::min);
    let is_good = |trial: &&Trial| {
        trial.error <= (2.0 * least).max(0.5 * plan.options.tolerance)
            && trial.derivative_error <= (2.0 * least_of_columns).max(plan.options.derivative_tolerance)
    };
    let good = known().find(is_good);
    let led = match good.filter(|trial| trial.extent == Extent::Nearby) {
        Some(trial) => Some(truth.trial_of_all(plan, trial.steps)?),
        None => None,
    };
    let good = led.as_ref().filter(|trial| trial.compared > 0).or(good);
    let (steps, error_share) = (STEPS[STEPS.len() - 1], plan.options.error_share);
    let unknown = Trial { steps, error: f64::NAN, error_share, ..Trial::default() };
    Ok(good.unwrap_or(&unknown).choice(plan, &trials, false))
}

/// The choice that takes the least work of those that meet the tolerances, if it takes less than `most`; and all trials on the way to it.
fn cheapest(
    plan: &Plan,
    truth: &mut Truth,
    trials: &mut Vec<Trial>,
    mut most: f64,
) -> Result<Option<PilotChoice>, BackendError> {
    let mut best = None;
    for steps in STEPS {
        if stages(&plan.with_options(PlanOptions { steps, ..plan.options })) as f64 >= most {
            break;
        }
        let meets = |trial: &Trial| trial.meets(&plan.options);
        let trial = match truth.trial_nearby(plan, steps)? {
            Some(trial) if !meets(&trial) || truth.choice(plan, &trial, trials)?.work >= most => trial,
            Some(_) => truth.trial_of_all(plan, steps)?,
            None => truth.trial(plan, steps)?,
        };
        trials.push(trial);
        let last = &trials[trials.len() - 1];
        if meets(last) && last.extent == Extent::All {
            let choice = truth.choice(plan, last, trials)?;
            if choice.work < most {
                most = choice.work;
                best = Some(choice);
            }
        }
    }
    Ok(best)
}

/// Where no sample reaches its load: the fewest steps on which folds lie where the truth has them, within the tolerance.
fn choose_by_folds(plan: &Plan, truth: &Truth) -> Result<PilotChoice, BackendError> {
    let load = |of: &Solutions, at: usize| of.get(at, Quantity::LoadFraction);
    let is_fold = |of: &Solutions, at: usize| of.status(at) == Status::Fold && load(of, at) > 0.0;
    let was_seen = |at: &usize| truth.solutions.get(*at, Quantity::LoadFractionError) < FOLD_EVIDENCE;
    let all = 0..truth.batch.sample_count();
    let folds: Vec<usize> = all.filter(|at| is_fold(&truth.solutions, *at)).filter(was_seen).collect();
    let mut trials: Vec<Trial> = Vec::new();
    for steps in STEPS {
        trials.push(Trial { steps, error: f64::NAN, error_share: plan.options.error_share, ..Trial::default() });
        let mut ours = truth.pending(plan);
        truth.answer_from_rest(&Truth::bare(plan, steps), &folds, &mut ours)?;
        let off = |at: &usize| (load(&ours, *at) / load(&truth.solutions, *at) - 1.0).abs();
        let agrees = |at: &usize| is_fold(&ours, *at) && off(at) <= plan.options.tolerance;
        if !folds.is_empty() && folds.iter().all(agrees) {
            break;
        }
    }
    Ok(trials[trials.len() - 1].choice(plan, &trials, false))
}

/// What a number of steps is worth, by comparison with the truth.
#[derive(Default)]
struct Trial {
    steps: usize,
    /// Samples that converged in both.
    compared: usize,
    /// Largest error of tips.
    error: f64,
    /// The worst column of a sample: 95 % are below.
    derivative_error: f64,
    /// See [`PlanOptions::error_share`], with a reserve.
    error_share: f64,
    /// See [`PlanOptions::error_floor`].
    error_floor: f64,
    /// With a reserve, too.
    derivative_scale: DerivativeScale,
    /// Error of derivatives of the middle sample, and how much of that is doubt of the truth.
    columns: (f64, f64),
    /// Samples whose derivatives are off by more than is allowed.
    beyond: usize,
    /// Samples that are solved, with their bare error estimates.
    bare_estimates: Vec<(usize, f64)>,
    extent: Extent,
}

/// Which samples a trial has answered, and how.
#[derive(Default, PartialEq)]
enum Extent {
    /// Every known one, from rest.
    #[default]
    All,
    /// Every known one near the truth alone: these missed the tolerances.
    Nearby,
    /// The first few alone, from rest: these missed the tolerances.
    Few,
}

impl Trial {
    fn new(plan: &Plan, batch: &Batch, steps: usize, ours: &Solutions, truth: &Truth) -> Trial {
        let samples: Vec<usize> = truth.known().into_iter().filter(|at| ours.status(*at).is_success()).collect();
        let scales = ColumnScales::of_each(plan, &truth.solutions);
        let (mut error, mut share) = (0.0f64, None);
        let (mut tips, mut columns, mut bare) = (Vec::new(), Vec::new(), Vec::new());
        for &at in &samples {
            let (tip, column) = apart(plan, batch, &scales, (ours, &truth.solutions), at);
            // An error below the truth's own doubt, or in its round-off, is no share of anything.
            let is_told = tip > truth.doubt[at].0.max(ROUND_OFF);
            let (tip, column) = (tip + truth.doubt[at].0, column + truth.doubt[at].1);
            error = error.max(tip);
            tips.push(tip);
            columns.push(column);
            bare.push(ours.get(at, Quantity::DerivativeError));
            if is_told {
                let of_sample = RESERVE * tip / ours.get(at, Quantity::ErrorEstimate);
                share = Some(share.unwrap_or(LEAST_SHARE).max(of_sample));
            }
        }
        let error_floor = tip_floor(tips).min(MOST_OF_TOLERANCE * plan.options.tolerance);
        let error = if samples.is_empty() { f64::NAN } else { error };
        let derivative_scale = derivative_scale(&columns, &bare);
        let doubts = distribution(samples.iter().map(|at| truth.doubt[*at].1).collect());
        let middle = (distribution(columns.clone()).median, doubts.median);
        let bare_estimates = samples.iter().map(|at| (*at, ours.get(*at, Quantity::ErrorEstimate))).collect();
        let beyond = columns.iter().filter(|error| **error > plan.options.derivative_tolerance).count();
        let derivative_error = distribution(columns).p95;
        let (compared, error_share) = (samples.len(), share.unwrap_or(plan.options.error_share));
        Trial {
            steps,
            compared,
            error,
            derivative_error,
            error_share,
            error_floor,
            derivative_scale,
            columns: middle,
            beyond,
            bare_estimates,
            extent: Extent::All,
        }
    }

    fn meets(&self, options: &PlanOptions) -> bool {
        let PlanOptions { tolerance, derivative_tolerance, .. } = *options;
        self.compared > 0 && self.error < 0.5 * tolerance && self.derivative_error <= derivative_tolerance
    }

    /// Whether a few of so many samples tell that all of them would not meet the tolerances.
    fn is_hopeless(&self, options: &PlanOptions, samples: usize) -> bool {
        self.compared == 0 || self.error >= 0.5 * options.tolerance || self.beyond * 20 > samples
    }

    /// Whether doubt is much of what was measured of derivatives.
    fn is_drowned(&self) -> bool {
        let (error, doubt) = self.columns;
        doubt > ROUND_OFF && doubt > MOST_DOUBT * error
    }

    fn choice(&self, plan: &Plan, trials: &[Trial], reached: bool) -> PilotChoice {
        let Trial { steps, compared, error, derivative_error, error_share, error_floor, derivative_scale, .. } = *self;
        let PlanOptions { tolerance, derivative_tolerance, stepper, .. } = plan.options;
        let stages = stages(&plan.with_options(PlanOptions { steps, ..plan.options }));
        PilotChoice {
            stepper,
            steps,
            stages,
            work: stages as f64,
            error,
            tolerance,
            derivative_error: if plan.derivatives.is_empty() { None } else { Some(derivative_error) },
            derivative_tolerance,
            error_share,
            error_floor,
            derivative_scale,
            reached,
            compared,
            tried: trials.iter().map(|trial| (trial.steps, trial.error)).collect(),
        }
    }
}

/// From the errors of tips.
fn tip_floor(errors: Vec<f64>) -> f64 {
    let spread = distribution(errors);
    (TIP_FLOOR * spread.median).max((TIP_TAIL * spread.p95).min(MOST_TIP_MEDIANS * spread.median))
}

/// From the errors of derivatives and the bare differences of the pilot's samples. Without either it says nothing.
fn derivative_scale(errors: &[f64], bare: &[f64]) -> DerivativeScale {
    let spread = distribution(errors.to_vec());
    let usual = DERIVATIVE_RESERVE * spread.median;
    let floor = usual.max((DERIVATIVE_TAIL * spread.p95).min(MOST_MEDIANS * spread.median));
    let shares = errors.iter().zip(bare).filter(|(error, bare)| **error > usual && **bare > 0.0);
    let share = shares.map(|(error, bare)| SHARE_RESERVE * error / bare).fold(1.0, f64::max);
    if floor > 0.0 && share.is_finite() { DerivativeScale { share, floor } } else { DerivativeScale::default() }
}
