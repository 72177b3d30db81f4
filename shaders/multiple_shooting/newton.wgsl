// Newton's method on all nodes of a rod: its steps, and what becomes of the nodes. N2
// crates/core/src/cpu/multiple_shooting/newton.rs

// Newton's step at all nodes, after a pass with transfers, under a share of the load; its size, against the largest moment.
fn newton_step(rod: Rod, lambda: f32) -> f32 {
    let l_tip = rod.l_tip * lambda;
    //@if LOAD_WITHOUT_ENERGY
    factor_symmetric();
    let index_there = node_index;
    let least_there = least;
    //@end
    factor(hat(l_tip * 0.5)); // N2
    //@if LOAD_WITHOUT_ENERGY
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
