// From rest to full load on the coarse grid: load steps, prediction, Newton's method with a bound. R4
// crates/core/src/cpu/equilibrium/path.rs

const PATH_TOLERANCE: f32 = 0.0; //@spec
const CONTRACTION: f32 = 0.0; //@spec
const LOAD_STEP_TOLERANCE: f32 = 0.0; //@spec
const FULL_LOAD_TOLERANCE: f32 = 0.0; //@spec
const TRUST: f32 = 0.0; //@spec
const NEARBY: f32 = 0.0; //@spec
const CORRECTIONS: f32 = 0.0; //@spec
const DEPARTURE: f32 = 0.0; //@spec
const DEPARTURE_AIM: f32 = 0.0; //@spec
const FIRST_BEND: f32 = 0.0; //@spec
const RETREATS: f32 = 0.0; //@spec
const NEAR_MARGIN: f32 = 0.0; //@spec
const SPENT: f32 = 0.0; //@spec
const WIDENING: f32 = 0.0; //@spec
const AIM: f32 = 0.0; //@spec
const LEAST_RATIO: f32 = 0.0; //@spec
const MOST_RATIO: f32 = 0.0; //@spec
const RETREAT: f32 = 0.0; //@spec
const SMALLEST_RAMP_STEP: f32 = 0.0; //@spec
const SMALLEST_GUARDED_STEP: f32 = 0.0; //@spec
const SMALLEST_UNSYMMETRIC_STEP: f32 = 0.0; //@spec
const PASS_LIMIT: f32 = 0.0; //@spec
const SAFE_MARGIN: f32 = 0.0; //@spec
const NARROW_MARGIN: f32 = 0.0; //@spec
const FOLD_MARGIN: f32 = 0.0; //@spec

// How to reach the full load; each is tried where the one before did not lead to a stable equilibrium.
const RAMP: u32 = 0u;
const GUARDED_RAMP: u32 = 1u;
// The first and the last path that this kernel follows.
const FIRST_PATH: u32 = 0u; //@spec
const LAST_PATH: u32 = 1u; //@spec
// Not from rest: from a given base moment, away from known equilibria.
const SEARCH: u32 = 2u;
// From the base moment that anchors predict, along no path at all.
const ANCHORED: u32 = 3u;

// The last accepted states, for the prediction of the next.
struct History {
    // Load fraction and base moment accepted last.
    lambda: f32,
    m0: vec3<f32>,
    // Load fraction before that, and the secant between the two.
    lambda_before: f32,
    secant: vec3<f32>,
    // Second divided difference.
    bend: vec3<f32>,
}

// Where a sample stands on its path.
struct PathEnd {
    path: u32,
    history: History,
    m0: vec3<f32>,
    inverse: mat3x3<f32>,
    passes: f32,
    reached: bool,
    // In more than one load step.
    ramped: bool,
    //@if ANCHORED
    // Anchors tell it so well that no step need come before the check.
    close: bool,
    //@end
    exhausted: bool,
    // Not reached, and near a fold or a bifurcation.
    fold: bool,
}

// How the equilibrium sets out from rest.
struct RestSlope {
    // dm0/dlambda: the moment of all loads on the unbent rod, R4 at u = u*.
    m0: vec3<f32>,
    // The largest moment by all loads inside the unbent rod, at its base and at the ends of its flexible segments. Loads that
    // cancel at the base bend the rod between them all the same.
    largest: f32,
}

// dm0/dlambda at rest, and the largest moment inside the unbent rod, in a second pass.
fn rest_slope(rod: Rod) -> RestSlope {
    var stiff = rod;
    stiff.is_stiff = true;
    var rest = RestSlope();
    for (var pass_number = 0u; pass_number < 2u; pass_number++) {
        largest_moment = length(rest.m0);
        let tip = shoot(COARSE, stiff, 1.0, rest.m0, NO_COLUMNS, false);
        if pass_number == 0u { rest.m0 = rod.l_tip - tip.m; }
    }
    rest.largest = largest_moment;
    return rest;
}

// Base moment at load fraction `goal` by quadratic extrapolation.
fn predict(history: History, goal: f32) -> vec3<f32> {
    let ahead = goal - history.lambda;
    let slope = axpy(ahead + history.lambda - history.lambda_before, history.bend, history.secant);
    return axpy(ahead, slope, history.m0);
}

