//! A search for the inputs of one point: each step is the answer of a linear programme on the last row.

use super::programme::Programme;
use super::rows::Row;
use crate::model::{Status, Vector};
use crate::study::workspace::{Inputs, MOST_INPUTS};
use std::f64::consts::TAU;

/// Sides of the polygon around the cone of friction, and cuts that one step may add where it leaves the cone.
const SIDES: usize = 12;
const MOST_CUTS: usize = 8;
/// How far a step may leave the cone before that is cut, over the cone's radius: less than searches aim inside of it.
const CUT: f64 = 2e-5;
/// A cone's radius, over the unit of force, below which round-off decides.
const ROUND_OFF: f64 = 1e-5;
/// Searches aim within their bounds by this share, so that rows end inside of them.
const INSIDE: f64 = 5e-5;
/// How near a demanded normal force must be, as a share of it.
const EXACT: f64 = 1e-4;
/// A step that promises less, as a share of the normal force, is the last; forces below the least, over the unit, count as that.
const PROMISE: f64 = 1e-4;
const LEAST_FORCE: f64 = 0.05;
/// Steps over half the range of an input: at first, and where a search ends.
const FIRST: f64 = 0.5;
const SMALLEST: f64 = 1e-3;
/// Weight of the largest violation, at first, at last, and by how much it grows.
const WEIGHT: f64 = 10.0;
const MOST_WEIGHT: f64 = 1e4;
const HEAVIER: f64 = 10.0;
/// The same while no row holds yet.
const FIRST_WEIGHT: f64 = 1e3;
/// Rows of one search, at most.
const MOST_ROWS: usize = 60;

/// What is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Aim {
    /// The most normal force that friction holds.
    Most,
    /// The least.
    Least,
    /// The least coefficient of friction at a normal force (N).
    Ratio(f64),
}

/// What all searches have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    pub aim: Aim,
    /// Number of inputs.
    pub count: usize,
    pub friction: f64,
    pub minimum_margin: f64,
    /// Normal forces below it do not count (N).
    pub floor: f64,
    /// Unit of force (N).
    pub unit: f64,
}

impl Rules {
    /// What is to be small.
    pub(super) fn goal(&self, row: &Row) -> f64 {
        match self.aim {
            Aim::Most => -row.normal_force / self.unit,
            Aim::Least => row.normal_force / self.unit,
            Aim::Ratio(_) => row.friction() / self.unit,
        }
    }

    /// The largest violation of a bound, over the unit of force; 0 where a row lies within all of them.
    fn violation(&self, normal_force: f64, friction: f64, margin: f64) -> f64 {
        let force = match self.aim {
            Aim::Ratio(force) => (normal_force - force).abs() / self.unit,
            _ => self.out_of_cone(normal_force, friction).max((self.floor - normal_force) / self.unit),
        };
        force.max(self.minimum_margin + INSIDE - margin).max(0.0)
    }

    fn out_of_cone(&self, normal_force: f64, friction: f64) -> f64 {
        (friction - (1.0 - INSIDE) * self.friction * normal_force) / self.unit
    }

    fn violation_of(&self, row: &Row) -> f64 {
        self.violation(row.normal_force, row.friction(), row.margin)
    }

    /// Whether a row answers, exactly.
    pub(super) fn holds(&self, row: &Row) -> bool {
        let force = match self.aim {
            Aim::Ratio(force) => (row.normal_force / force - 1.0).abs() <= EXACT,
            _ => row.friction() <= self.friction * row.normal_force && row.normal_force >= self.floor,
        };
        row.status.is_success() && row.normal_force > 0.0 && row.margin >= self.minimum_margin && force
    }

    /// Whether a row is a better answer than another.
    pub(super) fn is_better(&self, row: &Row, than: &Row) -> bool {
        self.goal(row) < self.goal(than)
    }

    /// Whether a row, which may violate bounds, promises a clearly better answer than another: by a share, and by more than next to nothing.
    pub(super) fn is_clearly_better(&self, row: &Row, than: &Row, share: f64) -> bool {
        let (one, other) = (self.merit(row, WEIGHT), self.merit(than, WEIGHT));
        row.status.is_success() && other - one > share * self.goal(than).abs() + 1e-3 * share
    }

    /// Of some rows the one to begin from; `None` where none is a success.
    pub(super) fn first(&self, rows: &[Row]) -> Option<usize> {
        let usable = (0..rows.len()).filter(|k| rows[*k].status.is_success());
        usable.min_by(|a, b| {
            let key = |k: &usize| (!self.holds(&rows[*k]), self.merit(&rows[*k], WEIGHT));
            let ((a, merit_a), (b, merit_b)) = (key(a), key(b));
            a.cmp(&b).then(merit_a.total_cmp(&merit_b))
        })
    }

