// Which samples a kernel takes, and which it leaves to another of the same dispatch. src/gpu/rounds.rs
//
// A list: the workgroups that its samples fill, as an indirect dispatch has them, and those that LANES invocations fill for each
// sample to be followed with care; how many samples there are, and how many of them of that kind; whether it takes none. Then the
// samples: those to be followed with care from the front, the others from the back.

const LIST_GROUPS: u32 = 0u;
const LIST_GROUPS_WITH_CARE: u32 = 3u;
const LIST_COUNT: u32 = 6u;
const LIST_WITH_CARE: u32 = 7u;
const LIST_OTHERS: u32 = 8u;
const LIST_CLOSED: u32 = 9u;
const LIST_SAMPLES: u32 = 10u;
// In place of their number: every sample of the dispatch.
const EVERY_SAMPLE: u32 = 0xffffffffu;

@group(0) @binding(5) var<storage, read> taken_list: array<u32>;
@group(0) @binding(6) var<storage, read_write> left_list: array<atomic<u32>>;

// The sample of an invocation; none where there are no more.
fn taken_sample(place: u32) -> u32 {
    let count = taken_list[LIST_COUNT];
    if count == EVERY_SAMPLE { return place; }
    if place >= count { return settings.sample_count; }
    let with_care = taken_list[LIST_WITH_CARE];
    if place < with_care { return taken_list[LIST_SAMPLES + place]; }
    return taken_list[arrayLength(&taken_list) - 1u - (place - with_care)];
}

// The sample of an invocation that follows guarded paths; none where there are no more.
fn taken_with_care(place: u32) -> u32 {
    if place >= taken_list[LIST_WITH_CARE] { return settings.sample_count; }
    return taken_list[LIST_SAMPLES + place];
}

// Whether another kernel takes what this one leaves.
fn may_leave() -> bool {
    return atomicLoad(&left_list[LIST_CLOSED]) == 0u;
}

// Leaves a sample to another kernel, to be followed with care or not.
fn leave(sample: u32, with_care: bool) {
    atomicMax(&left_list[LIST_GROUPS], atomicAdd(&left_list[LIST_COUNT], 1u) / WORKGROUP + 1u);
    if with_care {
        let place = atomicAdd(&left_list[LIST_WITH_CARE], 1u);
        atomicMax(&left_list[LIST_GROUPS_WITH_CARE], place / WORKGROUP + 1u);
        atomicStore(&left_list[LIST_SAMPLES + place], sample);
    } else {
        let place = atomicAdd(&left_list[LIST_OTHERS], 1u);
        atomicStore(&left_list[arrayLength(&left_list) - 1u - place], sample);
    }
}
