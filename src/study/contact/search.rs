//! A search for the inputs of one point: each step is the best of a model of the last row, with second derivatives learned on the way.

use super::programme::Programme;
use super::rows::{Row, across, dot};
use crate::model::{Status, Vector};
use crate::study::workspace::{Inputs, MOST_INPUTS};
use std::cmp::Ordering;
use std::f64::consts::TAU;

/// Sides of the polygon around the cone of friction, and cuts that one step may add where it leaves the cone.
const SIDES: usize = 6;
const MOST_CUTS: usize = 8;
/// How far a step may leave the cone before that is cut, over the cone's radius: less than searches aim inside of it.
const CUT: f64 = 2e-5;
/// A cone's radius, over the unit of force, below which round-off decides.
const ROUND_OFF: f64 = 1e-5;
/// How far within their bounds searches aim, as a share, so that rows end inside of them: for the best answer, and for any.
pub(super) const INSIDE: f64 = 5e-5;
pub(super) const WELL_INSIDE: f64 = 0.02;
/// The same next to the apex of the cone, over the least normal force that counts: above it, and the apex of the cone within.
const ABOVE: f64 = 1.1;
const APEX: f64 = 0.05;
/// How near a demanded normal force must be, as a share of it.
const EXACT: f64 = 1e-4;
/// A step that promises less, as a share of the normal force, is the last; forces below the least, over the unit, count as that.
const PROMISE: f64 = 3e-4;
const LEAST_FORCE: f64 = 0.05;
/// Step over half the range of an input at which a search ends.
const SMALLEST: f64 = 2e-4;
/// Weight of the largest violation, at first, at last, and by how much it grows.
const WEIGHT: f64 = 3.0;
const MOST_WEIGHT: f64 = 1e4;
const HEAVIER: f64 = 10.0;
/// The same while no row holds yet.
const FIRST_WEIGHT: f64 = 1e3;
/// Rows of one search, at most: with an answer, and without one.
const MOST_ROWS: usize = 50;
const MOST_WITHOUT: usize = 24;
/// Steps that lead to no equilibrium, at most, one after the other.
const MOST_LOST: usize = 8;
/// How near a step may come to the end of equilibria, over how near it was.
const NEAREST: f64 = 0.4;
/// A forecast that violates its bounds by less, as a share of the force, may lead within them.
const NEARLY: f64 = 0.03;
/// Steps that take less than this share of the violation away, at most, one after the other.
const TOO_SLOW: f64 = 0.04;
const MOST_SLOW: usize = 4;

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
    /// Searches aim within their bounds by this share, so that rows end inside of them.
    pub inside: f64,
    /// Whether any answer will do.
    pub is_any_enough: bool,
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
            _ => self.out_of_cone(normal_force, friction).max((ABOVE * self.floor - normal_force) / self.unit),
        };
        force.max(self.minimum_margin + INSIDE - margin).max(0.0)
    }

    fn out_of_cone(&self, normal_force: f64, friction: f64) -> f64 {
        (friction - self.friction * ((1.0 - self.inside) * normal_force - APEX * self.floor)) / self.unit
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

    /// Order of searches: those with an answer first, then by merit.
    pub(super) fn compare(&self, a: &Search, b: &Search) -> Ordering {
        let key = |search: &Search| match search.best {
            Some((_, row)) => (false, self.goal(&row)),
            None => (true, self.merit(&search.row, FIRST_WEIGHT)),
        };
        let ((a, of_a), (b, of_b)) = (key(a), key(b));
        a.cmp(&b).then(of_a.total_cmp(&of_b))
    }

    pub(super) fn merit(&self, row: &Row, weight: f64) -> f64 {
        self.goal(row) + weight * self.violation_of(row)
    }
}

/// What the rows of a search have told of the response beyond their derivatives; searches nearby begin with it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Learned {
    /// How the square of the margin follows the inputs (Broyden 1965): about straight towards the end of stable equilibria.
    margin_rates: Inputs,
    /// Second derivatives of the three forces over the unit (Powell 1970).
    curves: [[Inputs; MOST_INPUTS]; 3],
}

