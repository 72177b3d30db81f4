// Columns by parameters where the rod begins and where a flexible segment ends. F2, J4
// crates/core/src/cpu/rod/field/ends.rs

// How force and moment go on along a flexible segment.
struct LoadSlope {
    dm: vec3<f32>,
    dn: vec3<f32>,
}

//@if FORWARD
// Columns by three parameters at the base, its load held.
fn base_columns(state: State) -> Columns {
    var three: Columns;
    three.w = sources.w0;
    three.dp = sources.dp0;
    //@if WANT_INSERTION
    let first = load_flexible(0u, false);
    let d2 = cross(state.t, state.d1);
    let omega = curvature(section(first, 0.0), state.d1, d2, state.t, state.m);
    three.w = outer(omega, sources.insertion, three.w);
    three.dp = outer(velocity(first, state.d1, d2, state.t, state.n), sources.insertion, three.dp);
    //@end
    return three;
}

//@if SEGMENT_SOURCES
// More of a flexible segment at its distal end, where the state stands.
fn lengthen(segment: Flexible, state: State) {
    let d2 = cross(state.t, state.d1);
    let omega = curvature(section(segment, 1.0), state.d1, d2, state.t, state.m);
    let v = velocity(segment, state.d1, d2, state.t, state.n);
    let slope = slopes(segment, state, v);
    columns.w = outer(omega, source.dL, columns.w);
    columns.dp = outer(v, source.dL, columns.dp);
    columns.dm = outer(slope.dm, source.dL, columns.dm);
    columns.dn = outer(slope.dn, source.dL, columns.dn);
}
//@end
//@end

// m' and n' under the full load, where p' is `v`. F2
fn slopes(segment: Flexible, state: State, v: vec3<f32>) -> LoadSlope {
    var slope = LoadSlope(cross(state.n, v), -segment.w);
    //@if MAGNET
    if segment.has_magnet {
        let mu = to_world(state.d1, cross(state.t, state.d1), state.t, segment.mu);
        let here = field(state.p);
        slope.dm = cross_sub(mu, here.B, slope.dm);
        slope.dn = slope.dn - here.G * mu;
    }
    //@end
    return slope;
}
