//! Where the time of a GPU engine goes.

use super::dispatch_buffers::DeviceTime;

/// Summed over all batches (s). Kernels and copies are timed by the device's own clock where it has one. They overlap
/// with the host's work.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Timings {
    /// Finding and opening the device.
    pub open: f64,
    /// Checking the shader and making the pipeline.
    pub compile: f64,
    /// An empty dispatch, in which some drivers compile.
    pub first_dispatch: f64,
    /// Converting inputs and handing over work. A software adapter may compute meanwhile.
    pub upload: f64,
    /// The kernels. Without a clock on the device: from submission to completion.
    pub kernel: f64,
    /// Copies to memory that the host can read. Zero without a clock on the device.
    pub copy: f64,
    /// The host's wait for kernels and copies.
    pub wait: f64,
    /// Converting outputs.
    pub unpack: f64,
    /// Dispatches that came back.
    pub dispatch_count: u64,
    /// Samples of these.
    pub sample_count: u64,
}

impl Timings {
    /// One dispatch that has come back; returns the seconds of its kernels.
    pub(super) fn add(&mut self, time: DeviceTime, on_the_wall: f64, samples: usize) -> f64 {
        let kernel = time.kernels.unwrap_or(on_the_wall);
        self.kernel += kernel;
        self.copy += time.copies.unwrap_or(0.0);
        self.dispatch_count += 1;
        self.sample_count += samples as u64;
        kernel
    }

    /// By name (s).
    pub fn named(&self) -> Vec<(&'static str, f64)> {
        vec![
            ("open", self.open),
            ("compile", self.compile),
            ("first_dispatch", self.first_dispatch),
            ("upload", self.upload),
            ("kernel", self.kernel),
            ("copy", self.copy),
            ("wait", self.wait),
            ("unpack", self.unpack),
        ]
    }
}
