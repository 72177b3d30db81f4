// Sensitivity columns in threes: virtual rotation w, displacement dp and dM of each. J1 to J4. src/lanes/column.rs

// Three columns; those of a unit tip force carry dn = e_k.
struct Columns {
    w: mat3x3<f32>,
    dp: mat3x3<f32>,
    dM: mat3x3<f32>,
}

// What three columns leave behind on a segment; `row[j]`, a column of WGSL, holds component j of each.
struct Trace {
    //@if COLLECT_CURVATURE
    // Integral of dm_b,j, and of dm_b,j m_b,j.
    rest_curvature: mat3x3<f32>,
    stiffness: mat3x3<f32>,
    //@end
    //@if COLLECT_LOAD
    // Integral of dp_j.
    load: mat3x3<f32>,
    //@end
    //@if COLLECT_COIL
    // w . (R e_j x B) and (w x R mu)_j on a rigid segment.
    dipole: mat3x3<f32>,
    field: mat3x3<f32>,
    //@end
    // Change of H at the distal end.
    length: vec3<f32>,
}

// dm of three columns, from dM.
fn column_moment(unit_force: bool, p: vec3<f32>, n: vec3<f32>, dp: mat3x3<f32>, dM: mat3x3<f32>) -> mat3x3<f32> {
    var dm = dM;
    if unit_force { dm = dM - hat(p); } // J3
    //@if FORCE
    return columns_cross_sub(dp, n, dm); // J3
    //@else
    return dm;
    //@end
}

// a row^T + sum
fn outer(a: vec3<f32>, row: vec3<f32>, sum: mat3x3<f32>) -> mat3x3<f32> {
    return mat3x3<f32>(axpy(row.x, a, sum[0]), axpy(row.y, a, sum[1]), axpy(row.z, a, sum[2]));
}

// C x = R K^-1 R^T x for three vectors.
fn compliance_times(
    segment: Flexible, d1: vec3<f32>, d2: vec3<f32>, t: vec3<f32>, x: mat3x3<f32>,
) -> mat3x3<f32> {
    let k = segment.compliance;
    //@if ANISOTROPIC
    let x1 = row_times(d1, x) * k.x;
    let x2 = row_times(d2, x) * k.y;
    let x3 = row_times(t, x) * k.z;
    let sum = mat3x3<f32>(t * x3.x, t * x3.y, t * x3.z);
    return outer(d1, x1, outer(d2, x2, sum));
    //@else
    return outer(t, row_times(t, x) * (k.z - k.x), x * k.x);
    //@end
}

//@repeat r TABLEAU_COUNT
// Takes three columns, number `k` in the traces, over one step whose stages are known.
fn step_columns_r(segment: Flexible, lambda: f32, h: f32, k: u32, integrates: bool) {
    let unit_force = k == BY_FORCE;
    var three = columns[k];
    var dw: array<mat3x3<f32>, STAGES>;
    var ddp: array<mat3x3<f32>, STAGES>;
    //@if LOAD
    var ddM: array<mat3x3<f32>, STAGES>;
    let weight = segment.w * lambda;
    //@end
    //@if COLLECTS[r]
    var x_stages: array<mat3x3<f32>, STAGES>;
    var dp_stages: array<mat3x3<f32>, STAGES>;
    //@end
    for (var i = 0u; i < STAGE_COUNT_r; i++) { //@unroll
        var w = three.w;
        var dp = three.dp;
        var dM = three.dM;
        for (var j = 0u; j < i; j++) { //@unroll
            //@if A[r][i][j]
            let ha = h * A[r][i][j];
            w = columns_axpy(ha, dw[j], w);
            dp = columns_axpy(ha, ddp[j], dp);
            //@if LOAD
            dM = columns_axpy(ha, ddM[j], dM);
            //@end
            //@end
        } //@end
        let stage = stages[i];
        let dm = column_moment(unit_force, stage.p, stage.n, dp, dM);
        let x = columns_cross_sub(w, stage.m, dm);
        dw[i] = compliance_times(segment, stage.d1, stage.d2, stage.t, x); // J1
        ddp[i] = columns_cross(w, stage.t); // J2
        //@if LOAD
        ddM[i] = columns_cross(dp, -weight); // J3
        //@end
        //@if COLLECTS[r]
        x_stages[i] = x;
        dp_stages[i] = dp;
        //@end
    } //@end
    for (var j = 0u; j < STAGE_COUNT_r; j++) { //@unroll
        //@if B[r][j]
        let hb = h * B[r][j];
        three.w = columns_axpy(hb, dw[j], three.w);
        three.dp = columns_axpy(hb, ddp[j], three.dp);
        //@if LOAD
        three.dM = columns_axpy(hb, ddM[j], three.dM);
        //@end
        //@end
    } //@end
    columns[k] = three;
    //@if COLLECTS[r]
    if integrates { collect_integrals(h, &x_stages, &dp_stages, k); }
    //@end
}
//@end

