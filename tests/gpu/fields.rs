//! Fields that vary in space on the GPU: turn by turn, in f32.

use crate::common::check::{difference, norm};
use crate::common::fields::{FieldCase, cases, engine_errors, plan_by_slots};
use crate::common::{root, scenes};
use rodsweep::backend::{Backend, BackendKind, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::engines::EngineRequest;
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::gpu::{Device, Gpu};
use rodsweep::input::read_scene;
use rodsweep::model::{
    Axis, Parameter, Plan, PlanOptions, Quantity, Rigid, Scene, Segment, SegmentKind, Slot, Solutions, Status, Stepper,
};
use rodsweep::spec::SweepSpec;
use rodsweep::sweep::{Memory, SweepJob};
use rodsweep::table::Table;

/// In f32, of pose, base moment and columns.
const SINGLE: f64 = 2e-5;

fn options() -> PlanOptions {
    PlanOptions {
        tolerance: SINGLE,
        stepper: Stepper::Tp6,
        steps: 12,
        base_moment_rows: true,
        ..PlanOptions::default()
    }
}

fn gpu(device: &Device, plan: &Plan) -> Gpu {
    Gpu::new(device.clone(), plan, Precision::F32).expect("supported")
}

fn lanes(plan: &Plan, precision: Precision) -> Cpu {
    Cpu::new(plan, precision).expect("supported")
}

/// Pose, base moment, stability index and every column.
fn expect_golden(device: &Device, cases: impl Iterator<Item = FieldCase>) {
    let make = |plan: &Plan| Box::new(gpu(device, plan)) as Box<dyn Backend>;
    let (pose, moment, columns) = engine_errors(cases.collect(), options(), 1.0, make);
    assert!(pose <= SINGLE && moment <= SINGLE && columns.0 <= SINGLE, "{pose:e} {moment:e} {columns:?}");
}

/// Every thirteenth golden scene: a software adapter takes seconds to compile the kernel of one.
#[test]
fn golden_scenes() {
    let Some(device) = device_or_skip("fields: golden_scenes") else { return };
    expect_golden(&device, cases().into_iter().step_by(13));
}

#[test]
#[ignore = "takes minutes where software compiles"]
fn every_golden_scene() {
    let Some(device) = device_or_skip("fields: every_golden_scene") else { return };
    expect_golden(&device, cases().into_iter());
}

/// Largest difference of two engines' rows that both are equilibria: pose over the length, base moment, every column
/// relative to it or to what is natural, and where.
fn apart(plan: &Plan, a: &Solutions, b: &Solutions, sample: usize) -> (f64, String) {
    let units = plan.units;
    let scales = [units.length, 1.0, units.moment(), units.curvature()];
    let mut worst = (0.0, String::new());
    let mut note = |x: f64, what: String| {
        if x > worst.0 || x.is_nan() {
            worst = (x, what);
        }
    };
    let vectors = [(Quantity::TipPosition, units.length), (Quantity::TipTangent, 1.0), (Quantity::TipD1, 1.0)];
    for (quantity, scale) in vectors.into_iter().chain([(Quantity::BaseMoment, units.moment())]) {
        let (a, b) = (a.vector(sample, quantity), b.vector(sample, quantity));
        note(difference(&a, &b) / norm(&b).max(scale), format!("{quantity:?}"));
    }
    if let (Some(a), Some(b)) = (a.own_curvature(sample), b.own_curvature(sample)) {
        note(difference(&a, &b) / norm(&b).max(units.curvature()), "curvature".into());
    }
    for (k, derivative) in plan.derivatives.iter().enumerate() {
        let unit: f64 = derivative.terms.iter().map(|(slot, _)| 1.0 / slot.unit(&units)).fold(0.0, f64::max);
        for (row, scale) in scales.iter().enumerate().take(plan.rows() / 3) {
            let of =
                |s: &Solutions| -> [f64; 3] { std::array::from_fn(|axis| s.derivative(sample, k, 3 * row + axis)) };
            let off = difference(&of(a), &of(b)) / norm(&of(b)).max(scale * unit);
            note(off, format!("{} {row}: {:?} {:?}", derivative.name, of(a), of(b)));
        }
    }
    worst
}

/// Places, turns and strengths of an arm's magnet at random, from far away to where it pulls the rod in: statuses and
/// indices are those of the CPU in f32, rows those of the CPU in f64.
#[test]
fn a_random_batch_is_that_of_the_cpu() {
    let Some(device) = device_or_skip("fields: a_random_batch") else { return };
    let scene = read_scene(&root().join("sweeps/scenes/arm_magnet.toml")).expect("a good scene");
    let names = ["magnets.arm.position", "magnets.arm.rotation", "magnets.arm.strength", "field.flux_density.x"];
    let parameters = scenes::parameters(&scene, &names);
    let wrt =
        [parameters.clone(), scenes::parameters(&scene, &["insertion", "loads.tip_force", "tube.length"])].concat();
    let axes: Vec<Vec<Parameter>> = parameters.iter().map(|parameter| vec![*parameter]).collect();
    let plan = Plan::new(&scene, &axes, &wrt, PlanOptions { base_moment_rows: false, ..options() }).expect("a plan");
    let share =
        |sample: usize, axis: usize| (0.618_034 * (sample * axes.len() + axis) as f64 + 0.37 * axis as f64).fract();
    let ranges =
        [(0.08, 0.2), (-0.05, 0.05), (0.0, 0.1), (-2.0, 2.0), (-2.0, 2.0), (-1.0, 1.0), (0.1, 1.5), (-1e-3, 1e-3)];
    let batch = plan.batch(96, |sample, row| {
        for (axis, (value, (from, to))) in row.iter_mut().zip(ranges).enumerate() {
            *value = from + (to - from) * share(sample, axis);
        }
    });
    let found = gpu(&device, &plan).solve(&batch).expect("solved");
    let [single, double] = [Precision::F32, Precision::F64].map(|p| lanes(&plan, p).solve(&batch).expect("solved"));
    let (mut worst, mut counts) = ((0.0, String::new()), [0; 16]);
    for sample in 0..96 {
        let status = found.status(sample);
        counts[usize::from(status.code())] += 1;
        assert_eq!(status, single.status(sample), "{sample}: {:?} in f64", double.status(sample));
        let index = |solutions: &Solutions| solutions.get(sample, Quantity::StabilityIndex);
        assert!(index(&found) == index(&single) || !status.is_converged(), "{sample}: {}", index(&found));
        if status.is_success() {
            let here = apart(&plan, &found, &double, sample);
            let bound = found.get(sample, Quantity::DerivativeError).max(found.get(sample, Quantity::ErrorEstimate));
            assert!(here.0 <= bound.max(SINGLE), "{sample}: {here:?}, bound {bound:e}");
            worst = if here.0 > worst.0 { here } else { worst };
            let margins = [&found, &double].map(|s| s.get(sample, Quantity::StabilityMargin));
            assert!((margins[0] - margins[1]).abs() <= 1e-4, "{sample}: {margins:?}");
            assert_eq!(found.get(sample, Quantity::LoadFraction), 1.0);
        }
    }
    println!("statuses {counts:?}, worst {worst:?}");
    assert!(
        counts[usize::from(Status::Ramped.code())] > 48 && counts[usize::from(Status::Fold.code())] > 0,
        "{counts:?}"
    );
}

/// A rod within the clearance of a magnet has no answer; nor has one that the magnet pulls in.
#[test]
fn magnets_keep_their_distance_and_pull_in() {
    let Some(device) = device_or_skip("fields: magnets") else { return };
    let status = |scene: &Scene| {
        let plan = Plan::single(scene, &[], options()).expect("a plan");
        gpu(&device, &plan).solve(&plan.batch(1, |_, _| {})).expect("solved").status(0)
    };
    let case = cases().into_iter().find(|case| case.scene.name.starts_with("golden-dipole-5")).expect("a scene");
    let mut near = case.scene.clone();
    near.sources.magnets[0].position = [case.p_tip[0] + 0.004, case.p_tip[1], case.p_tip[2]];
    near.sources.magnets[0].moment = [0.0, 0.0, 1e-3];
    near.sources.magnets[0].clearance = 0.03;
    assert_eq!(status(&near), Status::TooNearMagnet);
    let mut arm = read_scene(&root().join("sweeps/scenes/arm_magnet.toml")).expect("a good scene");
    arm.sources.magnets[0].position[0] = 0.09;
    assert_eq!(status(&arm), Status::Fold);
}

/// A rigid holder in front with a dipole of its own, shear, a taper and a rest curvature; with and without lever arms.
#[test]
fn combinations_are_those_of_the_cpu() {
    let Some(device) = device_or_skip("fields: combinations") else { return };
    for (name, rigid_force_arm) in [("golden-mixed-4 distributed", true), ("golden-dipole-4 middle", false)] {
        let mut scene = cases().into_iter().find(|case| case.scene.name == name).expect("a scene").scene;
        scene.rigid_force_arm = rigid_force_arm;
        let holder = Rigid { dipole_per_length: Some([1.0, -2.0, 3.0]), ..Rigid::default() };
        scene.segments.insert(0, Segment { name: "holder".into(), length: 0.01, kind: SegmentKind::Rigid(holder) });
        let SegmentKind::Flexible(first) = &mut scene.segments[1].kind else { panic!("flexible") };
        first.stiffness_shear = Some([1.0, 2.0]);
        let axes = |of: fn(usize, Axis) -> Slot, segment: usize| Axis::ALL.map(|axis| of(segment, axis));
        let slots = [
            axes(Slot::Dipole, 0).to_vec(),
            axes(Slot::ShearCompliance, 1).to_vec(),
            axes(Slot::Stiffness, 1).to_vec(),
            axes(Slot::RestCurvature, 1).to_vec(),
            axes(Slot::Load, 1).to_vec(),
            vec![Slot::Length(0), Slot::Length(1)],
            axes(Slot::SourcePosition, 0).to_vec(),
            Axis::ALL.map(Slot::BasePosition).to_vec(),
            Axis::ALL.map(Slot::TipMoment).to_vec(),
        ]
        .concat();
        let plan = plan_by_slots(&scene, &slots, options());
        let batch = plan.batch(1, |_, _| {});
        let found = gpu(&device, &plan).solve(&batch).expect("solved");
        let double = lanes(&plan, Precision::F64).solve(&batch).expect("solved");
        assert_eq!(found.status(0), double.status(0), "{name}");
        assert!(found.own_curvature(0).is_some());
        let worst = apart(&plan, &found, &double, 0);
        println!("{name}: {worst:?}");
        assert!(worst.0 <= SINGLE, "{name}: {worst:?}");
    }
}

/// A sweep that asks for the GPU has the rows of the CPU, second attempts and all.
#[test]
fn a_sweep_is_that_of_the_cpu() {
    if device_or_skip("fields: a_sweep").is_none() {
        return;
    }
    let file = root().join("sweeps/coil_array.toml");
    let rows = |backend: BackendKind| -> Table {
        let mut spec = SweepSpec::read(&file).expect("a sweep");
        spec.tolerance = SINGLE;
        let request = EngineRequest::of(backend).precision(Some(Precision::F32));
        let mut rows = Memory::new();
        SweepJob::new(spec).engine(request).limit(Some(64)).spot_check(None).run(&mut rows).expect("a run");
        rows.into_table()
    };
    let (by_gpu, by_cpu) = (rows(BackendKind::Gpu), rows(BackendKind::Cpu));
    assert_eq!(by_gpu.column("status"), by_cpu.column("status"));
    for (a, b) in by_gpu.columns.iter().zip(&by_cpu.columns).filter(|(a, _)| a.name.starts_with("p_tip")) {
        for row in 0..64 {
            let off = (a.values.number(row) - b.values.number(row)).abs();
            assert!(off <= SINGLE * 0.1, "{} {row}: {off:e} m", a.name);
        }
    }
}
