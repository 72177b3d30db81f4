//! Every equilibrium that can be found: Newton's method from many base moments, deflated by what is known.
//!
//! Samples are searched together, round by round, so that an engine gets large batches. A sample's starts, rounds and
//! end follow from what was found of that sample, so its equilibria do not depend on its neighbours.

use crate::backend::BackendFactory;
use crate::backend::{Backend, BackendError, BackendKind, Precision};
use crate::clock::Busy;
use crate::model::vectors::norm;
use crate::model::{
    BaseWrench, Batch, MOST_KNOWN, Plan, PlanOptions, Quantity, Rod, Solutions, Start, Status, Stepper, Vector,
};
use crate::results::evidence::has_no_energy;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::ops::Range;

/// Searches of a round.
const ROUND: usize = 128;
/// A sample is done when so many rounds in a row have found nothing: if its signs add up, and if they do not.
const EMPTY_ROUNDS: usize = 4;
const EMPTY_ROUNDS_UNBALANCED: usize = 16;
const MOST_ROUNDS: usize = 64;
/// Searches of one call of an engine; bounds memory.
const MOST_SEARCHES: usize = 1 << 17;
/// Equilibria far from rest may be bent much more than the one from rest. A search takes 32 of these steps: 20 are too
/// few for the golden lists. So are 48 of order eight for finishing what was found.
const LEAST_STEPS: usize = 64;
const LEAST_RK4_STEPS: usize = 96;
/// What is found is finished on these multiples of the steps, until its error estimate meets the tolerance.
const FINER: [usize; 3] = [1, 2, 4];
/// Base moments closer than this, relative to their size, belong to one equilibrium.
const SAME: f64 = 1e-6;
/// The same for single precision.
const SAME_SINGLE: f64 = 1e-3;
/// Finishing moves an answer by its error, less than this, not to another equilibrium.
const STAYS: f64 = 0.05;
/// Fractional parts of its multiples fill the cube evenly (Roberts' generalised golden ratio).
const GOLDEN: f64 = 1.220_744_084_605_759_5;

/// Energy (J) of a rod's state with a load at the base, where its loads have a potential.
pub type Energy<'a> = &'a (dyn Fn(&Rod, BaseWrench) -> Option<f64> + Sync);

/// What a search needs from the layers above.
#[derive(Clone, Copy)]
pub struct BranchTools<'a> {
    /// Searches, in whatever precision.
    pub engine: BackendFactory<'a>,
    /// Finishes what was found, in f64.
    pub finisher: BackendFactory<'a>,
    /// Orders what was found.
    pub energy: Energy<'a>,
}

/// One equilibrium.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Branch {
    /// Sample of the batch.
    pub sample: usize,
    /// In J; `None` where the loads have no potential.
    pub energy: Option<f64>,
    /// Whether it is the one reached from rest.
    pub from_rest: bool,
    /// Load at the base; its force is told where the field varies.
    pub base: BaseWrench,
}

/// What was found of one sample.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Equilibria {
    /// Its rows.
    pub rows: Range<usize>,
    /// Whether the signs of det(dr/dm0) add up to 1, as they do over all equilibria. A necessary condition. Not so where
    /// nothing was searched, see [`Rod::is_too_limp`].
    pub balanced: bool,
    /// Searches made.
    pub searches: usize,
}

/// The equilibria of a batch: sample after sample, lowest energy first; where nothing has one, lowest index first.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Branches {
    /// Their rows.
    pub solutions: Solutions,
    /// One for each row of `solutions`.
    pub branches: Vec<Branch>,
    /// One for each sample of the batch.
    pub samples: Vec<Equilibria>,
}

/// A search prepared for a plan.
pub struct BranchSearch<'a> {
    tools: BranchTools<'a>,
    plan: Plan,
    /// The plan without derivatives.
    bare: Plan,
    engine: Box<dyn Backend>,
    same: f64,
    /// By their place in `FINER`, made when first needed.
    finishers: Vec<Box<dyn Backend>>,
}

