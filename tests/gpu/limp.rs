//! Limp and taut rods on the GPU: on the device by nodes, in f32.

use crate::common::check::{difference, norm, pose_error};
use crate::common::day::of_today;
use crate::common::limp::{LimpCase, cases, measure};
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::engines::second_attempt;
use rodsweep::gpu::testing::{Faults, device_or_skip};
use rodsweep::gpu::{Device, Gpu};
use rodsweep::model::{Axis, Batch, Parameter, Plan, PlanOptions, Quantity, Sensitivity, Solutions, Status, Stepper};

/// Of the tip position, over the length.
const POSITION: f64 = 1e-4;
/// The same against the CPU in f32; of the base moment and of the stability margin, relative.
const AGAINST_CPU: [f64; 3] = [POSITION, 1e-3, 1e-3];
/// Columns of the tip, relative, of scenes whose torsion is not soft.
const COLUMNS: f64 = 1e-3;

fn options(sensitivity: Sensitivity) -> PlanOptions {
    let stepper = Stepper::Rk4;
    PlanOptions { base_moment_rows: true, tolerance: 1e-4, steps: 32, sensitivity, stepper, ..PlanOptions::default() }
}

fn gpu(device: &Device, plan: &Plan) -> Gpu {
    Gpu::new(device.clone(), plan, Precision::F32).expect("supported")
}

fn solve(backend: &mut dyn Backend, batch: &Batch) -> Solutions {
    backend.solve(batch).expect("solved")
}

fn named(name: &str) -> LimpCase {
    cases().into_iter().find(|case| case.scene.name == name).expect("a golden scene")
}

/// A sixth of the golden scenes each day: a software adapter takes many seconds to compile the kernel of one.
#[test]
fn golden_scenes() {
    let Some(device) = device_or_skip("limp: golden_scenes") else { return };
    expect_golden(&device, of_today(cases(), 6));
}

#[test]
#[ignore = "takes minutes where software compiles"]
fn every_golden_scene() {
    let Some(device) = device_or_skip("limp: every_golden_scene") else { return };
    expect_golden(&device, cases());
}

/// At first in f32, row by row beside the CPU in f32; then, where the estimate leaves doubt, in f64 by the second attempt.
fn expect_golden(device: &Device, cases: Vec<LimpCase>) {
    let mut offenders = Vec::new();
    for case in cases {
        let plan = Plan::single(&case.scene, &[], options(Sensitivity::Auto)).expect("a valid plan");
        let batch = plan.batch(1, |_, _| {});
        let found = solve(&mut gpu(device, &plan), &batch);
        let cpu = solve(&mut Cpu::new(&plan, Precision::F32).expect("supported"), &batch);
        let length = plan.units.length;
        let golden = |solutions: &Solutions| pose_error(solutions, 0, &case.p_tip, &case.R_tip, length);
        let position = difference(&found.vector(0, Quantity::TipPosition), &case.p_tip) / length;
        let (pose, estimate) = (golden(&found), found.get(0, Quantity::ErrorEstimate));
        let of = |solutions: &Solutions, quantity| solutions.vector(0, quantity);
        let m0 = of(&cpu, Quantity::BaseMoment);
        let apart = [
            difference(&of(&found, Quantity::TipPosition), &of(&cpu, Quantity::TipPosition)) / length,
            difference(&of(&found, Quantity::BaseMoment), &m0) / norm(&m0).max(plan.units.moment()),
            (found.get(0, Quantity::StabilityMargin) / cpu.get(0, Quantity::StabilityMargin) - 1.0).abs(),
        ];
        let apart_text = apart.map(|x| format!("{x:.1e}")).join(" ");
        println!(
            "{:28} {:8} position {position:.1e} pose {pose:.1e} estimate {estimate:.1e} apart {apart_text} passes {} {}",
            case.scene.name,
            found.status(0).name(),
            found.get(0, Quantity::Iterations),
            cpu.get(0, Quantity::Iterations),
        );
        let index = found.get(0, Quantity::StabilityIndex);
        let is_good = found.status(0).is_success() && position <= POSITION && pose <= estimate && index == 0.0;
        let is_alike = apart.iter().zip(AGAINST_CPU).all(|(apart, most)| *apart <= most);
        let again = solve(second_attempt(&plan).expect("supported").as_mut(), &batch);
        let is_settled = again.status(0).is_success() && golden(&again) <= 1e-9;
        if !(is_good && is_alike && is_settled) {
            offenders.push(format!(
                "{}: {:?} {position:.1e} {pose:.1e} {apart_text}",
                case.scene.name,
                found.status(0)
            ));
        }
    }
    assert!(offenders.is_empty(), "\n{}", offenders.join("\n"));
}

