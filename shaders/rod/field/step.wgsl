// One step over a flexible segment in a field that varies: the rod once, then every column. F2, F6, J1, J2
// crates/core/src/cpu/rod/field/step.rs

// The rod at one place.
struct State {
    p: vec3<f32>,
    d1: vec3<f32>,
    t: vec3<f32>,
    m: vec3<f32>,
    n: vec3<f32>,
}

// Three columns.
struct Columns {
    w: mat3x3<f32>,
    dp: mat3x3<f32>,
    dm: mat3x3<f32>,
    dn: mat3x3<f32>,
}

// What three columns are the change by: force, moment, rotation or displacement at the base or at the start of an interval,
// or parameters.
const BY_FORCE: u32 = 0u;
const BY_MOMENT: u32 = 1u;
const BY_ROTATION: u32 = 2u;
const BY_DISPLACEMENT: u32 = 3u;
const BY_PARAMETERS: u32 = 4u;

// One of several equal steps over a segment under part of its loads.
struct Step {
    // Its length.
    h: f32,
    // Its start and its length as shares of the segment.
    start: f32,
    share: f32,
    lambda: f32,
}

// The three in hand.
var<private> columns: Columns;

//@if MAGNET
// The field at one stage.
struct Magnetic {
    mu: vec3<f32>,
    here: Local,
}

// At the stages of the last step.
var<private> magnetic: array<Magnetic, STAGES>;
//@end

//@repeat r TABLEAU_COUNT
// Takes the rod over one step; `with_columns` says whether columns will follow.
fn step_rod_r(segment: Flexible, step: Step, with_columns: bool, state: ptr<function, State>) {
    var dd1: array<vec3<f32>, STAGES>;
    var dt: array<vec3<f32>, STAGES>;
    var dm: array<vec3<f32>, STAGES>;
    //@if N_VARIES
    var dn: array<vec3<f32>, STAGES>;
    //@end
    for (var i = 0u; i < STAGE_COUNT_r; i++) { //@unroll
        var p = (*state).p;
        var d1 = (*state).d1;
        var t = (*state).t;
        var m = (*state).m;
        var n = (*state).n;
        for (var j = 0u; j < i; j++) { //@unroll
            //@if A[r][i][j]
            let ha = step.h * A[r][i][j];
            p = axpy(ha, stage_velocity(stages[j]), p);
            d1 = axpy(ha, dd1[j], d1);
            t = axpy(ha, dt[j], t);
            m = axpy(ha, dm[j], m);
            //@if N_VARIES
            n = axpy(ha, dn[j], n);
            //@end
            //@end
        } //@end
        let at = section(segment, C[r][i] * step.share + step.start);
        let d2 = cross(t, d1);
        let omega = curvature(at, d1, d2, t, m);
        let v = velocity(segment, d1, d2, t, n);
        dd1[i] = cross(omega, d1);
        dt[i] = cross(omega, t);
        dm[i] = cross(n, v);
        //@if LOAD
        dn[i] = segment.w * -step.lambda;
        //@end
        //@if MAGNET
        if segment.has_magnet {
            let mu = to_world(d1, d2, t, segment.mu * step.lambda);
            let here = local(p, mu, with_columns);
            dm[i] = cross_sub(mu, here.B, dm[i]); // F2
            dn[i] = dn[i] - here.G * mu; // F2
            magnetic[i] = Magnetic(mu, here);
        }
        //@end
        stages[i] = Stage(p, d1, d2, t, m, n, v, at.compliance);
    } //@end
    for (var j = 0u; j < STAGE_COUNT_r; j++) { //@unroll
        //@if B[r][j]
        let hb = step.h * B[r][j];
        (*state).p = axpy(hb, stage_velocity(stages[j]), (*state).p);
        (*state).d1 = axpy(hb, dd1[j], (*state).d1);
        (*state).t = axpy(hb, dt[j], (*state).t);
        (*state).m = axpy(hb, dm[j], (*state).m);
        //@if N_VARIES
        (*state).n = axpy(hb, dn[j], (*state).n);
        //@end
        //@end
    } //@end
}
//@end

