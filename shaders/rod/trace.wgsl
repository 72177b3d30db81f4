// What columns leave behind along the rod: the integrals and values that rows of the Jacobian are made of.
// crates/core/src/cpu/rod/trace.rs

//@if TRACES
// What three columns leave behind on a segment; `row[j]`, a column of WGSL, holds component j of each.
struct Trace {
    //@if COLLECT_STRAIN
    // Integral of dm_b,j; the same times s / length.
    rest_curvature: mat3x3<f32>,
    rest_curvature_rise: mat3x3<f32>,
    // Integral of -dm_b,j m_b,j / K_j^2; the same times s / length.
    stiffness: mat3x3<f32>,
    stiffness_rise: mat3x3<f32>,
    //@end
    //@if WANT_SHEAR_COMPLIANCE
    // Integral of dn_b,j n_b,j.
    shear_compliance: mat3x3<f32>,
    //@end
    //@if COLLECT_LOAD
    // Integral of dp_j on a flexible segment, dp_j in the middle of a rigid one.
    load: mat3x3<f32>,
    //@end
    //@if COLLECT_DIPOLE
    // w . (R e_j x B): its integral on a flexible segment, its value on a rigid one.
    dipole: mat3x3<f32>,
    //@end
    //@if COLLECT_FIELD
    // (w x R mu)_j, likewise.
    field: mat3x3<f32>,
    //@end
    // Change of H at the distal end.
    length: vec3<f32>,
}

// Threes that leave traces: those of the answer.
const TRACED: u32 = 3u; //@spec

// What each three columns leave behind on the segment in hand.
var<private> trace: array<Trace, THREES>;

// Adds a stage's part of the integrals that the derivatives need, with the stepper's own weight times the step, for
// column `c` of the three `k`.
fn collect_integrals(
    rod: Rod, segment: Flexible, hb: f32, share: f32, stage: Stage,
    w: vec3<f32>, x: vec3<f32>, dp: vec3<f32>, dn: vec3<f32>, k: u32, c: u32,
) {
    let d = mat3x3<f32>(stage.d1, stage.d2, stage.t);
    //@if COLLECT_STRAIN
    let compliance = compliance_at(segment, stage.compliance);
    for (var j = 0u; j < 3u; j++) { //@unroll
        let dm_body = dot(d[j], x) * hb;
        let strain = -dot(d[j], stage.m) * (compliance[j] * compliance[j]);
        //@if WANT_REST_CURVATURE
        trace[k].rest_curvature[j][c] += dm_body;
        //@end
        //@if WANT_REST_CURVATURE_RISE
        trace[k].rest_curvature_rise[j][c] += share * dm_body;
        //@end
        //@if WANT_STIFFNESS
        trace[k].stiffness[j][c] += strain * dm_body;
        //@end
        //@if WANT_STIFFNESS_RISE
        trace[k].stiffness_rise[j][c] += strain * share * dm_body;
        //@end
    } //@end
    //@end
    //@if WANT_SHEAR_COMPLIANCE
    let y = column_force(k, dn, stage.n, w);
    for (var j = 0u; j < 3u; j++) { //@unroll
        trace[k].shear_compliance[j][c] += dot(d[j], stage.n) * hb * dot(d[j], y);
    } //@end
    //@end
    //@if WANT_LOAD
    for (var j = 0u; j < 3u; j++) { //@unroll
        trace[k].load[j][c] += hb * dp[j];
    } //@end
    //@end
    //@if WANT_DIPOLE_PER_LENGTH
    for (var j = 0u; j < 3u; j++) { //@unroll
        trace[k].dipole[j][c] += hb * dot(cross(d[j], rod.B), w);
    } //@end
    //@end
    //@if COLLECT_FIELD
    //@if MAGNET
    if segment.has_magnet {
        let torque = cross(w, to_world(stage.d1, stage.d2, stage.t, segment.mu));
        for (var j = 0u; j < 3u; j++) { //@unroll
            trace[k].field[j][c] += hb * torque[j];
        } //@end
    }
    //@end
    //@end
}

// Change of H = m_b . K^-1 m_b / 2 + m_b . u* + n . t + n_b . Kse^-1 n_b / 2 at the distal end of a flexible segment.
//
// `omega` is R u there and `v` p'.
fn length_row(
    rod: Rod, segment: Flexible, state: State, m: vec3<f32>, n: vec3<f32>, omega: vec3<f32>, v: vec3<f32>, k: u32,
) -> vec3<f32> {
    let three = columns[k];
    let dm = columns_moment(k, state.p, n);
    var row = row_times(omega, columns_cross_sub(three.w, m, dm));
    if k == BY_FORCE { row = row + v; }
    //@if FORCE
    row = row + row_times(n, columns_cross(three.w, v));
    //@end
    //@if LOAD
    row = row + row_times(segment.w, three.dp);
    //@end
    //@if MAGNET
    if segment.has_magnet {
        let mu_world = to_world(state.d1, cross(state.t, state.d1), state.t, segment.mu);
        row = row + row_times(rod.B, columns_cross(three.w, mu_world));
    }
    //@end
    return row;
}

// What three columns leave on a rigid segment; `state` and columns are those at its proximal end, `n` is the force at
// its distal end.
fn collect_rigid(rod: Rod, segment: Rigid, state: State, n: vec3<f32>, k: u32) {
    let w = columns[k].w;
    //@if WANT_DIPOLE
    let d = mat3x3<f32>(state.d1, cross(state.t, state.d1), state.t);
    for (var j = 0u; j < 3u; j++) { //@unroll
        trace[k].dipole[j] = row_times(cross(d[j], rod.B), w);
    } //@end
    //@end
    //@if COLLECT_FIELD
    trace[k].field = transpose(columns_cross(w, world_dipole(segment, state, 1.0)));
    //@end
    let wt = columns_cross(w, state.t);
    //@if WANT_WEIGHT
    trace[k].load = transpose(columns_axpy(segment.length * 0.5, wt, columns[k].dp));
    //@end
    //@if WANT_LENGTH
    if k == BY_FORCE { trace[k].length = state.t; }
    //@if FORCE
    trace[k].length = trace[k].length + row_times(axpy(0.5, segment.w, n), wt);
    //@end
    //@end
}
//@end
