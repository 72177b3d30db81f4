// Newton's method on the fine grid and the row of each sample, in a field that varies. F5, J5
// crates/core/src/cpu/equilibrium/field/answer.rs

const FINE_TRUST: f32 = 0.0; //@spec
const FIELD_COLUMN_NOISE: f32 = 0.0; //@spec
const DERIVATIVE_COLUMN: u32 = 20u; //@spec
const DERIVATIVE_COUNT: u32 = 1u; //@spec
const DIFFERENCE: f32 = 0.0; //@spec
const SECOND_ORDER: f32 = 0.0; //@spec
const FIELD_CHORD_LIMIT: f32 = 0.0; //@spec
const FIELD_NEWTON_LIMIT: f32 = 0.0; //@spec
const NO_EQUILIBRIUM: f32 = 0.0; //@spec
const REACH: f32 = 0.0; //@spec
const ROUND_OFF: f32 = 0.0; //@spec
const BEND_NOISE: f32 = 0.0; //@spec
const LITTLE_TURN: f32 = 0.0; //@spec
const STAGE_NOISE: f32 = 0.0; //@spec
const ROWS: u32 = 9u; //@spec

// Takes the sample one turn further: a pass over the rod, and what follows from it.
fn solve_varying() {
    let stage = u32(held(STAGE));
    let rod = load();
    load_space(rod);
    var base = held_pair(TRIAL);
    var lambda = 1.0;
    var resolution = FINE;
    var what = BASE;
    switch stage {
        case AT_REST: {
            base = Pair();
            lambda = LITTLE_LOAD;
        }
        case ON_PATH: {
            lambda = held(GOAL);
            what = select(BASE, TRANSFERS, held(LOOKS) > 0.5);
        }
        case IN_NEWTON: { what = select(BASE, STATE, held(IS_CHORD) > 0.5); }
        case TO_CHECK: {
            resolution = CHECK;
            what = STATE;
        }
        case TO_ANSWER: { what = TRANSFERS; }
        default: { what = PARAMETERS; }
    }
    let on_path = stage <= ON_PATH;
    if on_path { resolution = select(COARSE, CAREFUL, held(CARE) > 0.5); }
    //@if FORWARD
    if what == PARAMETERS { load_parameters(u32(held(THREE))); }
    //@end
    // The field acts on the path as if it did at the middles of rigid segments, but for short unstable stretches under a tip moment;
    // the answer corrects it.
    var at_middles = on_path;
    //@if LOAD_WITHOUT_ENERGY
    at_middles = false;
    //@end
    integrate(rod, resolution, lambda, base, what, at_middles);
    var inverse = Mat6();
    if what == STATE || what == PARAMETERS {
        inverse = held_mat6(INVERSE);
    } else {
        inverse = solve(matrix, identity6());
    }
    var index = 0.0;
    if what == TRANSFERS { index = stability_index(); }
    keeps_inverse = false;
    store_status(STATUS_PENDING);
    switch stage {
        case AT_REST: {
            start_path(rod, inverse);
            hold(STAGE, f32(ON_PATH));
            if !(0.0 < leeway) { lose(TOO_NEAR); }
        }
        case ON_PATH: {
            let outcome = follow_varying(rod, inverse, index);
            switch outcome {
                case GOES_ON: {}
                case REACHED: {
                    hold(STAGE, f32(IN_NEWTON));
                    hold(NEWTON_STEPS, 0.0);
                    hold(BOUND, FINE_TRUST);
                    hold(IS_CHORD, 1.0);
                    hold(IS_CONVERGED, 0.0);
                }
                default: { lose(outcome); }
            }
        }
        case IN_NEWTON: { balance(rod, what, inverse); }
        case TO_CHECK: {
            hold_state(CHECKED, tip);
            hold(STAGE, f32(TO_ANSWER));
        }
        case TO_ANSWER: { write(rod, inverse, index); }
        default: { finish_rows(rod, inverse); }
    }
    if keeps_inverse { hold_mat6(INVERSE, inverse); }
}

// A step of Newton's method: chord steps with the path's inverse while they bring much.
fn balance(rod: Rod, what: u32, inverse: Mat6) {
    let base = held_pair(TRIAL);
    if what == BASE {
        keeps_inverse = true;
        hold(BOUND, FINE_TRUST);
    }
    let step = newton_step(rod, 1.0, inverse);
    let change = norm(step);
    let trusted = is_finite(change) && change < held(BOUND);
    let count = held(NEWTON_STEPS) + 1.0;
    let converged = trusted && size(step, base) < settings.tolerance;
    if trusted {
        hold_pair(TRIAL, sum(1.0, step, base));
        hold(BOUND, change * CONTRACTION);
    }
    if !trusted || count >= FIELD_CHORD_LIMIT { hold(IS_CHORD, 0.0); }
    hold(PASSES, held(PASSES) + 1.0);
    hold(NEWTON_STEPS, count);
    hold(IS_CONVERGED, select(0.0, 1.0, converged));
    if converged || count >= FIELD_NEWTON_LIMIT { hold(STAGE, f32(TO_CHECK)); }
}

// What a change of the base's load does to the tip: displacement and rotation.
fn moved(change: Pair) -> Pair {
    return on(pose, change);
}

