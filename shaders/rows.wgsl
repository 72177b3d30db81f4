// Every derivative from nine columns: rows of the Jacobian by reciprocity. J5 and the table of model loads.
// src/lanes/rows.rs
//
// The functional of a derivative is gathered in its rows, segment by segment, and turned into them at the end. The
// table of slots lies behind the constants, see src/gpu/slots.rs.

const DERIVATIVE_COUNT: u32 = 1u; //@spec
const DERIVATIVE_COLUMN: u32 = 19u; //@spec
const ROWS: u32 = 9u; //@spec
const SLOT_TABLE: u32 = 0u; //@spec
const SLOT_LENGTH: u32 = 5u; //@spec
const KIND_BASE_POSITION: u32 = 0u; //@spec
const KIND_BASE_ROTATION: u32 = 1u; //@spec
const KIND_FLUX_DENSITY: u32 = 2u; //@spec
const KIND_TIP_FORCE: u32 = 3u; //@spec
const KIND_TIP_MOMENT: u32 = 4u; //@spec
const KIND_INSERTION: u32 = 5u; //@spec
const KIND_LENGTH: u32 = 6u; //@spec
const KIND_STIFFNESS: u32 = 7u; //@spec
const KIND_REST_CURVATURE: u32 = 8u; //@spec
const KIND_DIPOLE: u32 = 9u; //@spec
const KIND_LOAD: u32 = 10u; //@spec

// One slot of a derivative; `source` is an entry of the constants, or past them a column of the inputs.
struct Slot {
    derivative: u32,
    kind: u32,
    segment: u32,
    axis: u32,
    source: u32,
}

// A linear functional of the threes of columns: by base moment, by base rotation, by tip force.
struct Functional {
    by_moment: vec3<f32>,
    by_rotation: vec3<f32>,
    by_force: vec3<f32>,
}

// How the columns combine to the responses to a unit tip force, a unit tip moment and a unit base rotation.
struct Responses {
    force: mat3x3<f32>,
    moment: mat3x3<f32>,
    rotation: mat3x3<f32>,
    // dm0 by base rotation, less its canonical part.
    base_rotation: mat3x3<f32>,
}

//@if DERIVATIVES
// Solves the (adjoint) tip condition dm(L) - w(L) x l_tip = unit for each load. J5
fn new_responses(rod: Rod, tip: Tip) -> Responses {
    let dm_moment = tip_moment_columns(tip, BY_MOMENT);
    let dm_rotation = tip_moment_columns(tip, BY_ROTATION);
    let dm_force = tip_moment_columns(tip, BY_FORCE);
    //@if TIP_MOMENT
    let moment = inverse(columns_cross_sub(columns[BY_MOMENT].w, rod.l_tip, dm_moment));
    let by_force = columns_cross_sub(columns[BY_FORCE].w, rod.l_tip, dm_force);
    let by_rotation = columns_cross_sub(columns[BY_ROTATION].w, rod.l_tip, dm_rotation);
    let plain = inverse(dm_moment);
    return Responses(-1.0 * (moment * by_force), moment, -1.0 * (moment * by_rotation), -1.0 * (plain * dm_rotation));
    //@else
    let moment = inverse(dm_moment);
    let rotation = -1.0 * (moment * dm_rotation);
    return Responses(-1.0 * (moment * dm_force), moment, rotation, rotation);
    //@end
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
        transpose(responses.force) * axis,
        transpose(responses.moment) * axis,
        canonical + responses.base_rotation * axis,
    );
}

// Writes the rows of every derivative, `ROWS` columns each.
fn write_rows(rod: Rod, m0: vec3<f32>, n0: vec3<f32>, responses: Responses) {
    for (var index = 0u; index < DERIVATIVE_COUNT; index++) {
        let at = DERIVATIVE_COLUMN + ROWS * index;
        var sum: Functional;
        //@if TRACES
        sum = Functional(loaded_vector(at), loaded_vector(at + 3u), loaded_vector(at + 6u));
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
                case KIND_INSERTION: { extra = extra + insertion_rows(rod, m0, n0, responses, rate); }
                //@end
                default: {
                    sum.by_moment = axpy(rate, functional(slot, BY_MOMENT), sum.by_moment);
                    sum.by_rotation = axpy(rate, functional(slot, BY_ROTATION), sum.by_rotation);
                    sum.by_force = axpy(rate, functional(slot, BY_FORCE), sum.by_force);
                }
            }
        }
        let block = extra + rows(responses, sum);
        store_vector(at, block[0]);
        store_vector(at + 3u, block[1]);
        store_vector(at + 6u, block[2]);
    }
}

