// Flexible segments and their cross-sections: curvature from moment (R1), shear and stretch from force (R5).
// crates/core/src/cpu/rod/section.rs

// What varies along it does so linearly: x(s) = x + (s / length) x_rise.
struct Flexible {
    length: f32,
    // Meant only where the segment does not taper.
    compliance: vec3<f32>,
    stiffness: vec3<f32>,
    stiffness_rise: vec3<f32>,
    u_star: vec3<f32>,
    u_star_rise: vec3<f32>,
    // Force and dipole per length.
    w: vec3<f32>,
    mu: vec3<f32>,
    // Diagonal of Kse^-1.
    shear: vec3<f32>,
    tapers: bool,
    shears: bool,
    has_magnet: bool,
}

// A cross-section of a flexible segment.
struct Section {
    compliance: vec3<f32>,
    u_star: vec3<f32>,
}

// Reads a flexible segment's record.
fn load_flexible(index: u32, is_stiff: bool) -> Flexible {
    let at = first_entry(index);
    var segment: Flexible;
    segment.length = record_length(at);
    segment.u_star = record_rest_curvature(at);
    let stiffness = record_stiffness(at);
    segment.stiffness = stiffness;
    segment.compliance = 1.0 / stiffness;
    //@if TAPER
    segment.tapers = has(index, TAPERS);
    segment.stiffness_rise = record_stiffness_rise(at);
    //@end
    //@if CURVATURE_RISE
    segment.u_star_rise = record_rest_curvature_rise(at);
    //@end
    //@if LOAD
    segment.w = record_load(at);
    //@end
    //@if MAGNET
    segment.has_magnet = has(index, HAS_MAGNET);
    segment.mu = record_dipole_per_length(at);
    //@end
    //@if SHEAR
    segment.shears = has(index, SHEARS);
    segment.shear = record_shear_compliance(at);
    //@end
    if is_stiff { return stiff(segment); }
    return segment;
}

// The cross-section at a share `x` of the length.
fn section(segment: Flexible, x: f32) -> Section {
    var found = Section(segment.compliance, segment.u_star);
    //@if TAPER
    if segment.tapers { found.compliance = 1.0 / axpy(x, segment.stiffness_rise, segment.stiffness); }
    //@end
    //@if CURVATURE_RISE
    found.u_star = axpy(x, segment.u_star_rise, segment.u_star);
    //@end
    return found;
}

// The compliance at a cross-section whose own is known.
fn compliance_at(segment: Flexible, section: vec3<f32>) -> vec3<f32> {
    //@if TAPER
    if segment.tapers { return section; }
    //@end
    return segment.compliance;
}

// The same rod unable to bend or shear.
fn stiff(segment: Flexible) -> Flexible {
    var same = segment;
    same.compliance = vec3<f32>();
    same.tapers = false;
    same.shears = false;
    return same;
}

// Curvature in the world frame, R u = R u* + R K^-1 R^T m.
fn curvature(section: Section, d1: vec3<f32>, d2: vec3<f32>, t: vec3<f32>, m: vec3<f32>) -> vec3<f32> {
    let u_star = section.u_star;
    let k = section.compliance;
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

// p' = R nu, the tangent where the segment neither shears nor stretches.
fn velocity(segment: Flexible, d1: vec3<f32>, d2: vec3<f32>, t: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    //@if SHEAR
    if segment.shears {
        let c = segment.shear;
        return axpy(c.x * dot(d1, n), d1, axpy(c.y * dot(d2, n), d2, axpy(c.z * dot(t, n), t, t))); // R5
    }
    //@end
    return t;
}

// R v for a vector of the body frame.
fn to_world(d1: vec3<f32>, d2: vec3<f32>, t: vec3<f32>, v: vec3<f32>) -> vec3<f32> {
    return axpy(v.x, d1, axpy(v.y, d2, t * v.z));
}
