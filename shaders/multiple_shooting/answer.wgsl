// Answers by nodes: the path from rest, Newton's method on ever finer steps, and the row of each rod. N4
// crates/core/src/cpu/multiple_shooting/answer.rs

const COLUMN_NOISE: f32 = 0.0; //@spec
const NODE_FLOOR: f32 = 0.0; //@spec
const NODE_COLUMNS_GOOD: f32 = 0.0; //@spec
const NODE_CORRECTIONS: f32 = 0.0; //@spec
const NODE_GOOD: f32 = 0.0; //@spec
const NODE_ENOUGH: f32 = 0.0; //@spec
const NODE_NEARBY: f32 = 0.0; //@spec
const NODE_ROUND_OFF: f32 = 0.0; //@spec
const NODE_LEVELS: u32 = 1u; //@spec
const NODE_STEPS: array<u32, 1> = array<u32, 1>(1u); //@spec
const REACH: f32 = 0.0; //@spec
const NO_EQUILIBRIUM: f32 = 0.0; //@spec

// How far a sample is.
const AT_REST: u32 = 0u;
const ON_PATH: u32 = 1u;
const IN_NEWTON: u32 = 2u;
const TO_COMPARE: u32 = 3u;
const TO_COLLECT: u32 = 4u;
const DONE: u32 = 5u;

// Takes the sample one turn further: a pass over all intervals, and what follows from it.
fn solve_nodes() {
    let stage = u32(held(STAGE));
    let rod = load();
    interval_count = u32(held(INTERVALS));
    var lambda = 1.0;
    var steps = memory_settings.path_steps;
    var what = TRANSFERS;
    if stage == AT_REST {
        hold(PASSES, 0.0);
        hold(LEVEL, 0.0);
        hold(THREE, 0.0);
        hold(LAMBDA, 0.0);
        if !cut(rod, memory_settings.spacing) {
            lose(STATUS_NOT_CONVERGED);
            return;
        }
        hold_node(interval_at(0u) + NODE, Node(rod.d1, rod.t, vec3<f32>()));
        what = REST;
        lambda = 0.0;
    } else if stage == ON_PATH {
        lambda = held(GOAL);
    } else {
        steps = node_steps(u32(held(LEVEL)));
        //@if RECIPROCITY
        if stage == TO_COMPARE { what = DRIVING; }
        if stage == TO_COLLECT { what = COLLECTING; }
        //@else
        if stage == TO_COLLECT { what = DRIVING; }
        //@end
    }
    pass_nodes(rod, lambda, select(FINE, COARSE, stage <= ON_PATH), steps, what);
    var size = 0.0;
    if stage != AT_REST && stage != TO_COLLECT { size = newton_step(rod, lambda); }
    // What a load step that is rejected does to the nodes, its successor undoes.
    if stage == ON_PATH || stage == IN_NEWTON { take_step(); }
    store_status(STATUS_PENDING);
    switch stage {
        case AT_REST: {
            start_path();
            hold(STAGE, f32(ON_PATH));
        }
        case ON_PATH: {
            switch follow_nodes(rod, size) {
                case GOES_ON: {}
                case REACHED: {
                    hold(STAGE, f32(IN_NEWTON));
                    hold(NEWTON_STEPS, 0.0);
                }
                case AT_FOLD: { lose(STATUS_FOLD); }
                case EXHAUSTED: { lose(STATUS_STEP_LIMIT); }
                default: { lose(STATUS_NOT_CONVERGED); }
            }
        }
        case IN_NEWTON: { balance(size); }
        case TO_COMPARE: { answer(rod); }
        default: { finish_rows(rod); }
    }
}

fn node_steps(level: u32) -> u32 {
    var steps = 0u;
    for (var k = 0u; k < NODE_LEVELS; k++) { //@unroll
        steps = select(steps, NODE_STEPS[k], level == k);
    } //@end
    return steps;
}

// Ends a sample without an equilibrium.
fn lose(code: u32) {
    store(STABILITY_INDEX_COLUMN, NO_EQUILIBRIUM);
    store(ITERATIONS_COLUMN, held(PASSES));
    store(LOAD_FRACTION_COLUMN, held(LAMBDA));
    store(LOAD_FRACTION_ERROR_COLUMN, 1.0);
    store_status(code);
    hold(STAGE, f32(DONE));
}

