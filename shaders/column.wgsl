// Sensitivity columns in threes: virtual rotation w, displacement dp and dM of each. J1 to J4. src/lanes/column.rs

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

// dn of three columns: none, the unit matrix, or what forward columns carry.
struct Force {
    is_unit: bool,
    is_forward: bool,
    dn: mat3x3<f32>,
}

// dn of three columns, by their number, which no register has to hold.
fn force_of(k: u32) -> Force {
    var dn: Force;
    //@if RECIPROCITY
    dn.is_unit = k == BY_FORCE;
    //@end
    //@if SOURCE_FORCE
    dn.is_forward = k == FORWARD;
    dn.dn = columns[k].dn;
    //@end
    return dn;
}

// dm of three columns, from dM.
fn column_moment(dn: Force, p: vec3<f32>, n: vec3<f32>, dp: mat3x3<f32>, dM: mat3x3<f32>) -> mat3x3<f32> {
    var dm = dM;
    if dn.is_unit { dm = dM - hat(p); }
    if dn.is_forward { dm = columns_cross_add(dn.dn, p, dM); } // J3
    //@if FORCE
    return columns_cross_sub(dp, n, dm); // J3
    //@else
    return dm;
    //@end
}

// dn - w x n of three columns: what the force changes by in the body frame.
fn column_force(dn: Force, n: vec3<f32>, w: mat3x3<f32>) -> mat3x3<f32> {
    let turned = columns_cross(w, n);
    if dn.is_unit { return identity() - turned; }
    if dn.is_forward { return dn.dn - turned; }
    return -1.0 * turned;
}

// R diag(k) R^T x for three vectors.
fn compliance_times(k: vec3<f32>, d1: vec3<f32>, d2: vec3<f32>, t: vec3<f32>, x: mat3x3<f32>) -> mat3x3<f32> {
    //@if ANISOTROPIC
    return principal_times(k, d1, d2, t, x);
    //@else
    return outer(t, row_times(t, x) * (k.z - k.x), x * k.x);
    //@end
}

// R diag(k) R^T x, any k.
fn principal_times(k: vec3<f32>, d1: vec3<f32>, d2: vec3<f32>, t: vec3<f32>, x: mat3x3<f32>) -> mat3x3<f32> {
    let x1 = row_times(d1, x) * k.x;
    let x2 = row_times(d2, x) * k.y;
    let x3 = row_times(t, x) * k.z;
    let sum = mat3x3<f32>(t * x3.x, t * x3.y, t * x3.z);
    return outer(d1, x1, outer(d2, x2, sum));
}

//@repeat r TABLEAU_COUNT
// Takes three columns, number `k`, over one step whose stages are known.
fn step_columns_r(rod: Rod, segment: Flexible, lambda: f32, step: Step, k: u32, collects: bool) {
    var three = columns[k];
    var dw: array<mat3x3<f32>, STAGES>;
    var ddp: array<mat3x3<f32>, STAGES>;
    //@if DM_VARIES
    var ddM: array<mat3x3<f32>, STAGES>;
    //@end
    //@if LOAD
    let weight = segment.w * lambda;
    //@end
    //@if MAGNET
    let mu = segment.mu * lambda;
    //@end
    for (var i = 0u; i < STAGE_COUNT_r; i++) { //@unroll
        var w = three.w;
        var dp = three.dp;
        var dM = three.dM;
        for (var j = 0u; j < i; j++) { //@unroll
            //@if A[r][i][j]
            let ha = step.h * A[r][i][j];
            w = columns_axpy(ha, dw[j], w);
            dp = columns_axpy(ha, ddp[j], dp);
            //@if DM_VARIES
            dM = columns_axpy(ha, ddM[j], dM);
            //@end
            //@end
        } //@end
        let stage = stages[i];
        var dn = force_of(k);
        //@if SOURCE_LOAD
        dn = source_force(dn, step.h * C[r][i]);
        //@end
        let dm = column_moment(dn, stage.p, stage.n, dp, dM);
        let x = columns_cross_sub(w, stage.m, dm);
        let compliance = compliance_at(segment, stage.compliance);
        dw[i] = compliance_times(compliance, stage.d1, stage.d2, stage.t, x); // J1
        ddp[i] = columns_cross(w, stage_velocity(stage)); // J2
        //@if SHEAR
        if segment.shears {
            let y = column_force(dn, stage.n, w);
            ddp[i] = ddp[i] + principal_times(segment.shear, stage.d1, stage.d2, stage.t, y); // J2
        }
        //@end
        //@if LOAD
        ddM[i] = columns_cross(dp, -weight); // J3
        //@end
        //@if MAGNET
        if segment.has_magnet {
            let mu_world = to_world(stage.d1, stage.d2, stage.t, mu);
            ddM[i] = columns_cross_sub(columns_cross(w, mu_world), rod.B, ddM[i]); // J3
        }
        //@end
        //@if SEGMENT_SOURCES
        if k == FORWARD {
            //@if SOURCE_BEND
            dw[i] = source_bend(C[r][i] * step.share + step.start, compliance, stage, dw[i]); // J1
            //@end
            //@if WANT_SHEAR_COMPLIANCE
            ddp[i] = source_shear(stage, ddp[i]); // J2
            //@end
            //@if DM_VARIES
            ddM[i] = source_couple(rod, segment, stage, ddM[i]); // J3
            //@end
        }
        //@end
        //@if COLLECTS[r][i]
        if collects {
            let at = C[r][i] * step.share + step.start;
            collect_integrals(rod, segment, step.h * B[r][i], at, stage, w, x, dp, dn, k);
        }
        //@end
    } //@end
    for (var j = 0u; j < STAGE_COUNT_r; j++) { //@unroll
        //@if B[r][j]
        let hb = step.h * B[r][j];
        three.w = columns_axpy(hb, dw[j], three.w);
        three.dp = columns_axpy(hb, ddp[j], three.dp);
        //@if DM_VARIES
        three.dM = columns_axpy(hb, ddM[j], three.dM);
        //@end
        //@end
    } //@end
    //@if SOURCE_LOAD
    three.dn = source_force(force_of(k), step.h).dn;
    //@end
    columns[k] = three;
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
    let dn = force_of(k);
    if dn.is_unit { columns[k].dM = columns[k].dM + hat(t * segment.length); }
    if dn.is_forward { columns[k].dM = columns_cross_sub(dn.dn, t * segment.length, columns[k].dM); }
    //@end
}

// Takes three columns, number `k`, over the unloaded distal part: it turns and moves as a rigid body.
fn cross_free_columns(state: State, p_tip: vec3<f32>, k: u32) {
    columns[k].dp = columns[k].dp + columns_cross(columns[k].w, p_tip - state.p); // R6
}
