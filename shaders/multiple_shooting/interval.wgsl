// One interval between nodes: a pass over it alone, and how its end changes with its start. N1
// crates/core/src/cpu/multiple_shooting/interval.rs

// Orientation and moment at a node.
struct Node {
    d1: vec3<f32>,
    t: vec3<f32>,
    m: vec3<f32>,
}

// Where a pass left the orientation at right angles but for its error.
fn new_node(d1: vec3<f32>, t: vec3<f32>, m: vec3<f32>) -> Node {
    let tangent = t * (1.0 / length(t));
    let across = axpy(-dot(d1, tangent), tangent, d1);
    return Node(across * (1.0 / length(across)), tangent, m);
}

// The rod of the interval at `at` alone: its base at the node.
fn load_interval(rod: Rod, at: u32, node: Node) -> Rod {
    var alone = rod;
    alone.d1 = node.d1;
    alone.t = node.t;
    alone.n0 = held_vector(at + FORCE_THERE);
    alone.first = u32(held(at + FIRST));
    alone.end = u32(held(at + END));
    alone.start = held(at + START);
    alone.share = held(at + SHARE);
    alone.is_last = held(at + KIND) == LAST_PIECE;
    alone.is_tip = alone.end == SEGMENT_COUNT && held(at + KIND) == RIGID_PIECE;
    return alone;
}

// What is left between the end of an interval and the node there: rotation and canonical moment. N1
fn defect(end: Tip, node: Node, e_w: ptr<function, vec3<f32>>, e_mu: ptr<function, vec3<f32>>) {
    *e_w = turn(node, Node(end.d1, end.t, end.m));
    *e_mu = cross_add(node.m * 0.5, *e_w, end.m - node.m);
}

// The rotation vector from one node's orientation to another's, to second order.
fn turn(before: Node, after: Node) -> vec3<f32> {
    let d2 = cross(cross(before.t, before.d1), cross(after.t, after.d1));
    return (cross(before.d1, after.d1) + d2 + cross(before.t, after.t)) * 0.5;
}

// A piece of a flexible segment: where it starts and how long it is, as shares of the whole.
fn piece(whole: Flexible, start: f32, share: f32) -> Flexible {
    var segment = whole;
    segment.length = whole.length * share;
    segment.stiffness = axpy(start, whole.stiffness_rise, whole.stiffness);
    segment.stiffness_rise = whole.stiffness_rise * share;
    segment.u_star = axpy(start, whole.u_star_rise, whole.u_star);
    segment.u_star_rise = whole.u_star_rise * share;
    return segment;
}

//@if SEGMENT_SOURCES
// The same of the source in hand; what lengthens the segment does so at its end.
fn source_piece(start: f32, share: f32, is_last: bool) {
    if !is_last { source.dL = vec3<f32>(); }
    source.dK = columns_axpy(start, source.dK_rise, source.dK);
    source.dK_rise = source.dK_rise * share;
    source.du_star = columns_axpy(start, source.du_star_rise, source.du_star);
    source.du_star_rise = source.du_star_rise * share;
}
//@end
