// The rod in the reduced form: R1 (balance of force and moment), R3 (rigid segments), R6 (unloaded distal part).
// crates/core/src/cpu/rod/segments.rs

//@if !VARYING_FIELD
// Where the rod is: position, first director, tangent, and M = m + p x n.
struct State {
    p: vec3<f32>,
    d1: vec3<f32>,
    t: vec3<f32>,
    M: vec3<f32>,
}
//@end

struct Rigid {
    length: f32,
    mu: vec3<f32>,
    // The whole force on it.
    w: vec3<f32>,
}

// A rod under full loads; its segments are loaded where they are crossed.
struct Rod {
    // Unable to bend or shear.
    is_stiff: bool,
    d1: vec3<f32>,
    t: vec3<f32>,
    B: vec3<f32>,
    f_tip: vec3<f32>,
    l_tip: vec3<f32>,
    // n at the base.
    n0: vec3<f32>,
    flexible_length: f32,
    length: f32,
    //@if NODES
    // Of an interval alone: its segments, which share of the first, how many steps, what its end is.
    first: u32,
    end: u32,
    start: f32,
    share: f32,
    steps: u32,
    is_last: bool,
    is_tip: bool,
    //@end
}

// Reads the base of the sample's record.
fn load() -> Rod {
    var rod: Rod;
    rod.d1 = base_d1();
    rod.t = base_t();
    rod.B = flux_density();
    //@if FORCE
    rod.f_tip = tip_force();
    rod.n0 = base_force(rod);
    //@end
    //@if LOAD_WITHOUT_ENERGY
    rod.l_tip = tip_moment();
    //@end
    rod.flexible_length = flexible_length();
    rod.length = rod_length();
    return rod;
}

// n at the base under full loads: tip force and all the weight.
fn base_force(rod: Rod) -> vec3<f32> {
    var n = rod.f_tip;
    //@if LOAD
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        //@if FLEXIBLE[j]
        n = axpy(length_j(), load_j(), n); // R1
        //@else
        n = n + weight_j(); // R1
        //@end
    } //@end
    //@end
    return n;
}

// Length of the flexible segments.
fn flexible_length() -> f32 {
    var length = 0.0;
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        length = length + select(0.0, length_j(), has(j, IS_FLEXIBLE));
    } //@end
    return length;
}

// Length of what is integrated.
fn rod_length() -> f32 {
    var length = 0.0;
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        length = length + length_j();
    } //@end
    return length;
}

// Reads a rigid segment's record.
fn load_rigid(index: u32) -> Rigid {
    let at = first_entry(index);
    var segment: Rigid;
    segment.length = record_length(at);
    //@if DIPOLE
    segment.mu = record_dipole(at);
    //@end
    //@if LOAD
    segment.w = record_weight(at);
    //@end
    return segment;
}

//@if !VARYING_FIELD
// Moment from M = m + p x n.
fn moment(p: vec3<f32>, M: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    //@if FORCE
    return cross_sub(p, n, M); // R1
    //@else
    return M;
    //@end
}

// Crosses a rigid segment: position and moment jump, the orientation stays.
fn cross_rigid(rod: Rod, segment: Rigid, lambda: f32, n: ptr<function, vec3<f32>>, state: ptr<function, State>) {
    let p = (*state).p;
    let t = (*state).t;
    //@if DIPOLE
    let mu_world = world_dipole(segment, *state, lambda);
    (*state).M = cross_sub(mu_world, rod.B, (*state).M); // R3
    //@end
    (*state).p = axpy(segment.length, t, p); // R3
    //@if LOAD
    let weight = segment.w * lambda;
    //@if RIGID_FORCE_ARM
    let middle = axpy(segment.length * 0.5, t, p);
    //@else
    let middle = p;
    //@end
    (*state).M = cross_sub(middle, weight, (*state).M); // R3
    *n = *n - weight; // R1
    //@end
    //@if FORCE_WITHOUT_ARM
    (*state).M = cross_add(t * segment.length, *n, (*state).M);
    //@end
}

// R mu, scaled by the load fraction.
fn world_dipole(segment: Rigid, state: State, lambda: f32) -> vec3<f32> {
    return to_world(state.d1, cross(state.t, state.d1), state.t, segment.mu) * lambda;
}

// Takes the state over the unloaded distal part, which keeps its rest shape.
fn cross_free(state: ptr<function, State>) {
    //@if FREE
    let start = *state;
    let d2 = cross(start.t, start.d1);
    (*state).p = start.p + to_world(start.d1, d2, start.t, free_p()); // R6
    (*state).d1 = to_world(start.d1, d2, start.t, free_d1());
    (*state).t = to_world(start.d1, d2, start.t, free_t()); // R6
    //@end
}
//@end
