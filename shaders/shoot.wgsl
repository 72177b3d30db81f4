// One pass over the rod, base to tip, from a base moment: state, columns, and what they leave behind.
// src/lanes/shoot.rs

// Which threes of columns: by the base moment, by the base rotation, by the tip force.
const BY_MOMENT: u32 = 0u;
const BY_ROTATION: u32 = 1u;
const BY_FORCE: u32 = 2u;
const THREES: u32 = 3u; //@spec

// Steps over each segment: on the path, for the answer, for the error estimate.
const COARSE: u32 = 0u;
const FINE: u32 = 1u;
const CHECK: u32 = 2u;
const COARSE_STEPS: array<u32, 1> = array<u32, 1>(1u); //@spec
const STEPS: array<u32, 1> = array<u32, 1>(1u); //@spec
const STATION_COUNT: u32 = 2u; //@spec

// w of the first two threes at the end of a step.
struct Station {
    by_moment: mat3x3<f32>,
    by_rotation: mat3x3<f32>,
}

// The columns of the last pass that had any.
var<private> columns: array<Columns, THREES>;
//@if TRACES
// What each three columns leave behind on the segment in hand.
var<private> trace: array<Trace, THREES>;
//@end
// Stations of the last recorded pass, but for the one at the base.
var<private> stations: array<Station, STATION_COUNT>;
var<private> station_count: u32;

// The distal end of the rod after a pass.
struct Tip {
    p: vec3<f32>,
    d1: vec3<f32>,
    t: vec3<f32>,
    m: vec3<f32>,
    n: vec3<f32>,
}

// Three columns at the base: by the base moment.
fn moment_columns() -> Columns {
    return Columns(zero_matrix(), zero_matrix(), identity());
}

// Three columns at the base: by a virtual rotation of the base, in canonical form (dm = w x m0 / 2).
fn rotation_columns(m0: vec3<f32>) -> Columns {
    return Columns(identity(), zero_matrix(), hat(m0) * -0.5);
}

// Three columns at the base: by the tip force.
fn force_columns() -> Columns {
    return Columns(zero_matrix(), zero_matrix(), zero_matrix());
}

fn identity() -> mat3x3<f32> {
    return mat3x3<f32>(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 1.0, 0.0), vec3<f32>(0.0, 0.0, 1.0));
}

fn zero_matrix() -> mat3x3<f32> {
    return mat3x3<f32>();
}

fn is_flexible(index: u32) -> bool {
    var flexible = false;
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        //@if FLEXIBLE[j]
        flexible = flexible || index == j;
        //@end
    } //@end
    return flexible;
}

fn step_count(index: u32, resolution: u32) -> u32 {
    var coarse = 0u;
    var fine = 0u;
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        coarse = select(coarse, COARSE_STEPS[j], index == j);
        fine = select(fine, STEPS[j], index == j);
    } //@end
    return select(select(fine, 2u * fine, resolution == CHECK), coarse, resolution == COARSE);
}

// Appends a station.
fn add_station() {
    stations[station_count] = Station(columns[BY_MOMENT].w, columns[BY_ROTATION].w);
    station_count += 1u;
}

// Integrates the rod from base moment `m0` at load fraction `lambda`, with it as many threes of columns.
//
// With `record` set the columns leave traces and stations.
fn shoot(resolution: u32, rod: Rod, lambda: f32, m0: vec3<f32>, threes: u32, record: bool) -> Tip {
    var state = State(vec3<f32>(), rod.d1, rod.t, m0);
    var n = base_force(rod) * lambda;
    let tableau = select(TABLEAU_COUNT - 1u, 0u, resolution == COARSE);
    if threes > 0u {
        columns[BY_MOMENT] = moment_columns();
        columns[BY_ROTATION] = rotation_columns(m0);
        //@if DERIVATIVES
        columns[BY_FORCE] = force_columns();
        //@end
    }
    if record {
        station_count = 0u;
    }
    let collects = record && threes == THREES;
    //@if TRACES
    if collects { clear_functionals(); }
    //@end
    for (var index = 0u; index < SEGMENT_COUNT; index++) {
        //@if TRACES
        if collects { trace = array<Trace, THREES>(); }
        //@end
        if is_flexible(index) {
            let segment = load_flexible(index, rod.softness);
            let steps = step_count(index, resolution);
            let h = segment.length / f32(steps);
            for (var i = 0u; i < steps; i++) {
                for (var r = 0u; r < TABLEAU_COUNT; r++) { //@unroll
                    if tableau == r {
                        step_rod_r(segment, lambda, h, n, &state);
                        for (var k = 0u; k < THREES; k++) { //@unroll
                            if k < threes { step_columns_r(segment, lambda, h, k, collects); }
                        } //@end
                    }
                } //@end
                //@if LOAD
                n = axpy(-h * lambda, segment.w, n); // R1
                //@end
                if record { add_station(); }
            }
            //@if COLLECT_LENGTH
            if collects && steps > 0u {
                let m = moment(state.p, state.M, n);
                let d2 = cross(state.t, state.d1);
                let omega = curvature(segment, state.d1, d2, state.t, m);
                collect_length(state, m, n, segment.w, omega);
            }
            //@end
        //@if RIGID
        } else {
            let segment = load_rigid(index);
            for (var k = 0u; k < THREES; k++) { //@unroll
                if k < threes {
                    //@if COLLECT_COIL
                    if collects { collect_coil(rod, segment, lambda, state, k); }
                    //@end
                    cross_rigid_columns(rod, segment, lambda, n, state, k);
                    //@if COLLECT_LOAD
                    if collects { collect_rigid_load(segment.length, state.t, k); }
                    //@end
                }
            } //@end
            cross_rigid(rod, segment, lambda, &n, &state);
            //@if COLLECT_LENGTH
            if collects {
                let m = moment(state.p, state.M, n);
                collect_length(state, m, n, segment.w, vec3<f32>());
            }
            //@end
        //@end
        }
        //@if TRACES
        if collects { gather_functionals(index); }
        //@end
    }
    return Tip(state.p, state.d1, state.t, moment(state.p, state.M, n), n);
}

//@if COLLECT_LENGTH
// The change of H of every three columns.
fn collect_length(state: State, m: vec3<f32>, n: vec3<f32>, w: vec3<f32>, curvature: vec3<f32>) {
    for (var k = 0u; k < THREES; k++) { //@unroll
        trace[k].length = length_row(state, m, n, w, curvature, k == BY_FORCE, columns[k]);
    } //@end
}
//@end

//@if COLLECT_LOAD
// Integral of dp over a rigid segment, from the columns at its distal end.
fn collect_rigid_load(length: f32, t: vec3<f32>, k: u32) {
    let half = length * 0.5;
    let middle = columns_axpy(-half, columns_cross(columns[k].w, t), columns[k].dp);
    let rows = transpose(middle * length);
    for (var j = 0u; j < 3u; j++) { //@unroll
        trace[k].load[j] = rows[j];
    } //@end
}
//@end

// dm of three columns at the tip.
fn tip_moment_columns(tip: Tip, k: u32) -> mat3x3<f32> {
    return column_moment(k == BY_FORCE, tip.p, tip.n, columns[k].dp, columns[k].dM);
}
