//! The wall comes: under the full load it moves from where it just touches the tip to its place, or a tip that is held is drawn
//! straight to its point. Every step must stay stable. W4
//!
//! Steps are judged as those of the load are: by the turn of every station, and by the second variation.

use super::contact::{Balance, Contact, Touch, of_base};
use super::hessian::{Stability, stability};
use super::passage::{Passage, combined};
use super::ramp::{APPROACH, End, FOLD_MARGIN, LITTLE_STEP, RATIO, SMALL_LOAD, SOFT};
use super::shooting::pass_by_sections;
use super::state::{BaseLoad, Column, Varying};
use crate::reference::answer;
use crate::reference::extrapolation::Extrapolation;
use crate::reference::ramp::{
    ALIKE, ARRIVED, ARRIVED_TURN, CONTRACTION, CORRECTION, CORRECTION_TURN, FIRST_TURN, LITTLE_LOAD, MOST_PASSES,
    QUICK, SECTIONS, SMALLEST_STEP, TOLERANCE, differs_widely, twice,
};
use crate::reference::stability::margin;
use nalgebra::{DVector, Matrix3, Vector3};

/// The error of one integration step may have grown to this at the tip.
const GROWN: f64 = 1e-4;

/// Where the wall's way leads.
pub(super) struct Way {
    pub base: BaseLoad,
    pub touch: Touch,
    /// Share of the way.
    pub tau: f64,
    pub steps: usize,
    pub passes: usize,
    pub end: End,
}

/// The last tangents of the way, the latest first, and where they were.
struct Tangents(Vec<(f64, DVector<f64>)>);

impl Tangents {
    /// How many tell where the way leads.
    const MOST: usize = 4;

    fn add(&mut self, tau: f64, tangent: &DVector<f64>) {
        self.0.insert(0, (tau, tangent.clone()));
        self.0.truncate(Self::MOST);
    }

    /// The change of the unknown to `tau`: the integral of the polynomial through the tangents, in Newton's form; by the last one alone where
    /// the others would change it by more than half. W4
    fn lead(&self, tau: f64) -> DVector<f64> {
        let (at, mut divided): (Vec<f64>, Vec<DVector<f64>>) = self.0.iter().cloned().unzip();
        let back = |k: usize| at.get(k).map_or(0.0, |before| at[0] - before);
        let (h, a, b) = (tau - at[0], back(1), back(2));
        let (square, cube, fourth) = (h.powi(2) / 2.0, h.powi(3) / 3.0, h.powi(4) / 4.0);
        let weights = [square, cube + a * square, fourth + (a + b) * cube + a * b * square];
        let straight = &divided[0] * h;
        let mut bent = straight.clone();
        for (order, weight) in (1..at.len()).zip(weights) {
            for k in 0..at.len() - order {
                divided[k] = (&divided[k] - &divided[k + 1]) / (at[k] - at[k + order]);
            }
            bent.axpy(weight, &divided[0], 1.0);
        }
        if (&bent - &straight).norm() > 0.5 * straight.norm() { straight } else { bent }
    }
}

/// An equilibrium on the way.
struct Step {
    base: BaseLoad,
    touch: Touch,
    /// d(unknown)/d(tau)
    tangent: DVector<f64>,
    passage: Passage,
    leeway: f64,
    least: f64,
    margin: f64,
    fast: bool,
}

enum Refused {
    TooNear,
    Outside,
    /// The wall would pull a tip that slides.
    Pulled,
    Other,
}

/// What stays the same on the way.
struct Coming<'a> {
    rod: &'a Varying,
    contact: Contact,
    /// The shift of the conditions at its start. W4
    distance: DVector<f64>,
    /// Compliance added to that of the tissue at the start of the way. W4
    softness: f64,
    pace: f64,
}

