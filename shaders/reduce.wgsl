// Counts solved samples in voxels; whatever needs more than that is handed back. The layout is that of
// src/gpu/shader/voxel_request.rs.

struct Request {
    mark: f32,
    // Largest error estimate and residual that need no second look.
    estimate: f32,
    residual: f32,
    // Voxels to a unit of length, and where the base is among them.
    cells: f32,
    base_x: f32,
    base_y: f32,
    base_z: f32,
    // The box around the tips that are known to the host.
    low_x: f32,
    low_y: f32,
    low_z: f32,
    high_x: f32,
    high_y: f32,
    high_z: f32,
    // First voxel of the grid, and its size.
    first_x: i32,
    first_y: i32,
    first_z: i32,
    size_x: u32,
    size_y: u32,
    size_z: u32,
    sample_count: u32,
    wanted_count: u32,
    // Where the wanted samples stand in the tally, ascending.
    wanted_at: u32,
}

@group(0) @binding(0) var<uniform> request: Request;
@group(0) @binding(1) var<storage, read> outputs: array<f32>;
@group(0) @binding(2) var<storage, read_write> tally: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read_write> returned: array<f32>;
@group(0) @binding(4) var<storage, read_write> voxels: array<atomic<u32>>;

const WORKGROUP: u32 = 64u; //@spec
const BLOCK: u32 = 256u; //@spec
const OUTPUT_COUNT: u32 = 19u; //@spec
const TIP_POSITION_COLUMN: u32 = 0u; //@spec
const RESIDUAL_COLUMN: u32 = 12u; //@spec
const ERROR_ESTIMATE_COLUMN: u32 = 13u; //@spec
const STATUS_COLUMN: u32 = 18u; //@spec
const STATUS_OK: u32 = 0u; //@spec
const STATUS_RAMPED: u32 = 2u; //@spec
// Relative distance to the side of a voxel below which the host decides.
const VOXEL_MARGIN: f32 = 0.0; //@spec

// What the tally starts with: returned samples, ramped ones among the counted, unwritten ones; then the returned.
const RETURNED: u32 = 0u;
const RAMPED: u32 = 1u;
const FIRST_RETURNED: u32 = 4u;

fn solved(sample: u32, column: u32) -> f32 {
    return outputs[(sample / BLOCK) * OUTPUT_COUNT * BLOCK + column * BLOCK + sample % BLOCK];
}

// Whether the host asked for the sample's row.
fn is_wanted(sample: u32) -> bool {
    var low = request.wanted_at;
    var end = low + request.wanted_count;
    while low < end {
        let middle = (low + end) / 2u;
        if atomicLoad(&tally[middle]) < sample { low = middle + 1u; } else { end = middle; }
    }
    return low < request.wanted_at + request.wanted_count && atomicLoad(&tally[low]) == sample;
}

// Between two numbers, which an undefined one is not, whatever the compiler assumes.
fn is_within(low: f32, a: f32, high: f32) -> bool {
    //@if F64
    return a >= low && a <= high && abs(a) < 1e300;
    //@else
    return a >= low && a <= high && (bitcast<u32>(a) & 0x7f800000u) != 0x7f800000u;
    //@end
}

// The voxel along one axis, counted from the grid's first; past `size` where the host must say which.
fn cell(p: f32, base: f32, first: i32, size: u32) -> u32 {
    let along = p * request.cells;
    let place = along + base;
    let whole = floor(place);
    let inside = place - whole;
    let margin = VOXEL_MARGIN * (abs(along) + abs(base) + 1.0);
    let number = i32(whole) - first;
    if inside < margin || inside > 1.0 - margin || number < 0 { return size; }
    return u32(number);
}

// Whether nothing about a solved sample is new but its voxel; then counts it.
fn is_counted(sample: u32) -> bool {
    let x = solved(sample, TIP_POSITION_COLUMN);
    let y = solved(sample, TIP_POSITION_COLUMN + 1u);
    let z = solved(sample, TIP_POSITION_COLUMN + 2u);
    let is_known = is_within(request.low_x, x, request.high_x) && is_within(request.low_y, y, request.high_y)
        && is_within(request.low_z, z, request.high_z)
        && is_within(0.0, solved(sample, RESIDUAL_COLUMN), request.residual)
        && is_within(0.0, solved(sample, ERROR_ESTIMATE_COLUMN), request.estimate);
    if !is_known || is_wanted(sample) { return false; }
    let i = cell(x, request.base_x, request.first_x, request.size_x);
    let j = cell(y, request.base_y, request.first_y, request.size_y);
    let k = cell(z, request.base_z, request.first_z, request.size_z);
    if i >= request.size_x || j >= request.size_y || k >= request.size_z { return false; }
    atomicAdd(&voxels[i + request.size_x * (j + request.size_y * k)], 1u);
    return true;
}

fn give_back(sample: u32) {
    let at = atomicAdd(&tally[RETURNED], 1u);
    atomicStore(&tally[FIRST_RETURNED + at], sample);
    let base = (at / BLOCK) * OUTPUT_COUNT * BLOCK + at % BLOCK;
    for (var column = 0u; column < OUTPUT_COUNT; column++) { returned[base + column * BLOCK] = solved(sample, column); }
}

@compute @workgroup_size(WORKGROUP)
fn reduce(@builtin(global_invocation_id) id: vec3<u32>) {
    let sample = id.x;
    if sample >= request.sample_count { return; }
    let code = solved(sample, STATUS_COLUMN) - request.mark;
    let ramped = code == f32(STATUS_RAMPED);
    // A row that was left unwritten has none of the codes.
    if (ramped || code == f32(STATUS_OK)) && is_counted(sample) {
        if ramped { atomicAdd(&tally[RAMPED], 1u); }
    } else {
        give_back(sample);
    }
}
