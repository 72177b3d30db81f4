// One step of the rod: the stages once, for every column to use. src/lanes/step.rs
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
}

// Stages of the last step.
var<private> stages: array<Stage, STAGES>;

//@repeat r TABLEAU_COUNT
// Takes the rod over one step of length `h`; `n` is the force at its start.
fn step_rod_r(segment: Flexible, lambda: f32, h: f32, n: vec3<f32>, state: ptr<function, State>) {
    var dd1: array<vec3<f32>, STAGES>;
    var dt: array<vec3<f32>, STAGES>;
    //@if LOAD
    var dM: array<vec3<f32>, STAGES>;
    let weight = segment.w * lambda;
    //@end
    for (var i = 0u; i < STAGE_COUNT_r; i++) { //@unroll
        var p = (*state).p;
        var d1 = (*state).d1;
        var t = (*state).t;
        var M = (*state).M;
        for (var j = 0u; j < i; j++) { //@unroll
            //@if A[r][i][j]
            let ha = h * A[r][i][j];
            p = axpy(ha, stages[j].t, p); // R2
            d1 = axpy(ha, dd1[j], d1);
            t = axpy(ha, dt[j], t);
            //@if LOAD
            M = axpy(ha, dM[j], M);
            //@end
            //@end
        } //@end
        var n_stage = n;
        //@if LOAD
        n_stage = axpy(-h * C[r][i], weight, n); // R1
        //@end
        let d2 = cross(t, d1);
        let m = moment(p, M, n_stage);
        let omega = curvature(segment, d1, d2, t, m);
        stages[i] = Stage(p, d1, d2, t, m, n_stage);
        dd1[i] = cross(omega, d1); // R2
        dt[i] = cross(omega, t); // R2
        //@if LOAD
        dM[i] = -cross(p, weight); // R1
        //@end
    } //@end
    for (var j = 0u; j < STAGE_COUNT_r; j++) { //@unroll
        //@if B[r][j]
        let hb = h * B[r][j];
        (*state).p = axpy(hb, stages[j].t, (*state).p);
        (*state).d1 = axpy(hb, dd1[j], (*state).d1);
        (*state).t = axpy(hb, dt[j], (*state).t);
        //@if LOAD
        (*state).M = axpy(hb, dM[j], (*state).M);
        //@end
        //@end
    } //@end
}
//@end