    fn merit(&self, row: &Row, weight: f64) -> f64 {
        self.goal(row) + weight * self.violation_of(row)
    }
}

/// The search at one point.
#[derive(Clone, Debug)]
pub(super) struct Search {
    /// Where the tip is held (m).
    pub place: Vector,
    /// Inputs and their row.
    pub at: Inputs,
    pub row: Row,
    /// The best answer so far.
    pub best: Option<(Inputs, Row)>,
    /// What became of the last step, where that gave no equilibrium that can be used.
    pub blocked: Option<Status>,
    /// Inputs to be solved next; `None`: the search has ended.
    pub next: Option<Inputs>,
    radius: f64,
    weight: f64,
    /// How the margin follows the inputs, from the rows that were met (Broyden).
    margin_rates: Inputs,
    promised: f64,
    rows: usize,
}

impl Search {
    /// From a row; `radius` is that of the first step.
    pub(super) fn new(rules: &Rules, place: Vector, (at, row): (Inputs, Row), radius: Option<f64>) -> Search {
        let mut search = Search {
            place,
            at,
            row,
            best: rules.holds(&row).then_some((at, row)),
            blocked: None,
            next: None,
            radius: radius.unwrap_or(FIRST),
            weight: if rules.holds(&row) { WEIGHT } else { FIRST_WEIGHT },
            margin_rates: [0.0; MOST_INPUTS],
            promised: 0.0,
            rows: 0,
        };
        search.propose(rules);
        search
    }

    /// Takes in what came of the step, and proposes another.
    pub(super) fn judge(&mut self, rules: &Rules, row: Row) {
        let Some(next) = self.next.take() else { return };
        self.rows += 1;
        let step: Inputs = std::array::from_fn(|k| next[k] - self.at[k]);
        let size = step.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        if row.status.is_success() {
            self.learn(&step, row.margin - self.row.margin);
            let gained = rules.merit(&self.row, self.weight) - rules.merit(&row, self.weight);
            let is_best = self.best.as_ref().is_none_or(|(_, best)| rules.is_better(&row, best));
            if rules.holds(&row) && is_best {
                if self.best.is_none() {
                    self.weight = WEIGHT;
                }
                self.best = Some((next, row));
            }
            let kept = gained / self.promised;
            if kept > 0.1 {
                (self.at, self.row, self.blocked) = (next, row, None);
                if kept > 0.7 && size > 0.9 * self.radius {
                    self.radius = (2.0 * self.radius).min(1.0);
                } else if kept < 0.3 {
                    self.radius = 0.5 * size;
                }
            } else {
                self.radius = 0.5 * size;
            }
        } else {
            self.blocked = Some(row.status);
            self.radius = 0.4 * size;
        }
        if self.rows < MOST_ROWS {
            self.propose(rules);
        }
    }

    /// The next step, if one is worth its row.
    fn propose(&mut self, rules: &Rules) {
        loop {
            if self.radius >= SMALLEST
                && let Some((step, promised)) = self.step(rules)
            {
                if promised > PROMISE * (self.row.normal_force / rules.unit).abs().max(LEAST_FORCE) {
                    self.promised = promised;
                    let moved = |k: usize| (self.at[k] + step[k]).clamp(-1.0, 1.0);
                    self.next = Some(std::array::from_fn(|k| if k < rules.count { moved(k) } else { 0.0 }));
                    return;
                }
            }
            let is_over = self.weight >= MOST_WEIGHT || self.best.is_some() && self.blocked.is_some();
            if rules.holds(&self.row) || is_over {
                return;
            }
            // Out of a bound still: it has to weigh more.
            self.weight *= HEAVIER;
            self.radius = self.radius.max(0.05);
        }
    }

