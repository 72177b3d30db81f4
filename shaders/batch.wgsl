// One sample for each invocation: where its numbers lie. src/gpu/shader/settings.rs owns the layout.

struct Settings {
    // Added to every status, so that a row left by an earlier dispatch is noticed.
    mark: f32,
    tolerance: f32,
    chord_tolerance: f32,
    first_order_tolerance: f32,
    turn_tolerance: f32,
    error_share: f32,
    derivative_share: f32,
    derivative_floor: f32,
    sample_count: u32,
    // Always zero, which no compiler can know.
    zero: u32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<storage, read> constants: array<f32>;
@group(0) @binding(2) var<storage, read> inputs: array<f32>;
@group(0) @binding(3) var<storage, read_write> outputs: array<f32>;

const WORKGROUP: u32 = 64u; //@spec
const BLOCK: u32 = 256u; //@spec
const INPUT_COUNT: u32 = 1u; //@spec
const OUTPUT_COUNT: u32 = 21u; //@spec

const TIP_POSITION_COLUMN: u32 = 0u; //@spec
const TIP_D1_COLUMN: u32 = 3u; //@spec
const TIP_TANGENT_COLUMN: u32 = 6u; //@spec
const BASE_MOMENT_COLUMN: u32 = 9u; //@spec
const RESIDUAL_COLUMN: u32 = 12u; //@spec
const ERROR_ESTIMATE_COLUMN: u32 = 13u; //@spec
const DERIVATIVE_ERROR_COLUMN: u32 = 19u; //@spec
const STABILITY_MARGIN_COLUMN: u32 = 14u; //@spec
const STABILITY_INDEX_COLUMN: u32 = 15u; //@spec
const ITERATIONS_COLUMN: u32 = 16u; //@spec
const LOAD_FRACTION_COLUMN: u32 = 17u; //@spec
const LOAD_FRACTION_ERROR_COLUMN: u32 = 20u; //@spec
const STATUS_COLUMN: u32 = 18u; //@spec

const STATUS_OK: u32 = 0u; //@spec
const STATUS_REFINED: u32 = 1u; //@spec
const STATUS_RAMPED: u32 = 2u; //@spec
const STATUS_FOLD: u32 = 3u; //@spec
const STATUS_UNSTABLE: u32 = 4u; //@spec
const STATUS_STEP_LIMIT: u32 = 5u; //@spec
const STATUS_NOT_CONVERGED: u32 = 6u; //@spec
const STATUS_BAD_PARAMETER: u32 = 7u; //@spec
const STATUS_NON_FINITE: u32 = 8u; //@spec
const STATUS_PENDING: u32 = 9u; //@spec

var<private> input_base: u32;
var<private> output_base: u32;

// Points to a sample's numbers; false for an invocation without a sample.
fn select_sample(sample: u32) -> bool {
    let block = sample / BLOCK;
    let lane = sample % BLOCK;
    input_base = block * INPUT_COUNT * BLOCK + lane;
    output_base = block * OUTPUT_COUNT * BLOCK + lane;
    return sample < settings.sample_count;
}

// One of the sample's inputs.
fn input(column: u32) -> f32 {
    return inputs[input_base + column * BLOCK];
}

// Writes one of the sample's outputs.
fn store(column: u32, value: f32) {
    outputs[output_base + column * BLOCK] = value;
}

fn store_vector(column: u32, value: vec3<f32>) {
    store(column, value.x);
    store(column + 1u, value.y);
    store(column + 2u, value.z);
}

// What this invocation has stored there.
fn loaded_vector(column: u32) -> vec3<f32> {
    let at = output_base + column * BLOCK;
    return vec3<f32>(outputs[at], outputs[at + BLOCK], outputs[at + 2u * BLOCK]);
}

// Says what became of the sample; without it the whole dispatch is refused.
fn store_status(code: u32) {
    store(STATUS_COLUMN, settings.mark + f32(code));
}
