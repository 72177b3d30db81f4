//! Whether a driver computes what it should: a small shader with known answers.
//!
//! Every kernel relies on the essential checks. The others are facts that some kernels must know.

use super::device::{Device, failed};
use super::shader::{Piece, Specialisation, check, emit};
use crate::backend::BackendError;
use std::fmt;
use std::sync::atomic::Ordering;
use wgpu::BufferUsages as Usage;

/// Iterations of the loop test; some drivers stop at 65,535.
const STEPS: u32 = 100_000;

/// One answer of the device.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Check {
    /// What was computed.
    pub name: &'static str,
    /// The right answer.
    pub expected: f64,
    /// The device's answer.
    pub found: f64,
    /// Whether it is as near as it should be.
    pub passed: bool,
    /// Whether results cannot be trusted without it.
    pub essential: bool,
}

/// All answers of the device.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SelfTest {
    /// In a fixed order.
    pub checks: Vec<Check>,
}

impl SelfTest {
    /// Whether every essential check passed.
    pub fn passed(&self) -> bool {
        self.checks.iter().all(|check| check.passed || !check.essential)
    }

    /// Whether loops may run for more than 65,535 iterations in an invocation.
    pub fn has_long_loops(&self) -> bool {
        self.checks.iter().filter(|check| check.name.contains("loop")).all(|check| check.passed)
    }
}

/// Refuses a device that gets an essential check wrong. A device is tested once.
pub(super) fn expect_right(device: &Device) -> Result<(), BackendError> {
    if device.computes_right.load(Ordering::Relaxed) {
        return Ok(());
    }
    let test = self_test(device)?;
    match test.checks.iter().find(|check| check.essential && !check.passed) {
        None => {
            device.computes_right.store(true, Ordering::Relaxed);
            Ok(())
        }
        Some(Check { name, expected, found, .. }) => Err(failed(format!(
            "{} computes wrong numbers ({name}: {found} instead of {expected}); update the driver, or use the CPU engine",
            device.adapter().name
        ))),
    }
}

/// Runs the test on a device.
///
/// # Errors
///
/// `DeviceFailed`, `OutOfMemory`: it could not run. Wrong answers are no error here.
pub fn self_test(device: &Device) -> Result<SelfTest, BackendError> {
    let tiny = (-13f32).exp2();
    let angle = 1.25f32;
    // Rounded away in part when added to one.
    let small = 1.25 * (-24f32).exp2();
    let operands = [1.0, 3.0, 2.0, tiny, angle, 0.0, STEPS as f32, small];
    let piece =
        Piece { name: "shaders/self_test.wgsl".into(), text: include_str!("../../shaders/self_test.wgsl").into() };
    let source = emit(&[piece], &Specialisation::default()).map_err(failed)?;
    check(&source).map_err(failed)?;
    let mut found = run(device, &source.text, &operands, 13)?;
    if device.faults.wrong_arithmetic {
        found[0] *= 1.001;
    }
    let scrambled = (0..STEPS).fold(1u32, |state, _| state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let last = f64::from((scrambled >> 8) as f32);
    let lost = f64::from(small) - 2f64.powi(-23);
    let (two, half_ulp) = (2f64, 2f64.powi(-24));
    // Name, answer, relative error allowed, essential.
    let expected = [
        ("division", 1.0 / 3.0, 5.0 * half_ulp, true),
        ("square root", two.sqrt(), 6.0 * half_ulp, true),
        ("inverse square root", 1.0 / two.sqrt(), 5.0 * half_ulp, true),
        ("fma rounds once", -f64::from(tiny).powi(2), 0.0, false),
        ("sine", f64::from(angle).sin(), 1e-6, false),
        ("cosine", f64::from(angle).cos(), 1e-6, false),
        ("arctangent", 0.5f64.atan(), 1e-6, false),
        ("plain error-free sum", lost, 0.0, false),
        ("guarded error-free sum", lost, 0.0, false),
        ("iterations of one loop", f64::from(STEPS), 0.0, false),
        ("result of one loop", last, 0.0, false),
        ("iterations of a nested loop", f64::from(STEPS), 0.0, false),
        ("result of a nested loop", last, 0.0, false),
    ];
    let check = |((name, expected, allowed, essential), found): ((&'static str, f64, f64, bool), &f32)| {
        let found = f64::from(*found);
        Check { name, expected, found, passed: (found - expected).abs() <= allowed * expected.abs(), essential }
    };
    Ok(SelfTest { checks: expected.into_iter().zip(&found).map(check).collect() })
}

/// Runs the shader, one invocation for each loop test, on two buffers.
fn run(device: &Device, text: &str, operands: &[f32], answer_count: usize) -> Result<Vec<f32>, BackendError> {
    let bytes = 4 * answer_count as u64;
    let source = wgpu::ShaderSource::Wgsl(text.into());
    let module = device.scoped("self-test shader", || {
        device.raw.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("self-test"), source })
    })?;
    let pipeline = device.scoped("self-test pipeline", || {
        device.raw.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("self-test"),
            layout: None,
            module: &module,
            entry_point: Some("self_test"),
            compilation_options: Default::default(),
            cache: None,
        })
    })?;
    let inputs = device.buffer("operands", 4 * operands.len() as u64, Usage::STORAGE | Usage::COPY_DST)?;
    let answers = device.buffer("answers", bytes, Usage::STORAGE | Usage::COPY_SRC)?;
    let staging = device.buffer("answers", bytes, Usage::MAP_READ | Usage::COPY_DST)?;
    device.queue.write_buffer(&inputs, 0, bytemuck::cast_slice(operands));
    let entries = [
        wgpu::BindGroupEntry { binding: 0, resource: inputs.as_entire_binding() },
        wgpu::BindGroupEntry { binding: 1, resource: answers.as_entire_binding() },
    ];
    let layout = pipeline.get_bind_group_layout(0);
    let bind_group = device.scoped("self-test bind group", || {
        let descriptor = wgpu::BindGroupDescriptor { label: Some("self-test"), layout: &layout, entries: &entries };
        device.raw.create_bind_group(&descriptor)
    })?;
    let mut encoder = device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bind_group, &[]);
    pass.dispatch_workgroups(2, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&answers, 0, &staging, 0, bytes);
    device.queue.submit([encoder.finish()]);
    // A failure shows when the range is taken.
    staging.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    device.wait(None)?;
    let view = staging.slice(..).get_mapped_range().map_err(failed)?;
    Ok(bytemuck::cast_slice(&view).to_vec())
}

impl fmt::Display for SelfTest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for check in &self.checks {
            let verdict = match (check.passed, check.essential) {
                (true, _) => "ok",
                (false, true) => "WRONG",
                (false, false) => "differs",
            };
            write!(f, "{:<28} {verdict}", check.name)?;
            if !check.passed {
                write!(f, ": {} instead of {}", check.found, check.expected)?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}
