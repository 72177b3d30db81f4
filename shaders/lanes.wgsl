// A pass with care on several invocations a sample: each carries the rod and one column, by base moment or by base rotation.
// A pass is then a third as long. crates/core/src/cpu/rod/shoot.rs

// Invocations of a sample; those beyond six columns carry none.
const LANES: u32 = 8u; //@spec

//@if LANES
struct Column {
    w: vec3<f32>,
    dp: vec3<f32>,
    dM: vec3<f32>,
}

var<workgroup> shared_columns: array<Column, WORKGROUP>;
var<workgroup> shared_busy: array<u32, WORKGROUP>;
var<workgroup> any_busy: u32;

// This invocation of the workgroup, and the first of its sample.
var<private> invocation: u32;
var<private> first_lane: u32;

// Whether any sample of the workgroup is under way.
fn is_any_busy(busy: bool) -> bool {
    shared_busy[invocation] = select(0u, 1u, busy);
    workgroupBarrier();
    if invocation == 0u {
        var any = 0u;
        for (var i = 0u; i < WORKGROUP; i += LANES) { any = any | shared_busy[i]; }
        any_busy = any;
    }
    return workgroupUniformLoad(&any_busy) != 0u;
}

// The column of this invocation at the base.
fn start_lane(m0: vec3<f32>) {
    let lane = invocation - first_lane;
    let by_moment = moment_columns();
    let by_rotation = rotation_columns(m0);
    var three: Columns;
    if lane < 3u {
        three.dM[0] = by_moment.dM[lane];
    } else if lane < 6u {
        three.w[0] = by_rotation.w[lane - 3u];
        three.dM[0] = by_rotation.dM[lane - 3u];
    }
    columns[BY_MOMENT] = three;
}

// Shares the column of this invocation with the others of its sample.
fn share_column() {
    workgroupBarrier();
    let three = columns[BY_MOMENT];
    shared_columns[invocation] = Column(three.w[0], three.dp[0], three.dM[0]);
    workgroupBarrier();
}

// w of three columns, from that of a lane on.
fn shared_rotation(lane: u32) -> mat3x3<f32> {
    let at = first_lane + lane;
    return mat3x3<f32>(shared_columns[at].w, shared_columns[at + 1u].w, shared_columns[at + 2u].w);
}

// One pass on the careful grid, with the stability index. It leaves the columns by base moment in `columns[BY_MOMENT]`.
fn shoot_on_lanes(rod: Rod, lambda: f32, m0: vec3<f32>) -> Tip {
    start_lane(m0);
    let tip = shoot(CAREFUL, rod, lambda, m0, PATH_COLUMNS, true);
    share_column();
    for (var c = 0u; c < 3u; c++) { //@unroll
        columns[BY_MOMENT].w[c] = shared_columns[first_lane + c].w;
        columns[BY_MOMENT].dp[c] = shared_columns[first_lane + c].dp;
        columns[BY_MOMENT].dM[c] = shared_columns[first_lane + c].dM;
    } //@end
    return tip;
}
//@end
