//! A turn of the load along the curve of equilibria: where it lies, and its load on the fine grid. C5

use super::curve::{CurveEnd, Equations, Point, Seen};
use super::lane::{Lane, Scalar};
use crate::model::path::{TURN_LIMIT, TURN_STEEPNESS, TURN_TOLERANCE};

/// The last points before and behind a turn, and where it is looked for between.
pub struct Turn<L: Lane, P> {
    pub seen: L::Mask,
    pub found: L::Mask,
    /// Where the next pass goes, and the direction of the curve there.
    pub trial: P,
    pub along: P,
    /// Load fractions before and behind.
    before: L,
    behind: L,
    /// The slope of the load along the curve: how it changes with the arc, and its last value.
    change: L,
    slope: L,
    /// The last move along the curve, and the arc.
    moved: L,
    arc: L,
    passes: L,
}

impl<L: Lane, P: Point<L>> Turn<L, P> {
    #[inline(always)]
    pub fn new(at: P) -> Self {
        let zero = at.lambda().constant(0.0);
        let nobody = zero.lt(zero);
        Self {
            seen: nobody,
            found: nobody,
            trial: at,
            along: at,
            before: zero,
            behind: zero,
            change: zero,
            slope: zero,
            moved: zero,
            arc: zero,
            passes: zero,
        }
    }

    /// Begins between two points and their tangents, where the cubic through them has its largest load, below the full one;
    /// returns the lanes that do.
    #[inline(always)]
    pub fn begin<E: Equations<L, Point = P>>(
        &mut self,
        lanes: L::Mask,
        (from, out): (P, P),
        (to, into): (P, P),
        arc: L,
    ) -> L::Mask {
        let one = arc.constant(1.0);
        let u = out.lambda() / (out.lambda() - into.lambda());
        let (square, left) = (u * u, one - u);
        let end = square * (one.constant(3.0) - u * one.constant(2.0));
        let start = from.times(one - end).plus(end, to);
        let trial = start.plus(arc * u * left * left, out).plus(-(arc * square * left), into);
        let lanes = lanes & trial.lambda().lt(one);
        self.seen = self.seen | lanes;
        self.trial = P::select(lanes, trial, self.trial);
        self.along = P::select(lanes, out.plus(one, into).times(one.constant(0.5)), self.along);
        self.before = L::select(lanes, from.lambda(), self.before);
        self.behind = L::select(lanes, to.lambda(), self.behind);
        self.change = L::select(lanes, (into.lambda() - out.lambda()) / arc, self.change);
        self.arc = L::select(lanes, arc, self.arc);
        self.moved = L::select(lanes, one.constant(0.0), self.moved);
        lanes
    }

    /// Moves `lanes` to the curve and along it to where its load turns; returns those that do not get there.
    #[inline(always)]
    pub fn close_in<E: Equations<L, Point = P>>(&mut self, seen: &Seen<L, P, E::Metric>, lanes: L::Mask) -> L::Mask {
        let one = self.arc.constant(1.0);
        let slope = seen.tangent.lambda();
        let measured = (slope - self.slope) / self.moved;
        let is_alike = measured.lt(self.change * one.constant(0.3)) & (self.change * one.constant(3.0)).lt(measured);
        self.change = L::select(lanes & is_alike, measured, self.change);
        let half = self.arc * one.constant(0.5);
        let move_on = (-(slope / self.change)).min(half).max(-half);
        let new = self.trial.plus(one, seen.delta).plus(move_on, seen.tangent);
        let tolerance = one.constant(TURN_TOLERANCE.max(64.0 * L::Scalar::EPSILON));
        let near = seen.size.lt(tolerance * (one + new.size()));
        let flat = slope.abs().lt(one.constant(TURN_STEEPNESS));
        let highest = self.before.lt(new.lambda()) & self.behind.lt(new.lambda()) & new.lambda().lt(one);
        let found = lanes & near & flat & highest & seen.regular;
        self.trial = P::select(lanes, new, self.trial);
        self.along = P::select(lanes, seen.tangent, self.along);
        self.slope = L::select(lanes, slope, self.slope);
        self.moved = L::select(lanes, move_on, self.moved);
        self.passes = L::select(lanes, self.passes + one, self.passes);
        self.found = self.found | found;
        lanes & !found & !self.passes.lt(one.constant(TURN_LIMIT))
    }

    /// Takes turns to the fine grid, then to twice its steps, whose load is the answer; says so in `end`.
    #[inline(always)]
    pub fn finish<E: Equations<L, Point = P>>(&self, equations: &mut E, metric: &E::Metric, end: &mut CurveEnd<L, P>) {
        let one = self.arc.constant(1.0);
        let (mut at, mut tangent) = (self.trial, self.along);
        let (mut rise, mut moved) = (one, one);
        for _ in 0..2 {
            let seen = equations.look(true, at, E::row(metric, tangent));
            tangent = seen.tangent;
            let slope = tangent.lambda();
            let along = -(slope / self.change);
            at = at.plus(one, seen.delta).plus(along, tangent);
            // The slope of the load falls to zero on the way.
            rise = slope * along * one.constant(0.5);
            moved = seen.size * seen.size + along * along;
        }
        let (change, round_off) = equations.check(at);
        let lambda = at.lambda() - rise + change;
        let error = change.abs() + moved + round_off;
        let found = self.found & lambda.is_finite() & error.is_finite();
        end.fold = found;
        end.at = P::select(found, at.with_lambda(lambda), end.at);
        end.tangent = P::select(found, tangent, end.tangent);
        end.load_error = L::select(found, error, end.load_error);
        end.passes = L::select(found, end.passes + one.constant(3.0), end.passes);
    }
}
