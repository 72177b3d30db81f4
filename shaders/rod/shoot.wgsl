// One pass over the rod, base to tip, from a base moment: state, columns, and what they leave behind.
// crates/core/src/cpu/rod/shoot.rs

// Which threes of columns: by the base moment, then by the tip force or by three parameters, by the base rotation.
const BY_MOMENT: u32 = 0u;
const BY_FORCE: u32 = 1u;
const FORWARD: u32 = 1u;
const BY_ROTATION: u32 = 2u; //@spec
const THREES: u32 = 3u; //@spec

// Which of them a pass takes, a bit for each: none, those of a path, with those of stability, those of the answer.
const NO_COLUMNS: u32 = 0u;
const PATH_COLUMNS: u32 = 1u;
const STABILITY_COLUMNS: u32 = 5u; //@spec
const ANSWER_COLUMNS: u32 = 7u; //@spec
const FORWARD_COLUMNS: u32 = 2u;

// Intervals of the stability index over a segment of many steps, at least, and the shortest as a share of the rod.
const STATIONS_EACH: u32 = 1u; //@spec
const SHORTEST_INTERVAL: f32 = 0.0; //@spec
const UNBUCKLED: f32 = 0.0; //@spec

// The columns of the last pass that had any.
var<private> columns: array<Columns, THREES>;

// The largest moment at the ends of flexible segments of a rod that is stiff.
var<private> largest_moment: f32;

// The distal end of the rod after a pass.
struct Tip {
    p: vec3<f32>,
    d1: vec3<f32>,
    t: vec3<f32>,
    m: vec3<f32>,
    n: vec3<f32>,
}