impl Learned {
    /// The square of the margin changes so over a step.
    fn learn_margin(&mut self, step: &Inputs, change: f64) {
        let square: f64 = step.iter().map(|x| x * x).sum();
        let expected: f64 = step.iter().zip(&self.margin_rates).map(|(x, rate)| x * rate).sum();
        let factor = (change - expected) / square;
        if factor.is_finite() {
            self.margin_rates.iter_mut().zip(step).for_each(|(rate, x)| *rate += factor * x);
        }
    }

    /// From two rows a step apart.
    fn learn(&mut self, rules: &Rules, step: &Inputs, (from, to): (&Row, &Row)) {
        let square: f64 = step.iter().map(|x| x * x).sum();
        if square == 0.0 {
            return;
        }
        self.learn_margin(step, squared(to.margin) - squared(from.margin));
        for (of, curve) in self.curves.iter_mut().enumerate() {
            let count = rules.count;
            let left: Inputs = std::array::from_fn(|k| {
                let seen = (to.rates[k][of] - from.rates[k][of]) / rules.unit;
                seen - (0..count).map(|j| curve[k][j] * step[j]).sum::<f64>()
            });
            let along = left.iter().zip(step).map(|(a, b)| a * b).sum::<f64>() / square;
            for (k, rates) in curve.iter_mut().enumerate().take(count) {
                for (j, rate) in rates.iter_mut().enumerate().take(count) {
                    *rate += (left[k] * step[j] + step[k] * left[j] - along * step[k] * step[j]) / square;
                }
            }
        }
    }
}

/// Where the equilibria that a search follows end, as a plane: its level is 1 where the search stands and 0 at the end.
#[derive(Clone, Copy, Debug)]
struct Edge {
    level: f64,
    rates: Inputs,
}

impl Default for Edge {
    fn default() -> Edge {
        Edge { level: 1.0, rates: [0.0; MOST_INPUTS] }
    }
}

impl Edge {
    /// A step has led beyond it.
    fn lose(&mut self, step: &Inputs) {
        let excess = 1.0 + dot_inputs(&self.rates, step);
        let square = dot_inputs(step, step);
        self.rates.iter_mut().zip(step).for_each(|(rate, x)| *rate -= excess * x / square);
    }

    /// The search stands elsewhere.
    fn follow(&mut self, step: &Inputs) {
        let level = (1.0 + dot_inputs(&self.rates, step)).max(NEAREST);
        self.rates.iter_mut().for_each(|rate| *rate /= level);
    }
}

fn dot_inputs(a: &Inputs, b: &Inputs) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// With its sign.
fn squared(margin: f64) -> f64 {
    margin * margin.abs()
}

/// How forces and margin follow the inputs near a row; forces over the unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Model<'a> {
    force: f64,
    along: [f64; 2],
    /// Of the margin, with its sign.
    square: f64,
    rates: [[f64; 3]; MOST_INPUTS],
    learned: &'a Learned,
    edge: Edge,
}

impl<'a> Model<'a> {
    fn new(rules: &Rules, row: &Row, learned: &'a Learned) -> Model<'a> {
        Model {
            force: row.normal_force / rules.unit,
            along: row.along.map(|x| x / rules.unit),
            square: squared(row.margin),
            rates: row.rates.map(|rate| rate.map(|x| x / rules.unit)),
            learned,
            edge: Edge::default(),
        }
    }

    /// The same about inputs a step away.
    fn after(&self, count: usize, step: &Inputs) -> Model<'a> {
        let mut to = self.straight_after(count, step);
        for (of, curve) in self.learned.curves.iter().enumerate() {
            for k in 0..count {
                let bend: f64 = (0..count).map(|j| curve[k][j] * step[j]).sum();
                to.add(of, 0.5 * bend * step[k]);
                to.rates[k][of] += bend;
            }
        }
        to
    }

