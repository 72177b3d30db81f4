// What a sample in a field that varies holds in its memory. src/gpu/shader/varying.rs owns the sizes.

// Numbers of a sample, and of each of its intervals.
const HEAD_NUMBERS: u32 = 147u; //@spec
const INTERVAL_NUMBERS: u32 = 145u; //@spec

// Of a sample: how far it is, whether with care, where it stands on its path.
const STAGE: u32 = 0u;
const CARE: u32 = 1u;
const LAMBDA: u32 = 2u;
const GOAL: u32 = 3u;
const LOAD_STEP: u32 = 4u;
const LAST_SIZE: u32 = 5u;
const FIRST_SIZE: u32 = 6u;
const CORRECTIONS_MADE: u32 = 7u;
const PASSES: u32 = 8u;
const WEAKEST: u32 = 9u;
const LAST_MARGIN: u32 = 10u;
// Of the last load step that was rejected: it lost stability, it came too near a magnet.
const IS_UNSTABLE: u32 = 11u;
const IS_TOO_NEAR: u32 = 12u;
// Whether the next pass has transfers, from which stability follows.
const LOOKS: u32 = 13u;
// Newton's method for the answer: steps made, the longest that is trusted, whether the last inverse serves on.
const NEWTON_STEPS: u32 = 14u;
const BOUND: u32 = 15u;
const IS_CHORD: u32 = 16u;
const IS_CONVERGED: u32 = 17u;
// The three of parameters in hand.
const THREE: u32 = 18u;
// Force and moment at the base: on trial, accepted last; how they grow with the load.
const TRIAL: u32 = 19u;
const ACCEPTED: u32 = 25u;
const SECANT: u32 = 31u;
// Of dr/d(n0, m0), and how the tip's pose follows the load at the base.
const INVERSE: u32 = 37u;
const POSE: u32 = 73u;
// The tip on twice the steps.
const CHECKED: u32 = 109u;
// How the curvature beyond rigid segments follows the load at the base.
const FIRST_BY_LOAD: u32 = 124u;
// At the load accepted last: the tip, and how far it may move before the rod is too near to a magnet.
const LAST_LEEWAY: u32 = 142u;
const LAST_TIP: u32 = 143u;
const LAST_DETERMINANT: u32 = 146u;

// Of an interval: whether it bends, and how its end follows its start.
const BENDS: u32 = 0u;
const TRANSFER_A: u32 = 1u;
const TRANSFER_B: u32 = 37u;
const TRANSFER_C: u32 = 73u;
const TRANSFER_D: u32 = 109u;

const_assert LAST_DETERMINANT < HEAD_NUMBERS;
const_assert TRANSFER_D + 36u <= INTERVAL_NUMBERS;

// Intervals of the last pass with transfers.
var<private> interval_count: u32;

fn interval_at(i: u32) -> u32 {
    return HEAD_NUMBERS + i * INTERVAL_NUMBERS;
}

fn held_pair(at: u32) -> Pair {
    return Pair(held_vector(at), held_vector(at + 3u));
}

fn hold_pair(at: u32, pair: Pair) {
    hold_vector(at, pair.first);
    hold_vector(at + 3u, pair.last);
}

fn held_mat6(at: u32) -> Mat6 {
    return Mat6(held_matrix(at), held_matrix(at + 9u), held_matrix(at + 18u), held_matrix(at + 27u));
}

fn hold_mat6(at: u32, m: Mat6) {
    hold_matrix(at, m.a);
    hold_matrix(at + 9u, m.b);
    hold_matrix(at + 18u, m.c);
    hold_matrix(at + 27u, m.d);
}

fn held_state(at: u32) -> State {
    let m = held_vector(at + 9u);
    return State(held_vector(at), held_vector(at + 3u), held_vector(at + 6u), m, held_vector(at + 12u));
}

fn hold_state(at: u32, state: State) {
    hold_vector(at, state.p);
    hold_vector(at + 3u, state.d1);
    hold_vector(at + 6u, state.t);
    hold_vector(at + 9u, state.m);
    hold_vector(at + 12u, state.n);
}
