// The first kernel of three: follows a path from rest and tells where it ended. R4
// crates/core/src/cpu/equilibrium/path.rs

@compute @workgroup_size(WORKGROUP)
fn follow(@builtin(global_invocation_id) id: vec3<u32>) {
    //@if GUARDS
    // The guarded path of samples whose ramp was lost.
    if !select_sample(taken_with_care(id.x)) { return; }
    hand_end(follow_path(load(), FIRST_PATH, handed_rest()), NEXT_CHORD);
    //@else
    if !select_sample(taken_sample(id.x)) { return; }
    //@if ANCHORS
    if handed_next() != NEXT_RAMP { return; }
    //@end
    let rod = load();
    let rest = rest_slope(rod);
    let end = follow_path(rod, FIRST_PATH, rest);
    hand_rest(rest);
    hand_end(end, select(NEXT_GUARDED, NEXT_CHORD, end.reached));
    //@end
}
