// The boundary value problem: from rest to full load, Newton's method on the base moment. R4, J5
// src/lanes/solve.rs
//
// Drivers inline every call, so one call of `shoot` serves every phase, and samples in different phases share it.

const PATH_TOLERANCE: f32 = 0.0; //@spec
const CONTRACTION: f32 = 0.0; //@spec
const TRUST: f32 = 0.0; //@spec
const CORRECTIONS: f32 = 0.0; //@spec
const EASY: f32 = 0.0; //@spec
const FIRST_RAMP_STEP: f32 = 0.0; //@spec
const SMALLEST_RAMP_STEP: f32 = 0.0; //@spec
const SMALLEST_GUARDED_STEP: f32 = 0.0; //@spec
const PASS_LIMIT: f32 = 0.0; //@spec
const CHORD_LIMIT: u32 = 0u; //@spec
const CHORD_TRUST: f32 = 0.0; //@spec
const CHORD_TOLERANCE: f32 = 0.0; //@spec
const NEWTON_LIMIT: u32 = 0u; //@spec
const EPSILON: f32 = 0.0; //@spec
const ROUND_OFF: f32 = 0.0; //@spec

// How to reach the full load; each is tried where the one before did not lead to a stable equilibrium.
const DIRECT: u32 = 0u;
const RAMP: u32 = 1u;
const GUARDED_RAMP: u32 = 2u;

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
    exhausted: bool,
}

