// The curvature where the first flexible segment starts, beyond rigid ones. There the moment at the base does not tell
// it: the force at the base is unknown, too. J1
// crates/core/src/cpu/rod/field/first.rs

//@if BEYOND_RIGID
const FIRST_FLEXIBLE: u32 = 0u; //@spec

// Body frame: itself, by force and moment at the base, by three parameters with the load at the base held.
var<private> first_u: vec3<f32>;
var<private> first_by_force: mat3x3<f32>;
var<private> first_by_moment: mat3x3<f32>;
var<private> first_by_parameters: mat3x3<f32>;

// Where that segment starts. The canonical load there follows that at the base, which turns nothing.
fn load_first(segment: Flexible, state: State, by_parameters: bool) {
    let d2 = cross(state.t, state.d1);
    let R = mat3x3<f32>(state.d1, d2, state.t);
    let at = section(segment, 0.0);
    let k = compliance_at(segment, at.compliance);
    first_u = to_body(R, curvature(at, state.d1, d2, state.t, state.m));
    for (var j = 0u; j < 3u; j++) { //@unroll
        first_by_force[j] = to_body(R, compliance_times(k, state.d1, d2, state.t, carried_load.c[j]));
        first_by_moment[j] = to_body(R, compliance_times(k, state.d1, d2, state.t, carried_load.d[j]));
    } //@end
    //@if FORWARD
    if by_parameters {
        let stage = Stage(state.p, state.d1, d2, state.t, state.m, state.n, state.t, at.compliance);
        for (var j = 0u; j < 3u; j++) { //@unroll
            let x = cross_sub(columns.w[j], state.m, columns.dm[j]);
            var dw = compliance_times(k, state.d1, d2, state.t, x); // J1
            //@if SOURCE_BEND
            dw = source_bend(j, 0.0, k, stage, dw); // J1
            //@end
            first_by_parameters[j] = to_body(R, dw);
        } //@end
    }
    //@end
}

// What a change of the load at the base does to it.
fn first_moved(change: Pair) -> vec3<f32> {
    return first_by_force * change.first + first_by_moment * change.last;
}

fn to_body(R: mat3x3<f32>, v: vec3<f32>) -> vec3<f32> {
    return row_times(v, R);
}
//@end