/// Coils and a bare end, a dead tip moment, segments of their own stiffness: all parameters, both ways. Half of them each day.
#[test]
fn derivatives() {
    let Some(device) = device_or_skip("limp: derivatives") else { return };
    let mut offenders = Vec::new();
    let cases = [
        ("horizontal_1e3", Sensitivity::Reciprocity),
        ("mixed_tip_moment_taut_20", Sensitivity::Reciprocity),
        ("two_coils_limp", Sensitivity::Reciprocity),
        ("two_coils_limp", Sensitivity::Forward),
    ];
    for (name, sensitivity) in of_today(cases, 2) {
        let make = |plan: &Plan| Box::new(gpu(&device, plan)) as Box<_>;
        let errors = measure(&named(name), options(sensitivity), make);
        println!("{sensitivity:?} {errors:?}");
        if !(errors.status.is_success() && errors.J.0 <= COLUMNS && errors.J_m0.0 <= COLUMNS) {
            offenders.push(format!("{sensitivity:?} {errors:?}"));
        }
    }
    assert!(offenders.is_empty(), "\n{}", offenders.join("\n"));
}

/// From stiff to limp in one batch: a row depends on its sample alone, and samples that need no nodes have none.
#[test]
fn neighbours_change_no_bit() {
    let Some(device) = device_or_skip("limp: neighbours_change_no_bit") else { return };
    let case = named("anisotropic_segments_3e3");
    let weight = Parameter::DistributedForce(Axis::Z);
    let load = weight.get(&case.scene);
    let wrt = [Parameter::TipForce(Axis::X), weight];
    let plan = Plan::new(&case.scene, &[vec![weight]], &wrt, options(Sensitivity::Auto)).expect("a valid plan");
    let share = |sample: usize| load * 10f64.powf(sample as f64 / 7.0 - 4.0);
    let batch = plan.batch(35, |sample, row| row[0] = share(sample));
    let mut gpu = gpu(&device, &plan);
    let together = solve(&mut gpu, &batch);
    let statuses: Vec<Status> = (0..35).map(|sample| together.status(sample)).collect();
    assert!(statuses.iter().all(|status| status.is_success()), "{statuses:?}");
    let bits = |solutions: &Solutions, sample: usize| -> Vec<u64> {
        (0..plan.output_count()).map(|column| solutions.values.get(sample, column).to_bits()).collect()
    };
    for sample in (0..35).step_by(3) {
        let alone = solve(&mut gpu, &plan.batch(1, |_, row| row[0] = share(sample)));
        assert_eq!(bits(&together, sample), bits(&alone, 0), "sample {sample}");
    }
    // What is other on a device without room for nodes is by nodes.
    let faults = Faults { memory: Some(1 << 20), ..Faults::default() };
    let without = Device::open_with_faults(Some(&device.adapter().name), faults).expect("it was there before");
    let single = solve(&mut self::gpu(&without, &plan), &batch);
    let by_nodes: Vec<bool> = (0..35).map(|sample| bits(&together, sample) != bits(&single, sample)).collect();
    assert!(!by_nodes[..7].contains(&true) && !by_nodes[28..].contains(&false), "{by_nodes:?}");
}

/// What the device has no room for is left as a single pass left it, and a note says so.
#[test]
fn a_device_without_room_leaves_nodes_to_the_cpu() {
    let Some(shared) = device_or_skip("limp: a_device_without_room") else { return };
    let plan = Plan::single(&named("horizontal_1e4").scene, &[], options(Sensitivity::Auto)).expect("a valid plan");
    let batch = plan.batch(1, |_, _| {});
    for faults in [
        Faults { largest_buffer: Some(1 << 20), ..Faults::default() },
        Faults { memory: Some(1 << 20), ..Faults::default() },
    ] {
        let device = Device::open_with_faults(Some(&shared.adapter().name), faults).expect("it was there before");
        let mut gpu = gpu(&device, &plan);
        let found = solve(&mut gpu, &batch);
        assert!(!found.status(0).is_success(), "{:?}", found.status(0));
        let notes = gpu.take_notes();
        assert!(notes.iter().any(|note| note.contains("no room for the nodes of 1 limp")), "{notes:?}");
    }
}
