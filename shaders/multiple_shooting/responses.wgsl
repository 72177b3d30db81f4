// Derivatives by nodes: what loads and parameters do to all nodes, and rows of the Jacobian from it. N2, J5
// crates/core/src/cpu/multiple_shooting/responses.rs

//@if RECIPROCITY
// Responses to a unit tip moment, a unit tip force and a unit rotation of the base: (w, mu) at the node in hand, its
// displacement, mu at the base.
var<private> response_w: array<mat3x3<f32>, 3>;
var<private> response_mu: array<mat3x3<f32>, 3>;
var<private> response_dp: array<mat3x3<f32>, 3>;
var<private> response_base: array<mat3x3<f32>, 3>;
//@end

// Writes the rows of the derivatives after a pass with drives and its elimination, those by reciprocity after one more.
fn write_node_rows(rod: Rod) {
    //@if FORWARD
    write_driven_rows(rod);
    //@end
    //@if RECIPROCITY
    write_reciprocal_rows(rod);
    //@end
}

//@if FORWARD
// Rows of the three forward columns in hand.
fn write_driven_rows(rod: Rod) {
    let m0 = held_vector(interval_at(0u) + NODE + 6u);
    let sources = load_sources(forward_three);
    let base = base_slope(rod, m0);
    var w_base = sources.w0;
    //@if WANT_INSERTION
    w_base = outer(base.omega, sources.insertion, w_base);
    //@end
    s_tip = hat(rod.l_tip * 0.5);
    solve_threes(sources.dl_tip, true, G_MOMENT);
    let change = tip_change(w_base, true);
    var position = sources.dp0 + change.dp;
    var base_moment = columns_cross_add(w_base, m0 * 0.5, change.mu_base);
    //@if WANT_INSERTION
    position = outer(base.v, sources.insertion, position);
    base_moment = outer(base.torque, sources.insertion, base_moment);
    //@end
    for (var k = 0u; k < 3u; k++) { //@unroll
        if 3u * forward_three + k < DERIVATIVE_COUNT {
            store_rows(3u * forward_three + k, mat3x3<f32>(position[k], change.w[k], base_moment[k]));
        }
    } //@end
}
//@end

// What three loads do to the tip, and mu at the base.
struct TipChange {
    w: mat3x3<f32>,
    dp: mat3x3<f32>,
    mu_base: mat3x3<f32>,
}

// Rotation and displacement of the tip by unit tip moments; of reciprocal responses leaves g at every node.
fn tip_response(rod: Rod) -> TipChange {
    //@if RECIPROCITY
    hold_matrix(BASE_ROTATION, held_matrix(interval_at(0u) + PIVOT_S));
    //@if LOAD_WITHOUT_ENERGY
    // The adjoint condition, dm - w x l_tip = unit.
    factor(hat(rod.l_tip * -0.5));
    //@end
    for (var k = 0u; k < 2u; k++) {
        let by_force = k == 1u;
        solve_threes(identity() * select(1.0, 0.0, by_force), by_force, select(G_MOMENT, G_DRIVE, by_force));
    }
    //@else
    solve_threes(identity(), false, G_MOMENT);
    //@end
    return tip_change(mat3x3<f32>(), false);
}

// Rotation and displacement of the tip by loads at the tip and, where they do, by what drives the intervals.
fn tip_change(w_base: mat3x3<f32>, is_driven: bool) -> TipChange {
    var change: TipChange;
    change.w = w_base;
    for (var i = 0u; i < interval_count; i++) {
        let at = interval_at(i);
        let w = change.w;
        let mu = held_matrix(at + PIVOT_S) * w + held_matrix(at + G_MOMENT);
        if i == 0u { change.mu_base = mu; }
        change.dp = change.dp + held_matrix(at + DP_W) * w + held_matrix(at + DP_MU) * mu;
        change.w = held_matrix(at + A_THERE) * w + held_matrix(at + B_THERE) * mu;
        //@if DRIVES
        if is_driven {
            change.dp = change.dp + held_matrix(at + DRIVE_DP);
            change.w = change.w + held_matrix(at + DRIVE_W);
        }
        //@end
    }
    return change;
}

//@if RECIPROCITY
// Rows by reciprocity: the columns are the responses themselves.
fn write_reciprocal_rows(rod: Rod) {
    for (var k = 0u; k < THREES; k++) { //@unroll
        columns[k] = Columns();
        columns[k].w = response_w[k];
        columns[k].dp = response_dp[k];
    } //@end
    var responses: Responses;
    responses.moment = identity();
    responses.base_force = response_base[1];
    responses.base_moment = response_base[0];
    responses.base_rotation = held_matrix(BASE_ROTATION);
    write_rows(rod, held_vector(interval_at(0u) + NODE + 6u), responses);
}

