// The pass with all columns at the end of a path, stability and status of the equilibrium, and the row of a sample. R4, J5
// crates/core/src/cpu/equilibrium/solve.rs

const NEWTON_LIMIT: u32 = 0u; //@spec
const FINE_TRUST: f32 = 0.0; //@spec
const REACH: f32 = 0.0; //@spec
const NO_EQUILIBRIUM: f32 = 0.0; //@spec

// Result of the pass with all columns; `columns` holds the columns themselves.
struct Found {
    tip: Tip,
    w: mat3x3<f32>,
    w_inverse: mat3x3<f32>,
    // Newton's step, and its length.
    delta: vec3<f32>,
    size: f32,
    // The step is so short that it does to first order.
    converged: bool,
}

// Stability and status of an equilibrium.
struct Verdict {
    index: f32,
    stable: bool,
    converged: bool,
    code: u32,
}

// One pass on the fine grid with all columns.
fn find(rod: Rod, end: PathEnd) -> Found {
    var found: Found;
    start_columns(rod, end.m0);
    found.tip = shoot(FINE, rod, 1.0, end.m0, ANSWER_COLUMNS, true);
    found.w = tip_moment_columns(found.tip, BY_MOMENT);
    found.w_inverse = inverse(found.w);
    found.delta = newton_step(rod, found.tip, found.w_inverse);
    found.size = length(found.delta);
    let tolerance = settings.tolerance * (1.0 + length(end.m0));
    let first_order = margin(found.w_inverse) * settings.first_order_tolerance;
    let is_still = length(columns[BY_MOMENT].w * found.delta) < settings.turn_tolerance;
    found.converged = end.reached && found.size < max(tolerance, first_order) && is_still;
    return found;
}

// Whether Newton's method takes another step.
fn moves_on(end: PathEnd, found: Found) -> bool {
    return end.reached && !found.converged && found.size < FINE_TRUST;
}

// Stability and status of the equilibrium that the pass with all columns found.
fn judge(rod: Rod, end: PathEnd, found: Found) -> Verdict {
    var verdict: Verdict;
    verdict.index = stability_index(found.tip);
    //@if !ROTATES
    //@if GUARDS
    if found.converged && verdict.index >= 0.5 { verdict.index = whole_index(rod, end.m0); }
    //@end
    //@end
    let within_reach = is_finite(length(found.tip.p)) && length(found.tip.p) < REACH;
    let certain = end.path == SEARCH || verdict.index < 0.5 || is_sharp(found.w);
    verdict.converged = found.converged && within_reach && certain;
    verdict.stable = verdict.index < 0.5;
    //@if LOAD_WITHOUT_ENERGY
    // Under a dead tip moment det W tells whether the rod has diverged; few steps to get there do not tell. S6
    if end.path != RAMP && has_no_energy(rod) {
        verdict.stable = verdict.stable || 0.0 < dot(found.w[0], cross(found.w[1], found.w[2]));
    }
    //@end
    verdict.code = status_codes(end, verdict.converged, verdict.stable, is_finite(found.size) && within_reach);
    return verdict;
}

// Writes the row of a sample, in the plan's units.
fn write_row(rod: Rod, end: PathEnd, check: Check, found: Found, verdict: Verdict) {
    let answered = answer(rod, check, found.tip, found.delta, columns[BY_MOMENT], end.m0, found.w, found.w_inverse);
    let residual = length(found.w * (answered.m0 - end.m0));

    store_vector(TIP_POSITION_COLUMN, answered.p);
    store_vector(TIP_D1_COLUMN, answered.d1);
    store_vector(TIP_TANGENT_COLUMN, answered.t);
    store_vector(BASE_MOMENT_COLUMN, answered.m0);
    store(RESIDUAL_COLUMN, residual);
    store(STABILITY_MARGIN_COLUMN, margin(found.w_inverse) * select(-1.0, 1.0, verdict.stable));
    store(STABILITY_INDEX_COLUMN, select(NO_EQUILIBRIUM, verdict.index, verdict.converged));
    store(ITERATIONS_COLUMN, end.passes);
    store(LOAD_FRACTION_COLUMN, end.history.lambda);
    store(LOAD_FRACTION_ERROR_COLUMN, 1.0);
    store(ERROR_ESTIMATE_COLUMN, answered.error);
    store(DERIVATIVE_ERROR_COLUMN, answered.derivative_error);
    write_derivatives(rod, end.m0, found.tip);
    store_status(verdict.code);
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
    if end.path == ANCHORED { return select(STATUS_PENDING, STATUS_OK, converged && stable); }
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
