// The nodes of a rod, and a pass over all their intervals. src/lanes/nodes/state.rs

// What a pass is for: the rod at rest, Newton's method, what drives the intervals as well, the traces of responses.
const REST: u32 = 0u;
const TRANSFERS: u32 = 1u;
const DRIVING: u32 = 2u;
const COLLECTING: u32 = 3u;

// The rod's end, its position summed over the intervals.
var<private> rod_tip: Tip;

// A pass over every interval, of so many steps: nodes at rest, or defects, transfers, tip and what else it is for.
//
// All passes are one call: the code of a pass is long.
fn pass_nodes(rod: Rod, lambda: f32, resolution: u32, steps: u32, what: u32) {
    var p = vec3<f32>();
    //@if FORWARD
    forward_three = u32(held(THREE));
    //@end
    var force = driving_forces();
    var taken = select(STABILITY_COLUMNS, NO_COLUMNS, what == REST);
    //@if DRIVES
    if what == DRIVING { taken = taken | FORWARD_COLUMNS; }
    //@end
    //@if TRACES
    collects_traces = what == COLLECTING;
    if collects_traces {
        taken = taken | FORWARD_COLUMNS;
        clear_functionals();
    }
    //@end
    //@if RECIPROCITY
    if what == COLLECTING { start_responses(); }
    //@end
    for (var i = 0u; i < interval_count; i++) {
        let at = interval_at(i);
        let node = held_node(at + NODE);
        var alone = load_interval(rod, at, node);
        alone.steps = steps;
        start_node_columns(node, force);
        //@if RECIPROCITY
        if what == COLLECTING { load_responses(at); }
        //@end
        var end: Tip;
        //@if TRACES
        let integrates = true;
        //@else
        let integrates = what != COLLECTING;
        //@end
        if integrates { end = shoot(resolution, alone, lambda, node.m, taken, false); }
        p = p + end.p;
        let is_tip = i + 1u == interval_count;
        if what == REST {
            let next = new_node(end.d1, end.t, vec3<f32>());
            if !is_tip { hold_node(interval_at(i + 1u) + NODE, next); }
            continue;
        }
        if what == COLLECTING {
            //@if RECIPROCITY
            follow_responses(at);
            //@end
            continue;
        }
        push_transfer(at, end, alone);
        //@if DRIVES
        if what == DRIVING {
            hold_matrix(at + DRIVE_W, columns[BY_FORCE].w);
            hold_matrix(at + DRIVE_MU, canonical(end, BY_FORCE));
            hold_matrix(at + DRIVE_DP, columns[BY_FORCE].dp);
            //@if SOURCE_FORCE
            force = columns[FORWARD].dn;
            //@end
        }
        //@end
        var e_w = vec3<f32>();
        var e_mu = vec3<f32>();
        if !is_tip { defect(end, held_node(interval_at(i + 1u) + NODE), &e_w, &e_mu); }
        hold_vector(at + DEFECT_W, e_w);
        hold_vector(at + DEFECT_MU, e_mu);
        rod_tip = Tip(p, end.d1, end.t, end.m, end.n);
    }
}

fn push_transfer(at: u32, end: Tip, alone: Rod) {
    hold_matrix(at + A_THERE, columns[BY_ROTATION].w);
    hold_matrix(at + B_THERE, columns[BY_MOMENT].w);
    hold_matrix(at + C_THERE, canonical(end, BY_ROTATION));
    hold_matrix(at + D_THERE, canonical(end, BY_MOMENT));
    hold_matrix(at + DP_W, columns[BY_ROTATION].dp);
    hold_matrix(at + DP_MU, columns[BY_MOMENT].dp);
    hold(at + BENT_LENGTH, record_length(first_entry(alone.first)) * alone.share);
}

// The columns of a pass over an interval: by the moment at its start, by what drives it, by the rotation there.
fn start_node_columns(node: Node, force: mat3x3<f32>) {
    columns[BY_MOMENT] = moment_columns();
    //@if DRIVES
    columns[BY_FORCE] = Columns();
    //@end
    //@if SOURCE_FORCE
    columns[FORWARD].dn = force;
    //@end
    columns[BY_ROTATION] = rotation_columns(node.m);
}

// Newton's step at all nodes, after a pass with transfers, under a share of the load; its size, against the largest moment.
fn newton_step(rod: Rod, lambda: f32) -> f32 {
    let l_tip = rod.l_tip * lambda;
    //@if TIP_MOMENT
    factor_symmetric();
    let index_there = node_index;
    let least_there = least;
    //@end
    factor(hat(l_tip * 0.5)); // N2
    //@if TIP_MOMENT
    node_index = index_there;
    least = least_there;
    //@end
    solve_changes(l_tip - rod_tip.m);
    return step_size();
}

// Stability is that of the symmetric part.
fn factor_symmetric() {
    factor(mat3x3<f32>()); // N5
}

fn step_size() -> f32 {
    var turned = 0.0;
    var change = 0.0;
    var largest = 0.0;
    var is_sound = true;
    for (var i = 0u; i < interval_count; i++) {
        let at = interval_at(i);
        let w = held_vector(at + CHANGE_W);
        let m = held_vector(at + NODE + 6u);
        let dm = length(cross_add(w, m * 0.5, held_vector(at + CHANGE_MU)));
        is_sound = is_sound && is_finite(length(w)) && is_finite(dm);
        turned = max(turned, length(w));
        change = max(change, dm);
        largest = max(largest, length(m));
    }
    return select(LOST, max(turned, change / (1.0 + largest)), is_sound);
}

// Takes Newton's step. N2
fn take_step() {
    for (var i = 0u; i < interval_count; i++) {
        let at = interval_at(i);
        let node = held_node(at + NODE);
        let w = held_vector(at + CHANGE_W);
        let m = node.m + cross_add(w, node.m * 0.5, held_vector(at + CHANGE_MU));
        hold_node(at + NODE, new_node(rotate(w, node.d1), rotate(w, node.t), m));
    }
}

// Puts the base where it is held: nothing else would correct it.
fn hold_base(rod: Rod) {
    let base = interval_at(0u) + NODE;
    hold_node(base, Node(rod.d1, rod.t, held_vector(base + 6u)));
}

// The node at the end of an interval; beyond the last it is the tip.
fn end_of(i: u32) -> Node {
    if i + 1u < interval_count { return held_node(interval_at(i + 1u) + NODE); }
    return Node(rod_tip.d1, rod_tip.t, rod_tip.m);
}

// Accepts the nodes on trial.
fn keep() {
    for (var i = 0u; i < interval_count; i++) {
        let at = interval_at(i);
        hold_node(at + EARLIER, held_node(at + BEFORE));
        hold_node(at + BEFORE, held_node(at + ACCEPTED));
        hold_node(at + ACCEPTED, held_node(at + NODE));
    }
}

// The largest defect, at a node or at the tip.
fn residual(l_tip: vec3<f32>) -> f32 {
    var largest = length(rod_tip.m - l_tip);
    for (var i = 0u; i < interval_count; i++) {
        let at = interval_at(i);
        largest = max(largest, max(length(held_vector(at + DEFECT_W)), length(held_vector(at + DEFECT_MU))));
    }
    return largest;
}
