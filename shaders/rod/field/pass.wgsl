// One pass over the rod, base to tip, from the load at the base: state, transfers of its intervals, parameters. F5
// crates/core/src/cpu/rod/field/pass.rs

// What a pass carries along: the state alone, columns by the load at the base, the transfer of every interval and their
// product, or forward columns of three parameters.
const STATE: u32 = 0u;
const BASE: u32 = 1u;
const TRANSFERS: u32 = 2u;
const PARAMETERS: u32 = 3u;

// What is no length, in plan units.
const SHORT: f32 = 1e-9;

// Of the last pass: the tip, how its pose and its residual follow the load at the base, how far it may move before any part of
// the rod is within the clearance of a magnet, if each moves in proportion to its share of the rod.
var<private> tip: State;
var<private> pose: Mat6;
var<private> matrix: Mat6;
var<private> leeway: f32;

// Columns by force and by moment at the base, while a pass carries them; the canonical load while it carries transfers.
var<private> by_force: Columns;
var<private> by_moment: Columns;
var<private> carried_load: Mat6;
// The same of the interval in hand, three by three.
var<private> next_pose: Mat6;
var<private> next_load: Mat6;

// dr/d(n0, m0) from the canonical load at the tip, with moment `m` there.
fn residual(m: vec3<f32>) -> Mat6 {
    let half = m * 0.5;
    return Mat6(
        carried_load.a,
        carried_load.b,
        columns_cross_add(pose.c, half, carried_load.c),
        columns_cross_add(pose.d, half, carried_load.d),
    );
}

// dm - w x m / 2 of three columns.
fn canonical(m: vec3<f32>) -> mat3x3<f32> {
    return columns_cross_sub(columns.w, m * 0.5, columns.dm);
}

// Three columns at the start of an interval: by force, by moment, by rotation or by displacement there.
fn interval_columns(by: u32, m: vec3<f32>) -> Columns {
    var three: Columns;
    switch by {
        case BY_FORCE: { three.dn = identity(); }
        case BY_MOMENT: { three.dm = identity(); }
        case BY_ROTATION: {
            three.w = identity();
            three.dm = hat(m) * -0.5;
        }
        default: { three.dp = identity(); }
    }
    return three;
}

// Halfway over a step of this length; a rigid segment is straight.
fn midway(before: State, after: State, span: f32) -> vec3<f32> {
    return (before.p + after.p) * 0.5 + (before.t - after.t) * (span * 0.125);
}