//@repeat r TABLEAU_COUNT
// Takes three columns over a step whose stages are known; `by` says of what.
fn step_columns_r(segment: Flexible, step: Step, by: u32) {
    //@if MAGNET
    //@if FORWARD
    // What the parameters change of the field, at every stage of the answer's method.
    var changes: array<FieldChange, STAGES>;
    if by == BY_PARAMETERS && segment.has_magnet {
        for (var i = 0u; i < STAGES; i++) {
            changes[i] = parameters_field(stages[i].p, magnetic[i].mu);
        }
    }
    //@end
    //@end
    for (var c = 0u; c < 3u; c++) { //@unroll UNROLLED
        var dw: array<vec3<f32>, STAGES>;
        var ddp: array<vec3<f32>, STAGES>;
        var ddm: array<vec3<f32>, STAGES>;
        //@if DN_VARIES
        var ddn: array<vec3<f32>, STAGES>;
        //@end
        let w_0 = columns.w[c];
        let dp_0 = columns.dp[c];
        let dm_0 = columns.dm[c];
        let dn_0 = columns.dn[c];
        for (var i = 0u; i < STAGE_COUNT_r; i++) { //@unroll
            var w = w_0;
            var dp = dp_0;
            var dm = dm_0;
            var dn = dn_0;
            for (var j = 0u; j < i; j++) { //@unroll
                //@if A[r][i][j]
                let ha = step.h * A[r][i][j];
                w = axpy(ha, dw[j], w);
                dp = axpy(ha, ddp[j], dp);
                dm = axpy(ha, ddm[j], dm);
                //@if DN_VARIES
                dn = axpy(ha, ddn[j], dn);
                //@end
                //@end
            } //@end
            let stage = stages[i];
            let compliance = compliance_at(segment, stage.compliance);
            let x = cross_sub(w, stage.m, dm);
            dw[i] = compliance_times(compliance, stage.d1, stage.d2, stage.t, x); // J1
            ddp[i] = cross(w, stage_velocity(stage)); // J2
            //@if SHEAR
            if segment.shears {
                let y = cross_sub(w, stage.n, dn);
                ddp[i] = ddp[i] + principal_times(segment.shear, stage.d1, stage.d2, stage.t, y); // J2
            }
            //@end
            //@if SEGMENT_SOURCES
            if by == BY_PARAMETERS {
                //@if SOURCE_BEND
                dw[i] = source_bend(c, C[r][i] * step.share + step.start, compliance, stage, dw[i]); // J1
                //@end
                //@if WANT_SHEAR_COMPLIANCE
                ddp[i] = source_shear(c, stage, ddp[i]); // J2
                //@end
                //@if SOURCE_LOAD
                ddn[i] = -source.dload[c];
                //@end
            }
            //@end
            ddm[i] = cross_sub(ddp[i], stage.n, cross(dn, stage_velocity(stage))); // J3
            //@if MAGNET
            if segment.has_magnet {
                let mu = magnetic[i].mu;
                let here = magnetic[i].here;
                var dmu = cross(w, mu);
                var dB = here.G * dp;
                var dF = here.T3 * dp;
                //@if FORWARD
                if by == BY_PARAMETERS {
                    //@if SEGMENT_SOURCES
                    dmu = dmu + to_world(stage.d1, stage.d2, stage.t, source.dmu[c]);
                    //@end
                    dB = dB + changes[i].dB[c];
                    dF = dF + changes[i].dF[c];
                }
                //@end
                ddm[i] = cross_sub(dmu, here.B, cross_sub(mu, dB, ddm[i])); // F6
                ddn[i] = ddn[i] - dF - here.G * dmu; // F6
            }
            //@end
        } //@end
        var w = w_0;
        var dp = dp_0;
        var dm = dm_0;
        var dn = dn_0;
        for (var j = 0u; j < STAGE_COUNT_r; j++) { //@unroll
            //@if B[r][j]
            let hb = step.h * B[r][j];
            w = axpy(hb, dw[j], w);
            dp = axpy(hb, ddp[j], dp);
            dm = axpy(hb, ddm[j], dm);
            //@if DN_VARIES
            dn = axpy(hb, ddn[j], dn);
            //@end
            //@end
        } //@end
        columns.w[c] = w;
        columns.dp[c] = dp;
        columns.dm[c] = dm;
        columns.dn[c] = dn;
    } //@end
}
//@end
