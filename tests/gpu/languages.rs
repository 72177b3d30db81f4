//! Kernels of every kind, written to a folder for `tests/languages/run` and `benches/gpu/compile`.

use rodsweep::backend::Precision;
use rodsweep::gpu::shader::{Generator, KERNELS, Kernel};
use rodsweep::model::{Parameter, Plan, PlanOptions, Sensitivity, Stepper};
use std::fs;
use std::path::PathBuf;

#[test]
#[ignore = "writes files: tests/languages/run, benches/gpu/compile"]
fn kernels_are_written_to_a_folder() {
    let folder = PathBuf::from(std::env::var_os("RODSWEEP_SHADERS").expect("RODSWEEP_SHADERS names a folder"));
    let write = |name: String, kernel: &Kernel| {
        fs::write(folder.join(format!("{name}.wgsl")), &kernel.source.text).expect("written");
    };
    let scene = crate::common::scenes::catheter();
    let axes = crate::common::scenes::parameters(&scene, &["coil.current.x", "loads.tip_force.y"]);
    let axes: Vec<_> = axes.into_iter().map(|parameter| vec![parameter]).collect();
    let general = super::shaders::general();
    let mut plans = vec![Plan::new(&scene, &axes, &[], PlanOptions::default()).expect("a plan")];
    for (scene, stepper) in [(&scene, Stepper::Tp6), (&general, Stepper::Rk4)] {
        for sensitivity in [Sensitivity::Forward, Sensitivity::Reciprocity] {
            let options = PlanOptions { sensitivity, stepper, ..PlanOptions::default() };
            plans.push(Plan::single(scene, &Parameter::all(scene), options).expect("a plan"));
        }
    }
    plans.push(super::shaders::anchored(3, &["coil.current", "insertion", "loads.tip_force"]));
    let names = ["tips", "forward", "reciprocity", "general-forward", "general-reciprocity", "anchors"];
    assert_eq!(plans.len(), names.len());
    for (of, plan) in names.iter().zip(&plans) {
        for entry in KERNELS {
            for unrolled in [false, true] {
                let kernel = Kernel::new(entry, plan, Precision::F32, unrolled).expect("a kernel");
                let name = format!("{of}-{}{}", kernel.entry_point, if unrolled { "-unrolled" } else { "" });
                let stages = kernel.stages.iter().filter(|_| !unrolled).flat_map(|stages| stages.named());
                stages.for_each(|(stage, kernel)| write(format!("{name}-{stage}"), kernel));
                kernel.anchored.iter().for_each(|anchored| write(format!("{name}-anchored"), anchored));
                write(name, &kernel);
            }
        }
        write(format!("{of}-nodes"), &Kernel::nodes(plan, false).expect("a kernel"));
    }
    for (number, plan) in super::shaders::varying_plans().iter().enumerate() {
        write(format!("varying-{number}"), &Kernel::varying(plan, false).expect("a kernel"));
    }
    for (number, recipe) in super::shaders::recipes().iter().enumerate() {
        let generator = Generator::new(&plans[0], recipe).expect("a generator");
        let kernel = Kernel::generate(&plans[0], &generator, Precision::F32).expect("a kernel");
        write(format!("generate-{number}"), &kernel);
    }
    write("reduce".into(), &Kernel::reduce(&plans[0], Precision::F32).expect("a kernel"));
}