impl<'a> BranchSearch<'a> {
    /// Prepares engines for a plan.
    ///
    /// # Errors
    ///
    /// An engine that cannot search, or cannot be used.
    pub fn new(plan: &Plan, tools: BranchTools<'a>) -> Result<BranchSearch<'a>, BackendError> {
        if plan.terms.wall {
            let remedy =
                "every equilibrium is not searched with a wall yet; take the one from rest, or leave out `[wall]`";
            let what = "a wall in the search for every equilibrium".into();
            return Err(BackendError::Unsupported { backend: BackendKind::Cpu, what, remedy: remedy.into() });
        }
        let least = if plan.options.stepper == Stepper::Rk4 { LEAST_RK4_STEPS } else { LEAST_STEPS };
        let steps = plan.options.steps.max(least);
        let plan = plan.with_options(PlanOptions { steps, ..plan.options });
        let bare = plan.without_derivatives(plan.options);
        let mut engine = (tools.engine)(&bare.with_starts())?;
        let same = match engine.info().precision {
            Precision::F64 => SAME,
            Precision::F32 => SAME_SINGLE,
        };
        engine.solve(&bare.start_batch(&bare.batch(0, |_, _| {}), &[]))?;
        Ok(BranchSearch { tools, plan, bare, engine, same, finishers: Vec::new() })
    }

    /// Looks for the equilibria of every sample of a batch of the plan, beside those from rest. `None` if `stop` said
    /// so between two rounds.
    ///
    /// # Errors
    ///
    /// An engine that fails.
    pub fn find(
        &mut self,
        batch: &Batch,
        from_rest: &Solutions,
        stop: &dyn Fn() -> bool,
    ) -> Result<Option<Branches>, BackendError> {
        let mut found = self.begin(batch, from_rest)?;
        let bare = self.bare.same_rods(&self.plan, batch);
        let group = (self.engine.batch_size().min(MOST_SEARCHES) / ROUND).max(1);
        loop {
            let open: Vec<usize> = (0..found.len()).filter(|sample| found[*sample].is_open()).collect();
            if open.is_empty() {
                break;
            }
            for samples in open.chunks(group) {
                if stop() {
                    return Ok(None);
                }
                let starts: Vec<Start> =
                    samples.iter().flat_map(|sample| found[*sample].next_starts(*sample)).collect();
                let solutions = self.engine.solve(&self.bare.start_batch(&bare, &starts))?;
                for (k, sample) in samples.iter().enumerate() {
                    found[*sample].add_round(&solutions, k * ROUND..(k + 1) * ROUND, self.same);
                }
            }
        }
        self.finish(batch, from_rest, &found).map(Some)
    }

    /// Where every sample starts: with its equilibrium from rest, on the grid of the search.
    fn begin(&mut self, batch: &Batch, from_rest: &Solutions) -> Result<Vec<Found>, BackendError> {
        let unit = self.plan.units.moment();
        let known: Vec<usize> =
            (0..batch.sample_count()).filter(|sample| from_rest.status(*sample).is_converged()).collect();
        let start = |sample: &usize| Start {
            sample: *sample,
            m0: from_rest.vector(*sample, Quantity::BaseMoment),
            n0: None,
            known: &[],
        };
        let finer = self.solve_finer(0, batch, &known.iter().map(start).collect::<Vec<_>>())?;
        let busy = Busy::here();
        let mut found: Vec<Found> = (0..batch.sample_count())
            .into_par_iter()
            .map(|sample| {
                let _busy = busy.enter();
                let is_rod = !batch.bad[sample] && from_rest.status(sample) != Status::BadParameter;
                let radius = if is_rod { self.plan.moment_bound(batch, sample).max(unit) } else { 0.0 };
                let is_limp = is_rod && self.plan.sample_rod(batch, sample).is_too_limp();
                let is_dead = has_no_energy(&self.plan, batch, sample);
                Found { unit, radius, is_over: !is_rod || is_limp, is_limp, is_dead, ..Found::default() }
            })
            .collect();
        for (row, sample) in known.iter().enumerate() {
            let m0 = from_rest.vector(*sample, Quantity::BaseMoment);
            let of = &mut found[*sample];
            let moved = finer.vector(row, Quantity::BaseMoment);
            let stays = finer.status(row).is_converged() && near(m0, moved, unit, STAYS);
            if stays {
                of.add(&finer, row, 0.0)
            } else {
                of.add(from_rest, *sample, 0.0)
            };
            of.has_from_rest = !of.moments.is_empty();
        }
        Ok(found)
    }

    /// Solves from where equilibria are, on `FINER[level]` times the steps, with derivatives.
    fn solve_finer(&mut self, level: usize, batch: &Batch, starts: &[Start]) -> Result<Solutions, BackendError> {
        while self.finishers.len() <= level {
            let steps = self.plan.options.steps * FINER[self.finishers.len()];
            let plan = self.plan.with_options(PlanOptions { steps, ..self.plan.options }).with_starts();
            self.finishers.push((self.tools.finisher)(&plan)?);
        }
        self.finishers[level].solve(&self.plan.start_batch(batch, starts))
    }

    /// Each once more from where it is, as a row.
    fn finish(&mut self, batch: &Batch, from_rest: &Solutions, found: &[Found]) -> Result<Branches, BackendError> {
        let mut starts: Vec<Start> = Vec::new();
        for (sample, of) in found.iter().enumerate() {
            let bases = of.moments.iter().zip(&of.forces);
            starts.extend(bases.map(|(m0, n0)| Start { sample, m0: *m0, n0: *n0, known: &[] }));
        }
        let mut rows = self.solve_finer(0, batch, &starts)?;
        for level in 1..FINER.len() {
            let is_doubtful = |row: &usize| !is_good(&rows, *row, self.plan.options.tolerance);
            let doubtful: Vec<usize> = (0..starts.len()).filter(is_doubtful).collect();
            if doubtful.is_empty() {
                break;
            }
            let again = |row: &usize| match rows.status(*row).is_converged() {
                true => {
                    Start { m0: rows.vector(*row, Quantity::BaseMoment), n0: rows.base_force(*row), ..starts[*row] }
                }
                false => starts[*row],
            };
            let finer = self.solve_finer(level, batch, &doubtful.iter().map(again).collect::<Vec<_>>())?;
            for (from, row) in doubtful.into_iter().enumerate() {
                let least = rows.get(row, Quantity::ErrorEstimate);
                let bound = if rows.status(row).is_converged() && least.is_finite() { least } else { f64::INFINITY };
                if is_good(&finer, from, bound) {
                    rows.copy_row(row, &finer, from);
                    if finer.status(from).is_success() {
                        rows.set_status(row, Status::Refined);
                    }
                }
            }
        }
        Ok(self.collect(batch, from_rest, found, &starts, &rows))
    }

    /// Without repetitions, in order, with energies; the row from rest is the one that was given.
    fn collect(
        &self,
        batch: &Batch,
        from_rest: &Solutions,
        found: &[Found],
        starts: &[Start],
        rows: &Solutions,
    ) -> Branches {
        let (plan, energy) = (&self.plan, self.tools.energy);
        let mut ends = Vec::with_capacity(found.len());
        let mut end = 0;
        for of in found {
            ends.push(end..end + of.moments.len());
            end += of.moments.len();
        }
        let busy = Busy::here();
        let chosen: Vec<Vec<(usize, Branch)>> = ends
            .par_iter()
            .zip(found)
            .enumerate()
            .map(|(sample, (range, of))| {
                let _busy = busy.enter();
                chosen(plan, energy, (batch, sample), range.clone(), of, rows)
            })
            .collect();
        let mut solutions = Solutions::new(&self.plan, chosen.iter().map(Vec::len).sum());
        let (mut branches, mut samples) = (Vec::new(), Vec::with_capacity(found.len()));
        for (chosen, of) in chosen.iter().zip(found) {
            let (first, mut signs) = (branches.len(), 0);
            for (row, branch) in chosen {
                let (from, row) = if branch.from_rest { (from_rest, starts[*row].sample) } else { (rows, *row) };
                solutions.copy_row(branches.len(), from, row);
                signs += sign(from, row, of.is_dead);
                branches.push(*branch);
            }
            let balanced = signs == 1 && !of.is_limp;
            samples.push(Equilibria { rows: first..branches.len(), balanced, searches: of.searches });
        }
        Branches { solutions, branches, samples }
    }
}

/// The rows of one sample that stay, with what is known of them.
fn chosen(
    plan: &Plan,
    energy: Energy,
    rod: (&Batch, usize),
    range: Range<usize>,
    of: &Found,
    rows: &Solutions,
) -> Vec<(usize, Branch)> {
    let (batch, sample) = rod;
    let rod = plan.sample_rod(batch, sample);
    let mut chosen: Vec<(usize, Branch)> = Vec::new();
    let mut moments: Vec<Vector> = Vec::new();
    for row in range.clone() {
        let from_rest = of.has_from_rest && row == range.start;
        let start = of.moments[row - range.start];
        let moved = rows.vector(row, Quantity::BaseMoment);
        // The row from rest is given: one that has left it is not its.
        let converged = rows.status(row).is_converged() && (!from_rest || near(start, moved, of.unit, STAYS));
        let m0 = if converged { moved } else { start };
        let is_new = converged && moments.iter().all(|other| !near(m0, *other, of.unit, SAME));
        if is_new || from_rest {
            moments.push(m0);
            let force = if converged { rows.base_force(row) } else { of.forces[row - range.start] };
            let base = BaseWrench { moment: m0, force };
            chosen.push((row, Branch { sample, energy: energy(&rod, base), from_rest, base }));
        }
    }
    let rank = |(row, branch): &(usize, Branch)| {
        let [x, y, z] = rows.vector(*row, Quantity::BaseMoment);
        [branch.energy.unwrap_or(f64::INFINITY), rows.get(*row, Quantity::StabilityIndex), x, y, z]
    };
    chosen.sort_by(|a, b| {
        let orders = rank(a).into_iter().zip(rank(b)).map(|(a, b)| a.total_cmp(&b));
        orders.fold(Ordering::Equal, Ordering::then)
    });
    chosen
}

/// Distinct equilibria of a sample so far.
#[derive(Default)]
struct Found {
    moments: Vec<Vector>,
    /// Forces at the base that go with them, where a search in a field that varies has told them.
    forces: Vec<Option<Vector>>,
    signs: i64,
    has_from_rest: bool,
    unit: f64,
    /// Of the ball in which searches start (N·m).
    radius: f64,
    searches: usize,
    empty_rounds: usize,
    is_over: bool,
    /// It is not searched at all.
    is_limp: bool,
    /// A dead moment acts at its tip: margins have the sign of det(dr/dm0), which an index does not tell.
    is_dead: bool,
}

impl Found {
    fn is_open(&self) -> bool {
        let patience = if self.signs == 1 { EMPTY_ROUNDS } else { EMPTY_ROUNDS_UNBALANCED };
        !self.is_over && self.empty_rounds < patience && self.searches < MOST_ROUNDS * ROUND
    }

