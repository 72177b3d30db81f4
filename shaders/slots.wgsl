// The table of slots, and the functionals of the derivatives, which are gathered in their rows segment by segment.
// The table lies behind the constants, see src/gpu/shader/slots.rs.

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
const KIND_STIFFNESS_RISE: u32 = 8u; //@spec
const KIND_REST_CURVATURE: u32 = 9u; //@spec
const KIND_REST_CURVATURE_RISE: u32 = 10u; //@spec
const KIND_LOAD: u32 = 11u; //@spec
const KIND_DIPOLE_PER_LENGTH: u32 = 12u; //@spec
const KIND_SHEAR_COMPLIANCE: u32 = 13u; //@spec
const KIND_DIPOLE: u32 = 14u; //@spec
const KIND_WEIGHT: u32 = 15u; //@spec

// One slot of a derivative; `entry` is one of the constants, or past them a column of the inputs.
struct Slot {
    derivative: u32,
    kind: u32,
    segment: u32,
    axis: u32,
    entry: u32,
}

//@if SLOTS
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
    if slot.entry >= SLOT_TABLE { return input(slot.entry - SLOT_TABLE); }
    //@end
    return constants[slot.entry];
}

//@if TRACES
// Empties every functional.
fn clear_functionals() {
    for (var index = 0u; index < DERIVATIVE_COUNT; index++) {
        let at = DERIVATIVE_COLUMN + ROWS * index;
        for (var k = 0u; k < TRACED; k++) { //@unroll
            store_vector(at + 3u * k, vec3<f32>());
        } //@end
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
        for (var k = 0u; k < TRACED; k++) { //@unroll
            let row = at + 3u * k;
            store_vector(row, axpy(rate, trace_functional(slot, k), loaded_vector(row)));
        } //@end
    }
}

// The functional of a slot of the segment whose traces are in hand.
fn trace_functional(slot: Slot, k: u32) -> vec3<f32> {
    switch slot.kind {
        //@if COLLECT_FIELD
        case KIND_FLUX_DENSITY: { return component(trace[k].field, slot.axis); }
        //@end
        //@if COLLECT_DIPOLE
        case KIND_DIPOLE, KIND_DIPOLE_PER_LENGTH: { return component(trace[k].dipole, slot.axis); }
        //@end
        //@if WANT_LENGTH
        case KIND_LENGTH: { return trace[k].length; }
        //@end
        //@if WANT_REST_CURVATURE
        case KIND_REST_CURVATURE: { return component(trace[k].rest_curvature, slot.axis); }
        //@end
        //@if WANT_REST_CURVATURE_RISE
        case KIND_REST_CURVATURE_RISE: { return component(trace[k].rest_curvature_rise, slot.axis); }
        //@end
        //@if WANT_STIFFNESS
        case KIND_STIFFNESS: { return component(trace[k].stiffness, slot.axis); }
        //@end
        //@if WANT_STIFFNESS_RISE
        case KIND_STIFFNESS_RISE: { return component(trace[k].stiffness_rise, slot.axis); }
        //@end
        //@if WANT_SHEAR_COMPLIANCE
        case KIND_SHEAR_COMPLIANCE: { return component(trace[k].shear_compliance, slot.axis); }
        //@end
        //@if COLLECT_LOAD
        case KIND_LOAD, KIND_WEIGHT: { return component(trace[k].load, slot.axis); }
        //@end
        default: { return vec3<f32>(); }
    }
}
//@end
//@end
