// What a sample holds in a storage buffer, number by number, the samples of a dispatch side by side. It outlasts a dispatch:
// each takes every sample one turn further. src/gpu/shader/nodes.rs and varying.rs own the sizes.

struct MemorySettings {
    // Samples that there is room for.
    stride: u32,
    // By nodes: intervals that there is room for, and the path's pace.
    most_intervals: u32,
    spacing: f32,
    path_steps: u32,
    path_tolerance: f32,
    least_pivot: f32,
}

@group(0) @binding(4) var<uniform> memory_settings: MemorySettings;
@group(0) @binding(5) var<storage, read_write> memory: array<f32>;
// Samples that are not done.
@group(0) @binding(6) var<storage, read_write> under_way: atomic<u32>;

var<private> sample_at: u32;

fn held(at: u32) -> f32 {
    return memory[at * memory_settings.stride + sample_at];
}

fn hold(at: u32, value: f32) {
    memory[at * memory_settings.stride + sample_at] = value;
}

fn held_vector(at: u32) -> vec3<f32> {
    return vec3<f32>(held(at), held(at + 1u), held(at + 2u));
}

fn hold_vector(at: u32, value: vec3<f32>) {
    hold(at, value.x);
    hold(at + 1u, value.y);
    hold(at + 2u, value.z);
}

fn held_matrix(at: u32) -> mat3x3<f32> {
    return mat3x3<f32>(held_vector(at), held_vector(at + 3u), held_vector(at + 6u));
}

fn hold_matrix(at: u32, value: mat3x3<f32>) {
    hold_vector(at, value[0]);
    hold_vector(at + 3u, value[1]);
    hold_vector(at + 6u, value[2]);
}

// Whether a number is neither infinite nor undefined; by its bits, whatever the compiler assumes.
fn is_finite(a: f32) -> bool {
    //@if F64
    return abs(a) < 1e300;
    //@else
    return (bitcast<u32>(a) & 0x7f800000u) != 0x7f800000u;
    //@end
}
