// The turns of a sample in a field that varies: which comes next, and what ends them.

// How far a sample is.
const AT_REST: u32 = 0u;
const ON_PATH: u32 = 1u;
const IN_NEWTON: u32 = 2u;
const TO_CHECK: u32 = 3u;
const TO_ANSWER: u32 = 4u;
const TO_DIFFERENTIATE: u32 = 5u;
const DONE: u32 = 6u;

// Ends a path that did not arrive; one without care is followed again with it.
fn lose(outcome: u32) {
    if held(CARE) < 0.5 {
        restart();
        return;
    }
    store(STABILITY_INDEX_COLUMN, NO_EQUILIBRIUM);
    store(ITERATIONS_COLUMN, held(PASSES));
    store(LOAD_FRACTION_COLUMN, held(LAMBDA));
    store(LOAD_FRACTION_ERROR_COLUMN, 1.0);
    var code = STATUS_NOT_CONVERGED;
    if outcome == EXHAUSTED { code = STATUS_STEP_LIMIT; }
    if outcome == AT_FOLD { code = STATUS_FOLD; }
    if outcome == TOO_NEAR { code = STATUS_TOO_NEAR_MAGNET; }
    store_status(code);
    hold(STAGE, f32(DONE));
}

fn restart() {
    hold(CARE, 1.0);
    hold(PASSES, 0.0);
    hold(STAGE, f32(AT_REST));
}

// Writes the rows of three derivatives a turn.
fn finish_rows(rod: Rod, inverse: Mat6) {
    //@if FORWARD
    pose = held_mat6(POSE);
    write_rows(rod, inverse);
    hold(THREE, held(THREE) + 1.0);
    if held(THREE) < f32(FORWARD_THREES) { return; }
    //@end
    store_status(select(STATUS_RAMPED, STATUS_UNSTABLE, held(IS_UNSTABLE) > 0.5));
    hold(STAGE, f32(DONE));
}

@compute @workgroup_size(WORKGROUP)
fn advance(@builtin(global_invocation_id) id: vec3<u32>) {
    if !select_sample(id.x) { return; }
    sample_at = id.x;
    if u32(held(STAGE)) == DONE { return; }
    solve_varying();
    if u32(held(STAGE)) != DONE { atomicAdd(&under_way, 1u); }
}
