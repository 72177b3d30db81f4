// The path from rest in a field that stays: the rod's dipoles and all other loads grow, each step on the stable branch.
// crates/core/src/cpu/equilibrium/field/path.rs

const AIM: f32 = 0.0; //@spec
const CONTRACTION: f32 = 0.0; //@spec
const CORRECTIONS: f32 = 0.0; //@spec
const LITTLE_LOAD: f32 = 0.0; //@spec
const FIELD_LITTLE_STEP: f32 = 0.0; //@spec
const FIELD_LOAD_TOLERANCE: f32 = 0.0; //@spec
const FIELD_SOFT: f32 = 0.0; //@spec
const FIELD_SOFT_RATIO: f32 = 0.0; //@spec
const FIELD_TOLERANCE: f32 = 0.0; //@spec
const FIELD_TELLING: f32 = 0.0; //@spec
const FIRST_BEND: f32 = 0.0; //@spec
const FOLD_MARGIN: f32 = 0.0; //@spec
const FULL_LOAD_TOLERANCE: f32 = 0.0; //@spec
const FIELD_NEAR_MARGIN: f32 = 0.0; //@spec
const NODE_LEAST_RATIO: f32 = 0.0; //@spec
const NODE_MOST_RATIO: f32 = 0.0; //@spec
const NODE_PASS_LIMIT: f32 = 0.0; //@spec
const NODE_RETREAT: f32 = 0.0; //@spec
const NEAR_MARGIN: f32 = 0.0; //@spec
const PATH_TOLERANCE: f32 = 0.0; //@spec
const SMALLEST_GUARDED_STEP: f32 = 0.0; //@spec
const SAFE_MARGIN: f32 = 0.0; //@spec
const SMALLEST_RAMP_STEP: f32 = 0.0; //@spec
const SPENT: f32 = 0.0; //@spec
const TRUST: f32 = 0.0; //@spec
const WIDENING: f32 = 0.0; //@spec

const STATUS_TOO_NEAR_MAGNET: u32 = 10u; //@spec

// Where the path goes on after a turn.
const GOES_ON: u32 = 0u;
const REACHED: u32 = 1u;
const AT_FOLD: u32 = 2u;
const TOO_NEAR: u32 = 3u;
const EXHAUSTED: u32 = 4u;
const FAILED: u32 = 5u;

// Whether the inverse in hand is that of the load accepted last.
var<private> keeps_inverse: bool;

// sqrt(3) over the norm of d(m0)/d(l_tip).
fn margin(inverse: Mat6) -> f32 {
    let d = inverse.d;
    return sqrt(3.0) / sqrt(dot(d[0], d[0]) + dot(d[1], d[1]) + dot(d[2], d[2]));
}

// Size of a change of the load at the base, against 1 and the load.
fn size(change: Pair, base: Pair) -> f32 {
    return norm(change) / (norm(base) + 1.0);
}

fn norm(pair: Pair) -> f32 {
    return sqrt(dot(pair.first, pair.first) + dot(pair.last, pair.last));
}

fn sum(s: f32, a: Pair, b: Pair) -> Pair {
    return Pair(axpy(s, a.first, b.first), axpy(s, a.last, b.last));
}

// Whether a load step changes the margin so much, where it is small, that stability may be lost and won again between.
fn leaps(margin: f32, last: f32) -> bool {
    return differs_widely(margin, last, FIELD_NEAR_MARGIN, sqrt(WIDENING));
}

// The same of the determinant of the second variation.
fn softens(determinant: f32, last: f32) -> bool {
    return differs_widely(determinant, last, FIELD_SOFT, FIELD_SOFT_RATIO);
}

// Whether the rod may have passed through a magnet in a load step: its tip moved farther than its leeway before and after,
// both together.
fn passes_by(way: f32, before: f32, after: f32) -> bool {
    return !(way < before + after);
}

// What the loads at the tip ask the load at the base to change by, under a share of them. F5
fn newton_step(rod: Rod, lambda: f32, inverse: Mat6) -> Pair {
    return on(inverse, Pair(rod.f_tip * lambda - tip.n, rod.l_tip * lambda - tip.m)); // F5
}

// Puts the path at rest, after a pass under little load: how the equilibrium sets out tells how far the first step may go.
fn start_path(rod: Rod, inverse: Mat6) {
    let none = Pair();
    let secant = sum(1.0 / LITTLE_LOAD, newton_step(rod, LITTLE_LOAD, inverse), none);
    let step = min(FIRST_BEND / max(size(secant, none), 1e-6), 1.0);
    hold_pair(ACCEPTED, none);
    hold_pair(SECANT, secant);
    hold_pair(TRIAL, sum(step, secant, none));
    hold(LAMBDA, 0.0);
    hold(GOAL, step);
    hold(LOAD_STEP, step);
    hold(LAST_SIZE, TRUST / CONTRACTION);
    hold(FIRST_SIZE, 0.0);
    hold(CORRECTIONS_MADE, 0.0);
    hold(WEAKEST, 1.0);
    hold(LAST_MARGIN, margin(inverse));
    hold(IS_UNSTABLE, 0.0);
    hold(IS_TOO_NEAR, 0.0);
    hold(LOOKS, 0.0);
    hold(LAST_LEEWAY, leeway);
    hold_vector(LAST_TIP, tip.p);
    hold(LAST_DETERMINANT, 1.0);
}