//@if COLLECTS
// Adds a step's part of the integrals that the derivatives need, with the stepper's own weights.
fn collect_integrals(
    h: f32,
    x: ptr<function, array<mat3x3<f32>, STAGES>>,
    dp: ptr<function, array<mat3x3<f32>, STAGES>>,
    k: u32,
) {
    var sum = trace[k];
    for (var i = 0u; i < STAGES; i++) { //@unroll
        //@if WEIGHT[i]
        let hb = h * B[TABLEAU_COUNT - 1u][i];
        let stage = stages[i];
        //@if COLLECT_CURVATURE
        let d = mat3x3<f32>(stage.d1, stage.d2, stage.t);
        for (var j = 0u; j < 3u; j++) { //@unroll
            let dm_body = row_times(d[j], (*x)[i]) * hb;
            sum.rest_curvature[j] = sum.rest_curvature[j] + dm_body;
            sum.stiffness[j] = axpy(dot(d[j], stage.m), dm_body, sum.stiffness[j]);
        } //@end
        //@end
        //@if COLLECT_LOAD
        let rows = transpose((*dp)[i]);
        for (var j = 0u; j < 3u; j++) { //@unroll
            sum.load[j] = axpy(hb, rows[j], sum.load[j]);
        } //@end
        //@end
        //@end
    } //@end
    trace[k] = sum;
}
//@end

// Change of H = m_b . K^-1 m_b / 2 + m_b . u* + n . t at the distal end of a segment.
//
// `curvature` is R u there; on a rigid segment it is zero.
fn length_row(
    state: State, m: vec3<f32>, n: vec3<f32>, w: vec3<f32>, curvature: vec3<f32>, unit_force: bool, three: Columns,
) -> vec3<f32> {
    var row = vec3<f32>();
    if unit_force { row = state.t; }
    let dm = column_moment(unit_force, state.p, n, three.dp, three.dM);
    row = row + row_times(curvature, columns_cross_sub(three.w, m, dm));
    //@if FORCE
    row = row + row_times(n, columns_cross(three.w, state.t));
    //@end
    //@if LOAD
    row = row + row_times(w, three.dp);
    //@end
    return row;
}

// Takes three columns over a rigid segment; `state` and `n` are those before it.
fn cross_rigid_columns(rod: Rod, segment: Rigid, lambda: f32, n: vec3<f32>, state: State, k: u32) {
    let length = segment.length;
    let t = state.t;
    let three = columns[k];
    let wt = columns_cross(three.w, t);
    let dp = three.dp;
    var dM = three.dM;
    //@if DIPOLE
    let mu_world = world_dipole(segment, state, lambda);
    let dtau = columns_cross(columns_cross(three.w, mu_world), rod.B);
    dM = dM - dtau; // J4
    //@end
    columns[k].dp = columns_axpy(length, wt, dp); // J4
    var n_after = n;
    //@if LOAD
    let weight = segment.w * (lambda * length);
    //@if RIGID_FORCE_ARM
    let middle = columns_axpy(length * 0.5, wt, dp);
    //@else
    let middle = dp;
    //@end
    dM = columns_cross_sub(middle, weight, dM); // J4
    n_after = n - weight;
    //@end
    //@if !RIGID_FORCE_ARM
    //@if FORCE
    dM = columns_cross_add(wt * length, n_after, dM);
    //@end
    if k == BY_FORCE { dM = dM + hat(t * length); }
    //@end
    columns[k].dM = dM;
}

//@if COLLECT_COIL
// What a coil contributes: w . (R e_j x B) and (w x R mu)_j.
fn collect_coil(rod: Rod, segment: Rigid, lambda: f32, state: State, k: u32) {
    let w = columns[k].w;
    let d = mat3x3<f32>(state.d1, cross(state.t, state.d1), state.t);
    for (var j = 0u; j < 3u; j++) { //@unroll
        trace[k].dipole[j] = row_times(cross(d[j], rod.B), w);
    } //@end
    let mu_world = world_dipole(segment, state, lambda);
    let field = transpose(columns_cross(w, mu_world));
    for (var j = 0u; j < 3u; j++) { //@unroll
        trace[k].field[j] = field[j];
    } //@end
}
//@end
