//! Fields that vary in space on the GPU: turn by turn, in f32.

use crate::common::fields::{cases, engine_errors};
use rodsweep::backend::{Backend, Precision};
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::gpu::{Device, Gpu};
use rodsweep::model::{Plan, PlanOptions, Stepper};

fn gpu(device: &Device, plan: &Plan) -> Gpu {
    Gpu::new(device.clone(), plan, Precision::F32).expect("supported")
}

/// Both loads of every golden scene: pose, base moment, stability index, every column.
#[test]
fn golden_scenes() {
    let Some(device) = device_or_skip("fields: golden_scenes") else { return };
    let options = PlanOptions { tolerance: 2e-5, stepper: Stepper::Tp6, steps: 12, ..PlanOptions::default() };
    let only: Option<usize> = std::env::var("CASE").ok().map(|x| x.parse().unwrap());
    for (k, case) in cases().into_iter().enumerate() {
        if only.is_some_and(|only| k % 39 != only) {
            continue;
        }
        let start = std::time::Instant::now();
        println!("{k} {}", case.scene.name);
        let make = |plan: &Plan| Box::new(gpu(&device, plan)) as Box<dyn Backend>;
        let (pose, moment, columns) = engine_errors(vec![case], options, 1.0, make);
        println!("{:.1} s", start.elapsed().as_secs_f64());
        assert!(pose <= 2e-5 && moment <= 2e-5 && columns.0 <= 2e-5, "{pose:e} {moment:e} {columns:?}");
    }
}