// Leads the sample from rest to its full load, after a pass, with the inverse of its matrix and, where it looks, the index;
// without care one that asks for no short steps and comes near no fold.
fn follow_varying(rod: Rod, inverse: Mat6, index: f32) -> u32 {
    let is_careful = held(CARE) > 0.5;
    let goal = held(GOAL);
    let base = held_pair(TRIAL);
    let corrections = held(CORRECTIONS_MADE);
    let change = newton_step(rod, goal, inverse);
    let correction = size(change, base);
    // Moments and radians, as on other paths.
    let moved = max(norm(change), length(on(pose, change).last));
    let partial = goal < 1.0;
    let is_far = 0.0 < leeway;
    let contracting = is_finite(moved) && moved < held(LAST_SIZE) * CONTRACTION;
    var enough = select(FULL_LOAD_TOLERANCE, FIELD_LOAD_TOLERANCE, partial);
    //@if LOAD_WITHOUT_ENERGY
    enough = PATH_TOLERANCE;
    //@end
    let is_close = !is_careful || moved < FIELD_TOLERANCE;
    let converged = contracting && is_finite(correction) && correction < enough && is_close;
    let looks = held(LOOKS) > 0.5;
    hold(LOOKS, select(0.0, 1.0, converged && !looks));
    // Stability follows from transfers alone: another pass.
    if converged && !looks { return GOES_ON; }
    let margin_here = margin(inverse);
    let stable = index < 0.5;
    let go_on = !converged && contracting && corrections < CORRECTIONS;
    let passes = passes_by(distance(tip.p, held_vector(LAST_TIP)), held(LAST_LEEWAY), leeway);
    var softness = 1.0;
    //@if LOAD_WITHOUT_ENERGY
    softness = determinant;
    //@end
    let last_softness = held(LAST_DETERMINANT);
    let leap = leaps(margin_here, held(LAST_MARGIN)) || softens(softness, last_softness);
    let accept = converged && stable && is_far && !passes && !leap;
    let reject = !accept && !go_on;
    let is_narrow = !is_careful && accept && margin_here < SAFE_MARGIN;
    hold(IS_UNSTABLE, select(0.0, 1.0, reject && converged && !stable));
    hold(IS_TOO_NEAR, select(0.0, 1.0, reject && (!is_far || converged && passes)));
    let improved = sum(1.0, change, base);
    let lambda_before = held(LAMBDA);
    let used = goal - lambda_before;
    let most = affordable(margin_here, held(LAST_MARGIN), used, NEAR_MARGIN, SPENT);
    if accept {
        hold(WEAKEST, min(held(WEAKEST), margin_here));
        hold(LAST_MARGIN, margin_here);
        hold(LAST_DETERMINANT, softness);
        hold(LAST_LEEWAY, leeway);
        hold_vector(LAST_TIP, tip.p);
        let risen = sum(-1.0, held_pair(ACCEPTED), improved);
        // A step no longer than what its last correction may have left tells no direction.
        if moved * FIELD_TELLING < norm(risen) { hold_pair(SECANT, sum(1.0 / used, risen, Pair())); }
        hold_pair(ACCEPTED, improved);
        hold(LAMBDA, goal);
        keeps_inverse = true;
    }
    if accept || go_on { hold_pair(TRIAL, improved); }
    let lambda = held(LAMBDA);
    let reached = accept && !partial && !is_narrow;
    if corrections < 0.5 { hold(FIRST_SIZE, moved); }
    let ratio = clamp(sqrt(AIM * TRUST / max(held(FIRST_SIZE), 1e-6)), NODE_LEAST_RATIO, NODE_MOST_RATIO);
    var step = held(LOAD_STEP);
    if accept { step = used * ratio; }
    if accept && is_careful { step = min(step, most); }
    if accept && softness < FIELD_SOFT {
        let halfway = 0.5 * softness * used / abs(last_softness - softness);
        step = min(step, max(halfway, FIELD_LITTLE_STEP));
    }
    if reject { step = used * NODE_RETREAT; }
    hold(LOAD_STEP, step);
    let failed = is_narrow || reject && step < select(SMALLEST_RAMP_STEP, SMALLEST_GUARDED_STEP, is_careful);
    if !go_on && !reached {
        let next = min(lambda + step, 1.0);
        hold(GOAL, next);
        hold_pair(TRIAL, sum(next - lambda, held_pair(SECANT), held_pair(ACCEPTED)));
    }
    hold(LAST_SIZE, select(TRUST / CONTRACTION, moved, go_on));
    hold(CORRECTIONS_MADE, select(0.0, corrections + 1.0, go_on));
    hold(PASSES, held(PASSES) + 1.0);
    // With the field at the middles of rigid segments a path may go on where the rod's own ends.
    if reached { return select(REACHED, EXHAUSTED, is_careful && held(WEAKEST) < SAFE_MARGIN); }
    if held(PASSES) >= NODE_PASS_LIMIT { return EXHAUSTED; }
    if !failed { return GOES_ON; }
    if held(IS_TOO_NEAR) > 0.5 { return TOO_NEAR; }
    return select(FAILED, AT_FOLD, held(IS_UNSTABLE) > 0.5 || held(WEAKEST) < FOLD_MARGIN);
}