// dm0/dlambda at rest: the moment of all loads on the unbent rod, R4 at u = u*.
fn rest_slope(rod: Rod) -> vec3<f32> {
    var stiff = rod;
    stiff.softness = 0.0;
    let tip = shoot(COARSE, stiff, 1.0, vec3<f32>(), 0u, false);
    return rod.l_tip - tip.m;
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

// Follows the equilibrium from rest to the full load on the coarse grid; where a path fails, the next.
fn follow_path(rod: Rod, first: u32, secant: vec3<f32>) -> PathEnd {
    var end: PathEnd;
    var step = 0.0;
    var goal = 0.0;
    var last_size = 0.0;
    var corrections = 0.0;
    var started = false;
    end.path = first;
    loop {
        let guarded = end.path == GUARDED_RAMP;
        let first_step = select(FIRST_RAMP_STEP, 1.0, end.path == DIRECT);
        let ramp_step = select(SMALLEST_RAMP_STEP, SMALLEST_GUARDED_STEP, guarded);
        let smallest_step = select(ramp_step, 1.0, end.path == DIRECT);
        if !started {
            end.history = History(0.0, vec3<f32>(), 0.0, secant, vec3<f32>());
            step = first_step;
            goal = first_step;
            end.m0 = predict(end.history, goal);
            last_size = TRUST / CONTRACTION;
            corrections = 0.0;
            end.passes = 1.0;
            end.exhausted = false;
            started = true;
        }
        let tip = shoot(COARSE, rod, goal, end.m0, select(1u, 2u, guarded), guarded);
        let residual = tip.m - rod.l_tip * goal;
        let w = tip_moment_columns(tip, BY_MOMENT);
        let w_inverse = inverse(w);
        let delta = -(w_inverse * residual); // R4
        let size = length(delta);
        let m_new = end.m0 + delta;
        let converged = size < PATH_TOLERANCE * (1.0 + length(end.m0));
        let contracting = size < last_size * CONTRACTION && corrections < CORRECTIONS;
        var same_branch = 0.0 < dot(w[0], cross(w[1], w[2]));
        if guarded { same_branch = same_branch && stability_index(tip) < 0.5; }
        let accepted = converged && same_branch;
        let go_on = !converged && contracting;
        var failed = false;

        end.passes = end.passes + 1.0;
        if accepted || go_on { end.inverse = w_inverse; }
        if go_on {
            end.m0 = m_new;
            last_size = size;
            corrections = corrections + 1.0;
        } else {
            if accepted {
                end.history = accept(end.history, goal, m_new);
                end.reached = goal >= 1.0;
                if corrections < EASY { step = step + step; }
            } else {
                step = step * 0.5;
                failed = step < smallest_step;
            }
            goal = min(end.history.lambda + step, 1.0);
            end.m0 = select(predict(end.history, goal), m_new, end.reached);
            last_size = TRUST / CONTRACTION;
            corrections = 0.0;
        }
        end.exhausted = !end.reached && end.passes >= PASS_LIMIT;
        failed = failed || end.exhausted;
        if end.reached || failed && guarded { break; }
        if failed {
            end.path += 1u;
            started = false;
        }
    }
    return end;
}

// Moves the base moment to the fine grid's equilibrium by chord steps, without columns.
fn chord_steps(rod: Rod, end: ptr<function, PathEnd>) {
    var moving = (*end).reached;
    for (var i = 0u; i < CHORD_LIMIT; i++) {
        if !moving { break; }
        let tip = shoot(FINE, rod, 1.0, (*end).m0, 0u, false);
        let delta = -((*end).inverse * (tip.m - rod.l_tip));
        let size = length(delta);
        // A chord step that is not small says that the coarse grid was too coarse: Newton's method takes over.
        let small = size < CHORD_TRUST;
        if small { (*end).m0 = (*end).m0 + delta; }
        (*end).passes = (*end).passes + 1.0;
        moving = small && size >= settings.tolerance * CHORD_TOLERANCE;
    }
}

// Solves one sample and writes its row, in the plan's units.
fn solve_group() {
    let rod = load();
    let secant = rest_slope(rod);
    var end: PathEnd;
    var tip: Tip;
    var delta = vec3<f32>();
    var w_inverse = mat3x3<f32>();
    var index = 0.0;
    var code = STATUS_PENDING;
    for (var first = DIRECT; first <= GUARDED_RAMP; first = end.path + 1u) {
        end = follow_path(rod, first, secant);
        chord_steps(rod, &end);
        var moving = end.reached;
        var converged = false;
        var size = 0.0;
        for (var i = 0u; i < NEWTON_LIMIT; i++) {
            tip = shoot(FINE, rod, 1.0, end.m0, THREES, true);
            w_inverse = inverse(tip_moment_columns(tip, BY_MOMENT));
            delta = -(w_inverse * (tip.m - rod.l_tip)); // J5
            size = length(delta);
            converged = end.reached && size < settings.tolerance * (1.0 + length(end.m0));
            if moving { end.passes = end.passes + 1.0; }
            moving = moving && !converged && size < TRUST;
            if i + 1u == NEWTON_LIMIT || !moving { break; }
            end.m0 = end.m0 + delta;
        }
        index = stability_index(tip);
        code = status_codes(end, converged, index < 0.5, size);
        if code != STATUS_PENDING { break; }
    }
    // What is left of the residual is taken out to first order.
    let tip_position = tip.p + columns[BY_MOMENT].dp * delta;
    let turn = columns[BY_MOMENT].w * delta;
    let d1 = tip.d1 + cross(turn, tip.d1);
    let t = tip.t + cross(turn, tip.t);
    let m0 = end.m0 + delta;
    let residual = length(tip.m - rod.l_tip);

    let norm = dot(w_inverse[0], w_inverse[0]) + dot(w_inverse[1], w_inverse[1]) + dot(w_inverse[2], w_inverse[2]);
    let margin = sqrt(3.0 / norm);
    store_vector(TIP_POSITION_COLUMN, tip_position);
    store_vector(TIP_D1_COLUMN, d1);
    store_vector(TIP_TANGENT_COLUMN, t);
    store_vector(BASE_MOMENT_COLUMN, m0);
    store(RESIDUAL_COLUMN, residual);
    store(STABILITY_MARGIN_COLUMN, select(-margin, margin, index < 0.5));
    store(STABILITY_INDEX_COLUMN, index);
    store(ITERATIONS_COLUMN, end.passes);
    store(LOAD_FRACTION_COLUMN, end.history.lambda);
    //@if DERIVATIVES
    write_rows(rod, end.m0, base_force(rod), new_responses(rod, tip));
    //@end
    store(ERROR_ESTIMATE_COLUMN, error_estimate(rod, end.m0, w_inverse, tip_position, d1, t));
    store_status(code);
}

// Status of the sample, as a code.
fn status_codes(end: PathEnd, converged: bool, stable: bool, size: f32) -> u32 {
    let unsolved = select(STATUS_NON_FINITE, STATUS_NOT_CONVERGED, is_finite(size));
    if end.path == DIRECT { return select(STATUS_PENDING, STATUS_OK, converged && stable); }
    if end.path == RAMP { return select(STATUS_PENDING, STATUS_RAMPED, converged && stable); }
    let lost = select(STATUS_FOLD, STATUS_STEP_LIMIT, end.exhausted);
    let done = select(STATUS_UNSTABLE, STATUS_RAMPED, stable);
    return select(lost, select(unsolved, done, converged), end.reached);
}

// Whether a number is neither infinite nor undefined; by its bits, whatever the compiler assumes.
fn is_finite(a: f32) -> bool {
    return (bitcast<u32>(a) & 0x7f800000u) != 0x7f800000u;
}

// Difference to the equilibrium on twice as many steps, plus what round-off can do through dm0/dr.
fn error_estimate(
    rod: Rod, m0: vec3<f32>, w_inverse: mat3x3<f32>, p: vec3<f32>, d1: vec3<f32>, t: vec3<f32>,
) -> f32 {
    let tip = shoot(CHECK, rod, 1.0, m0, 0u, false);
    let delta = -(w_inverse * (tip.m - rod.l_tip));
    let by_moment = columns[BY_MOMENT];
    let turn = by_moment.w * delta;
    let dp = length(tip.p + by_moment.dp * delta - p);
    let dd1 = length(tip.d1 + cross(turn, tip.d1) - d1);
    let dt = length(tip.t + cross(turn, tip.t) - t);
    let response = transpose(by_moment.w * w_inverse);
    let amplification = length(response[0]) + length(response[1]) + length(response[2]);
    let round_off = (1.0 + amplification) * (ROUND_OFF * EPSILON);
    return max(max(dp, dd1), dt) + round_off * (1.0 + length(m0));
}

@compute @workgroup_size(WORKGROUP)
fn solve(@builtin(global_invocation_id) id: vec3<u32>) {
    if select_sample(id.x) { solve_group(); }
}
