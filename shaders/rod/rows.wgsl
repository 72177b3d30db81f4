// Every derivative from six columns, nine with those of the base moment: rows of the Jacobian by reciprocity. J5 and
// the table of model loads. crates/core/src/cpu/rod/rows.rs
//
// The functional of a derivative is gathered in its rows, segment by segment, and turned into them at the end.

const DERIVATIVE_COUNT: u32 = 1u; //@spec
const DERIVATIVE_COLUMN: u32 = 20u; //@spec
const ROWS: u32 = 9u; //@spec

// A linear functional of the threes of columns: by base moment, by tip force, by base rotation.
struct Functional {
    by_moment: vec3<f32>,
    by_force: vec3<f32>,
    by_rotation: vec3<f32>,
}

// How the columns combine to the responses to a unit tip force, a unit tip moment and a unit base rotation; of the
// last, zero where the base moment is not differentiated.
struct Responses {
    force: mat3x3<f32>,
    moment: mat3x3<f32>,
    rotation: mat3x3<f32>,
    // dm0 by base rotation, less its canonical part.
    base_rotation: mat3x3<f32>,
    //@if NODES
    // The base moments of the first two.
    base_force: mat3x3<f32>,
    base_moment: mat3x3<f32>,
    //@end
}

//@if RECIPROCITY
// Solves the (adjoint) tip condition dm(L) - w(L) x l_tip = unit for each load. J5
fn new_responses(rod: Rod, tip: Tip) -> Responses {
    let dm_moment = tip_moment_columns(tip, BY_MOMENT);
    let dm_force = tip_moment_columns(tip, BY_FORCE);
    var responses: Responses;
    //@if LOAD_WITHOUT_ENERGY
    responses.moment = inverse(columns_cross_sub(columns[BY_MOMENT].w, rod.l_tip, dm_moment));
    responses.force = -1.0 * (responses.moment * columns_cross_sub(columns[BY_FORCE].w, rod.l_tip, dm_force));
    //@else
    responses.moment = inverse(dm_moment);
    responses.force = -1.0 * (responses.moment * dm_force);
    //@end
    //@if ROTATES
    let dm_rotation = tip_moment_columns(tip, BY_ROTATION);
    //@if LOAD_WITHOUT_ENERGY
    let by_rotation = columns_cross_sub(columns[BY_ROTATION].w, rod.l_tip, dm_rotation);
    responses.rotation = -1.0 * (responses.moment * by_rotation);
    responses.base_rotation = -1.0 * (inverse(dm_moment) * dm_rotation);
    //@else
    responses.rotation = -1.0 * (responses.moment * dm_rotation);
    responses.base_rotation = responses.rotation;
    //@end
    //@end
    return responses;
}

// Rows of a parameter whose load columns have functional `q`: tip position, tip rotation, base moment.
fn rows(responses: Responses, q: Functional) -> mat3x3<f32> {
    return mat3x3<f32>(
        q.by_force + row_times(q.by_moment, responses.force),
        row_times(q.by_moment, responses.moment),
        q.by_rotation + row_times(q.by_moment, responses.rotation),
    );
}

// Rows of a virtual rotation of the base about a world axis given by its components.
fn base_rotation_rows(responses: Responses, m0: vec3<f32>, axis: vec3<f32>) -> mat3x3<f32> {
    let canonical = cross(axis, m0) * 0.5;
    return mat3x3<f32>(
        //@if NODES
        transpose(responses.base_force) * axis,
        transpose(responses.base_moment) * axis,
        //@else
        transpose(responses.force) * axis,
        transpose(responses.moment) * axis,
        //@end
        canonical + responses.base_rotation * axis,
    );
}

