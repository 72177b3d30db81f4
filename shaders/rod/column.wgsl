// Sensitivity columns in threes: virtual rotation w, displacement dp and dM of each. J1 to J4. crates/core/src/cpu/rod/column.rs

// Columns of a three that an invocation carries.
const COLUMN_COUNT: u32 = 3u; //@spec

//@if !VARYING_FIELD
// Three columns; those of a unit tip force carry dn = e_k.
struct Columns {
    w: mat3x3<f32>,
    dp: mat3x3<f32>,
    dM: mat3x3<f32>,
    //@if SOURCE_FORCE
    // Change of the internal force, of forward columns.
    dn: mat3x3<f32>,
    //@end
}

// dn of column `c` of a three: none, e_c, or what forward columns carry.
fn force_of(k: u32, c: u32) -> vec3<f32> {
    var dn = vec3<f32>();
    //@if RECIPROCITY
    if k == BY_FORCE { dn[c] = 1.0; }
    //@end
    //@if SOURCE_FORCE
    if k == FORWARD { dn = columns[k].dn[c]; }
    //@end
    return dn;
}

// Whether three columns carry a change of the internal force.
fn changes_force(k: u32) -> bool {
    //@if RECIPROCITY
    return k == BY_FORCE;
    //@else
    //@if SOURCE_FORCE
    return k == FORWARD;
    //@else
    return false;
    //@end
    //@end
}

// dm of a column of the three `k`, from dM.
fn column_moment(k: u32, dn: vec3<f32>, p: vec3<f32>, n: vec3<f32>, dp: vec3<f32>, dM: vec3<f32>) -> vec3<f32> {
    var dm = dM;
    if changes_force(k) { dm = cross_add(dn, p, dm); } // J3
    //@if FORCE
    return cross_sub(dp, n, dm); // J3
    //@else
    return dm;
    //@end
}

// dm of three columns, where the rod is at `p` with force `n`.
fn columns_moment(k: u32, p: vec3<f32>, n: vec3<f32>) -> mat3x3<f32> {
    let dp = columns[k].dp;
    let dM = columns[k].dM;
    return mat3x3<f32>(
        column_moment(k, force_of(k, 0u), p, n, dp[0], dM[0]),
        column_moment(k, force_of(k, 1u), p, n, dp[1], dM[1]),
        column_moment(k, force_of(k, 2u), p, n, dp[2], dM[2]),
    );
}

// dn - w x n of a column of the three `k`: what the force changes by in the body frame.
fn column_force(k: u32, dn: vec3<f32>, n: vec3<f32>, w: vec3<f32>) -> vec3<f32> {
    if changes_force(k) { return cross_add(n, w, dn); }
    return cross(n, w);
}
//@end

// R diag(k) R^T x
fn compliance_times(k: vec3<f32>, d1: vec3<f32>, d2: vec3<f32>, t: vec3<f32>, x: vec3<f32>) -> vec3<f32> {
    //@if ANISOTROPIC
    return principal_times(k, d1, d2, t, x);
    //@else
    return axpy(dot(t, x) * (k.z - k.x), t, x * k.x);
    //@end
}

// R diag(k) R^T x, any k.
fn principal_times(k: vec3<f32>, d1: vec3<f32>, d2: vec3<f32>, t: vec3<f32>, x: vec3<f32>) -> vec3<f32> {
    return axpy(dot(d1, x) * k.x, d1, axpy(dot(d2, x) * k.y, d2, t * (dot(t, x) * k.z)));
}