    /// Every other round without deflation, which may also push a search past what it would find.
    fn next_starts(&self, sample: usize) -> impl Iterator<Item = Start<'_>> {
        let is_even = (self.searches / ROUND).is_multiple_of(2);
        let known = if is_even { &[] } else { &self.moments[..self.moments.len().min(MOST_KNOWN)] };
        let points = self.searches..self.searches + ROUND;
        points.map(move |k| Start { sample, m0: point_in_ball(k, self.radius), n0: None, known })
    }

    fn add_round(&mut self, solutions: &Solutions, rows: Range<usize>, same: f64) {
        let before = self.moments.len();
        rows.for_each(|row| self.add(solutions, row, same));
        self.searches += ROUND;
        self.empty_rounds = if self.moments.len() > before { 0 } else { self.empty_rounds + 1 };
    }

    fn add(&mut self, solutions: &Solutions, row: usize, same: f64) {
        let m0 = solutions.vector(row, Quantity::BaseMoment);
        let is_sound = solutions.status(row).is_converged() && m0.iter().all(|m| m.is_finite());
        if is_sound && self.moments.iter().all(|other| !near(m0, *other, self.unit, same)) {
            self.moments.push(m0);
            self.forces.push(solutions.base_force(row));
            self.signs += sign(solutions, row, self.is_dead);
        }
    }
}

