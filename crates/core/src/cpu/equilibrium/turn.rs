//! A turn of the load along the curve of equilibria, and a point where it crosses another: where they lie, and their loads on
//! the fine grid. C5, C6

use super::equations::{CurveEnd, Equations, Point, Seen, look};
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::tolerances::{
    CONTRACTION, CROSSING_SPAN, CURVE_NEAR, FOLD_EVIDENCE, SMALLEST_SHARP_ARC, TURN_CORRECTIONS, TURN_EVIDENCE,
    TURN_FLATNESS, TURN_LIMIT, TURN_SIDE, TURN_TOLERANCE,
};

/// The last points before and behind a turn, and where it is looked for between.
pub struct Turn<L: Lane, P> {
    pub seen: L::Mask,
    pub found: L::Mask,
    /// Next to where curves cross.
    pub crossing: L::Mask,
    /// Where the next pass goes, and the direction of the curve there.
    pub trial: P,
    pub along: P,
    /// Load fractions before and behind.
    before: L,
    behind: L,
    /// How the slope of the load changes between both.
    bend: L,
    /// The slope of the load along the curve: how it changes with the arc where the load turns, and its last value.
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
            crossing: nobody,
            trial: at,
            along: at,
            before: zero,
            behind: zero,
            bend: zero,
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
        self.bend = L::select(lanes, (into.lambda() - out.lambda()) / arc, self.bend);
        self.change = L::select(lanes, self.bend, self.change);
        self.arc = L::select(lanes, arc, self.arc);
        self.moved = L::select(lanes, one.constant(0.0), self.moved);
        lanes
    }

    /// Moves `lanes` to the curve and along it to where its load turns; returns those that do not get there.
    #[inline(always)]
    pub fn close_in<E: Equations<L, Point = P>>(&mut self, seen: &Seen<L, P, E::Metric>, lanes: L::Mask) -> L::Mask {
        let one = self.arc.constant(1.0);
        let slope = seen.tangent.lambda();
        self.change = L::select(lanes, self.measured(self.change, slope - self.slope, self.moved), self.change);
        let half = self.arc * one.constant(0.5);
        let move_on = (-(slope / self.change)).min(half).max(-half);
        let new = self.trial.plus(one, seen.delta).plus(move_on, seen.tangent);
        let tolerance = one.constant(TURN_TOLERANCE.max(64.0 * L::Scalar::EPSILON)) * (one + new.size());
        let near = seen.size.lt(tolerance.min(self.arc * one.constant(CURVE_NEAR)));
        let flat = (slope * move_on).abs().lt(one.constant(TURN_FLATNESS) * new.lambda());
        let top = new.lambda() * one.constant(1.0 + TURN_FLATNESS);
        let highest = self.before.lt(top) & self.behind.lt(top) & new.lambda().lt(one);
        let regular = one.constant(0.0).lt(seen.whole);
        let found = lanes & near & flat & highest & regular;
        self.trial = P::select(lanes, new, self.trial);
        self.along = P::select(lanes, seen.tangent, self.along);
        self.slope = L::select(lanes, slope, self.slope);
        self.moved = L::select(lanes, move_on, self.moved);
        self.passes = L::select(lanes, self.passes + one, self.passes);
        self.found = self.found | found;
        lanes & !found & !self.passes.lt(one.constant(TURN_LIMIT))
    }

    /// How the slope changes along the curve, from its last two values; what is known of it where these are of no use.
    #[inline(always)]
    fn measured(&self, known: L, rise: L, moved: L) -> L {
        let measured = rise / moved;
        let (least, most) = (known.constant(0.1), known.constant(30.0));
        L::select(measured.lt(known * least) & (known * most).lt(measured), measured, known)
    }

    /// Takes turns to the fine grid, then to twice its steps, whose load is the answer; says so in `end`.
    #[inline(always)]
    pub fn finish<E: Equations<L, Point = P>>(&self, equations: &mut E, metric: &E::Metric, end: &mut CurveEnd<L, P>) {
        let one = self.arc.constant(1.0);
        let (mut at, mut tangent, mut metric) = (self.trial, self.along, *metric);
        let (mut rise, mut moved) = (one, one);
        let (mut change, mut last, mut along) = (self.change, one, one.constant(0.0));
        for _ in 0..TURN_CORRECTIONS {
            let seen = look(equations, true, at, E::row(&metric, tangent));
            (tangent, metric) = (seen.tangent, seen.metric);
            let slope = tangent.lambda();
            change = self.measured(change, slope - last, along);
            (last, along) = (slope, -(slope / change));
            at = at.plus(one, seen.delta).plus(along, tangent);
            // The slope of the load falls to zero on the way.
            rise = slope * along * one.constant(0.5);
            moved = seen.delta.lambda().abs() + rise.abs();
            end.passes = L::select(self.found, end.passes + one, end.passes);
            if !L::any(self.found & !moved.lt(one.constant(16.0 * L::Scalar::EPSILON))) {
                break;
            }
        }
        let (finer, round_off) = equations.check(at);
        let lambda = at.lambda() - rise + finer;
        let error = finer.abs() + moved + round_off;
        let least = error * one.constant(TURN_EVIDENCE);
        let side = self.side(least);
        // The finer grid has moved it by less than lies between the points that show it.
        let way = at.plus(-one, self.trial);
        let is_near = E::product(&metric, way, way).lt(side * side * one.constant(4.0));
        let falls = self.falls(equations, (at, tangent), &metric, (side, least));
        let found = self.found & is_near & falls & lambda.lt(one) & error.lt(one.constant(FOLD_EVIDENCE));
        end.fold = end.fold & found;
        end.at = P::select(found, at.with_lambda(lambda), end.at);
        end.tangent = P::select(found, tangent, end.tangent);
        end.load_error = L::select(found, error, end.load_error);
    }

    /// Finds the load where curves cross on the fine grid, by a secant of the determinant of C1 from a little before; says so in
    /// `end`. The error is its whole difference from the coarse grid. C6
    #[inline(always)]
    pub fn locate_crossing<E: Equations<L, Point = P>>(
        &self,
        equations: &mut E,
        metric: &E::Metric,
        end: &mut CurveEnd<L, P>,
    ) {
        let (at, tangent) = (end.at, end.tangent);
        let zero = self.arc.constant(0.0);
        let one = zero.constant(1.0);
        let span = one.constant(CROSSING_SPAN);
        let row = E::row(metric, tangent);
        let (mut lambda, mut slope, mut whole, mut before) = (zero, zero, zero, zero);
        let mut settles = self.crossing;
        for back in [CROSSING_SPAN, 0.0] {
            let mut here = at.plus(-one.constant(back), tangent);
            before = whole;
            let mut size = one;
            for _ in 0..TURN_CORRECTIONS {
                let seen = look(equations, true, here, row);
                here = here.plus(one, seen.delta);
                (lambda, slope, whole, size) = (here.lambda(), seen.tangent.lambda(), seen.whole, seen.size);
                end.passes = L::select(self.crossing, end.passes + one, end.passes);
                if !L::any(self.crossing & !size.lt(one.constant(TURN_TOLERANCE))) {
                    break;
                }
            }
            settles = settles & size.lt(one.constant(TURN_TOLERANCE));
        }
        let falls = before - whole;
        let ahead = span * whole / falls;
        let load = slope.abs().mul_add(ahead, lambda);
        let error = (load - at.lambda()).abs() + one.constant(SMALLEST_SHARP_ARC);
        let found = settles & zero.lt(before) & zero.lt(falls) & load.lt(one) & error.lt(one.constant(FOLD_EVIDENCE));
        end.fold = end.fold | found;
        end.at = P::select(found, at.with_lambda(load), end.at);
        end.load_error = L::select(found, error, end.load_error);
    }

    /// How far before a turn and behind it the load is looked at: half a step, or where it should have fallen by twice what counts.
    #[inline(always)]
    fn side(&self, least: L) -> L {
        let one = self.arc.constant(1.0);
        (self.arc * one.constant(0.5)).max((least * one.constant(4.0) / self.bend.abs()).sqrt())
    }

    /// Whether so far before a turn and behind it the load is less by the least that counts, on the fine grid. A curve that only comes
    /// near a turn has one on a coarse grid, and hardly falls behind it.
    #[inline(always)]
    fn falls<E: Equations<L, Point = P>>(
        &self,
        equations: &mut E,
        (top, tangent): (P, P),
        metric: &E::Metric,
        (side, least): (L, L),
    ) -> L::Mask {
        let zero = self.arc.constant(0.0);
        let one = zero.constant(1.0);
        let mut falls = self.found;
        for sign in [-1.0, 1.0] {
            let along = side * one.constant(sign);
            let row = E::row(metric, tangent);
            let ahead = top.plus(along, tangent);
            let mut at = ahead.with_lambda(ahead.lambda() + along * along * self.bend * one.constant(0.5));
            let mut size = one;
            let mut slope = zero;
            for _ in 0..TURN_SIDE {
                let seen = look(equations, true, at, row);
                at = at.plus(one, seen.delta);
                let larger = size * one.constant(CONTRACTION);
                falls = falls & seen.size.lt(larger);
                size = seen.size;
                slope = seen.tangent.lambda();
            }
            falls = falls & size.lt(side * one.constant(2.0 * CURVE_NEAR));
            falls = falls & (slope * one.constant(sign)).lt(zero) & at.lambda().lt(top.lambda() - least);
        }
        falls
    }
}
