// The nodes of a rod, and a pass over all their intervals. crates/core/src/cpu/multiple_shooting/state.rs

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
