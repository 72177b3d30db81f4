// The third kernel of three: one pass with all columns, and the row of the sample. What Newton's method would move further,
// and what needs another path, is left to another round. J5
// crates/core/src/cpu/equilibrium/solve.rs

// Whether the sample is done; else what comes next is told.
fn conclude(is_last: bool) -> bool {
    let next = handed_next();
    if (next == NEXT_RAMP || next == NEXT_GUARDED) && !is_last { return false; }
    let rod = load();
    var end = handed_end();
    let found = find(rod, end);
    if end.reached { end.passes = end.passes + 1.0; }
    if moves_on(end, found) && !is_last {
        hand_vector(HANDED_MOMENT, end.m0 + found.delta);
        hand(HANDED_PASSES, end.passes);
        hand_flags(end, NEXT_CHECK);
        return false;
    }
    var verdict = judge(rod, end, found);
    if verdict.code == STATUS_PENDING {
        if !is_last {
            var then = select(NEXT_GUARDED, NEXT_RAMP, end.path == ANCHORED);
            //@if !ROTATES
            //@if !GUARDS
            // Its index is counted by all columns in the next round.
            if found.converged && verdict.index >= 0.5 && end.path == RAMP { then = NEXT_CHECK; }
            //@end
            //@end
            hand_flags(end, then);
            return false;
        }
        // The second attempt starts from rest.
        verdict.code = STATUS_NOT_CONVERGED;
    }
    write_row(rod, end, handed_check(), found, verdict);
    return true;
}

@compute @workgroup_size(WORKGROUP)
fn answer_sample(@builtin(global_invocation_id) id: vec3<u32>) {
    let sample = taken_sample(id.x);
    if select_sample(sample) {
        if !conclude(!may_leave()) { leave(sample, handed_next() == NEXT_GUARDED); }
    }
}
