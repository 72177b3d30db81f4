// Forward columns: what three parameters change, segment by segment. crates/core/src/cpu/rod/source.rs
//
// The plan says which parameter acts where: `sources_k` for the k-th three of parameters and `source_j_k` for them on
// segment j are generated, see src/gpu/shader/sources.rs.

//@if FORWARD
const FORWARD_THREES: u32 = 1u; //@spec

// Three parameters: what each changes at the base and at the tip.
struct Sources {
    // Virtual rotation and displacement of the base.
    w0: mat3x3<f32>,
    dp0: mat3x3<f32>,
    // Change of the force at the base.
    dn0: mat3x3<f32>,
    dl_tip: mat3x3<f32>,
    // How fast each inserts.
    insertion: vec3<f32>,
}

// What three parameters change on one segment.
struct Source {
    dL: vec3<f32>,
    dK: mat3x3<f32>,
    dK_rise: mat3x3<f32>,
    du_star: mat3x3<f32>,
    du_star_rise: mat3x3<f32>,
    dC_se: mat3x3<f32>,
    // Of the dipole, per length on a flexible segment.
    dmu: mat3x3<f32>,
    // Of the force, per length on a flexible segment.
    dload: mat3x3<f32>,
    dB: mat3x3<f32>,
    // What of it is not zero on a flexible segment.
    bends: bool,
    shears: bool,
    loads: bool,
    magnetises: bool,
}

// The three of parameters in hand, and what it changes on the segment in hand.
var<private> forward_three: u32;
var<private> source: Source;

//@if !VARYING_FIELD
// What a three of parameters changes at the ends.
fn load_sources(three: u32) -> Sources {
    var sources: Sources;
    for (var k = 0u; k < FORWARD_THREES; k++) { //@unroll
        if three == k {
            sources = sources_k();
            //@if SOURCE_FORCE
            for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
                //@if SOURCE[j][k]
                let source_j = source_j_k();
                //@if FLEXIBLE[j]
                sources.dn0 = columns_axpy(length_j(), source_j.dload, sources.dn0);
                //@if LOAD
                sources.dn0 = outer(load_j(), source_j.dL, sources.dn0);
                //@end
                //@else
                sources.dn0 = sources.dn0 + source_j.dload;
                //@end
                //@end
            } //@end
            //@end
        }
    } //@end
    return sources;
}

// Reads what the three of parameters in hand changes on a segment.
fn load_source(index: u32) {
    source = Source();
    for (var k = 0u; k < FORWARD_THREES; k++) { //@unroll
        for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
            //@if SOURCE[j][k]
            if forward_three == k && index == j { source = source_j_k(); }
            //@end
        } //@end
    } //@end
}

// dn of column `c` a distance beyond the point where it is `dn`.
fn source_force(c: u32, dn: vec3<f32>, distance: f32) -> vec3<f32> {
    if source.loads { return axpy(-distance, source.dload[c], dn); }
    return dn;
}
//@end

// R du* + R d(K^-1) R^T m at a share `x` of the segment, added to `dw` of column `c`.
fn source_bend(c: u32, x: f32, k: vec3<f32>, stage: Stage, dw: vec3<f32>) -> vec3<f32> {
    if !source.bends { return dw; }
    let R = mat3x3<f32>(stage.d1, stage.d2, stage.t);
    var du = vec3<f32>();
    //@if SOURCE_REST_CURVATURE
    du = axpy(x, source.du_star_rise[c], source.du_star[c]);
    //@end
    //@if SOURCE_STIFFNESS
    du = du - row_times(stage.m, R) * k * k * axpy(x, source.dK_rise[c], source.dK[c]);
    //@end
    return dw + R * du; // J1
}

// R d(Kse^-1) R^T n, added to `ddp` of column `c`.
fn source_shear(c: u32, stage: Stage, ddp: vec3<f32>) -> vec3<f32> {
    if !source.shears { return ddp; }
    let R = mat3x3<f32>(stage.d1, stage.d2, stage.t);
    return ddp + R * (row_times(stage.n, R) * source.dC_se[c]);
}

//@if !VARYING_FIELD
// -p x df - (R dmu) x B - (R mu) x dB, added to `ddM` of column `c`.
fn source_couple(c: u32, rod: Rod, segment: Flexible, stage: Stage, ddM: vec3<f32>) -> vec3<f32> {
    var sum = ddM;
    //@if SOURCE_LOAD
    if source.loads { sum = sum + cross(source.dload[c], stage.p); }
    //@end
    //@if SOURCE_MAGNET
    if source.magnetises {
        let R = mat3x3<f32>(stage.d1, stage.d2, stage.t);
        sum = cross_sub(R * source.dmu[c], rod.B, sum) + cross(source.dB[c], R * segment.mu);
    }
    //@end
    return sum;
}

// More of a flexible segment at its distal end, where the rod goes on with R u, p' and M'.
fn source_lengthen(segment: Flexible, omega: vec3<f32>, v: vec3<f32>, slope: vec3<f32>) {
    columns[FORWARD].w = outer(omega, source.dL, columns[FORWARD].w);
    columns[FORWARD].dp = outer(v, source.dL, columns[FORWARD].dp);
    columns[FORWARD].dM = outer(slope, source.dL, columns[FORWARD].dM);
    //@if SOURCE_FORCE
    columns[FORWARD].dn = outer(-segment.w, source.dL, columns[FORWARD].dn);
    //@end
}

// -(R dmu) x B - (R mu) x dB - middle x dW on a rigid segment; lever arms are the caller's.
fn source_cross_rigid(rod: Rod, segment: Rigid, state: State) {
    //@if SOURCE_DIPOLE
    let R = mat3x3<f32>(state.d1, cross(state.t, state.d1), state.t);
    columns[FORWARD].dM = columns_cross_sub(R * source.dmu, rod.B, columns[FORWARD].dM);
    //@end
    //@if WANT_FLUX_DENSITY
    let mu_world = world_dipole(segment, state, 1.0);
    columns[FORWARD].dM = columns[FORWARD].dM + columns_cross(source.dB, mu_world);
    //@end
    //@if WANT_WEIGHT
    //@if RIGID_FORCE_ARM
    let middle = axpy(segment.length * 0.5, state.t, state.p);
    //@else
    let middle = state.p;
    //@end
    columns[FORWARD].dM = columns[FORWARD].dM + columns_cross(source.dload, middle);
    columns[FORWARD].dn = columns[FORWARD].dn - source.dload;
    //@end
}
//@end
//@end
