// The field at a point: B, its gradient G, and the second derivatives that columns need. F0, F1, F6
// crates/core/src/cpu/rod/field/space.rs
//
// Positions count from the base; mu0 / 4 pi is one in the plan's units.

const FIELD_RECORD: u32 = 8u; //@spec
const FIELD_DIPOLE_RECORD: u32 = 6u; //@spec
const DIPOLE_COUNT: u32 = 1u; //@spec
const CLEARANCES: array<f32, 1> = array<f32, 1>(0.0); //@spec

// Farther from every magnet than any rod.
const FAR: f32 = 1e9;
// Squares of lengths below this are none.
const TINY: f32 = 1e-30;

// B0 + G (x - x0) + the fields of dipoles.
struct Space {
    B0: vec3<f32>,
    //@if GRADIENT
    G: mat3x3<f32>,
    origin: vec3<f32>,
    //@end
    //@if SOURCES
    X: array<vec3<f32>, DIPOLE_COUNT>,
    M: array<vec3<f32>, DIPOLE_COUNT>,
    clearance: array<f32, DIPOLE_COUNT>,
    //@end
}

// The field at one point and what it does to a dipole there.
struct Local {
    B: vec3<f32>,
    G: mat3x3<f32>,
    // Second derivatives of mu . B.
    T3: mat3x3<f32>,
}

// That of the sample.
var<private> space: Space;

// The matrix of the five entries of a gradient. F0
fn gradient(entries: array<f32, 5>) -> mat3x3<f32> {
    return mat3x3<f32>(
        vec3<f32>(entries[0], entries[1], entries[2]),
        vec3<f32>(entries[1], entries[3], entries[4]),
        vec3<f32>(entries[2], entries[4], -(entries[0] + entries[3])),
    );
}

//@if SOURCES
// The field of a dipole M at a distance r. F0
fn dipole_B(M: vec3<f32>, r: vec3<f32>) -> vec3<f32> {
    let powers = inverses(r);
    return (r * (dot(M, r) * powers.x * 3.0) - M) * powers.y;
}

// The gradient of its field.
fn dipole_G(M: vec3<f32>, r: vec3<f32>) -> mat3x3<f32> {
    let powers = inverses(r);
    let b = dot(M, r);
    let along = axpy(b * powers.x * -5.0, r, M);
    let sum = outer(M, r, outer(r, along, identity() * b));
    return sum * (powers.x * powers.y * 3.0);
}

// Second derivatives of mu . B.
fn dipole_T3(M: vec3<f32>, r: vec3<f32>, mu: vec3<f32>) -> mat3x3<f32> {
    let powers = inverses(r);
    let a = dot(mu, r) * powers.x;
    let b = dot(M, r);
    let c = dot(mu, M);
    // Each is linear in r; what multiplies r r^T comes last.
    let q = axpy(b * powers.x, mu, M * a);
    let square = (a * b * 35.0 - 5.0 * c) * powers.x;
    var sum = outer(mu, M, outer(M, mu, identity() * (c - 5.0 * a * b)));
    sum = outer(q, r * -5.0, outer(r * -5.0, q, sum));
    sum = outer(r * square, r, sum);
    return sum * (powers.x * powers.y * 3.0);
}

// r^-2 and r^-3
fn inverses(r: vec3<f32>) -> vec2<f32> {
    let inverse2 = 1.0 / dot(r, r);
    return vec2<f32>(inverse2, inverse2 * sqrt(inverse2));
}
//@end

// Reads the sample's record of the field.
fn load_space(rod: Rod) {
    space.B0 = rod.B;
    //@if GRADIENT
    var entries: array<f32, 5>;
    for (var k = 0u; k < 5u; k++) { //@unroll
        entries[k] = record_field(k);
    } //@end
    space.G = gradient(entries);
    space.origin = field_vector(5u) - base_position();
    //@end
    //@if SOURCES
    space.clearance = CLEARANCES;
    for (var j = 0u; j < DIPOLE_COUNT; j++) {
        let at = FIELD_RECORD + FIELD_DIPOLE_RECORD * j;
        space.X[j] = field_vector(at) - base_position();
        space.M[j] = field_vector(at + 3u);
    }
    //@end
}

fn field_vector(at: u32) -> vec3<f32> {
    return vec3<f32>(record_field(at), record_field(at + 1u), record_field(at + 2u));
}

// B and G at a point.
fn field(x: vec3<f32>) -> Local {
    return local(x, vec3<f32>(), false);
}

// The same with what columns need for a dipole there, where they follow.
fn local(x: vec3<f32>, mu: vec3<f32>, with_columns: bool) -> Local {
    var found: Local;
    found.B = space.B0;
    //@if GRADIENT
    found.B = found.B + space.G * (x - space.origin);
    found.G = space.G;
    //@end
    //@if SOURCES
    for (var j = 0u; j < DIPOLE_COUNT; j++) {
        let r = x - space.X[j];
        found.B = found.B + dipole_B(space.M[j], r);
        found.G = found.G + dipole_G(space.M[j], r);
        if with_columns { found.T3 = found.T3 + dipole_T3(space.M[j], r, mu); }
    }
    //@end
    return found;
}

// Distance of a straight piece to the nearest dipole beyond its clearance.
fn clearance(start: vec3<f32>, end: vec3<f32>) -> f32 {
    var closest = FAR;
    //@if SOURCES
    let along = end - start;
    let per = 1.0 / max(dot(along, along), TINY);
    for (var j = 0u; j < DIPOLE_COUNT; j++) {
        let r = start - space.X[j];
        let share = clamp(-dot(r, along) * per, 0.0, 1.0);
        closest = min(closest, length(axpy(share, along, r)) - space.clearance[j]);
    }
    //@end
    return closest;
}
