// A rigid segment in a field that varies. F1, F3, F4, F6
// crates/core/src/cpu/rod/field/crossing.rs

const HAS_DIPOLE: u32 = 32u; //@spec
// Points of a rigid segment where the field acts, as shares of its length, and their shares of its dipole: the middle, for
// the path, then those of the answer.
const POINT_COUNT: u32 = 2u; //@spec
const POINTS: array<f32, 2> = array<f32, 2>(0.5, 0.5); //@spec
const POINT_SHARES: array<f32, 2> = array<f32, 2>(1.0, 1.0); //@spec

// A rigid segment under part of its loads, and the state before it.
struct Crossing {
    segment: Rigid,
    has_dipole: bool,
    lambda: f32,
    // Whether the field acts at its middle.
    on_path: bool,
    before: State,
}

fn point(k: u32) -> vec2<f32> {
    var found = vec2<f32>();
    for (var j = 0u; j < POINT_COUNT; j++) { //@unroll
        found = select(found, vec2<f32>(POINTS[j], POINT_SHARES[j]), k == j);
    } //@end
    return found;
}

// R mu
fn rigid_dipole(crossing: Crossing) -> vec3<f32> {
    let before = crossing.before;
    let d2 = cross(before.t, before.d1);
    return to_world(before.d1, d2, before.t, crossing.segment.mu) * crossing.lambda;
}

// The state beyond it.
fn cross_segment(crossing: Crossing) -> State {
    var state = crossing.before;
    let arm = state.t * crossing.segment.length;
    let load = crossing.segment.w * crossing.lambda;
    state.n = state.n - load;
    //@if DIPOLE
    if crossing.has_dipole {
        let mu = rigid_dipole(crossing);
        let end = select(POINT_COUNT, 1u, crossing.on_path);
        for (var k = select(1u, 0u, crossing.on_path); k < end; k++) {
            let at = point(k);
            let lever = arm * at.x;
            let here = field(state.p + lever);
            let part = mu * at.y;
            let force = here.G * part; // F1
            state.n = state.n - force;
            state.m = cross_sub(part, here.B, state.m); // F3, F4
            //@if RIGID_FORCE_ARM
            state.m = cross_sub(lever, force, state.m); // F3, F4
            //@end
        }
    }
    //@end
    //@if RIGID_FORCE_ARM
    state.m = cross_sub(arm, axpy(0.5, load, state.n), state.m); // F3, F4
    //@end
    state.p = state.p + arm;
    return state;
}

// Takes three columns over it, `by` says of what; `after` is the state beyond it.
fn cross_columns(crossing: Crossing, after: State, by: u32) {
    let before = crossing.before;
    let arm = before.t * crossing.segment.length;
    let load = crossing.segment.w * crossing.lambda;
    var change = columns;
    var darms = columns_cross(change.w, arm);
    var dload = mat3x3<f32>();
    //@if SEGMENT_SOURCES
    if by == BY_PARAMETERS {
        darms = outer(before.t, source.dL, darms);
        dload = source.dload;
    }
    //@end
    change.dn = change.dn - dload;
    change.dp = change.dp + darms;
    //@if DIPOLE
    if crossing.has_dipole {
        let mu = rigid_dipole(crossing);
        let end = select(POINT_COUNT, 1u, crossing.on_path);
        for (var j = select(1u, 0u, crossing.on_path); j < end; j++) {
            let at = point(j);
            let lever = arm * at.x;
            let part = mu * at.y;
            let x = before.p + lever;
            let here = local(x, part, true);
            let force = here.G * part;
            let dlevers = darms * at.x;
            let dx = columns.dp + dlevers;
            var dmu = columns_cross(columns.w, part);
            var dB = here.G * dx;
            var dF = here.T3 * dx;
            //@if FORWARD
            if by == BY_PARAMETERS {
                //@if SEGMENT_SOURCES
                let R = mat3x3<f32>(before.d1, cross(before.t, before.d1), before.t);
                dmu = columns_axpy(at.y, R * source.dmu, dmu);
                //@end
                let changed = parameters_field(x, part);
                dB = dB + changed.dB;
                dF = dF + changed.dF;
            }
            //@end
            let dforces = dF + here.G * dmu; // F6
            change.dn = change.dn - dforces;
            change.dm = columns_cross_sub(dmu, here.B, columns_cross_add(dB, part, change.dm)); // F6
            //@if RIGID_FORCE_ARM
            change.dm = columns_cross_sub(dlevers, force, columns_cross_add(dforces, lever, change.dm)); // F6
            //@end
        }
    }
    //@end
    //@if RIGID_FORCE_ARM
    let dmiddles = columns_axpy(0.5, dload, change.dn);
    let middle = axpy(0.5, load, after.n);
    change.dm = columns_cross_sub(darms, middle, columns_cross_add(dmiddles, arm, change.dm));
    //@end
    columns = change;
}