/// Whether a row has converged with an error estimate of at most a bound.
fn is_good(solutions: &Solutions, row: usize, bound: f64) -> bool {
    solutions.status(row).is_converged() && solutions.get(row, Quantity::ErrorEstimate) <= bound
}

/// Of det(dr/dm0).
fn sign(solutions: &Solutions, row: usize, is_dead: bool) -> i64 {
    if is_dead {
        return if solutions.get(row, Quantity::StabilityMargin) < 0.0 { -1 } else { 1 };
    }
    if solutions.get(row, Quantity::StabilityIndex).round() as i64 % 2 == 0 { 1 } else { -1 }
}

/// Whether two base moments differ by less than a share of their size.
fn near(a: Vector, b: Vector, unit: f64, share: f64) -> bool {
    norm(std::array::from_fn(|k| a[k] - b[k])) < share * (unit + norm(a))
}

/// Point k of a sequence that fills a ball, more densely towards its centre; point 0 is the centre.
fn point_in_ball(k: usize, radius: f64) -> Vector {
    let [x, y, z] = [1, 2, 3].map(|power| (k as f64 * GOLDEN.powi(-power)).fract());
    let (height, angle) = (2.0 * y - 1.0, 2.0 * std::f64::consts::PI * z);
    let across = (1.0 - height * height).max(0.0).sqrt();
    let r = radius * x;
    [r * across * angle.cos(), r * across * angle.sin(), r * height]
}
