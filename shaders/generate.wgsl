// The inputs of samples by their index, as in src/spec/sampling.rs. src/gpu/shader/generator.rs owns the layout.
//
// Values of a grid come from tables. Otherwise an input is a + b u of the shares u in [0, 1) of its axes, in whole
// numbers of 64 bits and rounded once.

struct Range {
    first_low: u32,
    first_high: u32,
    sample_count: u32,
    zero: u32,
}

@group(0) @binding(0) var<uniform> range: Range;
@group(0) @binding(1) var<storage, read> recipe: array<u32>;
@group(0) @binding(2) var<storage, read> tables: array<f32>;
@group(0) @binding(3) var<storage, read_write> inputs: array<f32>;

const WORKGROUP: u32 = 64u; //@spec
const BLOCK: u32 = 256u; //@spec
const INPUT_COUNT: u32 = 1u; //@spec
const AXIS_COUNT: u32 = 1u; //@spec
// Words of an axis in the recipe, where the places of the columns start and what concerns all axes.
const AXIS_WORDS: u32 = 1u; //@spec
const COLUMNS_AT: u32 = 1u; //@spec
const COMMON_AT: u32 = 1u; //@spec

// Of each axis: the place on a grid, or the share of its range as a fraction of 2^64.
var<private> places: array<vec2<u32>, AXIS_COUNT>;

fn wide_at(at: u32) -> vec2<u32> {
    return vec2<u32>(recipe[at], recipe[at + 1u]);
}

//@if GRID
// Quotient in the first two words, remainder in the third; the divisor is less than 2^31.
fn divide(a: vec2<u32>, by: u32) -> vec3<u32> {
    if a.y == 0u { return vec3<u32>(a.x / by, 0u, a.x % by); }
    var rest = a.y % by;
    var low = 0u;
    for (var bit = 0u; bit < 32u; bit++) {
        rest = (rest << 1u) | ((a.x >> (31u - bit)) & 1u);
        low = low << 1u;
        if rest >= by {
            rest -= by;
            low |= 1u;
        }
    }
    return vec3<u32>(low, a.y / by, rest);
}

fn set_places(index: vec2<u32>) {
    var rest = index;
    for (var axis = 0u; axis < AXIS_COUNT; axis++) {
        let divided = divide(rest, recipe[axis]);
        places[axis] = vec2<u32>(divided.z, 0u);
        rest = divided.xy;
    }
}

// From the table over the axes that the column depends on.
fn column_value(column: u32) -> f32 {
    let at = recipe[COLUMNS_AT + column];
    var place = 0u;
    var stride = 1u;
    for (var k = 0u; k < recipe[at + 1u]; k++) {
        let axis = recipe[at + 2u + k];
        place += stride * places[axis].x;
        stride *= recipe[axis];
    }
    return tables[recipe[at] + place];
}
//@else
fn set_places(index: vec2<u32>) {
    for (var axis = 0u; axis < AXIS_COUNT; axis++) { places[axis] = share(index, axis * AXIS_WORDS); }
}

//@if SOBOL
// The middle of the cell of a scrambled point.
fn share(index: vec2<u32>, at: u32) -> vec2<u32> {
    var point = 0u;
    for (var bits = index.x; bits != 0u; bits = bits & (bits - 1u)) {
        point = point ^ recipe[at + firstTrailingBit(bits)];
    }
    return vec2<u32>(0x80000000u, scramble(point, recipe[at + 32u]));
}

fn scramble(point: u32, key: u32) -> u32 {
    var x = reverseBits(point);
    x = x ^ (x * 0x3d20adeau);
    x = x + key;
    x = x * ((key >> 16u) | 1u);
    x = x ^ (x * 0x05526c56u);
    x = x ^ (x * 0x53a22864u);
    return reverseBits(x);
}
//@end

//@if UNIFORM
fn share(index: vec2<u32>, at: u32) -> vec2<u32> {
    let bits = hash(wide_at(at), index);
    return vec2<u32>(bits.x & 0xfffff800u, bits.y);
}
//@end