//@if TRACES
// Empties every functional.
fn clear_functionals() {
    for (var index = 0u; index < DERIVATIVE_COUNT; index++) {
        let at = DERIVATIVE_COLUMN + ROWS * index;
        store_vector(at, vec3<f32>());
        store_vector(at + 3u, vec3<f32>());
        store_vector(at + 6u, vec3<f32>());
    }
}

// Adds to the functionals what the columns left on a segment.
fn gather_functionals(segment: u32) {
    let list = SLOT_TABLE + segment;
    let end = u32(constants[list + 1u]);
    for (var i = u32(constants[list]); i < end; i += SLOT_LENGTH) {
        let slot = load_slot(i);
        let rate = load_rate(slot);
        let at = DERIVATIVE_COLUMN + ROWS * slot.derivative;
        for (var k = 0u; k < THREES; k++) { //@unroll
            let row = at + 3u * k;
            store_vector(row, axpy(rate, trace_functional(slot, k), loaded_vector(row)));
        } //@end
    }
}
//@end

fn load_slot(at: u32) -> Slot {
    return Slot(
        u32(constants[at]),
        u32(constants[at + 1u]),
        u32(constants[at + 2u]),
        u32(constants[at + 3u]),
        u32(constants[at + 4u]),
    );
}

// The rate of a slot: the same for all samples, or an input.
fn load_rate(slot: Slot) -> f32 {
    //@if VARYING_RATES
    if slot.source >= SLOT_TABLE { return input(slot.source - SLOT_TABLE); }
    //@end
    return constants[slot.source];
}

// `rate` along a world axis.
fn along(axis: u32, rate: f32) -> vec3<f32> {
    return select(vec3<f32>(), vec3<f32>(rate), vec3<u32>(0u, 1u, 2u) == vec3<u32>(axis));
}

//@if WANT_INSERTION
// More rod past the entry: the base is displaced by t and rotated by R0 u(0); the moment is that at the new base.
fn insertion_rows(rod: Rod, m0: vec3<f32>, n0: vec3<f32>, responses: Responses, rate: f32) -> mat3x3<f32> {
    let first = load_flexible(0u, 1.0);
    let d2 = cross(rod.t, rod.d1);
    let omega = curvature(first, rod.d1, d2, rod.t, m0);
    var rows = base_rotation_rows(responses, m0, omega * rate);
    rows[0] = axpy(rate, rod.t, rows[0]);
    //@if FORCE
    rows[2] = axpy(rate, cross(rod.t, n0), rows[2]);
    //@end
    return rows;
}
//@end

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

//@if TRACES
// The functional of a slot of the segment whose traces are in hand.
fn trace_functional(slot: Slot, k: u32) -> vec3<f32> {
    switch slot.kind {
        //@if COLLECT_COIL
        case KIND_FLUX_DENSITY: { return component(trace[k].field, slot.axis); }
        case KIND_DIPOLE: { return component(trace[k].dipole, slot.axis); }
        //@end
        //@if COLLECT_LENGTH
        case KIND_LENGTH: { return trace[k].length; }
        //@end
        //@if COLLECT_CURVATURE
        case KIND_REST_CURVATURE: { return component(trace[k].rest_curvature, slot.axis); }
        case KIND_STIFFNESS: {
            let compliance = load_flexible(slot.segment, 1.0).compliance[slot.axis];
            return component(trace[k].stiffness, slot.axis) * -(compliance * compliance);
        }
        //@end
        //@if COLLECT_LOAD
        case KIND_LOAD: { return component(trace[k].load, slot.axis); }
        //@end
        default: { return vec3<f32>(); }
    }
}
//@end

fn component(rows: mat3x3<f32>, axis: u32) -> vec3<f32> {
    return select(select(rows[2], rows[1], axis == 1u), rows[0], axis == 0u);
}
//@end
