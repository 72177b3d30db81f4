//! Where the time of a GPU engine goes.

use super::device_time::{DeviceTime, LISTS, Stage};
use crate::backend::RungCount;

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
    /// Of each kernel, as [`Stage::ALL`] has them; zero without a clock on the device.
    pub stages: [f64; Stage::COUNT],
    /// Samples that anchors left to the way from rest, then those that each round left to the next; of each, those that were
    /// left to be followed with care.
    pub left: [[u64; 2]; LISTS],
}

impl Timings {
    /// One dispatch that has come back; returns the seconds of its kernels.
    pub(super) fn add(&mut self, time: &DeviceTime, on_the_wall: f64, samples: usize) -> f64 {
        let kernel = time.kernels.unwrap_or(on_the_wall);
        self.kernel += kernel;
        self.copy += time.copies.unwrap_or(0.0);
        self.dispatch_count += 1;
        self.sample_count += samples as u64;
        for (stage, seconds) in &time.stages {
            self.stages[*stage as usize] += seconds;
        }
        let left = time.left.into_iter().flatten();
        self.left.iter_mut().flatten().zip(left).for_each(|(sum, left)| *sum += u64::from(left));
        kernel
    }

    /// By name (s).
    pub fn named(&self) -> Vec<(&'static str, f64)> {
        let parts = [
            ("open", self.open),
            ("compile", self.compile),
            ("first_dispatch", self.first_dispatch),
            ("upload", self.upload),
            ("kernel", self.kernel),
            ("copy", self.copy),
            ("wait", self.wait),
            ("unpack", self.unpack),
        ];
        parts.into_iter().chain(Stage::ALL.map(|(stage, name)| (name, self.stages[stage as usize]))).collect()
    }

    /// The ways to the full load that samples went, as the CPU's ladder names them; seconds are those of the device.
    pub fn rungs(&self, has_anchors: bool) -> Vec<RungCount> {
        let seconds = |stages: &[Stage]| stages.iter().map(|stage| self.stages[*stage as usize]).sum();
        let rung = |rung: &str, samples: u64, left: u64, stages: &[Stage]| RungCount {
            rung: rung.into(),
            samples,
            left,
            seconds: seconds(stages),
        };
        if self.stages[Stage::Path as usize] == 0.0 {
            return Vec::new();
        }
        let [of_anchors, of_rounds @ ..] = &self.left;
        let at_rest = if has_anchors { of_anchors[0] } else { self.sample_count };
        let with_care = of_rounds.iter().map(|left| left[1]).sum();
        let from_rest = [Stage::Path, Stage::Check, Stage::Columns];
        let anchors = has_anchors.then(|| rung("anchors", self.sample_count, at_rest, &[Stage::Anchored]));
        let others = [
            rung("load steps", at_rest, with_care, &from_rest),
            rung("guarded load steps", with_care, 0, &[Stage::Left]),
        ];
        anchors.into_iter().chain(others).collect()
    }
}
