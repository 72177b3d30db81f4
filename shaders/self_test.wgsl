// Known answers that a driver must reproduce. src/gpu/self_test.rs compares them.

@group(0) @binding(0) var<storage, read> operands: array<f32>;
@group(0) @binding(1) var<storage, read_write> answers: array<f32>;

// A step of a linear congruential generator: no compiler knows its thousandth power.
fn scramble(state: u32) -> u32 {
    return state * 1664525u + 1013904223u;
}

// `a` again, through a zero that no compiler knows: bars it from reordering sums.
fn guarded(a: f32, zero: u32) -> f32 {
    return bitcast<f32>(bitcast<u32>(a) ^ zero);
}

@compute @workgroup_size(1)
fn self_test(@builtin(workgroup_id) workgroup: vec3<u32>) {
    let steps = u32(operands[6]);
    var state = 1u;
    var count = 0u;
    if workgroup.x == 1u {
        for (var i = 0u; i < steps / 250u; i++) {
            for (var j = 0u; j < 250u; j++) {
                state = scramble(state);
                count += 1u;
            }
        }
        answers[11] = f32(count);
        answers[12] = f32(state >> 8u);
        return;
    }
    for (var i = 0u; i < steps; i++) {
        state = scramble(state);
        count += 1u;
    }
    answers[9] = f32(count);
    answers[10] = f32(state >> 8u);

    let one = operands[0];
    let three = operands[1];
    let two = operands[2];
    let tiny = operands[3];
    let angle = operands[4];
    let zero = bitcast<u32>(operands[5]);
    let small = operands[7];
    answers[0] = one / three;
    answers[1] = sqrt(two);
    answers[2] = inverseSqrt(two);
    answers[3] = fma(one + tiny, one - tiny, -one);
    answers[4] = sin(angle);
    answers[5] = cos(angle);
    answers[6] = atan2(one, two);

    let sum = one + small;
    let back = sum - one;
    answers[7] = (one - (sum - back)) + (small - back);
    let guarded_sum = guarded(one + small, zero);
    let guarded_back = guarded(guarded_sum - one, zero);
    let guarded_rest = guarded(guarded_sum - guarded_back, zero);
    answers[8] = guarded(one - guarded_rest, zero) + guarded(small - guarded_back, zero);
}
