// The rod in the reduced form: R1 (balance of force and moment), R2 (shape), R3 (rigid segments). src/lanes/rod.rs

const SEGMENT_COUNT: u32 = 1u; //@spec

// Where the rod is: position, first director, tangent, and M = m + p x n.
struct State {
    p: vec3<f32>,
    d1: vec3<f32>,
    t: vec3<f32>,
    M: vec3<f32>,
}

struct Flexible {
    length: f32,
    compliance: vec3<f32>,
    u_star: vec3<f32>,
    w: vec3<f32>,
}

struct Rigid {
    length: f32,
    mu: vec3<f32>,
    w: vec3<f32>,
}

// A rod under full loads; its segments are loaded where they are crossed.
struct Rod {
    // 0 for a rod that does not bend.
    softness: f32,
    d1: vec3<f32>,
    t: vec3<f32>,
    B: vec3<f32>,
    f_tip: vec3<f32>,
    l_tip: vec3<f32>,
}

// Reads the base of the sample's record.
fn load() -> Rod {
    var rod: Rod;
    rod.softness = 1.0;
    rod.d1 = base_d1();
    rod.t = base_t();
    rod.B = flux_density();
    //@if FORCE
    rod.f_tip = tip_force();
    //@end
    //@if TIP_MOMENT
    rod.l_tip = tip_moment();
    //@end
    return rod;
}

// Reads a flexible segment's record; `softness` scales the compliance.
fn load_flexible(index: u32, softness: f32) -> Flexible {
    var segment: Flexible;
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        //@if FLEXIBLE[j]
        if index == j {
            segment.length = length_j();
            segment.compliance = softness / stiffness_j();
            segment.u_star = rest_curvature_j();
            //@if LOAD
            segment.w = load_j();
            //@end
        }
        //@end
    } //@end
    return segment;
}

// Reads a rigid segment's record.
fn load_rigid(index: u32) -> Rigid {
    var segment: Rigid;
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        //@if !FLEXIBLE[j]
        if index == j {
            segment.length = length_j();
            //@if DIPOLE[j]
            segment.mu = dipole_j();
            //@end
            //@if LOAD
            segment.w = load_j();
            //@end
        }
        //@end
    } //@end
    return segment;
}

// n at the base under full loads: tip force and all the weight.
fn base_force(rod: Rod) -> vec3<f32> {
    var n = rod.f_tip;
    //@if LOAD
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        n = axpy(length_j(), load_j(), n); // R1
    } //@end
    //@end
    return n;
}

// Moment from M = m + p x n.
fn moment(p: vec3<f32>, M: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    //@if FORCE
    return cross_sub(p, n, M); // R1
    //@else
    return M;
    //@end
}

// Curvature in the world frame, R u = R u* + R K^-1 R^T m.
fn curvature(segment: Flexible, d1: vec3<f32>, d2: vec3<f32>, t: vec3<f32>, m: vec3<f32>) -> vec3<f32> {
    let u_star = segment.u_star;
    let k = segment.compliance;
    //@if ANISOTROPIC
    let ux = k.x * dot(d1, m) + u_star.x;
    let uy = k.y * dot(d2, m) + u_star.y;
    let uz = k.z * dot(t, m) + u_star.z;
    return axpy(ux, d1, axpy(uy, d2, t * uz)); // R1
    //@else
    let uz = (k.z - k.x) * dot(t, m) + u_star.z;
    return axpy(k.x, m, axpy(u_star.x, d1, axpy(u_star.y, d2, t * uz))); // R1
    //@end
}

// Crosses a rigid segment: position and moment jump, the orientation stays.
fn cross_rigid(rod: Rod, segment: Rigid, lambda: f32, n: ptr<function, vec3<f32>>, state: ptr<function, State>) {
    let length = segment.length;
    let p = (*state).p;
    let t = (*state).t;
    //@if DIPOLE
    let mu_world = world_dipole(segment, *state, lambda);
    (*state).M = cross_sub(mu_world, rod.B, (*state).M); // R3
    //@end
    (*state).p = axpy(length, t, p); // R3
    //@if LOAD
    let weight = segment.w * (lambda * length);
    //@if RIGID_FORCE_ARM
    let middle = axpy(length * 0.5, t, p);
    //@else
    let middle = p;
    //@end
    (*state).M = cross_sub(middle, weight, (*state).M); // R3
    *n = *n - weight; // R1
    //@end
    //@if FORCE
    //@if !RIGID_FORCE_ARM
    (*state).M = cross_add(t * length, *n, (*state).M);
    //@end
    //@end
}

// R mu, scaled by the load fraction.
fn world_dipole(segment: Rigid, state: State, lambda: f32) -> vec3<f32> {
    let d2 = cross(state.t, state.d1);
    return axpy(segment.mu.x, state.d1, axpy(segment.mu.y, d2, state.t * segment.mu.z)) * lambda;
}