//@if !VARYING_FIELD
//@repeat r TABLEAU_COUNT
// Takes three columns, number `k`, over one step whose stages are known, one after the other: the code of one column
// stays in the cache of a processor, and its numbers in registers.
fn step_columns_r(rod: Rod, segment: Flexible, lambda: f32, step: Step, k: u32, collects: bool) {
    //@if LOAD
    let weight = segment.w * lambda;
    //@end
    //@if MAGNET
    let mu = segment.mu * lambda;
    //@end
    for (var c = 0u; c < COLUMN_COUNT; c++) { //@unroll UNROLLED
        var dw: array<vec3<f32>, STAGES>;
        var ddp: array<vec3<f32>, STAGES>;
        //@if DM_VARIES
        var ddM: array<vec3<f32>, STAGES>;
        //@end
        let w_0 = columns[k].w[c];
        let dp_0 = columns[k].dp[c];
        let dM_0 = columns[k].dM[c];
        let dn_0 = force_of(k, c);
        for (var i = 0u; i < STAGE_COUNT_r; i++) { //@unroll
            var w = w_0;
            var dp = dp_0;
            var dM = dM_0;
            var dn = dn_0;
            for (var j = 0u; j < i; j++) { //@unroll
                //@if A[r][i][j]
                let ha = step.h * A[r][i][j];
                w = axpy(ha, dw[j], w);
                dp = axpy(ha, ddp[j], dp);
                //@if DM_VARIES
                dM = axpy(ha, ddM[j], dM);
                //@end
                //@end
            } //@end
            let stage = stages[i];
            //@if SOURCE_LOAD
            if k == FORWARD { dn = source_force(c, dn, step.h * C[r][i]); }
            //@end
            let dm = column_moment(k, dn, stage.p, stage.n, dp, dM);
            let x = cross_sub(w, stage.m, dm);
            let compliance = compliance_at(segment, stage.compliance);
            dw[i] = compliance_times(compliance, stage.d1, stage.d2, stage.t, x); // J1
            ddp[i] = cross(w, stage_velocity(stage)); // J2
            //@if SHEAR
            if segment.shears {
                let y = column_force(k, dn, stage.n, w);
                ddp[i] = ddp[i] + principal_times(segment.shear, stage.d1, stage.d2, stage.t, y); // J2
            }
            //@end
            //@if LOAD
            ddM[i] = cross(weight, dp); // J3
            //@end
            //@if MAGNET
            if segment.has_magnet {
                let mu_world = to_world(stage.d1, stage.d2, stage.t, mu);
                ddM[i] = cross_sub(cross(w, mu_world), rod.B, ddM[i]); // J3
            }
            //@end
            //@if SEGMENT_SOURCES
            if k == FORWARD {
                //@if SOURCE_BEND
                dw[i] = source_bend(c, C[r][i] * step.share + step.start, compliance, stage, dw[i]); // J1
                //@end
                //@if WANT_SHEAR_COMPLIANCE
                ddp[i] = source_shear(c, stage, ddp[i]); // J2
                //@end
                //@if DM_VARIES
                ddM[i] = source_couple(c, rod, segment, stage, ddM[i]); // J3
                //@end
            }
            //@end
            //@if COLLECTS[r][i]
            if collects {
                let at = C[r][i] * step.share + step.start;
                collect_integrals(rod, segment, step.h * B[r][i], at, stage, w, x, dp, dn, k, c);
            }
            //@end
        } //@end
        var w = w_0;
        var dp = dp_0;
        var dM = dM_0;
        for (var j = 0u; j < STAGE_COUNT_r; j++) { //@unroll
            //@if B[r][j]
            let hb = step.h * B[r][j];
            w = axpy(hb, dw[j], w);
            dp = axpy(hb, ddp[j], dp);
            //@if DM_VARIES
            dM = axpy(hb, ddM[j], dM);
            //@end
            //@end
        } //@end
        columns[k].w[c] = w;
        columns[k].dp[c] = dp;
        columns[k].dM[c] = dM;
        //@if SOURCE_LOAD
        if k == FORWARD { columns[k].dn[c] = source_force(c, dn_0, step.h); }
        //@end
    } //@end
}
//@end

// Takes three columns, number `k`, over a rigid segment; `state` and `n` are those before it.
fn cross_rigid_columns(rod: Rod, segment: Rigid, lambda: f32, n: vec3<f32>, state: State, k: u32) {
    let t = state.t;
    let dp = columns[k].dp;
    var arm = columns_cross(columns[k].w, t) * segment.length;
    //@if WANT_LENGTH
    //@if FORWARD
    if k == FORWARD { arm = outer(t, source.dL, arm); }
    //@end
    //@end
    //@if DIPOLE
    let mu_world = world_dipole(segment, state, lambda);
    let dtau = columns_cross(columns_cross(columns[k].w, mu_world), rod.B);
    columns[k].dM = columns[k].dM - dtau; // J4
    //@end
    columns[k].dp = dp + arm; // J4
    var n_after = n;
    //@if LOAD
    let weight = segment.w * lambda;
    //@if RIGID_FORCE_ARM
    let middle = columns_axpy(0.5, arm, dp);
    //@else
    let middle = dp;
    //@end
    columns[k].dM = columns_cross_sub(middle, weight, columns[k].dM); // J4
    n_after = n - weight;
    //@end
    //@if SEGMENT_SOURCES
    if k == FORWARD { source_cross_rigid(rod, segment, state); } // J4
    //@end
    //@if !RIGID_FORCE_ARM
    //@if FORCE
    columns[k].dM = columns_cross_add(arm, n_after, columns[k].dM);
    //@end
    //@if RECIPROCITY
    if k == BY_FORCE { columns[k].dM = columns[k].dM + hat(t * segment.length); }
    //@end
    //@if SOURCE_FORCE
    if k == FORWARD { columns[k].dM = columns_cross_sub(columns[k].dn, t * segment.length, columns[k].dM); }
    //@end
    //@end
}

// Takes three columns, number `k`, over the unloaded distal part: it turns and moves as a rigid body.
fn cross_free_columns(state: State, p_tip: vec3<f32>, k: u32) {
    columns[k].dp = columns[k].dp + columns_cross(columns[k].w, p_tip - state.p); // R6
}
//@end
