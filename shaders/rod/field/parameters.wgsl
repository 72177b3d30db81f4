// What parameters change: numbers of the rod, and of the field. F6
// crates/core/src/cpu/rod/field/parameters.rs
//
// The plan's table has the slots of each three of parameters, see src/gpu/shader/slots.rs.

//@if FORWARD
const KIND_FIELD_GRADIENT: u32 = 16u; //@spec
const KIND_FIELD_ORIGIN: u32 = 17u; //@spec
const KIND_SOURCE_POSITION: u32 = 18u; //@spec
const KIND_SOURCE_MOMENT: u32 = 19u; //@spec

// dB and dG mu at a point that stands still, by three parameters.
struct FieldChange {
    dB: mat3x3<f32>,
    dF: mat3x3<f32>,
}

// The three in hand: its slots in the table, and what it changes at the ends of the rod.
var<private> first_slot: u32;
var<private> end_slot: u32;
var<private> sources: Sources;

// Reads three parameters.
fn load_parameters(three: u32) {
    first_slot = u32(constants[SLOT_TABLE + three]);
    end_slot = u32(constants[SLOT_TABLE + three + 1u]);
    sources = Sources();
    for (var i = first_slot; i < end_slot; i += SLOT_LENGTH) {
        let slot = load_slot(i);
        let change = slot_change(slot);
        switch slot.kind {
            case KIND_BASE_POSITION: { sources.dp0 = sources.dp0 + change; }
            case KIND_BASE_ROTATION: { sources.w0 = sources.w0 + change; }
            case KIND_TIP_FORCE: { sources.dn0 = sources.dn0 + change; }
            case KIND_TIP_MOMENT: { sources.dl_tip = sources.dl_tip + change; }
            case KIND_INSERTION: {
                sources.insertion = sources.insertion + unit(slot.derivative, load_rate(slot));
            }
            default: {}
        }
    }
}

//@if SEGMENT_SOURCES
// Reads what the three parameters in hand change on a segment.
fn load_segment_source(index: u32) {
    source = Source();
    for (var i = first_slot; i < end_slot; i += SLOT_LENGTH) {
        let slot = load_slot(i);
        if slot.kind < KIND_LENGTH || slot.kind >= KIND_FIELD_GRADIENT || slot.segment != index { continue; }
        let change = slot_change(slot);
        switch slot.kind {
            //@if WANT_LENGTH
            case KIND_LENGTH: { source.dL = source.dL + unit(slot.derivative, load_rate(slot)); }
            //@end
            //@if SOURCE_BEND
            case KIND_STIFFNESS: { source.dK = source.dK + change; }
            case KIND_STIFFNESS_RISE: { source.dK_rise = source.dK_rise + change; }
            case KIND_REST_CURVATURE: { source.du_star = source.du_star + change; }
            case KIND_REST_CURVATURE_RISE: { source.du_star_rise = source.du_star_rise + change; }
            //@end
            //@if WANT_SHEAR_COMPLIANCE
            case KIND_SHEAR_COMPLIANCE: { source.dC_se = source.dC_se + change; }
            //@end
            case KIND_LOAD, KIND_WEIGHT: { source.dload = source.dload + change; }
            case KIND_DIPOLE, KIND_DIPOLE_PER_LENGTH: { source.dmu = source.dmu + change; }
            default: {}
        }
    }
    source.bends = true;
    source.shears = true;
}
//@end

// The rate of a slot in its column and row.
fn slot_change(slot: Slot) -> mat3x3<f32> {
    return outer(unit(slot.axis, load_rate(slot)), unit(slot.derivative, 1.0), mat3x3<f32>());
}

// dB and dG mu at a point that stands still. F6
fn parameters_field(x: vec3<f32>, mu: vec3<f32>) -> FieldChange {
    var change: FieldChange;
    for (var i = first_slot; i < end_slot; i += SLOT_LENGTH) {
        let slot = load_slot(i);
        let rate = load_rate(slot);
        let by = unit(slot.axis, rate);
        var dB = vec3<f32>();
        var dF = vec3<f32>();
        switch slot.kind {
            case KIND_FLUX_DENSITY: { dB = by; }
            //@if WANT_FIELD_GRADIENT
            case KIND_FIELD_GRADIENT: {
                var entries: array<f32, 5>;
                for (var k = 0u; k < 5u; k++) { //@unroll
                    entries[k] = select(0.0, rate, slot.axis == k);
                } //@end
                let dG = gradient(entries);
                dB = dG * (x - space.origin);
                dF = dG * mu;
            }
            //@end
            //@if WANT_FIELD_ORIGIN
            case KIND_FIELD_ORIGIN: { dB = -(space.G * by); }
            //@end
            //@if WANT_SOURCE_POSITION
            case KIND_SOURCE_POSITION: {
                let r = x - space.X[slot.segment];
                let M = space.M[slot.segment];
                dB = -(dipole_G(M, r) * by);
                dF = -(dipole_T3(M, r, mu) * by);
            }
            //@end
            //@if WANT_SOURCE_MOMENT
            case KIND_SOURCE_MOMENT: {
                let r = x - space.X[slot.segment];
                dB = dipole_B(by, r);
                dF = dipole_G(by, r) * mu;
            }
            //@end
            default: {}
        }
        let column = unit(slot.derivative, 1.0);
        change.dB = outer(dB, column, change.dB);
        change.dF = outer(dF, column, change.dF);
    }
    return change;
}

// `by` along an axis.
fn unit(axis: u32, by: f32) -> vec3<f32> {
    return select(vec3<f32>(), vec3<f32>(by), vec3<u32>(0u, 1u, 2u) == vec3<u32>(axis));
}
//@end