    /// The step that the row's derivatives promise most of, and how much.
    fn step(&self, rules: &Rules) -> Option<(Inputs, f64)> {
        let (row, count, unit) = (&self.row, rules.count, rules.unit);
        let is_ratio = matches!(rules.aim, Aim::Ratio(_));
        let (bound, elastic) = (count, count + 1);
        let variables = count + 2;
        let force = row.normal_force / unit;
        let along = row.along.map(|x| x / unit);
        let rate = |k: usize, of: usize| row.rates[k][of] / unit;
        let mut cost = vec![0.0; variables];
        match rules.aim {
            Aim::Most => (0..count).for_each(|k| cost[k] = -rate(k, 0)),
            Aim::Least => (0..count).for_each(|k| cost[k] = rate(k, 0)),
            Aim::Ratio(_) => cost[bound] = 1.0,
        }
        cost[elastic] = self.weight;
        let now = rules.violation_of(row);
        let mut low: Vec<f64> = (0..count).map(|k| (-self.radius).max(-1.0 - self.at[k])).collect();
        let mut high: Vec<f64> = (0..count).map(|k| self.radius.min(1.0 - self.at[k])).collect();
        low.extend([0.0; 2]);
        // As much as any row can lack within the step.
        let most = |of: &dyn Fn(usize) -> f64| self.radius * (0..count).map(|k| of(k).abs()).sum::<f64>();
        let any = most(&|k| rate(k, 0)) + most(&|k| rate(k, 1)) + most(&|k| rate(k, 2));
        let any = any + most(&|k| self.margin_rates[k]);
        let reserve = 1.0 + 2.0 * (now + any * (1.0 + rules.friction));
        high.extend([if is_ratio { f64::INFINITY } else { 0.0 }, reserve]);
        let mut rows: Vec<(Vec<f64>, f64)> = Vec::with_capacity(SIDES + MOST_CUTS + 4);
        let side = |angle: f64| {
            let (b, a) = angle.sin_cos();
            let mut side = vec![0.0; variables];
            let own = |k: usize| a * rate(k, 1) + b * rate(k, 2);
            let along = a * along[0] + b * along[1];
            if is_ratio {
                (0..count).for_each(|k| side[k] = own(k));
                side[bound] = -1.0;
                return (side, -along);
            }
            let friction = (1.0 - INSIDE) * rules.friction;
            (0..count).for_each(|k| side[k] = own(k) - friction * rate(k, 0));
            side[elastic] = -1.0;
            (side, friction * force - along)
        };
        let now_at = along[1].atan2(along[0]);
        rows.extend((0..SIDES).map(|k| side(now_at + k as f64 * TAU / SIDES as f64)));
        let mut keep = |of: &dyn Fn(usize) -> f64, limit: f64| {
            let mut kept: Vec<f64> = (0..count).map(of).collect();
            kept.extend([0.0, -1.0]);
            rows.push((kept, limit));
        };
        match rules.aim {
            Aim::Ratio(wanted) => {
                keep(&|k| rate(k, 0), wanted / unit - force);
                keep(&|k| -rate(k, 0), force - wanted / unit);
            }
            _ => keep(&|k| -rate(k, 0), force - (1.0 + INSIDE) * rules.floor / unit),
        }
        keep(&|k| -self.margin_rates[k], row.margin - rules.minimum_margin - INSIDE);
        let mut programme = Programme { cost, low, high, rows, elastic: Some(elastic) };
        for cuts in 0..=MOST_CUTS {
            let x = programme.solve()?;
            let after = |from: f64, of: usize| from + (0..count).map(|k| rate(k, of) * x[k]).sum::<f64>();
            let (force, along) = (after(force, 0), [after(along[0], 1), after(along[1], 2)]);
            let friction = along[0].hypot(along[1]);
            let out = match is_ratio {
                true => friction - x[bound],
                false => rules.out_of_cone(force * unit, friction * unit) - x[elastic],
            };
            let radius = if is_ratio { x[bound] } else { rules.friction * force };
            if out > CUT * radius.abs().max(ROUND_OFF) && cuts < MOST_CUTS {
                programme.rows.push(side(along[1].atan2(along[0])));
                continue;
            }
            let margin = row.margin + (0..count).map(|k| self.margin_rates[k] * x[k]).sum::<f64>();
            let goal = match rules.aim {
                Aim::Most => -force,
                Aim::Least => force,
                Aim::Ratio(_) => friction,
            };
            let promised = rules.merit(row, self.weight)
                - goal
                - self.weight * rules.violation(force * unit, friction * unit, margin);
            let step = std::array::from_fn(|k| if k < count { x[k] } else { 0.0 });
            return Some((step, promised));
        }
        None
    }

    /// What the margins of two rows say of its slope (Broyden 1965).
    fn learn(&mut self, step: &Inputs, change: f64) {
        let square: f64 = step.iter().map(|x| x * x).sum();
        if square > 0.0 && change.is_finite() {
            let expected: f64 = step.iter().zip(&self.margin_rates).map(|(x, rate)| x * rate).sum();
            let factor = (change - expected) / square;
            self.margin_rates.iter_mut().zip(step).for_each(|(rate, x)| *rate += factor * x);
        }
    }
}
