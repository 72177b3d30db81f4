// One step of the rod: the stages once, for every column to use. crates/core/src/cpu/rod/step.rs
//
// The functions of a tableau are emitted once for each: r = 0 follows the path, the last gives the answer.

const TABLEAU_COUNT: u32 = 1u; //@spec
const STAGES: u32 = 4u; //@spec
const A: array<array<array<f32, 1>, 1>, 1> = array<array<array<f32, 1>, 1>, 1>(); //@spec
const B: array<array<f32, 1>, 1> = array<array<f32, 1>, 1>(); //@spec
const C: array<array<f32, 1>, 1> = array<array<f32, 1>, 1>(); //@spec

// The rod at one stage.
struct Stage {
    p: vec3<f32>,
    d1: vec3<f32>,
    d2: vec3<f32>,
    t: vec3<f32>,
    m: vec3<f32>,
    n: vec3<f32>,
    // p' = R nu and the section's compliance, where they are needed.
    v: vec3<f32>,
    compliance: vec3<f32>,
}

//@if !VARYING_FIELD
// One step of several equal ones over a segment.
struct Step {
    // Its length.
    h: f32,
    // Its start and its length as shares of the segment.
    start: f32,
    share: f32,
    // Force at its start.
    n: vec3<f32>,
}
//@end

// Stages of the last step.
var<private> stages: array<Stage, STAGES>;

// p' at a stage.
fn stage_velocity(stage: Stage) -> vec3<f32> {
    //@if SHEAR
    return stage.v;
    //@else
    return stage.t;
    //@end
}

//@if !VARYING_FIELD
//@repeat r TABLEAU_COUNT
// Takes the rod over one step.
fn step_rod_r(rod: Rod, segment: Flexible, lambda: f32, step: Step, state: ptr<function, State>) {
    var dd1: array<vec3<f32>, STAGES>;
    var dt: array<vec3<f32>, STAGES>;
    //@if M_VARIES
    var dM: array<vec3<f32>, STAGES>;
    //@end
    //@if LOAD
    let weight = segment.w * lambda;
    //@end
    //@if MAGNET
    let mu = segment.mu * lambda;
    //@end
    for (var i = 0u; i < STAGE_COUNT_r; i++) { //@unroll
        var p = (*state).p;
        var d1 = (*state).d1;
        var t = (*state).t;
        var M = (*state).M;
        for (var j = 0u; j < i; j++) { //@unroll
            //@if A[r][i][j]
            let ha = step.h * A[r][i][j];
            p = axpy(ha, stage_velocity(stages[j]), p); // R2
            d1 = axpy(ha, dd1[j], d1);
            t = axpy(ha, dt[j], t);
            //@if M_VARIES
            M = axpy(ha, dM[j], M);
            //@end
            //@end
        } //@end
        let at = section(segment, C[r][i] * step.share + step.start);
        var n = step.n;
        //@if LOAD
        n = axpy(-step.h * C[r][i], weight, n); // R1
        //@end
        let d2 = cross(t, d1);
        let m = moment(p, M, n);
        let omega = curvature(at, d1, d2, t, m);
        stages[i].p = p;
        stages[i].d1 = d1;
        stages[i].d2 = d2;
        stages[i].t = t;
        stages[i].m = m;
        stages[i].n = n;
        //@if SHEAR
        stages[i].v = velocity(segment, d1, d2, t, n);
        //@end
        //@if TAPER
        stages[i].compliance = at.compliance;
        //@end
        dd1[i] = cross(omega, d1); // R2
        dt[i] = cross(omega, t); // R2
        //@if LOAD
        dM[i] = -cross(p, weight); // R1
        //@end
        //@if MAGNET
        if segment.has_magnet { dM[i] = cross_sub(to_world(d1, d2, t, mu), rod.B, dM[i]); } // R1
        //@end
    } //@end
    for (var j = 0u; j < STAGE_COUNT_r; j++) { //@unroll
        //@if B[r][j]
        let hb = step.h * B[r][j];
        (*state).p = axpy(hb, stage_velocity(stages[j]), (*state).p);
        (*state).d1 = axpy(hb, dd1[j], (*state).d1);
        (*state).t = axpy(hb, dt[j], (*state).t);
        //@if M_VARIES
        (*state).M = axpy(hb, dM[j], (*state).M);
        //@end
        //@end
    } //@end
}
//@end
//@end
