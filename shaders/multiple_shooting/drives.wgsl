// Drives of the intervals: unit tip forces, or the parameters of forward columns. crates/core/src/cpu/multiple_shooting/drives.rs

// Changes of the force at the base by three parameters; unit tip forces carry their own.
fn driving_forces() -> mat3x3<f32> {
    //@if SOURCE_FORCE
    return load_sources(forward_three).dn0;
    //@else
    return mat3x3<f32>();
    //@end
}