// Integrates the rod from the load `base` at a share `lambda` of its loads; what it comes to is left behind.
//
// All passes are one call, and all threes of a step another: their code is long.
fn integrate(rod: Rod, resolution: u32, lambda: f32, base: Pair, what: u32, on_path: bool) {
    var state = State(vec3<f32>(), rod.d1, rod.t, base.last, base.first);
    carried_load = identity6();
    pose = Mat6();
    leeway = FAR;
    var travelled = 0.0;
    let tableau = select(TABLEAU_COUNT - 1u, 0u, resolution <= CAREFUL);
    let first = select(BY_FORCE, BY_PARAMETERS, what == PARAMETERS);
    var end = select(BY_FORCE, BY_ROTATION, what == BASE);
    if what == TRANSFERS { end = BY_PARAMETERS; }
    if what == PARAMETERS { end = BY_PARAMETERS + 1u; }
    interval_count = 0u;
    by_force = interval_columns(BY_FORCE, state.m);
    by_moment = interval_columns(BY_MOMENT, state.m);
    //@if FORWARD
    if what == PARAMETERS { columns = base_columns(state); }
    //@end
    for (var index = 0u; index < SEGMENT_COUNT; index++) {
        //@if SEGMENT_SOURCES
        if what == PARAMETERS { load_segment_source(index); }
        //@end
        let is_flexible = has(index, IS_FLEXIBLE);
        let steps = select(1u, step_count(index, resolution), is_flexible);
        let share = 1.0 / f32(max(1u, steps));
        var place = vec2<f32>(0.0, share);
        //@if GRADED
        let grading = step_grading(index, resolution);
        if is_flexible { place.y = grading.y; }
        //@end
        var segment: Flexible;
        if is_flexible { segment = load_flexible(index, false); }
        //@if BEYOND_RIGID
        if index == FIRST_FLEXIBLE && what >= TRANSFERS { load_first(segment, state, what == PARAMETERS); }
        //@end
        for (var i = 0u; i < steps; i++) {
            let step = Step(segment.length * place.y, place.x, place.y, lambda);
            let before = state;
            //@if RIGID
            var crossing: Crossing;
            if !is_flexible {
                crossing = Crossing(load_rigid(index), has(index, HAS_DIPOLE), lambda, on_path, before);
                state = cross_segment(crossing);
            }
            //@end
            for (var r = 0u; r < TABLEAU_COUNT; r++) { //@unroll
                if is_flexible && tableau == r { step_rod_r(segment, step, what != STATE, &state); }
            } //@end
            next_pose = Mat6();
            next_load = Mat6();
            for (var by = first; by < end; by++) {
                take_columns(what, by, before.m);
                // Without a magnet a displacement takes the interval along.
                let stays = by == BY_DISPLACEMENT && !segment.has_magnet;
                for (var r = 0u; r < TABLEAU_COUNT; r++) { //@unroll
                    if is_flexible && tableau == r && !stays { step_columns_r(segment, step, by); }
                } //@end
                //@if RIGID
                if !is_flexible { cross_columns(crossing, state, by); }
                //@end
                keep_columns(what, by, state.m);
            }
            if what == TRANSFERS { push(is_flexible); }
            let middle = midway(before, state, step.h);
            travelled += distance(before.p, state.p);
            leeway = min(leeway, min(clearance(before.p, middle), clearance(middle, state.p)) / max(travelled, SHORT));
            //@if GRADED
            place = vec2<f32>(place.x + place.y, place.y * grading.x);
            //@else
            place.x = f32(i + 1u) * share;
            //@end
        }
        //@if WANT_LENGTH
        if is_flexible && what == PARAMETERS { lengthen(segment, state); }
        //@end
    }
    if what == BASE {
        pose = Mat6(by_force.dp, by_moment.dp, by_force.w, by_moment.w);
        matrix = Mat6(by_force.dn, by_moment.dn, by_force.dm, by_moment.dm);
    } else {
        matrix = residual(state.m);
    }
    tip = state;
    // A rod that is nowhere is near to nothing.
    leeway *= travelled;
    if !is_finite(leeway) { leeway = FAR; }
}

// Takes in hand the three that a pass carries from step to step, or those of the interval that begins.
fn take_columns(what: u32, by: u32, m: vec3<f32>) {
    if what == TRANSFERS { columns = interval_columns(by, m); }
    if what == BASE && by == BY_FORCE { columns = by_force; }
    if what == BASE && by == BY_MOMENT { columns = by_moment; }
}

// Keeps the three in hand, at the end of a step with moment `m`.
fn keep_columns(what: u32, by: u32, m: vec3<f32>) {
    if what == BASE && by == BY_FORCE { by_force = columns; }
    if what == BASE && by == BY_MOMENT { by_moment = columns; }
    if what == TRANSFERS {
        let dmu = canonical(m);
        // Force and displacement come first in their pairs.
        let is_first = by == BY_FORCE || by == BY_DISPLACEMENT;
        let is_load = by <= BY_MOMENT;
        let at = interval_at(interval_count) + select(9u, 0u, is_first);
        let pose_at = at + select(TRANSFER_A, TRANSFER_B, is_load);
        let load_at = at + select(TRANSFER_C, TRANSFER_D, is_load);
        hold_matrix(pose_at, columns.dp);
        hold_matrix(pose_at + 18u, columns.w);
        hold_matrix(load_at, columns.dn);
        hold_matrix(load_at + 18u, dmu);
        var before = pose;
        if is_load { before = carried_load; }
        var row = Pair3(before.c, before.d);
        if is_first { row = Pair3(before.a, before.b); }
        next_pose = plus(next_pose, product(columns.dp, columns.w, row));
        next_load = plus(next_load, product(columns.dn, dmu, row));
    }
}

// Adds the interval whose threes have been kept.
fn push(bends: bool) {
    hold(interval_at(interval_count) + BENDS, select(0.0, 1.0, bends));
    pose = next_pose;
    carried_load = next_load;
    interval_count += 1u;
}