// Writes the rows of every derivative.
fn write_rows(rod: Rod, m0: vec3<f32>, responses: Responses) {
    for (var index = 0u; index < DERIVATIVE_COUNT; index++) {
        let at = DERIVATIVE_COLUMN + ROWS * index;
        var sum: Functional;
        //@if TRACES
        sum.by_moment = loaded_vector(at);
        sum.by_force = loaded_vector(at + 3u);
        //@if ROTATES
        sum.by_rotation = loaded_vector(at + 6u);
        //@end
        //@end
        var extra = mat3x3<f32>();
        let list = SLOT_TABLE + SEGMENT_COUNT + index;
        let end = u32(constants[list + 1u]);
        for (var i = u32(constants[list]); i < end; i += SLOT_LENGTH) {
            let slot = load_slot(i);
            let rate = load_rate(slot);
            switch slot.kind {
                //@if WANT_BASE_POSITION
                case KIND_BASE_POSITION: { extra[0] = extra[0] + along(slot.axis, rate); }
                //@end
                //@if WANT_BASE_ROTATION
                case KIND_BASE_ROTATION: {
                    extra = extra + base_rotation_rows(responses, m0, along(slot.axis, rate));
                }
                //@end
                //@if WANT_INSERTION
                case KIND_INSERTION: { extra = extra + insertion_rows(rod, m0, responses, rate); }
                //@end
                default: {
                    sum.by_moment = axpy(rate, functional(slot, BY_MOMENT), sum.by_moment);
                    sum.by_force = axpy(rate, functional(slot, BY_FORCE), sum.by_force);
                    //@if ROTATES
                    sum.by_rotation = axpy(rate, functional(slot, BY_ROTATION), sum.by_rotation);
                    //@end
                }
            }
        }
        store_rows(index, extra + rows(responses, sum));
    }
}

// `rate` along a world axis.
fn along(axis: u32, rate: f32) -> vec3<f32> {
    return select(vec3<f32>(), vec3<f32>(rate), vec3<u32>(0u, 1u, 2u) == vec3<u32>(axis));
}

//@if WANT_INSERTION
// More rod past the entry: the base is displaced by p' and rotated by R0 u(0); the moment is that at the new base.
fn insertion_rows(rod: Rod, m0: vec3<f32>, responses: Responses, rate: f32) -> mat3x3<f32> {
    let base = base_slope(rod, m0);
    var rows = base_rotation_rows(responses, m0, base.omega * rate);
    rows[0] = axpy(rate, base.v, rows[0]);
    rows[2] = axpy(rate, base.torque, rows[2]);
    return rows;
}
//@end
//@end

// Stores the rows of one derivative: tip position, tip rotation and, where they are wanted, base moment.
fn store_rows(index: u32, rows: mat3x3<f32>) {
    let at = DERIVATIVE_COLUMN + ROWS * index;
    store_vector(at, rows[0]);
    store_vector(at + 3u, rows[1]);
    //@if BASE_MOMENT_ROWS
    store_vector(at + 6u, rows[2]);
    //@end
}

//@if FORWARD
// Writes the rows of every derivative from forward columns, each three but the first after a pass of its own. J5
fn write_forward_rows(rod: Rod, m0: vec3<f32>, tip: Tip) {
    let w_inverse = inverse(tip_moment_columns(tip, BY_MOMENT));
    for (var three = 0u; three < FORWARD_THREES; three++) {
        //@if MANY_SOURCES
        if three > 0u {
            forward_three = three;
            columns[FORWARD] = forward_columns(rod, load_sources(three), m0);
            _ = shoot(FINE, rod, 1.0, m0, FORWARD_COLUMNS, false);
        }
        //@end
        let sources = load_sources(three);
        let residual = tip_moment_columns(tip, FORWARD) - sources.dl_tip;
        let dm0 = -1.0 * (w_inverse * residual);
        let position = columns[FORWARD].dp + columns[BY_MOMENT].dp * dm0;
        let rotation = columns[FORWARD].w + columns[BY_MOMENT].w * dm0;
        var base_moment = dm0;
        //@if WANT_INSERTION
        base_moment = outer(base_slope(rod, m0).torque, sources.insertion, dm0);
        //@end
        for (var k = 0u; k < 3u; k++) { //@unroll
            if 3u * three + k < DERIVATIVE_COUNT {
                store_rows(3u * three + k, mat3x3<f32>(position[k], rotation[k], base_moment[k]));
            }
        } //@end
    }
}
//@end

//@if RECIPROCITY
// The functional of a slot on three columns, number `k`, at the tip.
fn functional(slot: Slot, k: u32) -> vec3<f32> {
    switch slot.kind {
        //@if WANT_TIP_FORCE
        case KIND_TIP_FORCE: { return component(transpose(columns[k].dp), slot.axis); }
        //@end
        //@if WANT_TIP_MOMENT
        case KIND_TIP_MOMENT: { return component(transpose(columns[k].w), slot.axis); }
        //@end
        default: { return vec3<f32>(); }
    }
}

fn component(rows: mat3x3<f32>, axis: u32) -> vec3<f32> {
    return select(select(rows[2], rows[1], axis == 1u), rows[0], axis == 0u);
}
//@end
