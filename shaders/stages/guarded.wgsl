// The guarded path of samples whose ramp was lost, on several invocations a sample. R4
// crates/core/src/cpu/equilibrium/path.rs

@compute @workgroup_size(WORKGROUP)
fn follow_with_care(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    invocation = local;
    first_lane = local - local % LANES;
    let sample = taken_with_care((group.x * LANES + group.y) * (WORKGROUP / LANES) + local / LANES);
    // All go on together, to the last barrier.
    let is_taken = sample < settings.sample_count;
    _ = select_sample(select(0u, sample, is_taken));
    let end = follow_path(load(), FIRST_PATH, handed_rest(), !is_taken);
    if is_taken && local == first_lane { hand_end(end, NEXT_CHORD); }
}