// Takes ever more steps until tip and columns no longer change, and writes the row.
fn answer(rod: Rod) {
    let by_tip = margin(w_inverse);
    let index = node_index;
    //@if LOAD_WITHOUT_ENERGY
    factor_symmetric();
    //@end
    let stability = node_margin(by_tip);
    //@if LOAD_WITHOUT_ENERGY
    factor(hat(rod.l_tip * 0.5));
    //@end
    let finer = tip_response(rod);
    let level = u32(held(LEVEL));
    let is_converged = held(IS_CONVERGED) > 0.5;
    if level > 0u {
        var error = 0.0;
        var columns_error = 0.0;
        difference(finer, rod.length, &error, &columns_error);
        let is_good = error < NODE_GOOD && columns_error < NODE_COLUMNS_GOOD;
        if is_good || !is_converged || level + 1u == NODE_LEVELS {
            let p = length(rod_tip.p);
            if !(is_converged && index < 0.5 && is_finite(p) && p < REACH && is_finite(error)) {
                lose(STATUS_NOT_CONVERGED);
                return;
            }
            let noise = round_off();
            // Responses to a tip moment do not tell the error of an integral over a short taper; the measured floor does.
            let floor = select(0.0, NODE_FLOOR * settings.derivative_floor, settings.derivative_floor < 1.0);
            let known = max(columns_error, floor);
            write_row(rod, error + noise, known + noise * COLUMN_NOISE, stability, index);
            return;
        }
    }
    hold_vector(COARSER_P, rod_tip.p);
    hold_vector(COARSER_D1, rod_tip.d1);
    hold_vector(COARSER_T, rod_tip.t);
    hold_matrix(COARSER_W, finer.w);
    hold_matrix(COARSER_DP, finer.dp);
    hold(LEVEL, f32(level + 1u));
    hold(NEWTON_STEPS, 0.0);
    hold(STAGE, f32(IN_NEWTON));
}

// Newton's method, a step a turn; then what a row needs is looked at.
fn balance(size: f32) {
    let count = held(NEWTON_STEPS) + 1.0;
    let converged = size < NODE_ENOUGH;
    let moving = !converged && size < NODE_NEARBY && count < NODE_CORRECTIONS;
    hold(PASSES, held(PASSES) + 1.0);
    hold(NEWTON_STEPS, count);
    hold(IS_CONVERGED, select(0.0, 1.0, converged));
    if !moving { hold(STAGE, f32(TO_COMPARE)); }
}

// The largest change of the tip, over the rod's length or in radians, and that of the columns, relative to them.
fn difference(finer: TipChange, rod_length: f32, tip: ptr<function, f32>, columns: ptr<function, f32>) {
    let shift = length(rod_tip.p - held_vector(COARSER_P)) / rod_length;
    let turned = max(length(rod_tip.d1 - held_vector(COARSER_D1)), length(rod_tip.t - held_vector(COARSER_T)));
    *tip = max(shift, turned);
    *columns = max(
        sqrt(squared_norm(finer.w - held_matrix(COARSER_W)) / squared_norm(finer.w)),
        sqrt(squared_norm(finer.dp - held_matrix(COARSER_DP)) / squared_norm(finer.dp)),
    );
}

// What rounding does: the larger the moments, the more it turns.
fn round_off() -> f32 {
    var largest = 0.0;
    for (var i = 0u; i < interval_count; i++) {
        largest = max(largest, length(held_vector(interval_at(i) + NODE + 6u)));
    }
    return (1.0 + largest) * (1.0 + sqrt(f32(interval_count))) * (NODE_ROUND_OFF * EPSILON);
}

// Writes the row of an equilibrium, but for its derivatives.
fn write_row(rod: Rod, error: f32, derivative_error: f32, stability: f32, index: f32) {
    store_vector(TIP_POSITION_COLUMN, rod_tip.p);
    store_vector(TIP_D1_COLUMN, rod_tip.d1);
    store_vector(TIP_TANGENT_COLUMN, rod_tip.t);
    store_vector(BASE_MOMENT_COLUMN, held_vector(interval_at(0u) + NODE + 6u));
    store(RESIDUAL_COLUMN, residual(rod.l_tip));
    store(ERROR_ESTIMATE_COLUMN, error);
    store(DERIVATIVE_ERROR_COLUMN, derivative_error);
    store(STABILITY_MARGIN_COLUMN, stability);
    store(STABILITY_INDEX_COLUMN, index);
    store(ITERATIONS_COLUMN, held(PASSES));
    store(LOAD_FRACTION_COLUMN, 1.0);
    store(LOAD_FRACTION_ERROR_COLUMN, 1.0);
    //@if DRIVES
    hold(STAGE, f32(TO_COLLECT));
    //@else
    store_status(STATUS_RAMPED);
    hold(STAGE, f32(DONE));
    //@end
}

// Writes the rows of the derivatives; forward columns, three a turn.
fn finish_rows(rod: Rod) {
    write_node_rows(rod);
    //@if FORWARD
    hold(THREE, held(THREE) + 1.0);
    if held(THREE) < f32(FORWARD_THREES) { return; }
    //@end
    store_status(STATUS_RAMPED);
    hold(STAGE, f32(DONE));
}

@compute @workgroup_size(WORKGROUP)
fn advance(@builtin(global_invocation_id) id: vec3<u32>) {
    if !select_sample(id.x) { return; }
    sample_at = id.x;
    if u32(held(STAGE)) == DONE { return; }
    solve_nodes();
    if u32(held(STAGE)) != DONE { atomicAdd(&under_way, 1u); }
}