//@if LATIN_HYPERCUBE
// In common: the number of samples, its bits, half the bits of the permutation, 2^(63 + bits) over the number.
fn share(index: vec2<u32>, at: u32) -> vec2<u32> {
    let bits = recipe[COMMON_AT + 2u];
    let jitter = hash(wide_at(at + 12u), index);
    let inside = wide_right(vec2<u32>(jitter.x & 0xfffff800u, jitter.y), bits);
    let place = wide_left(permuted(index, at), 64u - bits) | inside;
    let half = wide_share(place, wide_at(COMMON_AT + 4u));
    if half.y >= 0x80000000u { return vec2<u32>(0xffffffffu); }
    return wide_left(half, 1u);
}

// Feistel rounds, walked until inside; half of all walks end at each step at least where the number is large.
fn permuted(index: vec2<u32>, at: u32) -> vec2<u32> {
    let half = recipe[COMMON_AT + 3u];
    let mask = (1u << half) - 1u;
    var walked = index;
    for (var walk = 0u; walk < 1000u; walk++) {
        var left = wide_right(walked, half).x;
        var right = walked.x & mask;
        for (var round = 0u; round < 6u; round++) {
            let next = left ^ (hash(wide_at(at + 2u * round), vec2<u32>(right, 0u)).x & mask);
            left = right;
            right = next;
        }
        walked = wide_left(vec2<u32>(left, 0u), half) | vec2<u32>(right, 0u);
        if wide_less(walked, wide_at(COMMON_AT)) { break; }
    }
    return walked;
}
//@end

// a and each b are multiples of a power of two.
fn column_value(column: u32) -> f32 {
    let at = recipe[COLUMNS_AT + column];
    var sum = wide_at(at + 1u);
    for (var k = 0u; k < recipe[at + 3u]; k++) {
        let term = at + 4u + 4u * k;
        let part = wide_share(wide_at(term + 2u), places[recipe[term]]);
        if recipe[term + 1u] == 1u { sum = wide_add(sum, wide_negate(part)); } else { sum = wide_add(sum, part); }
    }
    let negative = sum.y >= 0x80000000u;
    if negative { sum = wide_negate(sum); }
    //@if F64
    let magnitude = (f32(sum.y) * 4294967296.0 + f32(sum.x)) * tables[column];
    return select(magnitude, -magnitude, negative);
    //@else
    return rounded(sum, i32(recipe[at]), negative);
    //@end
}

//@if !F64
// The nearest number to a magnitude times 2^exponent, to even; zero where it is too small.
fn rounded(magnitude: vec2<u32>, exponent: i32, negative: bool) -> f32 {
    if magnitude.x == 0u && magnitude.y == 0u { return 0.0; }
    let zeros = select(countLeadingZeros(magnitude.y), 32u + countLeadingZeros(magnitude.x), magnitude.y == 0u);
    let bits = wide_left(magnitude, zeros);
    let fraction = bits.y >> 8u;
    let tail = bits.y & 0xffu;
    let is_more = tail > 0x80u || tail == 0x80u && bits.x != 0u;
    let is_tie = tail == 0x80u && bits.x == 0u;
    let up = select(0u, 1u, is_more || is_tie && (fraction & 1u) == 1u);
    let place = 63 - i32(zeros) + exponent + 127;
    if place < 1 { return 0.0; }
    // A carry out of the fraction moves the exponent up.
    let word = (u32(place) << 23u) + (fraction - 0x800000u) + up;
    return bitcast<f32>(word | select(0u, 0x80000000u, negative));
}
//@end
//@end

@compute @workgroup_size(WORKGROUP)
fn generate(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= range.sample_count { return; }
    set_places(wide_add(vec2<u32>(range.first_low, range.first_high), vec2<u32>(id.x, 0u)));
    let base = (id.x / BLOCK) * INPUT_COUNT * BLOCK + id.x % BLOCK;
    for (var column = 0u; column < INPUT_COUNT; column++) { inputs[base + column * BLOCK] = column_value(column); }
}
