// How far a rod is from a fold anywhere along it: what a moment at each node turns there. N6
// crates/core/src/cpu/multiple_shooting/margin.rs

const NODE_USUAL: f32 = 0.0; //@spec

// The stability margin, after a pass with transfers and an elimination from S = 0 at the tip: `by_tip` is that of the rod's
// end. Where the compliance at a node, relative to that of the same shape without loads, is large, it counts.
fn node_margin(by_tip: f32) -> f32 {
    var compliance = mat3x3<f32>();
    var at_rest = mat3x3<f32>();
    var bent = 0.0;
    var largest = 0.0;
    for (var i = 0u; i < interval_count; i++) {
        let at = interval_at(i);
        let pivot = held_matrix(at + PIVOT_INVERSE);
        compliance = (transpose(pivot) * compliance + held_matrix(at + B_THERE)) * pivot; // N6
        if held(at + KIND) != RIGID_PIECE {
            let bend = piece(load_flexible(u32(held(at + FIRST)), false), held(at + START), held(at + SHARE));
            let before = held_node(at + NODE);
            let after = end_of(i);
            let half = turn(before, after) * 0.5;
            let middle = Node(rotate(half, before.d1), rotate(half, before.t), before.m);
            let near = bend.stiffness;
            let rise = bend.stiffness_rise;
            let sum = give(before, near) + give(after, near + rise) + give(middle, near + rise * 0.5) * 4.0;
            at_rest = at_rest + sum * (bend.length * (1.0 / 6.0));
            bent = bent + bend.length;
        }
        if bent > 0.0 {
            let relative = inverse(at_rest) * compliance;
            let rows = transpose(relative);
            largest = max(largest, dot(relative[0], rows[0]) + dot(relative[1], rows[1]) + dot(relative[2], rows[2]));
        }
    }
    let beyond = sqrt(largest * (1.0 / 3.0)) - NODE_USUAL;
    return 1.0 / max(beyond, 1.0 / by_tip); // N6
}

// What a moment turns per length of an unloaded rod: R K^-1 R^T.
fn give(node: Node, stiffness: vec3<f32>) -> mat3x3<f32> {
    let d2 = cross(node.t, node.d1);
    let along_d1 = outer(node.d1, node.d1 * (1.0 / stiffness.x), mat3x3<f32>());
    return outer(node.t, node.t * (1.0 / stiffness.z), outer(d2, d2 * (1.0 / stiffness.y), along_d1));
}
