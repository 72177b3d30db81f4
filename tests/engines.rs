//! The engines against golden results: one body, every engine, each with its own stated tolerance.

mod common;

use common::check::{Errors, Tolerance, check_golden};
use common::golden;
use rodsweep::backend::{Backend, Precision};
use rodsweep::lanes::Lanes;
use rodsweep::model::{Plan, PlanOptions, Stepper};

/// Answers are good to 2.4e-11; 32 steps of order eight leave less. The issue asks for 1e-9.
const F64: Tolerance = Tolerance { pose: 1e-10, moment: 1e-10, jacobian: 1e-9 };
/// Round-off of f32 (6e-8) over some ten steps of twelve stages, amplified by the stiffness of the problem.
const F32: Tolerance = Tolerance { pose: 2e-5, moment: 2e-5, jacobian: 2e-5 };

fn print(engine: &str, errors: &[Errors]) {
    let worst = |of: fn(&Errors) -> f64| errors.iter().map(of).fold(0.0, f64::max);
    println!(
        "{engine}: {} scenes, worst pose {:.1e}, moment {:.1e}, column {:.1e}",
        errors.len(),
        worst(|e| e.pose),
        worst(|e| e.moment),
        worst(|e| e.jacobian)
    );
    for e in errors.iter().take(12) {
        println!(
            "  {:30} {:8} pose {:.1e} column {:.1e} ({})",
            e.name,
            e.status.name(),
            e.pose,
            e.jacobian,
            e.worst_column
        );
    }
}

#[test]
fn lanes_f64() {
    for (stepper, steps) in [(Stepper::Dop853, 32), (Stepper::Rk4, 1024)] {
        let options = PlanOptions { tolerance: 1e-12, stepper, steps };
        let make = |plan: &Plan| Box::new(Lanes::new(plan, Precision::F64).expect("supported")) as Box<dyn Backend>;
        print(&format!("cpu f64 {}", stepper.name()), &check_golden(&golden::dev(), options, make, F64));
    }
}

#[test]
fn lanes_f32() {
    let options = PlanOptions { tolerance: 1e-6, stepper: Stepper::Dop853, steps: 8 };
    let make = |plan: &Plan| Box::new(Lanes::new(plan, Precision::F32).expect("supported")) as Box<dyn Backend>;
    print("cpu f32", &check_golden(&golden::dev(), options, make, F32));
}