// Writes the row, but for its derivatives; what is left of the residual is taken out to first order.
fn write(rod: Rod, inverse: Mat6, index: f32) {
    let base = held_pair(TRIAL);
    let left = newton_step(rod, 1.0, inverse);
    let by_rest = moved(left);
    let position = tip.p + by_rest.first;
    let d1 = tip.d1 + cross(by_rest.last, tip.d1);
    let t = tip.t + cross(by_rest.last, tip.t);
    let m0 = base.last + left.last;
    //@if BEYOND_RIGID
    store_vector(DERIVATIVE_COLUMN + ROWS * DERIVATIVE_COUNT, first_u + first_moved(left));
    hold_matrix(FIRST_BY_LOAD, first_by_force);
    hold_matrix(FIRST_BY_LOAD + 9u, first_by_moment);
    //@end
    let stable = index < 0.5;
    let stability = margin(inverse);
    let is_far = 0.0 < leeway;
    let is_sound = is_finite(length(tip.p)) && is_finite(norm(left));
    let is_small = size(left, base) < 10.0 * settings.tolerance;
    let converged = held(IS_CONVERGED) > 0.5 && is_sound && is_small && length(tip.p) < REACH;
    var code = select(STATUS_UNSTABLE, STATUS_RAMPED, stable);
    if !converged { code = select(STATUS_NON_FINITE, STATUS_NOT_CONVERGED, is_finite(length(tip.p))); }
    if !is_far { code = STATUS_TOO_NEAR_MAGNET; }
    if !is_far && held(CARE) < 0.5 {
        restart();
        return;
    }
    let is_equilibrium = converged && is_far;

    store_vector(TIP_POSITION_COLUMN, position);
    store_vector(TIP_D1_COLUMN, d1);
    store_vector(TIP_TANGENT_COLUMN, t);
    store_vector(BASE_MOMENT_COLUMN, m0);
    store(RESIDUAL_COLUMN, max(length(tip.n - rod.f_tip), length(tip.m - rod.l_tip)));
    store(STABILITY_MARGIN_COLUMN, select(-stability, stability, stable));
    store(STABILITY_INDEX_COLUMN, select(NO_EQUILIBRIUM, index, is_equilibrium));
    store(ITERATIONS_COLUMN, held(PASSES));
    store(LOAD_FRACTION_COLUMN, held(LAMBDA));
    store(LOAD_FRACTION_ERROR_COLUMN, 1.0);

    let check = held_state(CHECKED);
    let delta = on(inverse, Pair(rod.f_tip - check.n, rod.l_tip - check.m)); // F5
    let shift = moved(delta);
    let by_position = length(check.p + shift.first - position) / rod.length;
    let by_d1 = length(check.d1 + cross(shift.last, check.d1) - d1);
    let by_t = length(check.t + cross(shift.last, check.t) - t);
    let answers = times(pose, inverse);
    let square = 1.0 + squared_norm(answers);
    let noise = (length(base.first) + length(m0) + 1.0) * (ROUND_OFF * EPSILON) * sqrt(square);
    let largest = max(max(by_position, by_d1), by_t);
    // The second order of both moves of the tip to first order: to the answer, and of the pass on twice the steps to its rest.
    let turned = dot(by_rest.first, by_rest.first) + dot(by_rest.last, by_rest.last);
    let second_order = (turned + dot(shift.first, shift.first) + dot(shift.last, shift.last)) * SECOND_ORDER;
    let far = max(length(m0) - LITTLE_TURN, 0.0) * BEND_NOISE * (ROUND_OFF * EPSILON) * sqrt(square);
    let rounded = noise * STAGE_NOISE + far;
    store(ERROR_ESTIMATE_COLUMN, largest * DIFFERENCE * (1.0 + settings.error_share) + rounded + second_order);
    let both = largest + max(norm(delta) / stability, max(norm(shift), norm(by_rest)));
    let derivative_error = max(both * settings.derivative_share, settings.derivative_floor);
    store(DERIVATIVE_ERROR_COLUMN, derivative_error + (noise + far) / stability * FIELD_COLUMN_NOISE);
    keeps_inverse = true;
    hold_mat6(POSE, pose);
    hold(THREE, 0.0);
    //@if FORWARD
    if is_equilibrium {
        hold(STAGE, f32(TO_DIFFERENTIATE));
        hold(IS_UNSTABLE, select(1.0, 0.0, stable));
        return;
    }
    //@end
    store_status(code);
    hold(STAGE, f32(DONE));
}

//@if FORWARD
// The rows of the derivatives in hand: dX = dX|base + (dX/d(base)) d(base). J5
fn write_rows(rod: Rod, inverse: Mat6) {
    let three = u32(held(THREE));
    var slope = vec3<f32>();
    //@if WANT_INSERTION
    let base = held_pair(TRIAL);
    let state = State(vec3<f32>(), rod.d1, rod.t, base.last, base.first);
    let first = load_flexible(0u, false);
    slope = slopes(first, state, velocity(first, rod.d1, cross(rod.t, rod.d1), rod.t, base.first)).dm;
    //@end
    //@if BEYOND_RIGID
    first_by_force = held_matrix(FIRST_BY_LOAD);
    first_by_moment = held_matrix(FIRST_BY_LOAD + 9u);
    //@end
    for (var k = 0u; k < 3u; k++) { //@unroll
        if 3u * three + k < DERIVATIVE_COUNT {
            let dn = sources.dn0[k] - columns.dn[k];
            let dm = sources.dl_tip[k] - columns.dm[k];
            let change = on(inverse, Pair(dn, dm));
            let by_change = moved(change);
            let at = DERIVATIVE_COLUMN + ROWS * (3u * three + k);
            store_vector(at, columns.dp[k] + by_change.first);
            store_vector(at + 3u, columns.w[k] + by_change.last);
            //@if BASE_MOMENT_ROWS
            // What is inserted lies proximal to the former base.
            store_vector(at + 6u, change.last - slope * sources.insertion[k]);
            //@if BEYOND_RIGID
            store_vector(at + 9u, first_by_parameters[k] + first_moved(change));
            //@end
            //@end
        }
    } //@end
}
//@end