// Integrates the rod from base moment `m0` at load fraction `lambda`, the columns `taken` with it.
//
// With `record` set they leave stability; those of the answer always leave traces.
fn shoot(resolution: u32, rod: Rod, lambda: f32, m0: vec3<f32>, taken: u32, record: bool) -> Tip {
    var state = State(vec3<f32>(), rod.d1, rod.t, m0);
    var n = rod.n0 * lambda;
    var s = 0.0;
    let shortest = rod.flexible_length * SHORTEST_INTERVAL;
    let tableau = select(TABLEAU_COUNT - 1u, 0u, resolution == COARSE);
    //@if LANES
    // Another invocation carries them.
    let rotates = true;
    //@else
    //@if ROTATION
    let rotates = (taken & (1u << BY_ROTATION)) != 0u;
    //@else
    let rotates = false;
    //@end
    //@end
    //@if COLLECTS_RESPONSES
    let complete = collects_traces;
    //@else
    let complete = (taken & FORWARD_COLUMNS) != 0u;
    //@end
    if record { station = Station(zero_matrix(), identity(), 0.0, 0.0); }
    //@if NODES
    for (var index = rod.first; index < rod.end; index++) {
    //@else
    //@if TRACES
    if complete { clear_functionals(); }
    //@end
    for (var index = 0u; index < SEGMENT_COUNT; index++) {
    //@end
        //@if TRACES
        if complete { trace = array<Trace, THREES>(); }
        //@end
        //@if SEGMENT_SOURCES
        if complete { load_source(index); }
        //@if NODES
        if complete && has(index, IS_FLEXIBLE) { source_piece(rod.start, rod.share, rod.is_last); }
        //@end
        //@end
        if has(index, IS_FLEXIBLE) {
            //@if NODES
            let segment = piece(load_flexible(index, false), rod.start, rod.share);
            let steps = rod.steps;
            //@else
            let segment = load_flexible(index, rod.is_stiff);
            if rod.is_stiff { largest_moment = max(largest_moment, length(moment(state.p, state.M, n))); }
            let steps = step_count(index, resolution);
            //@end
            let share = 1.0 / f32(max(1u, steps));
            // Where a step starts and how long it is, as shares of the segment.
            var place = vec2<f32>(0.0, share);
            var longest = share;
            //@if GRADED
            //@if !NODES
            let grading = step_grading(index, resolution);
            place.y = grading.y;
            longest = place.y;
            for (var i = 1u; i < steps; i++) { longest = longest * max(1.0, grading.x); }
            //@end
            //@end
            let h = segment.length * longest;
            let stride = max(1u, steps / STATIONS_EACH);
            var collects = false;
            //@if COLLECTS
            collects = complete && has(index, HAS_INTEGRALS);
            //@end
            //@if !ROTATES
            if record && !rotates {
                let end = n - segment.length * lambda * segment.w;
                add_doubt(rod, segment, h * f32(stride), max(length(n), length(end)), UNBUCKLED);
            }
            //@end
            for (var i = 0u; i < steps; i++) {
                let step = Step(segment.length * place.y, place.x, place.y, n);
                for (var r = 0u; r < TABLEAU_COUNT; r++) { //@unroll
                    if tableau == r {
                        step_rod_r(rod, segment, lambda, step, &state);
                        for (var k = 0u; k < THREES; k++) { //@unroll UNROLLED
                            if (taken & (1u << k)) != 0u { step_columns_r(rod, segment, lambda, step, k, collects); }
                        } //@end
                    }
                } //@end
                //@if LOAD
                n = axpy(-step.h * lambda, segment.w, n); // R1
                //@end
                s = s + step.h;
                //@if GRADED
                //@if NODES
                place.x = f32(i + 1u) * share;
                //@else
                place = vec2<f32>(place.x + place.y, place.y * grading.x);
                //@end
                //@else
                place.x = f32(i + 1u) * share;
                //@end
                if record && ((i + 1u) % stride == 0u || i + 1u == steps) {
                    add_station(rotates, shortest, s, tip_of(state, n));
                }
            }
            //@if !NODES
            if rod.is_stiff { largest_moment = max(largest_moment, length(moment(state.p, state.M, n))); }
            //@end
            //@if WANT_LENGTH
            if complete { end_flexible(rod, segment, state, n); }
            //@end
            //@if COLLECTS_RESPONSES
            if complete { collect_responses(rod, segment.length, segment.w, true); }
            //@end
        //@if RIGID
        } else {
            let segment = load_rigid(index);
            let before = state;
            let n_before = n;
            cross_rigid(rod, segment, lambda, &n, &state);
            for (var k = 0u; k < THREES; k++) { //@unroll UNROLLED
                if (taken & (1u << k)) != 0u {
                    //@if COLLECT_RIGID
                    if complete { collect_rigid(rod, segment, before, n, k); }
                    //@end
                    cross_rigid_columns(rod, segment, lambda, n_before, before, k);
                }
            } //@end
            //@if COLLECTS_RESPONSES
            if complete { collect_responses(rod, 1.0, vec3<f32>(), false); }
            //@end
            // A coil may make A negative, and the step beyond it positive again.
            if record && !rotates { add_station(rotates, shortest, s, tip_of(state, n)); }
        //@end
        }
        //@if TRACES
        if complete { gather_functionals(index); }
        //@end
    }
    //@if FREE
    //@if NODES
    if !rod.is_tip { return tip_of(state, n); }
    //@end
    let before = state;
    cross_free(&state);
    for (var k = 0u; k < THREES; k++) { //@unroll UNROLLED
        if (taken & (1u << k)) != 0u { cross_free_columns(before, state.p, k); }
    } //@end
    //@end
    return tip_of(state, n);
}

fn tip_of(state: State, n: vec3<f32>) -> Tip {
    return Tip(state.p, state.d1, state.t, moment(state.p, state.M, n), n);
}

//@if WANT_LENGTH
// What a length does at the distal end of a flexible segment: its row by reciprocity, or to forward columns.
fn end_flexible(rod: Rod, segment: Flexible, state: State, n: vec3<f32>) {
    let m = moment(state.p, state.M, n);
    let d2 = cross(state.t, state.d1);
    let omega = curvature(section(segment, 1.0), state.d1, d2, state.t, m);
    let v = velocity(segment, state.d1, d2, state.t, n);
    //@if RECIPROCITY
    //@if NODES
    for (var k = 0u; k < THREES; k++) { //@unroll UNROLLED
        trace[k].length = length_row(rod, segment, state, m, n, omega, v, k);
    } //@end
    //@else
    for (var k = 0u; k < TRACED; k++) { //@unroll UNROLLED
        trace[k].length = length_row(rod, segment, state, m, n, omega, v, k);
    } //@end
    //@end
    //@else
    var slope = -cross(state.p, segment.w);
    if segment.has_magnet { slope = cross_sub(to_world(state.d1, d2, state.t, segment.mu), rod.B, slope); }
    source_lengthen(segment, omega, v, slope);
    //@end
}
//@end

// dm of three columns at the tip.
fn tip_moment_columns(tip: Tip, k: u32) -> mat3x3<f32> {
    return columns_moment(k, tip.p, tip.n);
}
