// What the plan says of each segment that must be integrated.

const SEGMENT_COUNT: u32 = 1u; //@spec
// First entry of its record.
const FIRST_ENTRY: array<u32, 1> = array<u32, 1>(1u); //@spec
const FLAGS: array<u32, 1> = array<u32, 1>(1u); //@spec
const IS_FLEXIBLE: u32 = 1u; //@spec
const TAPERS: u32 = 2u; //@spec
const SHEARS: u32 = 4u; //@spec
const HAS_MAGNET: u32 = 8u; //@spec
// Derivatives need integrals along it.
const HAS_INTEGRALS: u32 = 16u; //@spec

// Steps over each segment: on the path, on it with care, for the answer, for the error estimate.
const COARSE: u32 = 0u;
const CAREFUL: u32 = 1u;
const FINE: u32 = 2u;
const CHECK: u32 = 3u;
const COARSE_STEPS: array<u32, 1> = array<u32, 1>(1u); //@spec
const CAREFUL_STEPS: array<u32, 1> = array<u32, 1>(1u); //@spec
const STEPS: array<u32, 1> = array<u32, 1>(1u); //@spec

//@if GRADED
// On each grid: how many times as long as the one before each step over a segment is, and the first as a share of it.
const COARSE_RATIO: array<f32, 1> = array<f32, 1>(1.0); //@spec
const COARSE_FIRST: array<f32, 1> = array<f32, 1>(1.0); //@spec
const CAREFUL_RATIO: array<f32, 1> = array<f32, 1>(1.0); //@spec
const CAREFUL_FIRST: array<f32, 1> = array<f32, 1>(1.0); //@spec
const RATIO: array<f32, 1> = array<f32, 1>(1.0); //@spec
const FIRST: array<f32, 1> = array<f32, 1>(1.0); //@spec
const CHECK_RATIO: array<f32, 1> = array<f32, 1>(1.0); //@spec
const CHECK_FIRST: array<f32, 1> = array<f32, 1>(1.0); //@spec
//@end

fn first_entry(index: u32) -> u32 {
    var found = 0u;
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        found = select(found, FIRST_ENTRY[j], index == j);
    } //@end
    return found;
}

fn has(index: u32, flag: u32) -> bool {
    var flags = 0u;
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        flags = select(flags, FLAGS[j], index == j);
    } //@end
    return (flags & flag) != 0u;
}

fn step_count(index: u32, resolution: u32) -> u32 {
    var coarse = 0u;
    var careful = 0u;
    var fine = 0u;
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        coarse = select(coarse, COARSE_STEPS[j], index == j);
        careful = select(careful, CAREFUL_STEPS[j], index == j);
        fine = select(fine, STEPS[j], index == j);
    } //@end
    let of_answer = select(fine, 2u * fine, resolution == CHECK);
    return select(select(of_answer, careful, resolution == CAREFUL), coarse, resolution == COARSE);
}

//@if GRADED
// The ratio of the steps over a segment, and the first as a share of it.
fn step_grading(index: u32, resolution: u32) -> vec2<f32> {
    var found = vec2<f32>(1.0, 1.0);
    for (var j = 0u; j < SEGMENT_COUNT; j++) { //@unroll
        if index == j {
            found = vec2<f32>(RATIO[j], FIRST[j]);
            if resolution == CHECK { found = vec2<f32>(CHECK_RATIO[j], CHECK_FIRST[j]); }
            if resolution == CAREFUL { found = vec2<f32>(CAREFUL_RATIO[j], CAREFUL_FIRST[j]); }
            if resolution == COARSE { found = vec2<f32>(COARSE_RATIO[j], COARSE_FIRST[j]); }
        }
    } //@end
    return found;
}
//@end