fn accept(history: History, goal: f32, m0: vec3<f32>) -> History {
    let secant = (m0 - history.m0) * (1.0 / (goal - history.lambda));
    let bend = (secant - history.secant) * (1.0 / (goal - history.lambda_before));
    return History(goal, m0, history.lambda, secant, bend);
}

//@if LOAD_WITHOUT_ENERGY
// Whether a load step takes the margin so far, where it is small, that stability may be lost and won again between.
fn leaps(square: f32, last_square: f32) -> bool {
    let near = !is_above(max(square, last_square), NEAR_MARGIN);
    return near && (square * WIDENING < last_square || last_square * WIDENING < square);
}
//@end

// Follows the equilibrium from rest to the full load on the coarse grid; where a path fails, the next.
//@if LANES
//
// Invocations whose sample is `done` go on beside those of their workgroup.
fn follow_path(rod: Rod, first: u32, rest: RestSlope, is_done: bool) -> PathEnd {
    var done = is_done;
//@else
fn follow_path(rod: Rod, first: u32, rest: RestSlope) -> PathEnd {
//@end
    var end: PathEnd;
    var step = 0.0;
    var goal = 0.0;
    var last_size = 0.0;
    var first_size = 0.0;
    var corrections = 0.0;
    // Largest squared norm of the inverse on accepted steps, and that on the last.
    var weakest = 0.0;
    var last_square = 3.0;
    //@if LOAD_WITHOUT_ENERGY
    // (dr/dm0)^-1 there.
    var last_inverse = identity();
    let dead = has_no_energy(rod);
    //@end
    // Steps in a row that were rejected.
    var retreats = 0.0;
    var started = false;
    end.path = first;
    loop {
        //@if LANES
        if !is_any_busy(!done) { break; }
        //@end
        //@if GUARDS
        //@if RAMPS
        let guarded = end.path == GUARDED_RAMP;
        //@else
        let guarded = true;
        //@end
        //@else
        let guarded = false;
        //@end
        var smallest_step = select(SMALLEST_RAMP_STEP, SMALLEST_GUARDED_STEP, guarded);
        //@if LOAD_WITHOUT_ENERGY
        if guarded { smallest_step = SMALLEST_UNSYMMETRIC_STEP; }
        //@end
        let first_bound = TRUST * (1.0 / CONTRACTION);
        if !started {
            end.history = History(0.0, vec3<f32>(), 0.0, rest.m0, vec3<f32>());
            step = FIRST_BEND / max(rest.largest, FIRST_BEND);
            goal = step;
            end.m0 = predict(end.history, goal);
            last_size = first_bound;
            corrections = 0.0;
            weakest = 0.0;
            last_square = 3.0;
            //@if LOAD_WITHOUT_ENERGY
            last_inverse = identity();
            //@end
            retreats = 0.0;
            end.passes = 1.0;
            end.ramped = false;
            end.exhausted = false;
            started = true;
        }
        //@if LANES
        let tip = shoot_on_lanes(rod, goal, end.m0);
        if done { continue; }
        //@else
        columns[BY_MOMENT] = moment_columns();
        var taken = PATH_COLUMNS;
        //@if GUARDS
        if guarded {
            columns[BY_ROTATION] = rotation_columns(end.m0);
            taken = STABILITY_COLUMNS;
        }
        //@end
        let tip = shoot(select(COARSE, CAREFUL, guarded), rod, goal, end.m0, taken, guarded);
        //@end
        let residual = tip.m - rod.l_tip * goal;
        let w = tip_moment_columns(tip, BY_MOMENT);
        let w_inverse = inverse(w);
        let delta = -(w_inverse * residual); // R4
        // In plan units of moment or in radians: a soft rod turns far by little.
        let size = max(length(delta), length(columns[BY_MOMENT].w * delta));
        let m_new = end.m0 + delta;
        let partial = goal < 1.0;
        let ramp_tolerance = select(FULL_LOAD_TOLERANCE, LOAD_STEP_TOLERANCE, partial);
        let contracting = size < last_size * CONTRACTION && corrections < CORRECTIONS;
        // However small against the load, a correction that is not trusted may have led to another branch.
        let enough = select(ramp_tolerance, PATH_TOLERANCE, guarded);
        let converged = size < enough * (1.0 + length(end.m0)) && contracting;
        // A dead tip moment makes w unsymmetric; the index changes where its symmetric part is singular. Few steps ask for
        // that bound, those with care for w itself. S5, S6
        var form = w;
        var form_inverse = w_inverse;
        //@if LOAD_WITHOUT_ENERGY
        if !guarded {
            form = columns_cross_sub(columns[BY_MOMENT].w, rod.l_tip * (goal * 0.5), w);
            form_inverse = inverse(form);
        }
        //@end
        var same_branch = 0.0 < dot(form[0], cross(form[1], form[2]));
        if guarded {
            var holds = stability_index(tip) < 0.5;
            //@if LOAD_WITHOUT_ENERGY
            holds = holds || dead;
            //@end
            same_branch = same_branch && holds;
        }
        let square = squared_norm(form_inverse);
        // Too near a bifurcation to know afterwards on which side it was passed; no long correction may start beyond one.
        // Whoever retreats so often did not stand on the branch.
        let safe = is_above(square, SAFE_MARGIN) && retreats < RETREATS;
        let regular = select(same_branch && safe, same_branch || size < NEARBY, guarded);
        let recovers = !is_above(weakest, NARROW_MARGIN) && square < 0.25 * weakest;
        let lost = converged && same_branch && select(!safe, recovers, guarded);
        var accepted = converged && same_branch && !lost;
        //@if LOAD_WITHOUT_ENERGY
        var departed = 0.0;
        if guarded {
            departed = departure(last_inverse, w);
            let near = !dead || departed < DEPARTURE;
            accepted = accepted && near && !leaps(square, last_square);
        }
        //@end
        let go_on = !converged && contracting && regular;
        var failed = false;
        if corrections < 0.5 { first_size = size; }

        end.passes = end.passes + 1.0;
        if accepted || go_on { end.inverse = w_inverse; }
        if go_on {
            end.m0 = m_new;
            last_size = size;
            corrections = corrections + 1.0;
        } else {
            let used = goal - end.history.lambda;
            let ratio = first_size / (TRUST * AIM);
            let factor = 1.0 / sqrt(sqrt(max(select(MOST_RATIO, ratio, ratio < MOST_RATIO), LEAST_RATIO)));
            if accepted {
                end.history = accept(end.history, goal, m_new);
                weakest = max(weakest, square);
                end.reached = !partial;
                end.ramped = end.ramped || partial;
                retreats = 0.0;
                step = used * factor;
                if guarded {
                    let fall = vec2<f32>(sqrt(3.0 / square), sqrt(3.0 / last_square));
                    step = min(step, affordable(fall.x, fall.y, used, NEAR_MARGIN, SPENT));
                    //@if LOAD_WITHOUT_ENERGY
                    if dead { step = min(step, used * (DEPARTURE_AIM * DEPARTURE) / max(departed, SMALLEST)); }
                    last_inverse = w_inverse;
                    //@end
                }
                last_square = square;
            } else {
                retreats = retreats + 1.0;
                step = used * min(factor, RETREAT);
                failed = lost || step < smallest_step;
                // Between here and there lies a fold, which this grid may have put elsewhere, or no branch at all.
                if !guarded { failed = failed || !(same_branch && is_above(square, SAFE_MARGIN)); }
            }
            goal = min(end.history.lambda + step, 1.0);
            end.m0 = select(predict(end.history, goal), m_new, end.reached);
            last_size = first_bound;
            corrections = 0.0;
        }
        end.exhausted = !end.reached && end.passes >= PASS_LIMIT;
        failed = failed || end.exhausted;
        // The step was rejected for its stability, not for Newton's method.
        let unstable = converged && !same_branch && is_sharp(w);
        end.fold = guarded && failed && !end.exhausted && (unstable || !is_above(weakest, FOLD_MARGIN));
        //@if LANES
        done = end.reached || failed;
        if done { continue; }
        //@else
        if end.reached || failed && end.path >= LAST_PATH { break; }
        //@end
        if failed {
            end.path += 1u;
            started = false;
        }
    }
    return end;
}
