// The buffer by which one kernel of a dispatch hands a sample to the next: the end of its path, and the tip of the check pass.

// Numbers of a sample.
const HANDOVER_COUNT: u32 = 34u; //@spec
const HANDED_MOMENT: u32 = 0u;
const HANDED_INVERSE: u32 = 3u;
const HANDED_PASSES: u32 = 12u;
const HANDED_LOAD: u32 = 13u;
const HANDED_FLAGS: u32 = 14u;
const HANDED_CHECK: u32 = 15u;
const HANDED_REST: u32 = 30u;

// The next step of a sample: the check pass, after chord steps or without them; a path from rest, the ramp or the guarded one.
const NEXT_CHORD: u32 = 0u;
const NEXT_CHECK: u32 = 1u;
const NEXT_RAMP: u32 = 2u;
const NEXT_GUARDED: u32 = 3u;

@group(0) @binding(7) var<storage, read_write> handover: array<f32>;

fn handover_at(column: u32) -> u32 {
    // Outputs have the same blocks and lanes.
    let block = output_base / (OUTPUT_COUNT * BLOCK);
    return (block * HANDOVER_COUNT + column) * BLOCK + output_base % BLOCK;
}

fn hand(column: u32, value: f32) {
    handover[handover_at(column)] = value;
}

fn hand_vector(column: u32, value: vec3<f32>) {
    let at = handover_at(column);
    handover[at] = value.x;
    handover[at + BLOCK] = value.y;
    handover[at + 2u * BLOCK] = value.z;
}

fn handed(column: u32) -> f32 {
    return handover[handover_at(column)];
}

fn handed_vector(column: u32) -> vec3<f32> {
    let at = handover_at(column);
    return vec3<f32>(handover[at], handover[at + BLOCK], handover[at + 2u * BLOCK]);
}

fn bit(holds: bool, value: u32) -> u32 {
    return select(0u, value, holds);
}

// Hands over how the path ended, and the next step.
fn hand_flags(end: PathEnd, next: u32) {
    let ended = bit(end.reached, 1u) + bit(end.ramped, 2u) + bit(end.exhausted, 4u) + bit(end.fold, 8u);
    hand(HANDED_FLAGS, f32(ended + 16u * next + 64u * end.path));
}

fn handed_next() -> u32 {
    return (u32(handed(HANDED_FLAGS)) / 16u) % 4u;
}

// Hands over the slope at rest.
fn hand_rest(rest: RestSlope) {
    hand_vector(HANDED_REST, rest.m0);
    hand(HANDED_REST + 3u, rest.largest);
}

fn handed_rest() -> RestSlope {
    return RestSlope(handed_vector(HANDED_REST), handed(HANDED_REST + 3u));
}

// Hands over the end of a path, and the next step.
fn hand_end(end: PathEnd, next: u32) {
    hand_vector(HANDED_MOMENT, end.m0);
    hand_vector(HANDED_INVERSE, end.inverse[0]);
    hand_vector(HANDED_INVERSE + 3u, end.inverse[1]);
    hand_vector(HANDED_INVERSE + 6u, end.inverse[2]);
    hand(HANDED_PASSES, end.passes);
    hand(HANDED_LOAD, end.history.lambda);
    hand_flags(end, next);
}

// The end of the path, without its inverse.
fn handed_end() -> PathEnd {
    var end: PathEnd;
    let flags = u32(handed(HANDED_FLAGS));
    end.m0 = handed_vector(HANDED_MOMENT);
    end.passes = handed(HANDED_PASSES);
    end.history.lambda = handed(HANDED_LOAD);
    end.reached = (flags & 1u) != 0u;
    end.ramped = (flags & 2u) != 0u;
    end.exhausted = (flags & 4u) != 0u;
    end.fold = (flags & 8u) != 0u;
    end.path = flags / 64u;
    return end;
}

fn handed_inverse() -> mat3x3<f32> {
    return mat3x3<f32>(
        handed_vector(HANDED_INVERSE), handed_vector(HANDED_INVERSE + 3u), handed_vector(HANDED_INVERSE + 6u));
}

fn hand_check(check: Check) {
    hand_vector(HANDED_CHECK, check.m0);
    hand_vector(HANDED_CHECK + 3u, check.tip.p);
    hand_vector(HANDED_CHECK + 6u, check.tip.d1);
    hand_vector(HANDED_CHECK + 9u, check.tip.t);
    hand_vector(HANDED_CHECK + 12u, check.tip.m);
}

// Base moment and tip of the check pass. The force at the tip is not handed over.
fn handed_check() -> Check {
    var check: Check;
    check.m0 = handed_vector(HANDED_CHECK);
    check.tip.p = handed_vector(HANDED_CHECK + 3u);
    check.tip.d1 = handed_vector(HANDED_CHECK + 6u);
    check.tip.t = handed_vector(HANDED_CHECK + 9u);
    check.tip.m = handed_vector(HANDED_CHECK + 12u);
    return check;
}