    /// Without second derivatives.
    fn straight_after(&self, count: usize, step: &Inputs) -> Model<'a> {
        let mut to = *self;
        for of in 0..3 {
            to.add(of, (0..count).map(|k| self.rates[k][of] * step[k]).sum());
        }
        to.edge.level += dot_inputs(&self.edge.rates, step);
        to.square += (0..count).map(|k| self.learned.margin_rates[k] * step[k]).sum::<f64>();
        to
    }

    /// To the force along the normal or one of those across it.
    fn add(&mut self, of: usize, gained: f64) {
        match of {
            0 => self.force += gained,
            _ => self.along[of - 1] += gained,
        }
    }

    fn margin(&self) -> f64 {
        self.square.abs().sqrt().copysign(self.square)
    }

    fn friction(&self) -> f64 {
        self.along[0].hypot(self.along[1])
    }

    fn forecast(&self, rules: &Rules, inputs: Inputs) -> Forecast<'a> {
        let (force, friction) = (self.force, self.friction());
        let goal = match rules.aim {
            Aim::Most => -force,
            Aim::Least => force,
            Aim::Ratio(_) => friction,
        };
        let violation = rules.violation(force * rules.unit, friction * rules.unit, self.margin());
        Forecast { inputs, goal, violation, learned: self.learned }
    }

    /// With the tip held at a place beside, of another normal.
    fn shifted(mut self, rules: &Rules, row: &Row, (shift, turn): (Vector, Vector)) -> Model<'a> {
        let moved = |of: usize| (0..3).map(|axis| row.drift[axis][of] * shift[axis]).sum::<f64>() / rules.unit;
        // The frame turns with the normal: what pressed along it presses across it.
        let tilt = across(row.normal).map(|t| dot(t, turn));
        let [a, b] = self.along;
        self.force += moved(0);
        self.along = [a + moved(1) - tilt[0] * self.force, b + moved(2) - tilt[1] * self.force];
        self
    }
}

/// Where a model's best step within a box leads.
#[derive(Clone, Copy, Debug)]
pub(super) struct Forecast<'a> {
    pub inputs: Inputs,
    pub learned: &'a Learned,
    goal: f64,
    violation: f64,
}

impl Forecast<'_> {
    /// Whether it is a better answer than a row, by a share of its force.
    pub(super) fn is_better(&self, rules: &Rules, than: &Row, share: f64) -> bool {
        let least = share * (than.normal_force / rules.unit).max(LEAST_FORCE);
        rules.goal(than) - self.merit(WEIGHT) > least
    }

    /// Whether it lies within all bounds, or so near to it that a search may end there.
    pub(super) fn may_hold(&self) -> bool {
        self.violation <= NEARLY * self.goal.abs().max(1.0)
    }

    pub(super) fn merit(&self, weight: f64) -> f64 {
        self.goal + weight * self.violation
    }
}

/// The search at one point.
#[derive(Clone, Debug)]
pub(super) struct Search {
    /// Inputs and their row.
    pub at: Inputs,
    pub row: Row,
    /// The best answer so far.
    pub best: Option<(Inputs, Row)>,
    /// What became of the last step, where that gave no equilibrium that can be used.
    pub blocked: Option<Status>,
    /// Inputs to be solved next; `None`: the search has ended.
    pub next: Option<Inputs>,
    rows: usize,
    radius: f64,
    weight: f64,
    learned: Learned,
    edge: Edge,
    promised: f64,
    /// Steps without an equilibrium, one after the other.
    lost: usize,
    /// How far the last rejected row was off, in the merit.
    miss: Option<f64>,
    /// Steps that would need many more to come within all bounds, one after the other.
    slow: usize,
}

