// Where a pass starts: the columns at the base, and how the rod goes on from there. crates/core/src/cpu/rod/base.rs

// How the rod goes on at its base, where it is flexible: R u, p' and -m'.
struct BaseSlope {
    omega: vec3<f32>,
    v: vec3<f32>,
    torque: vec3<f32>,
}

// Three columns at the base: by the base moment.
fn moment_columns() -> Columns {
    var three: Columns;
    three.dM = identity();
    return three;
}

// Three columns at the base: by a virtual rotation of the base, in canonical form (dm = w x m0 / 2).
fn rotation_columns(m0: vec3<f32>) -> Columns {
    var three: Columns;
    three.w = identity();
    three.dM = hat(m0) * -0.5;
    return three;
}

// Three columns at the base: by the tip force.
fn force_columns() -> Columns {
    return Columns();
}

//@if FORWARD
// Three columns at the base: by three parameters, the base moment held.
fn forward_columns(rod: Rod, sources: Sources, m0: vec3<f32>) -> Columns {
    var three: Columns;
    three.w = sources.w0;
    three.dp = sources.dp0;
    //@if WANT_INSERTION
    let slope = base_slope(rod, m0);
    three.w = outer(slope.omega, sources.insertion, three.w);
    three.dp = outer(slope.v, sources.insertion, three.dp);
    //@end
    //@if FORCE
    three.dM = columns_cross(three.dp, rod.n0);
    //@end
    //@if SOURCE_FORCE
    three.dn = sources.dn0;
    //@end
    return three;
}
//@end

fn base_slope(rod: Rod, m0: vec3<f32>) -> BaseSlope {
    let first = load_flexible(0u, false);
    let d2 = cross(rod.t, rod.d1);
    let omega = curvature(section(first, 0.0), rod.d1, d2, rod.t, m0);
    let v = velocity(first, rod.d1, d2, rod.t, rod.n0);
    var torque = vec3<f32>();
    //@if FORCE
    torque = cross(v, rod.n0);
    //@end
    //@if MAGNET
    if first.has_magnet { torque = torque + cross(to_world(rod.d1, d2, rod.t, first.mu), rod.B); }
    //@end
    return BaseSlope(omega, v, torque);
}
