// The boundary value problem: Newton's method on the fine grid, and the row of each sample. R4, J5
// src/lanes/solve.rs

const NEWTON_LIMIT: u32 = 0u; //@spec
const FINE_TRUST: f32 = 0.0; //@spec
const REACH: f32 = 0.0; //@spec
const NO_EQUILIBRIUM: f32 = 0.0; //@spec

// Solves one sample and writes its row, in the plan's units.
fn solve_group() {
    let rod = load();
    //@if !SEARCH
    //@if !ANCHORED
    let rest = rest_slope(rod);
    //@end
    //@end
    var end: PathEnd;
    var check: Check;
    var tip: Tip;
    var delta = vec3<f32>();
    var size = 0.0;
    var w = mat3x3<f32>();
    var w_inverse = mat3x3<f32>();
    var index = 0.0;
    var stable = false;
    var converged = false;
    var code = STATUS_PENDING;
    for (var first = settings.first_path; first <= settings.last_path; first = end.path + 1u) {
        //@if SEARCH
        end = search(rod);
        //@else
        //@if ANCHORED
        end = anchored_end();
        if !end.reached { break; }
        //@else
        end = follow_path(rod, first, rest);
        //@end
        //@end
        var moved = true;
        for (var moves = true; moved; moves = false) {
            check = chord_steps(rod, &end, moves);
            moved = false;
            //@if ANCHORED
            if !end.reached { break; }
            //@end
            if !moves { break; }
            var moving = end.reached;
            converged = false;
            for (var i = 0u; i < NEWTON_LIMIT; i++) {
                start_columns(rod, end.m0);
                tip = shoot(FINE, rod, 1.0, end.m0, ANSWER_COLUMNS, true);
                w = tip_moment_columns(tip, BY_MOMENT);
                w_inverse = inverse(w);
                delta = newton_step(rod, tip, w_inverse);
                size = length(delta);
                let tolerance = settings.tolerance * (1.0 + length(end.m0));
                let first_order = margin(w_inverse) * settings.first_order_tolerance;
                let is_still = length(columns[BY_MOMENT].w * delta) < settings.turn_tolerance;
                converged = end.reached && size < max(tolerance, first_order) && is_still;
                if moving { end.passes = end.passes + 1.0; }
                moving = moving && !converged && size < FINE_TRUST;
                if i + 1u == NEWTON_LIMIT || !moving { break; }
                end.m0 = end.m0 + delta;
                moved = true;
            }
        }
        //@if ANCHORED
        if !end.reached { break; }
        //@end
        index = stability_index(tip);
        //@if !ROTATES
        //@if GUARDS
        if converged && index >= 0.5 { index = whole_index(rod, end.m0); }
        //@end
        //@end
        let within_reach = is_finite(length(tip.p)) && length(tip.p) < REACH;
        let certain = end.path == SEARCH || index < 0.5 || is_sharp(w);
        converged = converged && within_reach && certain;
        stable = index < 0.5;
        //@if TIP_MOMENT
        // Under a dead tip moment det W tells whether the rod has diverged; few steps to get there do not tell. S6
        if end.path != RAMP && has_dead_moment(rod) { stable = stable || 0.0 < dot(w[0], cross(w[1], w[2])); }
        //@end
        code = status_codes(end, converged, stable, is_finite(size) && within_reach);
        if code != STATUS_PENDING { break; }
    }
    //@if ANCHORED
    // Another kernel writes its row.
    if code == STATUS_PENDING {
        store_status(code);
        return;
    }
    //@end
    let answered = answer(rod, check, tip, delta, columns[BY_MOMENT], end.m0, w, w_inverse);
    let residual = length(w * (answered.m0 - end.m0));

    store_vector(TIP_POSITION_COLUMN, answered.p);
    store_vector(TIP_D1_COLUMN, answered.d1);
    store_vector(TIP_TANGENT_COLUMN, answered.t);
    store_vector(BASE_MOMENT_COLUMN, answered.m0);
    store(RESIDUAL_COLUMN, residual);
    store(STABILITY_MARGIN_COLUMN, margin(w_inverse) * select(-1.0, 1.0, stable));
    store(STABILITY_INDEX_COLUMN, select(NO_EQUILIBRIUM, index, converged));
    store(ITERATIONS_COLUMN, end.passes);
    store(LOAD_FRACTION_COLUMN, end.history.lambda);
    store(LOAD_FRACTION_ERROR_COLUMN, 1.0);
    store(ERROR_ESTIMATE_COLUMN, answered.error);
    store(DERIVATIVE_ERROR_COLUMN, answered.derivative_error);
    write_derivatives(rod, end.m0, tip);
    store_status(code);
}

// Writes the rows of the derivatives, by forward columns or by reciprocity.
fn write_derivatives(rod: Rod, m0: vec3<f32>, tip: Tip) {
    //@if FORWARD
    write_forward_rows(rod, m0, tip);
    //@end
    //@if RECIPROCITY
    write_rows(rod, m0, new_responses(rod, tip));
    //@end
}

// The columns of a pass at the base: by base moment, and what the derivatives need.
fn start_columns(rod: Rod, m0: vec3<f32>) {
    columns[BY_MOMENT] = moment_columns();
    //@if FORWARD
    columns[FORWARD] = forward_columns(rod, load_sources(0u), m0);
    //@end
    //@if RECIPROCITY
    columns[BY_FORCE] = force_columns();
    //@end
    //@if ROTATES
    columns[BY_ROTATION] = rotation_columns(m0);
    //@end
}

// Status of the sample, as a code.
fn status_codes(end: PathEnd, converged: bool, stable: bool, finite: bool) -> u32 {
    let unsolved = select(STATUS_NON_FINITE, STATUS_NOT_CONVERGED, finite);
    if end.path == SEARCH {
        return select(unsolved, select(STATUS_UNSTABLE, STATUS_OK, stable), end.reached && converged);
    }
    //@if ANCHORED
    if end.path == ANCHORED { return select(STATUS_PENDING, STATUS_OK, converged && stable); }
    //@end
    if end.path == RAMP {
        return select(STATUS_PENDING, select(STATUS_OK, STATUS_RAMPED, end.ramped), converged && stable);
    }
    let lost = select(select(unsolved, STATUS_FOLD, end.fold), STATUS_STEP_LIMIT, end.exhausted);
    let done = select(STATUS_UNSTABLE, STATUS_RAMPED, stable);
    return select(lost, select(unsolved, done, converged), end.reached);
}

// Whether a number is neither infinite nor undefined; by its bits, whatever the compiler assumes.
fn is_finite(a: f32) -> bool {
    //@if F64
    return abs(a) < 1e300;
    //@else
    return (bitcast<u32>(a) & 0x7f800000u) != 0x7f800000u;
    //@end
}

@compute @workgroup_size(WORKGROUP)
fn solve(@builtin(global_invocation_id) id: vec3<u32>) {
    //@if ANCHORED
    if select_sample(id.x) {
        solve_group();
        leave_pending(id.x);
    }
    //@else
    //@if ANCHORS
    if select_sample(left_sample(id.x)) { solve_group(); }
    //@else
    if select_sample(id.x) { solve_group(); }
    //@end
    //@end
}
