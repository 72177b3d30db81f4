// Block elimination over the nodes, from the free tip to the base and back: Newton's steps, responses, stability. N2, N3
// crates/core/src/cpu/multiple_shooting/elimination.rs

// What the tip asks for: mu = s_tip w + g.
var<private> s_tip: mat3x3<f32>;
// (dr/dm0)^-1
var<private> w_inverse: mat3x3<f32>;
// Negative eigenvalues of the second variation.
var<private> node_index: f32;
// The least pivot, its determinant relative to that of the interval alone, whose end is free.
var<private> least: f32;

// Eliminates the nodes of a rod whose tip asks for mu = `s` w + g.
fn factor(s_at_tip: mat3x3<f32>) {
    var s = s_at_tip;
    s_tip = s;
    node_index = 0.0;
    w_inverse = identity();
    least = 1.0;
    for (var i = interval_count; i > 0u; i--) {
        let at = interval_at(i - 1u);
        let a = held_matrix(at + A_THERE);
        let b = held_matrix(at + B_THERE);
        let c = held_matrix(at + C_THERE);
        let d = held_matrix(at + D_THERE);
        let p = d - s * b; // N2
        if held(at + KIND) != RIGID_PIECE && held(at + BENT_LENGTH) > 0.0 {
            // P b^-1 is that of the interval alone less what lies beyond.
            let alone = d * inverse(b);
            let form = alone - s;
            let negative = negative_count(form); // N3
            let odd = dot(p[0], cross(p[1], p[2])) < 0.0;
            node_index = node_index + select(negative, max(negative, 1.0), odd);
            least = min(least, symmetric_determinant(form) / symmetric_determinant(alone));
        }
        let p_inverse = inverse(p);
        s = p_inverse * (s * a - c); // N2
        w_inverse = p_inverse * w_inverse;
        hold_matrix(at + PIVOT_INVERSE, p_inverse);
        hold_matrix(at + PIVOT_S, s);
    }
}

// s at the end of an interval: that of the next one, or what the tip asks for.
fn s_beyond(i: u32) -> mat3x3<f32> {
    if i + 1u < interval_count { return held_matrix(interval_at(i + 1u) + PIVOT_S); }
    return s_tip;
}

// Changes (w, mu) at all nodes from the defects of the intervals and what the tip asks for; the base stays.
fn solve_changes(g_tip: vec3<f32>) {
    var g = g_tip;
    for (var i = interval_count; i > 0u; i--) {
        let at = interval_at(i - 1u);
        let e_w = held_vector(at + DEFECT_W);
        g = held_matrix(at + PIVOT_INVERSE) * (s_beyond(i - 1u) * e_w + g - held_vector(at + DEFECT_MU)); // N2
        hold_vector(at + CHANGE_MU, g);
    }
    var w = vec3<f32>();
    for (var i = 0u; i < interval_count; i++) {
        let at = interval_at(i);
        let mu = held_matrix(at + PIVOT_S) * w + held_vector(at + CHANGE_MU);
        hold_vector(at + CHANGE_W, w);
        hold_vector(at + CHANGE_MU, mu);
        w = held_matrix(at + A_THERE) * w + held_matrix(at + B_THERE) * mu + held_vector(at + DEFECT_W); // N2
    }
}

// The same for three loads: leaves g of every node at `to`. Where they drive the intervals, that stands for defects.
fn solve_threes(g_tip: mat3x3<f32>, is_driven: bool, to: u32) {
    var g = g_tip;
    for (var i = interval_count; i > 0u; i--) {
        let at = interval_at(i - 1u);
        //@if DRIVES
        if is_driven { g = s_beyond(i - 1u) * held_matrix(at + DRIVE_W) + g - held_matrix(at + DRIVE_MU); }
        //@end
        g = held_matrix(at + PIVOT_INVERSE) * g;
        hold_matrix(at + to, g);
    }
}

// Determinant of the symmetric part, times 8.
fn symmetric_determinant(a: mat3x3<f32>) -> f32 {
    let s = a + transpose(a);
    return dot(s[0], cross(s[1], s[2]));
}

// Rotates `v` by a small rotation vector.
fn rotate(w: vec3<f32>, v: vec3<f32>) -> vec3<f32> {
    let r = w * 0.5;
    let turn = cross(r, v);
    return v + (turn + cross(r, turn)) * (2.0 / (1.0 + dot(r, r)));
}
