// The boundary value problem in one kernel: a path, Newton's method on the fine grid, and the row of each sample. R4
// crates/core/src/cpu/equilibrium/solve.rs

// Solves one sample and writes its row; false where it is left to another kernel.
fn solve_group() -> bool {
    let rod = load();
    //@if !SEARCH
    //@if !ANCHORED
    let rest = rest_slope(rod);
    //@end
    //@end
    var end: PathEnd;
    var check: Check;
    var found: Found;
    var verdict: Verdict;
    for (var first = FIRST_PATH; first <= LAST_PATH; first = end.path + 1u) {
        //@if SEARCH
        end = search(rod);
        //@else
        //@if ANCHORED
        end = anchored_end();
        if !end.reached { return false; }
        //@else
        end = follow_path(rod, first, rest);
        //@end
        //@end
        var moved = true;
        for (var moves = true; moved; moves = false) {
            check = chord_steps(rod, &end, moves);
            moved = false;
            //@if ANCHORED
            if !end.reached { return false; }
            //@end
            if !moves { break; }
            var moving = end.reached;
            for (var i = 0u; i < NEWTON_LIMIT; i++) {
                found = find(rod, end);
                if moving { end.passes = end.passes + 1.0; }
                moving = moving && moves_on(end, found);
                if i + 1u == NEWTON_LIMIT || !moving { break; }
                end.m0 = end.m0 + found.delta;
                moved = true;
            }
        }
        verdict = judge(rod, end, found);
        if verdict.code != STATUS_PENDING { break; }
    }
    //@if ANCHORED
    if verdict.code == STATUS_PENDING { return false; }
    //@end
    write_row(rod, end, check, found, verdict);
    return true;
}

@compute @workgroup_size(WORKGROUP)
fn solve(@builtin(global_invocation_id) id: vec3<u32>) {
    let sample = taken_sample(id.x);
    if select_sample(sample) {
        if !solve_group() { leave(sample, false); }
    }
}
