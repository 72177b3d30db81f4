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

// What a pass over the rod is for.
const AT_REST: u32 = 0u;
const ON_PATH: u32 = 1u;
const ON_CHORD: u32 = 2u;
const NEWTON: u32 = 3u;
const ESTIMATE: u32 = 4u;
const DONE: u32 = 5u;

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
    history: History,
    step: f32,
    goal: f32,
    m0: vec3<f32>,
    last_size: f32,
    corrections: f32,
    passes: f32,
    inverse: mat3x3<f32>,
    reached: bool,
    failed: bool,
    exhausted: bool,
}

// What Newton's iteration found.
struct Found {
    p: vec3<f32>,
    d1: vec3<f32>,
    t: vec3<f32>,
    w_inverse: mat3x3<f32>,
}

// dm0/dlambda at rest: the moment of all loads on the unbent rod, R4 at u = u*.
fn rest_slope(rod: Rod, tip: Tip) -> vec3<f32> {
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

// A path before its first pass.
fn start_path(path: u32, secant: vec3<f32>) -> PathEnd {
    let first_step = select(FIRST_RAMP_STEP, 1.0, path == DIRECT);
    var end: PathEnd;
    end.history.secant = secant;
    end.step = first_step;
    end.goal = first_step;
    end.m0 = predict(end.history, end.goal);
    end.last_size = TRUST / CONTRACTION;
    end.passes = 1.0;
    return end;
}

// Follows the equilibrium from rest to the full load on the coarse grid: what one pass says.
fn follow_path(rod: Rod, path: u32, tip: Tip, index: f32, end: ptr<function, PathEnd>) {
    var now = *end;
    let residual = tip.m - rod.l_tip * now.goal;
    let w = tip_moment_columns(tip, BY_MOMENT);
    let w_inverse = inverse(w);
    let delta = -(w_inverse * residual); // R4
    let size = length(delta);
    let m_new = now.m0 + delta;
    let converged = size < PATH_TOLERANCE * (1.0 + length(now.m0));
    let contracting = size < now.last_size * CONTRACTION && now.corrections < CORRECTIONS;
    let same_branch = 0.0 < dot(w[0], cross(w[1], w[2])) && (path != GUARDED_RAMP || index < 0.5);
    let accepted = converged && same_branch;
    let go_on = !converged && contracting;

    now.passes = now.passes + 1.0;
    if accepted || go_on { now.inverse = w_inverse; }
    if go_on {
        now.m0 = m_new;
        now.last_size = size;
        now.corrections = now.corrections + 1.0;
    } else {
        if accepted {
            now.history = accept(now.history, now.goal, m_new);
            now.reached = now.goal >= 1.0;
            if now.corrections < EASY { now.step = now.step + now.step; }
        } else {
            let smallest_step = select(select(SMALLEST_GUARDED_STEP, SMALLEST_RAMP_STEP, path == RAMP), 1.0, path == DIRECT);
            now.step = now.step * 0.5;
            now.failed = now.step < smallest_step;
        }
        now.goal = min(now.history.lambda + now.step, 1.0);
        now.m0 = predict(now.history, now.goal);
        if now.reached { now.m0 = m_new; }
        now.last_size = TRUST / CONTRACTION;
        now.corrections = 0.0;
    }
    now.exhausted = !now.reached && now.passes >= PASS_LIMIT;
    now.failed = now.failed || now.exhausted;
    *end = now;
}

// Moves the base moment to the fine grid's equilibrium by a chord step, without columns; true to go on.
fn chord_steps(rod: Rod, tip: Tip, end: ptr<function, PathEnd>) -> bool {
    let delta = -((*end).inverse * (tip.m - rod.l_tip));
    let size = length(delta);
    // A chord step that is not small says that the coarse grid was too coarse: Newton's method takes over.
    let small = size < CHORD_TRUST;
    if small { (*end).m0 = (*end).m0 + delta; }
    (*end).passes = (*end).passes + 1.0;
    return small && size >= settings.tolerance * CHORD_TOLERANCE;
}

// The pass that a phase asks for.
fn next_pass(phase: u32, path: u32, end: PathEnd) -> Pass {
    switch phase {
        case AT_REST: { return Pass(COARSE, 0.0, 1.0, vec3<f32>(), 0u, false); }
        case ON_PATH: {
            let guarded = path == GUARDED_RAMP;
            return Pass(COARSE, 1.0, end.goal, end.m0, select(1u, 2u, guarded), guarded);
        }
        case ON_CHORD: { return Pass(FINE, 1.0, 1.0, end.m0, 0u, false); }
        case NEWTON: { return Pass(FINE, 1.0, 1.0, end.m0, THREES, true); }
        default: { return Pass(CHECK, 1.0, 1.0, end.m0, 0u, false); }
    }
}

// Solves one sample and writes its row, in the plan's units.
fn solve_group() {
    let rod = load();
    var path = DIRECT;
    var phase = AT_REST;
    var rest = vec3<f32>();
    var end: PathEnd;
    var found: Found;
    var steps = 0u;
    var code = STATUS_PENDING;
    while phase != DONE {
        let task = next_pass(phase, path, end);
        let tip = shoot(rod, task);
        var index = 0.0;
        if task.record { index = stability_index(tip); }
        switch phase {
            case AT_REST: {
                rest = rest_slope(rod, tip);
                end = start_path(path, rest);
                phase = ON_PATH;
            }
            case ON_PATH: {
                follow_path(rod, path, tip, index, &end);
                steps = 0u;
                if end.reached {
                    phase = ON_CHORD;
                } else if end.failed {
                    phase = NEWTON;
                }
            }
            case ON_CHORD: {
                let moving = chord_steps(rod, tip, &end);
                steps += 1u;
                if !moving || steps == CHORD_LIMIT {
                    phase = NEWTON;
                    steps = 0u;
                }
            }
            case NEWTON: {
                found.w_inverse = inverse(tip_moment_columns(tip, BY_MOMENT));
                let delta = -(found.w_inverse * (tip.m - rod.l_tip)); // J5
                let size = length(delta);
                let converged = end.reached && size < settings.tolerance * (1.0 + length(end.m0));
                let moving = end.reached && !converged && size < TRUST;
                if end.reached { end.passes = end.passes + 1.0; }
                steps += 1u;
                if moving && steps < NEWTON_LIMIT {
                    end.m0 = end.m0 + delta;
                    continue;
                }
                code = status_codes(end, path, converged, index < 0.5, size);
                phase = ESTIMATE;
                if code != STATUS_PENDING {
                    found = write_solution(rod, tip, end, found.w_inverse, delta, index);
                }
            }
            default: {
                error_estimate(rod, tip, end, found);
                store_status(code);
                phase = DONE;
            }
        }
        // The next path, as soon as it is known that this one does not lead to a stable equilibrium.
        if path != GUARDED_RAMP && (phase == NEWTON && end.failed || phase == ESTIMATE && code == STATUS_PENDING) {
            path += 1u;
            end = start_path(path, rest);
            phase = ON_PATH;
        }
    }
}

// Writes all but the error estimate and the status; what is left of the residual is taken out to first order.
fn write_solution(rod: Rod, tip: Tip, end: PathEnd, w_inverse: mat3x3<f32>, delta: vec3<f32>, index: f32) -> Found {
    let tip_position = tip.p + columns[BY_MOMENT].dp * delta;
    let turn = columns[BY_MOMENT].w * delta;
    let d1 = tip.d1 + cross(turn, tip.d1);
    let t = tip.t + cross(turn, tip.t);
    let squares = dot(w_inverse[0], w_inverse[0]) + dot(w_inverse[1], w_inverse[1]) + dot(w_inverse[2], w_inverse[2]);
    let margin = sqrt(3.0 / squares);
    store_vector(TIP_POSITION_COLUMN, tip_position);
    store_vector(TIP_D1_COLUMN, d1);
    store_vector(TIP_TANGENT_COLUMN, t);
    store_vector(BASE_MOMENT_COLUMN, end.m0 + delta);
    store(RESIDUAL_COLUMN, length(tip.m - rod.l_tip));
    store(STABILITY_MARGIN_COLUMN, select(-margin, margin, index < 0.5));
    store(STABILITY_INDEX_COLUMN, index);
    store(ITERATIONS_COLUMN, end.passes);
    store(LOAD_FRACTION_COLUMN, end.history.lambda);
    //@if DERIVATIVES
    write_rows(rod, end.m0, base_force(rod), new_responses(rod, tip));
    //@end
    return Found(tip_position, d1, t, w_inverse);
}

// Status of the sample, as a code.
fn status_codes(end: PathEnd, path: u32, converged: bool, stable: bool, size: f32) -> u32 {
    let unsolved = select(STATUS_NON_FINITE, STATUS_NOT_CONVERGED, is_finite(size));
    if path == DIRECT { return select(STATUS_PENDING, STATUS_OK, converged && stable); }
    if path == RAMP { return select(STATUS_PENDING, STATUS_RAMPED, converged && stable); }
    let lost = select(STATUS_FOLD, STATUS_STEP_LIMIT, end.exhausted);
    let done = select(STATUS_UNSTABLE, STATUS_RAMPED, stable);
    return select(lost, select(unsolved, done, converged), end.reached);
}

// Whether a number is neither infinite nor undefined; by its bits, whatever the compiler assumes.
fn is_finite(a: f32) -> bool {
    return (bitcast<u32>(a) & 0x7f800000u) != 0x7f800000u;
}

// Difference to the equilibrium on twice as many steps, plus what round-off can do through dm0/dr.
fn error_estimate(rod: Rod, tip: Tip, end: PathEnd, found: Found) {
    let delta = -(found.w_inverse * (tip.m - rod.l_tip));
    let by_moment = columns[BY_MOMENT];
    let turn = by_moment.w * delta;
    let dp = length(tip.p + by_moment.dp * delta - found.p);
    let dd1 = length(tip.d1 + cross(turn, tip.d1) - found.d1);
    let dt = length(tip.t + cross(turn, tip.t) - found.t);
    let columns = transpose(by_moment.w * found.w_inverse);
    let amplification = length(columns[0]) + length(columns[1]) + length(columns[2]);
    let round_off = (1.0 + amplification) * (ROUND_OFF * EPSILON);
    store(ERROR_ESTIMATE_COLUMN, max(max(dp, dd1), dt) + round_off * (1.0 + length(end.m0)));
}

@compute @workgroup_size(WORKGROUP)
fn solve(@builtin(global_invocation_id) id: vec3<u32>) {
    if select_sample(id.x) { solve_group(); }
}
