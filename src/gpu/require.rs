//! Tests without a GPU: a visible skip, or a failure where one is required.

use super::Device;

/// Opens a GPU for a test. Without one: prints that `test` is skipped and returns `None`, or panics where the
/// environment variable `RODSWEEP_GPU` is `require`.
pub fn device_or_skip(test: &str) -> Option<Device> {
    match Device::open() {
        Ok(device) => Some(device),
        Err(error) if std::env::var("RODSWEEP_GPU").is_ok_and(|value| value == "require") => {
            panic!("{test} requires a GPU (RODSWEEP_GPU=require): {error}")
        }
        Err(error) => {
            eprintln!("SKIPPED {test}: {error}");
            None
        }
    }
}
