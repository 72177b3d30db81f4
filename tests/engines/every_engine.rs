//! The engines against golden results: one body, every engine, each with its own stated tolerance.

use crate::common::check::{Errors, SMALL_COLUMN, SMALL_COLUMN_F32, Tolerance, check_golden};
use crate::common::day::of_today;
use crate::common::golden::{self, GoldenCase};
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::{Cpu, InstructionSet};
use rodsweep::gpu::Gpu;
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::model::{Plan, PlanOptions, Stepper};

/// The answers are good to 2.4e-11 and 64 steps of order eight leave less; scenes near a fold amplify both.
const F64: Tolerance = Tolerance { pose: 1e-10, moment: 1e-10, jacobian: 1e-9, small_column: SMALL_COLUMN };
/// Round-off of f32 (6e-8) over some ten steps of four to twelve stages.
const F32: Tolerance = Tolerance { pose: 2e-5, moment: 2e-5, jacobian: 2e-5, small_column: SMALL_COLUMN_F32 };
/// The scenes called hard amplify round-off by ten and more.
const F32_HARD: Tolerance = Tolerance { pose: 2e-5, moment: 2e-5, jacobian: 2e-4, small_column: SMALL_COLUMN_F32 };

fn print(engine: &str, errors: &[Errors]) {
    let worst = |of: fn(&Errors) -> f64| errors.iter().map(of).fold(0.0, f64::max);
    println!(
        "{engine}: {} scenes, worst pose {:.1e}, moment {:.1e}, column {:.1e}",
        errors.len(),
        worst(|e| e.pose),
        worst(|e| e.moment),
        worst(|e| e.jacobian)
    );
    for e in errors {
        let (name, status) = (&e.name, e.status.name());
        println!("  {name:30} {status:8} pose {:.1e} column {:.1e} ({})", e.pose, e.jacobian, e.worst_column);
    }
}

/// Scenes by whether they are well-conditioned, as their names say.
fn split() -> (Vec<GoldenCase>, Vec<GoldenCase>) {
    golden::dev().into_iter().partition(|case| !case.scene.name.contains("_hard_"))
}

/// Checks the golden scenes; one in `parts` of them each day, of the hard ones thrice as many.
fn check_f32(engine: &str, parts: usize, options: PlanOptions, make: impl Fn(&Plan) -> Box<dyn Backend> + Sync) {
    let (ordinary, hard) = split();
    assert_eq!((ordinary.len(), hard.len()), (52, 8));
    let (ordinary, hard) = (of_today(ordinary, parts), of_today(hard, parts.div_ceil(3)));
    print(engine, &check_golden(&ordinary, options, &make, F32));
    print(&format!("{engine}, hard"), &check_golden(&hard, options, &make, F32_HARD));
}

#[test]
fn lanes_f64() {
    for (stepper, steps) in [(Stepper::Dop853, 64), (Stepper::Rk4, 2048)] {
        let options = PlanOptions { tolerance: 1e-12, stepper, steps, ..PlanOptions::default() };
        let make = |plan: &Plan| Box::new(Cpu::new(plan, Precision::F64).expect("supported")) as Box<dyn Backend>;
        print(&format!("cpu f64 {}", stepper.name()), &check_golden(&golden::dev(), options, make, F64));
    }
}

#[test]
fn lanes_f32() {
    let options = PlanOptions { tolerance: 1e-6, stepper: Stepper::Dop853, steps: 16, ..PlanOptions::default() };
    let make = |plan: &Plan| Box::new(Cpu::new(plan, Precision::F32).expect("supported")) as Box<dyn Backend>;
    check_f32("cpu f32", 1, options, make);
}

#[test]
fn every_instruction_set() {
    for set in InstructionSet::available() {
        let make = |precision: Precision| {
            move |plan: &Plan| {
                Box::new(Cpu::with_instruction_set(plan, precision, set).expect("available")) as Box<dyn Backend>
            }
        };
        let options = PlanOptions { tolerance: 1e-12, stepper: Stepper::Dop853, steps: 64, ..PlanOptions::default() };
        print(set.name(), &check_golden(&golden::dev(), options, make(Precision::F64), F64));
        let options = PlanOptions { tolerance: 1e-6, stepper: Stepper::Dop853, steps: 16, ..PlanOptions::default() };
        check_f32(set.name(), 1, options, make(Precision::F32));
    }
}

/// Each scene has a kernel, which drivers compile for seconds.
#[test]
fn gpu_f32() {
    check_gpu_f32(6);
}

#[test]
#[ignore = "minutes of compiling on a software driver"]
fn gpu_f32_every_scene() {
    check_gpu_f32(1);
}

fn check_gpu_f32(parts: usize) {
    let Some(_) = device_or_skip("golden scenes on the GPU") else { return };
    let options = PlanOptions { tolerance: 1e-6, stepper: Stepper::Rk4, steps: 96, ..PlanOptions::default() };
    let make = |plan: &Plan| {
        let device = device_or_skip("golden scenes on the GPU").expect("it was there before");
        Box::new(Gpu::new(device, plan, Precision::F32).expect("supported")) as Box<dyn Backend>
    };
    check_f32("gpu f32", parts, options, make);
}

/// One scene in twelve each day; each has a kernel, which drivers compile for seconds.
#[test]
fn gpu_f64() {
    let Some(device) = device_or_skip("golden scenes on the GPU in f64") else { return };
    if !device.adapter().has_f64 {
        println!("skipped: {} has no f64", device.adapter().name);
        return;
    }
    let options = PlanOptions { tolerance: 1e-12, stepper: Stepper::Dop853, steps: 64, ..PlanOptions::default() };
    let make = |plan: &Plan| {
        let device = device_or_skip("golden scenes on the GPU in f64").expect("it was there before");
        Box::new(Gpu::new(device, plan, Precision::F64).expect("supported")) as Box<dyn Backend>
    };
    print("gpu f64", &check_golden(&of_today(golden::dev(), 12), options, make, F64));
}
