// Where the rod is cut for multiple shooting: nodes so close that no error grows much from one to the next. MS2
// crates/core/src/cpu/multiple_shooting/mesh.rs

// Panels of the midpoint rule over a segment.
const PANELS: u32 = 64u;
// Kinds of intervals: a piece of a flexible segment, the last of its pieces, rigid segments in a row.
const PIECE: f32 = 0.0;
const LAST_PIECE: f32 = 1.0;
const RIGID_PIECE: f32 = 2.0;

// Adds an interval from segments `first` up to `end`; false where there is no room.
fn push_interval(kind: f32, first: u32, end: u32, start: f32, share: f32, n: vec3<f32>) -> bool {
    if interval_count >= memory_settings.most_intervals { return false; }
    let at = interval_at(interval_count);
    hold(at + KIND, kind);
    hold(at + FIRST, f32(first));
    hold(at + END, f32(end));
    hold(at + START, start);
    hold(at + SHARE, share);
    hold_vector(at + FORCE_THERE, n);
    interval_count += 1u;
    return true;
}

// Cuts the rod so that errors grow by `spacing` powers of e between two nodes; false where there is no room.
fn cut(rod: Rod, spacing: f32) -> bool {
    var has_room = true;
    var follows_rigid = false;
    var n = rod.n0;
    interval_count = 0u;
    for (var index = 0u; index < SEGMENT_COUNT; index++) {
        if has(index, IS_FLEXIBLE) {
            let segment = load_flexible(index, false);
            has_room = pieces(index, segment, n, length(rod.B), spacing) && has_room;
            n = axpy(-segment.length, segment.w, n); // R1
            follows_rigid = false;
        } else {
            if follows_rigid {
                hold(interval_at(interval_count - 1u) + END, f32(index + 1u));
            } else {
                has_room = push_interval(RIGID_PIECE, index, index + 1u, 0.0, 1.0, n) && has_room;
            }
            //@if LOAD
            //@if RIGID
            n = n - load_rigid(index).w; // R1
            //@end
            //@end
            follows_rigid = has_room;
        }
    }
    //@if FREE
    if !follows_rigid {
        has_room = push_interval(RIGID_PIECE, SEGMENT_COUNT, SEGMENT_COUNT, 0.0, 1.0, n) && has_room;
    }
    //@end
    hold(INTERVALS, f32(interval_count));
    return has_room;
}

// Adds the pieces of a segment; `n` is the force at its start.
fn pieces(index: u32, segment: Flexible, n: vec3<f32>, field: f32, spacing: f32) -> bool {
    var total = 0.0;
    for (var panel = 0u; panel < PANELS; panel++) {
        total = total + growth(segment, n, field, panel);
    }
    let count = select(1.0, max(ceil(total / spacing), 1.0), is_finite(total));
    var panel = 0u;
    var before = 0.0;
    var rate = growth(segment, n, field, 0u);
    var start = 0.0;
    var has_room = true;
    for (var k = 1.0; k <= count && has_room; k += 1.0) {
        let wanted = total * k / count;
        while panel + 1u < PANELS && before + rate < wanted {
            before = before + rate;
            panel += 1u;
            rate = growth(segment, n, field, panel);
        }
        let is_last = k >= count;
        let end = select((f32(panel) + clamp((wanted - before) / rate, 0.0, 1.0)) * (1.0 / f32(PANELS)), 1.0, is_last);
        let there = axpy(-(segment.length * start), segment.w, n);
        let kind = select(PIECE, LAST_PIECE, is_last);
        has_room = push_interval(kind, index, index + 1u, start, end - start, there);
        start = end;
    }
    return has_room;
}

// By how many powers of e errors grow over a panel of a segment.
fn growth(segment: Flexible, n: vec3<f32>, field: f32, panel: u32) -> f32 {
    let near = segment.stiffness;
    let far = near + segment.stiffness_rise;
    let bend = min(min(near.x, near.y), min(far.x, far.y));
    let soft = max(max(near.x, near.y), max(far.x, far.y)) / min(near.z, far.z);
    let give = max(max(segment.shear.x, segment.shear.y), segment.shear.z);
    let curl = max(length(segment.u_star), length(segment.u_star + segment.u_star_rise)) * segment.length;
    let share = (f32(panel) + 0.5) * (1.0 / f32(PANELS));
    let pull = length(axpy(-(share * segment.length), segment.w, n));
    let tension = give * pull * pull + pull + length(segment.mu) * field;
    let rate = sqrt(tension / bend * max(1.0, soft)) * segment.length; // MS2
    let start = f32(panel) * (1.0 / f32(PANELS));
    let rises = max(max(rise(near.x, far.x, start), rise(near.y, far.y, start)), rise(near.z, far.z, start));
    return (rate + curl + 2.0) * (1.0 / f32(PANELS)) + rises; // MS2
}

// By how many powers of e a stiffness that changes linearly along a segment does over the panel that begins at this share of it.
fn rise(near: f32, far: f32, share: f32) -> f32 {
    let first = (far - near) * share + near;
    let last = (far - near) * (share + 1.0 / f32(PANELS)) + near;
    return abs(log(last / first));
}
