// Every derivative from nine columns: rows of the Jacobian by reciprocity. J5 and the table of model loads.
// src/lanes/rows.rs; the table of slots lies behind the constants, see src/gpu/slots.rs.

const DERIVATIVE_COUNT: u32 = 1u; //@spec
const DERIVATIVE_COLUMN: u32 = 19u; //@spec
const ROWS: u32 = 9u; //@spec
const SLOT_TABLE: u32 = 0u; //@spec
const SLOT_BASE_POSITION: u32 = 0u; //@spec
const SLOT_BASE_ROTATION: u32 = 1u; //@spec
const SLOT_FLUX_DENSITY: u32 = 2u; //@spec
const SLOT_TIP_FORCE: u32 = 3u; //@spec
const SLOT_TIP_MOMENT: u32 = 4u; //@spec
const SLOT_INSERTION: u32 = 5u; //@spec
const SLOT_LENGTH: u32 = 6u; //@spec
const SLOT_STIFFNESS: u32 = 7u; //@spec
const SLOT_REST_CURVATURE: u32 = 8u; //@spec
const SLOT_DIPOLE: u32 = 9u; //@spec
const SLOT_LOAD: u32 = 10u; //@spec

// One slot of a derivative; `source` is an entry of the constants, or past them a column of the inputs.
struct Slot {
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
    var at_slot = SLOT_TABLE + DERIVATIVE_COUNT;
    for (var index = 0u; index < DERIVATIVE_COUNT; index++) {
        var sum = Functional();
        var extra = mat3x3<f32>();
        let slot_end = at_slot + 4u * u32(constants[SLOT_TABLE + index]);
        while at_slot < slot_end {
            let slot = load_slot(at_slot);
            let rate = load_rate(slot);
            switch slot.kind {
                //@if WANT_BASE_POSITION
                case SLOT_BASE_POSITION: { extra[0] = extra[0] + along(slot.axis, rate); }
                //@end
                //@if WANT_BASE_ROTATION
                case SLOT_BASE_ROTATION: {
                    extra = extra + base_rotation_rows(responses, m0, along(slot.axis, rate));
                }
                //@end
                //@if WANT_INSERTION
                case SLOT_INSERTION: { extra = extra + insertion_rows(rod, m0, n0, responses, rate); }
                //@end
                default: {
                    sum.by_moment = axpy(rate, functional(slot, BY_MOMENT), sum.by_moment);
                    sum.by_rotation = axpy(rate, functional(slot, BY_ROTATION), sum.by_rotation);
                    sum.by_force = axpy(rate, functional(slot, BY_FORCE), sum.by_force);
                }
            }
            at_slot += 4u;
        }
        let block = extra + rows(responses, sum);
        let at = DERIVATIVE_COLUMN + ROWS * index;
        store_vector(at, block[0]);
        store_vector(at + 3u, block[1]);
        store_vector(at + 6u, block[2]);
    }
}

fn load_slot(at: u32) -> Slot {
    return Slot(u32(constants[at]), u32(constants[at + 1u]), u32(constants[at + 2u]), u32(constants[at + 3u]));
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

// The functional of a slot on three columns, number `k` in the traces.
fn functional(slot: Slot, k: u32) -> vec3<f32> {
    switch slot.kind {
        //@if WANT_TIP_FORCE
        case SLOT_TIP_FORCE: { return component(transpose(columns[k].dp), slot.axis); }
        //@end
        //@if WANT_TIP_MOMENT
        case SLOT_TIP_MOMENT: { return component(transpose(columns[k].w), slot.axis); }
        //@end
        //@if WANT_FLUX_DENSITY
        case SLOT_FLUX_DENSITY: {
            var total = vec3<f32>();
            for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
                total = total + component(traces[j][k].field, slot.axis);
            } //@end
            return total;
        }
        //@end
        //@if WANT_LENGTH
        case SLOT_LENGTH: { return trace_of(slot.segment, k).length; }
        //@end
        //@if WANT_REST_CURVATURE
        case SLOT_REST_CURVATURE: { return component(trace_of(slot.segment, k).rest_curvature, slot.axis); }
        //@end
        //@if WANT_STIFFNESS
        case SLOT_STIFFNESS: {
            let compliance = load_flexible(slot.segment, 1.0).compliance[slot.axis];
            return component(trace_of(slot.segment, k).stiffness, slot.axis) * -(compliance * compliance);
        }
        //@end
        //@if WANT_DIPOLE
        case SLOT_DIPOLE: { return component(trace_of(slot.segment, k).dipole, slot.axis); }
        //@end
        //@if WANT_LOAD
        case SLOT_LOAD: { return component(trace_of(slot.segment, k).load, slot.axis); }
        //@end
        default: { return vec3<f32>(); }
    }
}

//@if TRACES
// A trace, without an index that the compiler does not know.
fn trace_of(segment: u32, k: u32) -> Trace {
    var found: Trace;
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        if segment == j { found = traces[j][k]; }
    } //@end
    return found;
}
//@end

fn component(rows: mat3x3<f32>, axis: u32) -> vec3<f32> {
    return select(select(rows[2], rows[1], axis == 1u), rows[0], axis == 0u);
}
