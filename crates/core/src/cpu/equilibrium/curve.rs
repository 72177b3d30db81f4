//! The curve of equilibria from rest by its arclength, to a turn of the load, or to where it crosses another. C1 to C6
//!
//! A sample's steps depend on that sample alone: a lane that has finished is frozen while its neighbours go on.

use super::equations::{CurveEnd, Equations, Point, look};
use super::turn::Turn;
use crate::cpu::rod::stability::is_above;
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::tolerances::{
    CONTRACTION, CORRECTIONS, CURVE_AIM, CURVE_ANGLE, CURVE_APPROACH, CURVE_COSINE, CURVE_NEAR, CURVE_ON_TOP,
    CURVE_SAG, CURVE_SHARE, CURVE_STRAIGHT, CURVE_TOLERANCE, LEAST_RATIO, NARROW_MARGIN, SMALLEST_ARC,
    SMALLEST_SHARP_ARC, TRUST,
};

/// Farther than any curve goes.
const FAR: f64 = 1e9;

/// Follows the curve from a point to where its load turns. `slope` is its direction there, by the load fraction; its first load step is
/// `first` at most, corrections are trusted at this pace, and it takes at most `limit` passes. Where the load would be full at the next
/// point, that point is looked for under the full load, if `E` arrives; else the lane ends there without a fold.
#[inline(always)]
pub fn follow_curve<L: Lane, E: Equations<L>>(
    equations: &mut E,
    (from, slope, mut metric): (E::Point, E::Point, E::Metric),
    (first, pace, limit): (L, f64, f64),
    wanted: L::Mask,
) -> CurveEnd<L, E::Point> {
    let zero = first.constant(0.0);
    let one = zero.constant(1.0);
    let (share, trust) = (one.constant(CURVE_SHARE), one.constant(TRUST * pace));
    // The point accepted last, the tangent there, and half the second derivative behind it.
    let (mut at, mut bend) = (from, from.times(zero));
    let rise = E::product(&metric, slope, slope).sqrt();
    let mut tangent = slope.times(one / rise);
    let mut step = first.min(one.constant(0.25)) * rise;
    let mut row = E::row(&metric, tangent);
    let mut trial = at.plus(step, tangent);
    let mut bound = (step * share).min(trust * equations.caution(one));
    let (mut last_size, mut first_share) = (bound * one.constant(1.0 / CONTRACTION), zero);
    let (mut corrections, mut passes, mut weakest) = (zero, one, zero);
    // The determinant at the last point, and the way from there to a point where curves cross.
    let (mut last_whole, mut ahead) = (one, one.constant(FAR));
    // In single precision round-off hides what lies closer.
    let sharp = L::Scalar::SHARP;
    let smallest = one.constant(if sharp { SMALLEST_SHARP_ARC } else { SMALLEST_ARC });
    // The next point is about where the load is full: beyond it there is nothing to look for.
    let (mut failed, mut landing, mut reached) = (!wanted, one.lt(zero), one.lt(zero));
    let mut turn = Turn::new(from);
    loop {
        let active = !(failed | reached | turn.found | turn.crossing);
        if !L::any(active) {
            break;
        }
        let seen = look(equations, false, trial, row);
        let closing = active & turn.seen;
        let walking = active & !turn.seen;
        if L::any(closing) {
            failed = failed | turn.close_in::<E>(&seen, closing);
        }
        let size = seen.size;
        let new = trial.plus(one, seen.delta);
        let contracting = size.lt(last_size * one.constant(CONTRACTION)) & corrections.lt(one.constant(CORRECTIONS));
        let tolerance = ((one + trial.size()) * one.constant(CURVE_TOLERANCE)).min(step * one.constant(CURVE_NEAR));
        let converged = walking & contracting & size.lt(tolerance);
        // Neither a sharp bend, nor a point where curves cross. C3
        let length = E::product(&metric, seen.tangent, seen.tangent).sqrt();
        let cosine = E::product(&metric, seen.tangent, tangent) / length;
        let regular = zero.lt(seen.whole);
        let smooth = regular & one.constant(CURVE_COSINE).lt(cosine);
        let way = new.plus(-one, at);
        let arc = E::product(&metric, way, way).sqrt();
        let (before, after) = (tangent.lambda(), seen.tangent.lambda());
        let rises = zero.lt(after);
        let middle = way.lambda() * one.constant(1.5) / arc - (before + after) * one.constant(0.25);
        let sags = middle.lt(before.min(after) * one.constant(CURVE_SAG));
        let (mut stable, mut once, mut clear) = (rises, rises, rises);
        if L::any(converged & smooth) {
            let index = equations.index();
            (stable, once) = (index.lt(one.constant(0.5)), index.lt(one.constant(1.5)));
            clear = equations.is_clear();
        }
        // Which side of a bifurcation it has passed, no grid tells.
        let narrow = !is_above(weakest, NARROW_MARGIN) & seen.square.lt(weakest * one.constant(0.25));
        let lost = converged & rises & regular & narrow;
        let fits = converged & smooth & clear & !lost;
        let accept = fits & rises & stable & !sags & (landing | new.lambda().lt(one));
        let turned = fits & !rises & !stable & once;
        let turned = turn.begin::<E>(turned, (at, tangent), (new, seen.tangent), arc);
        let go_on = walking & !converged & contracting;
        let reject = walking & !accept & !turned & !go_on;

        first_share = L::select(corrections.lt(one.constant(0.5)), size / bound, first_share);
        let behind = at.plus(-one, new).plus(arc, seen.tangent);
        bend = E::Point::select(accept, behind.times(one / (arc * arc)), bend);
        at = E::Point::select(accept, new, at);
        let angle = ((one - cosine).max(one.constant(1e-6)) * one.constant(2.0)).sqrt();
        tangent = E::Point::select(accept, seen.tangent, tangent);
        metric = E::select_metric(accept, &seen.metric, &metric);
        weakest = L::select(accept, weakest.max(seen.square), weakest);
        if L::any(accept) {
            equations.keep(accept);
        }
        let ratio = (first_share * one.constant(1.0 / CURVE_AIM)).max(one.constant(LEAST_RATIO));
        let by_size = one / ratio.sqrt().sqrt();
        let longer = by_size.min(one.constant(CURVE_ANGLE) / angle).min(one.constant(2.0)).max(one.constant(0.3));
        let shorter = by_size.min(one.constant(0.4)).max(one.constant(0.1));
        step = L::select(accept, arc * longer, L::select(reject, step * shorter, step));
        // Next to a crossing the curve may bend away from it, as sharply as the rod is nearly symmetric.
        let crossed = converged & !regular;
        let falls = last_whole - seen.whole;
        let follows = zero.lt(falls) & one.constant(CURVE_STRAIGHT).lt(cosine) & ahead.lt(one.constant(FAR));
        let estimate = L::select(follows, arc * seen.whole / falls, one.constant(FAR));
        ahead = L::select(accept, estimate, ahead);
        ahead = L::select(crossed, arc * last_whole / (last_whole - seen.whole), ahead);
        last_whole = L::select(accept, seen.whole, last_whole);
        // On top of the crossing nothing is told: the last step goes over it.
        let (approach, least) = (ahead * one.constant(CURVE_APPROACH), smallest + smallest);
        let near = L::select(least.lt(approach), approach, ahead + least);
        step = L::select(accept | crossed, L::select(crossed, near, step.min(near)), step);
        // Nothing bends the curve aside within the smallest step: it crosses another, and loses its stability. C6
        let pinned = crossed & !(smallest * one.constant(5.0)).lt(arc);
        // Beyond it a tangent may be told backwards, and on top of it round-off tells one.
        let straight = one.constant(CURVE_STRAIGHT).lt(cosine.abs()) & zero.lt(after * cosine);
        let on_top = seen.whole.abs().lt(last_whole * one.constant(CURVE_ON_TOP));
        let leads_on = (arc * one.constant(CURVE_STRAIGHT)).lt(E::product(&metric, way, tangent));
        let straight = (straight | (on_top & leads_on)) & size.lt(arc * one.constant(CURVE_NEAR));
        turn.crossing = turn.crossing | if sharp { pinned & straight } else { one.lt(zero) };
        failed = failed | lost | (reject & !smallest.lt(step)) | pinned;

        // The next point by the parabola through the last two. C4
        let restart = accept | reject;
        let left = one - at.lambda();
        let rate = tangent.lambda();
        let root = (rate * rate + bend.lambda() * left * one.constant(4.0)).sqrt();
        let to_full = left * one.constant(2.0) / (rate + root);
        match E::ARRIVES {
            true => reached = reached | (accept & landing),
            false => failed = failed | (accept & landing),
        }
        let lands = restart & to_full.lt(step);
        landing = (landing & !restart) | lands;
        step = L::select(lands, to_full, step);
        let mut predicted = at.plus(step, tangent).plus(step * step, bend);
        row = E::Point::select(restart, E::row(&metric, tangent), row);
        if E::ARRIVES {
            predicted = E::Point::select(lands, predicted.with_lambda(one), predicted);
            row = E::Point::select(lands, row.times(zero).with_lambda(one), row);
        }
        trial = E::Point::select(restart, predicted, E::Point::select(go_on, new, trial));
        trial = E::Point::select(turn.seen & active, turn.trial, trial);
        row = E::Point::select(turn.seen & active, E::row(&metric, turn.along), row);
        bound = L::select(restart, (step * share).min(trust * equations.caution(one)), bound);
        last_size = L::select(go_on, size, bound * one.constant(1.0 / CONTRACTION));
        corrections = L::select(go_on, corrections + one, zero);
        passes = L::select(active, passes + one, passes);
        failed = failed | (active & !(reached | turn.found | turn.crossing) & !passes.lt(one.constant(limit)));
    }
    let nobody = one.lt(zero);
    let mut end =
        CurveEnd { at, tangent, reached, fold: turn.found & !turn.crossing, turned: nobody, load_error: one, passes };
    if L::any(turn.found) {
        turn.finish(equations, &metric, &mut end);
        end.turned = end.fold;
    }
    if L::any(turn.crossing) {
        turn.locate_crossing(equations, &metric, &mut end);
    }
    end
}