impl Search {
    /// From a row; `radius` is that of the first step.
    pub(super) fn new(rules: &Rules, (at, row): (Inputs, Row), (radius, learned): (f64, Learned)) -> Search {
        let mut search = Search {
            at,
            row,
            best: rules.holds(&row).then_some((at, row)),
            blocked: None,
            next: None,
            radius,
            weight: if rules.holds(&row) { WEIGHT } else { FIRST_WEIGHT },
            learned,
            edge: Edge::default(),
            promised: 0.0,
            lost: 0,
            miss: None,
            slow: 0,
            rows: 0,
        };
        if !(rules.is_any_enough && search.best.is_some()) {
            search.propose(rules);
        }
        search
    }

    /// What the search promises of a place beside, at a shift and a turn of the normal, within a radius.
    pub(super) fn forecast(&self, rules: &Rules, by: (Vector, Vector), radius: f64) -> Option<Forecast<'_>> {
        let (at, row) = self.best.unwrap_or((self.at, self.row));
        let model = Model::new(rules, &row, &self.learned).shifted(rules, &row, by);
        best_within(rules, &model, &at, (radius, FIRST_WEIGHT), FEW)
    }

    /// Its answer as the start of another search: inputs, and what the rows have told of the response there.
    pub(super) fn start(&self) -> Option<(Inputs, Learned)> {
        self.best.map(|(inputs, _)| (inputs, self.learned))
    }

    /// Where it stands: at its best answer, or where it ended without one.
    pub(super) fn end(&self) -> Inputs {
        self.best.map_or(self.at, |(at, _)| at)
    }

    /// Whether its first step promises a better answer than a row, by a share.
    pub(super) fn may_improve(&self, rules: &Rules, than: &Row, share: f64) -> bool {
        let model = Model::new(rules, &self.row, &self.learned);
        let to = best_within(rules, &model, &self.at, (self.radius, FIRST_WEIGHT), FEW);
        self.next.is_some() && to.is_some_and(|to| to.is_better(rules, than, share))
            || self.best.is_some_and(|(_, row)| rules.is_better(&row, than))
    }

    /// Takes in what came of the step, and proposes another.
    pub(super) fn judge(&mut self, rules: &Rules, row: Row) {
        let Some(next) = self.next.take() else { return };
        self.rows += 1;
        let step: Inputs = std::array::from_fn(|k| next[k] - self.at[k]);
        let size = step.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let gained = rules.merit(&self.row, self.weight) - rules.merit(&row, self.weight);
        let kept = gained / self.promised;
        if rules.holds(&row) && self.best.as_ref().is_none_or(|(_, best)| rules.is_better(&row, best)) {
            if self.best.is_none() {
                self.weight = WEIGHT;
            }
            self.best = Some((next, row));
        }
        // Far from what was promised, and no nearer after a shorter step, is another equilibrium.
        let miss = (gained - self.promised).abs();
        let is_other = kept < -1.0 && self.best.is_some() && self.miss.is_some_and(|before| miss > 0.6 * before);
        self.miss = (kept < -1.0).then_some(miss);
        if !row.status.is_success() || is_other {
            self.blocked = (!row.status.is_success()).then_some(row.status);
            self.edge.lose(&step);
            self.radius = 0.5 * size;
            self.lost += 1;
        } else {
            self.learned.learn(rules, &step, (&self.row, &row));
            self.lost = 0;
            let is_slow = self.best.is_none() && gained < TOO_SLOW * self.weight * rules.violation_of(&row);
            self.slow = if is_slow { self.slow + 1 } else { 0 };
            if kept > 0.1 {
                (self.at, self.row, self.blocked) = (next, row, None);
                self.edge.follow(&step);
            }
            if kept > 0.7 && size > 0.9 * self.radius {
                self.radius = (2.0 * self.radius).min(1.0);
            } else if kept < 0.3 {
                self.radius = if kept < -1.0 { 0.3 } else { 0.5 } * size;
            }
        }
        let most = if self.best.is_some() { MOST_ROWS } else { MOST_WITHOUT };
        if self.rows < most
            && self.lost < MOST_LOST
            && self.slow < MOST_SLOW
            && !(rules.is_any_enough && self.best.is_some())
        {
            self.propose(rules);
        }
    }

    /// The next step, if one is worth its row.
    fn propose(&mut self, rules: &Rules) {
        loop {
            let model = Model { edge: self.edge, ..Model::new(rules, &self.row, &self.learned) };
            if self.radius >= SMALLEST
                && let Some(to) = best_within(rules, &model, &self.at, (self.radius, self.weight), MANY)
            {
                let promised = rules.merit(&self.row, self.weight) - to.merit(self.weight);
                if promised > PROMISE * (self.row.normal_force / rules.unit).abs().max(LEAST_FORCE) {
                    self.promised = promised;
                    self.next = Some(to.inputs);
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
}

/// Steps of a search on a model, at most: for a rough forecast, and for the next row.
const FEW: usize = 5;
const MANY: usize = 300;

/// The best inputs of a model within a radius, bounds violated at a price.
fn best_within<'a>(
    rules: &Rules,
    model: &Model<'a>,
    at: &Inputs,
    (radius, weight): (f64, f64),
    most: usize,
) -> Option<Forecast<'a>> {
    let mut best = model.forecast(rules, *at);
    let mut near = *model;
    let mut within = radius;
    for _ in 0..most {
        let bound = |k: usize, sign: f64| {
            let ends = [at[k] + sign * radius, best.inputs[k] + sign * within, sign];
            ends.into_iter().fold(sign * f64::INFINITY, |a, b| if sign > 0.0 { a.min(b) } else { a.max(b) })
        };
        let box_of: [(f64, f64); MOST_INPUTS] =
            std::array::from_fn(|k| (bound(k, -1.0).min(best.inputs[k]), bound(k, 1.0).max(best.inputs[k])));
        let Some(inputs) = step(rules, &near, &best.inputs, &box_of, weight) else { break };
        let moved = |from: &Inputs| -> Inputs { std::array::from_fn(|k| inputs[k] - from[k]) };
        let straight = near.straight_after(rules.count, &moved(&best.inputs));
        let promised = best.merit(weight) - straight.forecast(rules, inputs).merit(weight);
        if promised <= 0.01 * PROMISE * near.force.abs().max(LEAST_FORCE) {
            break;
        }
        let to = model.after(rules.count, &moved(at));
        let found = to.forecast(rules, inputs);
        let kept = (best.merit(weight) - found.merit(weight)) / promised;
        let size = moved(&best.inputs).iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        if kept > 0.1 {
            (best, near) = (found, to);
        }
        if kept < 0.3 {
            within = 0.4 * size;
        } else if kept > 0.7 {
            within = (2.0 * within).min(2.0 * radius);
        }
    }
    Some(best)
}

/// The step within a box about inputs that a model promises most of, bounds violated at a price.
fn step(
    rules: &Rules,
    model: &Model<'_>,
    at: &Inputs,
    box_of: &[(f64, f64); MOST_INPUTS],
    weight: f64,
) -> Option<Inputs> {
    let (count, unit) = (rules.count, rules.unit);
    let is_ratio = matches!(rules.aim, Aim::Ratio(_));
    let (bound, elastic) = (count, count + 1);
    let variables = count + 2;
    let (force, along) = (model.force, model.along);
    let rate = |k: usize, of: usize| model.rates[k][of];
    let mut cost = vec![0.0; variables];
    match rules.aim {
        Aim::Most => (0..count).for_each(|k| cost[k] = -rate(k, 0)),
        Aim::Least => (0..count).for_each(|k| cost[k] = rate(k, 0)),
        Aim::Ratio(_) => cost[bound] = 1.0,
    }
    cost[elastic] = weight;
    let now = rules.violation(force * unit, along[0].hypot(along[1]) * unit, model.margin());
    let mut low: Vec<f64> = (0..count).map(|k| box_of[k].0 - at[k]).collect();
    let mut high: Vec<f64> = (0..count).map(|k| box_of[k].1 - at[k]).collect();
    let radius = low.iter().chain(&high).fold(0.0, |most: f64, x| most.max(x.abs()));
    low.extend([0.0; 2]);
    // As much as any row can lack within the step.
    let most = |of: &dyn Fn(usize) -> f64| radius * (0..count).map(|k| of(k).abs()).sum::<f64>();
    let any = most(&|k| rate(k, 0)) + most(&|k| rate(k, 1)) + most(&|k| rate(k, 2));
    let any = any + most(&|k| model.learned.margin_rates[k]);
    let reserve = 1.0 + 2.0 * (now + any * (1.0 + rules.friction));
    high.extend([if is_ratio { f64::INFINITY } else { 0.0 }, reserve]);
    let rows = Vec::with_capacity((SIDES + MOST_CUTS + 4) * variables);
    let limits = Vec::with_capacity(SIDES + MOST_CUTS + 4);
    let mut programme = Programme { cost, low, high, rows, limits, elastic: Some(elastic) };
    // A side of the polygon whose normal has these two parts.
    let side = |programme: &mut Programme, [a, b]: [f64; 2]| {
        let mut side = [0.0; MOST_INPUTS + 2];
        let side = &mut side[..variables];
        let own = |k: usize| a * rate(k, 1) + b * rate(k, 2);
        let along = a * along[0] + b * along[1];
        if is_ratio {
            (0..count).for_each(|k| side[k] = own(k));
            side[bound] = -1.0;
            return programme.keep(side, -along);
        }
        let friction = (1.0 - rules.inside) * rules.friction;
        (0..count).for_each(|k| side[k] = own(k) - friction * rate(k, 0));
        side[elastic] = -1.0;
        programme.keep(side, friction * force - along - rules.friction * APEX * rules.floor / unit);
    };
    let toward = |along: [f64; 2]| {
        let size = along[0].hypot(along[1]);
        if size > 0.0 { along.map(|x| x / size) } else { [1.0, 0.0] }
    };
    let [a, b] = toward(along);
    for k in 0..SIDES {
        let (sin, cos) = (k as f64 * TAU / SIDES as f64).sin_cos();
        side(&mut programme, [cos * a - sin * b, sin * a + cos * b]);
    }
    let keep = |programme: &mut Programme, of: &dyn Fn(usize) -> f64, last: f64, limit: f64| {
        let mut kept = [0.0; MOST_INPUTS + 2];
        (0..count).for_each(|k| kept[k] = of(k));
        kept[elastic] = last;
        programme.keep(&kept[..variables], limit);
    };
    match rules.aim {
        Aim::Ratio(wanted) => {
            keep(&mut programme, &|k| rate(k, 0), -1.0, wanted / unit - force);
            keep(&mut programme, &|k| -rate(k, 0), -1.0, force - wanted / unit);
        }
        _ => keep(&mut programme, &|k| -rate(k, 0), -1.0, force - ABOVE * rules.floor / unit),
    }
    let least = (rules.minimum_margin + INSIDE).powi(2);
    keep(&mut programme, &|k| -model.learned.margin_rates[k], -1.0, model.square - least);
    keep(&mut programme, &|k| -model.edge.rates[k], 0.0, (model.edge.level - NEAREST).max(0.0));
    for cuts in 0..=MOST_CUTS {
        let x = programme.solve()?;
        let after = |from: f64, of: usize| from + (0..count).map(|k| rate(k, of) * x[k]).sum::<f64>();
        let (force, along) = (after(force, 0), [after(along[0], 1), after(along[1], 2)]);
        let friction = along[0].hypot(along[1]);
        let out = match is_ratio {
            true => friction - x[bound],
            false => rules.out_of_cone(force * unit, friction * unit) - x[elastic],
        };
        let size = if is_ratio { x[bound] } else { rules.friction * force };
        if out > CUT * size.abs().max(ROUND_OFF) && cuts < MOST_CUTS {
            side(&mut programme, toward(along));
            continue;
        }
        let moved = |k: usize| (at[k] + x[k]).clamp(-1.0, 1.0);
        return Some(std::array::from_fn(|k| if k < count { moved(k) } else { 0.0 }));
    }
    None
}