/// Follows the equilibrium from that of the free rod, whose tip is at `p_free`, as far as it stays stable, and whether two ways ended
/// alike.
pub(super) fn from_free(rod: &Varying, contact: &Contact, base: BaseLoad, p_free: Vector3<f64>) -> (Way, bool) {
    let softness = free_compliance(rod, &base).map_or(0.0, |dp_df| contact.softness(&dp_df));
    let coming = |pace| Coming { rod, contact: *contact, distance: contact.distance(p_free), softness, pace };
    twice(
        None,
        |pace| coming(pace).follow(base, Touch::before(*contact, p_free)),
        |a, b| {
            let same_way = (a.tau - b.tau).abs() <= ALIKE * b.tau.max(LITTLE_LOAD) && a.end == b.end;
            let apart = (a.base.n - b.base.n).norm().max((a.base.m_body - b.base.m_body).norm());
            same_way && (b.end != End::Arrived || apart <= ALIKE * (1.0 + b.base.norm()))
        },
    )
}

impl Coming<'_> {
    fn follow(&self, base: BaseLoad, touch: Touch) -> Way {
        let still = DVector::zeros(6 + touch.count());
        let mut way = Way { base, touch, tau: 0.0, steps: 0, passes: 1, end: End::Fold };
        let mut integrator = Extrapolation::on_the_way(TOLERANCE);
        let mut last = match self.correct(0.0, &way.base, &way.touch, &still, &mut integrator, &mut way.passes) {
            Ok(first) => first,
            Err(Refused::TooNear) => return Way { end: End::TooNear, ..way },
            Err(Refused::Outside) => return Way { end: End::Outside, ..way },
            Err(Refused::Pulled | Refused::Other) => return way,
        };
        let mut step = self.first_step(&last);
        let mut tangents = Tangents(Vec::new());
        tangents.add(0.0, &last.tangent);
        let (mut too_near, mut outside, mut pulled) = (false, false, false);
        while way.tau < 1.0 {
            if way.passes >= MOST_PASSES {
                return Way { end: End::GaveUp, ..way };
            }
            let tau = if way.tau + step >= 1.0 { 1.0 } else { way.tau + step };
            let predicted = tangents.lead(tau);
            let found = self.correct(tau, &way.base, &way.touch, &predicted, &mut integrator, &mut way.passes);
            match found.and_then(|next| if leaps(&next, &last) { Err(Refused::Other) } else { Ok(next) }) {
                Ok(next) => {
                    (too_near, outside, pulled) = (false, false, false);
                    way.steps += 1;
                    step = (step * if next.fast { 2.0 } else { 1.0 }).min(self.first_step(&next));
                    if next.least < SOFT {
                        // As far as it takes, as things go, to half of it.
                        let slope = (last.least - next.least).abs() / (tau - way.tau);
                        step = step.min((0.5 * next.least / slope).max(self.pace * LITTLE_STEP));
                    }
                    (way.base, way.touch, way.tau) = (next.base, next.touch.clone(), tau);
                    tangents.add(tau, &next.tangent);
                    integrator.tighten((GROWN / next.passage.growth()).max(answer::TOLERANCE));
                    last = next;
                }
                Err(refused) => {
                    too_near |= matches!(refused, Refused::TooNear);
                    outside |= matches!(refused, Refused::Outside);
                    pulled |= matches!(refused, Refused::Pulled);
                    step = 0.5 * (tau - way.tau);
                    if step < self.pace * SMALLEST_STEP * way.tau.max(LITTLE_LOAD) {
                        let end = match (too_near, outside) {
                            (true, _) => End::TooNear,
                            (_, true) => End::Outside,
                            // Far from singular no wall makes a rod snap, unless its tip jumps from the wall.
                            _ if last.margin > FOLD_MARGIN && !pulled => End::GaveUp,
                            _ => End::Fold,
                        };
                        return Way { end, ..way };
                    }
                }
            }
        }
        Way { end: End::Arrived, ..way }
    }

    /// A step of the way after which a tangent still tells.
    fn first_step(&self, at: &Step) -> f64 {
        let by = of_base(&at.tangent);
        let moved = |of: fn(&Column) -> Vector3<f64>| at.passage.largest(|columns| combined(columns, of, &by).norm());
        let turn = self.pace * FIRST_TURN / moved(|column| column.w);
        let approach = APPROACH * at.leeway / moved(|column| column.dp);
        turn.min(approach.max(self.pace * LITTLE_STEP)).min(1.0)
    }

    /// Newton's iteration from the predicted unknown: the equilibrium it contracts to.
    fn correct(
        &self,
        tau: f64,
        base: &BaseLoad,
        touch: &Touch,
        predicted: &DVector<f64>,
        integrator: &mut Extrapolation,
        passes: &mut usize,
    ) -> Result<Step, Refused> {
        let changes = self.rod.base_changes();
        let mut base = base.moved(&of_base(predicted));
        let left = 1.0 - tau;
        let mut touch = touch.set_out(left * &self.distance, left * self.softness).moved(predicted);
        let allowed_turn = self.pace * CORRECTION_TURN;
        let allowed_first = self.pace * CORRECTION * predicted.norm().max(SMALL_LOAD);
        let mut allowed = allowed_first;
        let mut first = None;
        loop {
            let passage =
                pass_by_sections(self.rod, &base, &changes, SECTIONS, integrator).map_err(|_| Refused::Other)?;
            *passes += 1;
            let p = passage.tip.p;
            if !self.contact.has_normal(p) {
                return Err(Refused::Other);
            }
            let balance = Balance::new(&passage, Some(&touch));
            let step = balance.step().ok_or(Refused::Other)?;
            let size = step.norm();
            let by = of_base(&step);
            let turn = passage.largest(|columns| combined(columns, |column| column.w, &by).norm());
            let share = *first.get_or_insert((size / allowed_first).max(turn / allowed_turn));
            if size <= ARRIVED * (1.0 + base.norm()) && turn <= ARRIVED_TURN {
                *passes += 1;
                if !self.contact.sticks() && touch.strength[0] < -ARRIVED {
                    return Err(Refused::Pulled);
                }
                let found = stability(self.rod, &base, Some(&touch.hold(p)), integrator).ok_or(Refused::Other)?;
                let Stability { leeway, inside, .. } = found;
                if leeway <= 0.0 {
                    return Err(Refused::TooNear);
                }
                if inside <= 0.0 {
                    return Err(Refused::Outside);
                }
                let least = found.least_eigenvalue().ok_or(Refused::Other)?;
                let tangent = balance.answer(&self.by_tau(&touch)).ok_or(Refused::Other)?;
                let (base, touch) = (base.moved(&by), touch.moved(&step));
                let margin = margin(balance.moment_inverse(), false);
                return Ok(Step { base, touch, tangent, passage, leeway, least, margin, fast: share < QUICK });
            }
            // Also false for NaN.
            let contracts = size <= allowed && turn <= allowed_turn;
            if !contracts {
                return Err(Refused::Other);
            }
            allowed = CONTRACTION * size;
            base = base.moved(&by);
            touch = touch.moved(&step);
        }
    }

    /// How the residual changes as the wall comes.
    fn by_tau(&self, touch: &Touch) -> DVector<f64> {
        let count = self.distance.len();
        let sign = if self.contact.sticks() { 1.0 } else { -1.0 };
        let mut by = DVector::zeros(6 + count);
        by.rows_mut(6, count).copy_from(&(sign * &self.distance - self.softness * &touch.strength));
        by
    }
}

/// How the tip of a free rod follows a dead force on it.
fn free_compliance(rod: &Varying, base: &BaseLoad) -> Option<Matrix3<f64>> {
    let mut integrator = Extrapolation::on_the_way(TOLERANCE);
    let passage = pass_by_sections(rod, base, &rod.base_changes(), SECTIONS, &mut integrator).ok()?;
    let balance = Balance::new(&passage, None);
    let mut dp_df = Matrix3::zeros();
    for k in 0..3 {
        let mut force = DVector::zeros(6);
        force[k] = -1.0;
        let by = of_base(&balance.answer(&force)?);
        dp_df.set_column(k, &combined(&passage.tip.columns, |column| column.dp, &by));
    }
    Some(dp_df)
}

/// Whether a step changes the least eigenvalue so much, where it is small, that stability may be lost and won again between.
fn leaps(next: &Step, last: &Step) -> bool {
    differs_widely(next.least, last.least, SOFT, RATIO)
}
