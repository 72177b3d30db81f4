// The second kernel of three: chord steps onto the fine grid and the check, from the end of a path or from anchors. R4
// crates/core/src/cpu/equilibrium/chord.rs

@compute @workgroup_size(WORKGROUP)
fn approach(@builtin(global_invocation_id) id: vec3<u32>) {
    let sample = taken_sample(id.x);
    if !select_sample(sample) { return; }
    //@if ANCHORED
    var end = anchored_end();
    var check: Check;
    if end.reached { check = chord_steps(load(), &end, true); }
    hand_end(end, select(NEXT_RAMP, NEXT_CHORD, end.reached));
    if !end.reached {
        leave(sample, false);
        return;
    }
    //@else
    let next = handed_next();
    if next != NEXT_CHORD && next != NEXT_CHECK { return; }
    var end = handed_end();
    end.inverse = handed_inverse();
    let check = chord_steps(load(), &end, next == NEXT_CHORD);
    hand_vector(HANDED_MOMENT, end.m0);
    hand(HANDED_PASSES, end.passes);
    //@end
    hand_check(check);
}