// The responses at the base.
fn start_responses() {
    response_w = array<mat3x3<f32>, 3>(mat3x3<f32>(), mat3x3<f32>(), identity());
    response_dp = array<mat3x3<f32>, 3>();
}

// Reads the moments of the responses at the node of the interval at `at`.
fn load_responses(at: u32) {
    let s = held_matrix(at + PIVOT_S);
    response_mu[0] = s * response_w[0] + held_matrix(at + G_MOMENT);
    response_mu[1] = s * response_w[1] + held_matrix(at + G_DRIVE);
    response_mu[2] = s * response_w[2];
    if at == interval_at(0u) { response_base = response_mu; }
}

// Takes the responses over the interval at `at`.
fn follow_responses(at: u32) {
    let a = held_matrix(at + A_THERE);
    let b = held_matrix(at + B_THERE);
    let dp_w = held_matrix(at + DP_W);
    let dp_mu = held_matrix(at + DP_MU);
    for (var k = 0u; k < 3u; k++) { //@unroll
        response_dp[k] = response_dp[k] + dp_w * response_w[k] + dp_mu * response_mu[k];
        response_w[k] = a * response_w[k] + b * response_mu[k];
    } //@end
    response_dp[1] = response_dp[1] + held_matrix(at + DRIVE_DP);
    response_w[1] = response_w[1] + held_matrix(at + DRIVE_W);
}
//@end

//@if TRACES
// Whether a pass collects the traces of the responses.
var<private> collects_traces: bool;

// What the responses leave on a segment of an interval, of so much length, in place of what its columns have left there.
fn collect_responses(rod: Rod, length: f32, load: vec3<f32>, is_flexible: bool) {
    let left = trace;
    for (var k = 0u; k < TRACED; k++) { //@unroll
        //@if COLLECT_STRAIN
        let whole_curvature = of_response(left[0].rest_curvature, left[1].rest_curvature, left[2].rest_curvature, k);
        let whole_stiffness = of_response(left[0].stiffness, left[1].stiffness, left[2].stiffness, k);
        trace[k].rest_curvature = whole_curvature;
        trace[k].stiffness = whole_stiffness;
        //@if WANT_REST_CURVATURE_RISE
        let curvature = of_response(
            left[0].rest_curvature_rise, left[1].rest_curvature_rise, left[2].rest_curvature_rise, k,
        );
        trace[k].rest_curvature_rise = columns_axpy(rod.share, curvature, rod.start * whole_curvature);
        //@end
        //@if WANT_STIFFNESS_RISE
        let stiffness = of_response(left[0].stiffness_rise, left[1].stiffness_rise, left[2].stiffness_rise, k);
        trace[k].stiffness_rise = columns_axpy(rod.share, stiffness, rod.start * whole_stiffness);
        //@end
        //@end
        //@if WANT_SHEAR_COMPLIANCE
        trace[k].shear_compliance =
            of_response(left[0].shear_compliance, left[1].shear_compliance, left[2].shear_compliance, k);
        //@end
        //@if COLLECT_LOAD
        // An interval sees displacements from its start alone; that has moved.
        let moved = transpose(response_dp[k]);
        trace[k].load = columns_axpy(length, moved, of_response(left[0].load, left[1].load, left[2].load, k));
        //@end
        //@if COLLECT_DIPOLE
        trace[k].dipole = of_response(left[0].dipole, left[1].dipole, left[2].dipole, k);
        //@end
        //@if COLLECT_FIELD
        trace[k].field = of_response(left[0].field, left[1].field, left[2].field, k);
        //@end
        //@if WANT_LENGTH
        var row = transpose(response_mu[k]) * left[0].length + transpose(response_w[k]) * left[2].length;
        if k == 1u { row = row + left[1].length; }
        if is_flexible { row = select(vec3<f32>(), row + row_times(load, response_dp[k]), rod.is_last); }
        trace[k].length = row;
        //@end
    } //@end
}

// What the response `k` leaves, from what the columns leave: by moment, by what drives, by rotation.
fn of_response(by_moment: mat3x3<f32>, by_drive: mat3x3<f32>, by_rotation: mat3x3<f32>, k: u32) -> mat3x3<f32> {
    let sum = transpose(response_mu[k]) * by_moment + transpose(response_w[k]) * by_rotation;
    if k == 1u { return sum + by_drive; }
    return sum;
}
//@end
