//! The GPU engine's solutions against the CPU engine's, sample by sample.

use crate::common::check::{SMALL_COLUMN, Tolerance, column_error, difference, natural_size, norm, pose_error};
use crate::common::day::is_of_today;
use crate::common::scenes::flexible;
use crate::common::{golden, scenes};
use rodsweep::backend::{Backend, BackendError, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::gpu::shader::{KERNELS, Kernel};
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::gpu::{Device, Gpu};
use rodsweep::model::tolerances::growth_limit;
use rodsweep::model::{
    Axis, Base, Batch, Coil, CoilWinding, Flexible, Loads, Node, Parameter, Plan, PlanOptions, Profile, Quantity,
    Rigid, Scene, Segment, SegmentKind, Sensitivity, Solutions, Status, Stepper, Stiffness, Vector,
};
use rodsweep_bench::random::Random;
use std::thread;

/// GPU in f32 against the CPU in f64; the worst of well-conditioned rods lose two digits of seven.
const AGAINST_F64: Tolerance = Tolerance { pose: 4e-5, moment: 4e-5, jacobian: 4e-3, small_column: SMALL_COLUMN };
/// GPU in f32 against the CPU in f32: twice the round-off of either.
const AGAINST_F32: Tolerance = Tolerance { pose: 4e-5, moment: 4e-5, jacobian: 4e-3, small_column: SMALL_COLUMN };
/// Below this stability margin the status is decided by round-off, and errors have no bound.
const NEAR_FOLD: f64 = 0.03;
/// Share of samples that may lie that close to a fold.
const FEW: f64 = 0.02;

/// About as many steps as the GPU takes before it asks for fewer.
const MOST_STEPS: usize = 400;
/// Rods bent into several turns by loads far beyond their stiffness.
const HARDEST_POSE: f64 = 1e-3;
/// Samples of these whose path ends in f32 where it goes on in f64, or the other way.
const HARDEST_DIFFERING: usize = 8;

/// What a comparison found.
#[derive(Debug, Default)]
struct Worst {
    pose: f64,
    moment: f64,
    jacobian: f64,
    /// Sample and parameter of the worst column.
    column: (usize, String),
    excused: usize,
    solved: usize,
}

fn near_fold(solutions: &Solutions, sample: usize) -> bool {
    solutions.get(sample, Quantity::StabilityMargin).abs() < NEAR_FOLD || !solutions.status(sample).is_success()
}

/// Compares every sample; statuses must be equal, or the sample at the brink of a fold.
fn compare(plan: &Plan, found: &Solutions, expected: &Solutions, tolerance: Tolerance) -> Worst {
    let mut worst = Worst::default();
    let units = &plan.units;
    let mut offenders = Vec::new();
    for sample in 0..found.sample_count() {
        let (a, b) = (found.status(sample), expected.status(sample));
        assert_ne!(a, Status::Pending, "sample {sample}");
        let excused = near_fold(expected, sample) || near_fold(found, sample) && a != b;
        worst.excused += usize::from(excused);
        // Converged one way or the other is a matter of round-off; where the path ends is not.
        if a.is_success() != b.is_success() && !excused {
            offenders.push(format!("sample {sample}: {a:?} instead of {b:?}"));
        }
        if excused || !a.is_success() || !b.is_success() {
            continue;
        }
        worst.solved += 1;
        let p = expected.vector(sample, Quantity::TipPosition);
        let pose = pose_error(found, sample, &p, &expected.tip_rotation(sample), units.length);
        let m0 = expected.vector(sample, Quantity::BaseMoment);
        let moment = difference(&found.vector(sample, Quantity::BaseMoment), &m0) / norm(&m0).max(units.moment());
        let (mut jacobian, mut name) = (0.0, String::new());
        for (k, derivative) in plan.derivatives.iter().enumerate() {
            let column = |s: &Solutions| -> [f64; 6] { std::array::from_fn(|row| s.derivative(sample, k, row)) };
            let size = SMALL_COLUMN * natural_size(&plan.scene, derivative.parameter, units);
            let error = column_error(&column(found), &column(expected), size, units.length);
            if error.is_nan() || error > jacobian {
                (jacobian, name) = (error, derivative.name.clone());
            }
        }
        let beyond = |x: f64, limit: f64| x.is_nan() || x > limit;
        let margin = expected.get(sample, Quantity::StabilityMargin);
        if beyond(pose, tolerance.pose) || beyond(moment, tolerance.moment) || beyond(jacobian, tolerance.jacobian) {
            offenders
                .push(format!("sample {sample}: {pose:.1e} {moment:.1e} {jacobian:.1e} {name}, margin {margin:.3}"));
        }
        worst.pose = worst.pose.max(pose);
        worst.moment = worst.moment.max(moment);
        if jacobian > worst.jacobian {
            (worst.jacobian, worst.column) = (jacobian, (sample, name));
        }
    }
    assert!(offenders.is_empty(), "{worst:?}, beyond {tolerance:?}:\n{}", offenders.join("\n"));
    worst
}

/// Solves on the GPU and on the CPU in both precisions, and compares.
fn check_plan(name: &str, mut gpu: Gpu, plan: &Plan, batch: &Batch) -> Solutions {
    let found = gpu.solve(batch).unwrap();
    let cpu = |precision| Cpu::new(plan, precision).unwrap().solve(batch).unwrap();
    let f64s = compare(plan, &found, &cpu(Precision::F64), AGAINST_F64);
    let f32s = compare(plan, &found, &cpu(Precision::F32), AGAINST_F32);
    let first = gpu.timings().compile + gpu.timings().first_dispatch;
    eprintln!("{name}: compiled in {first:.1} s; against f64 {f64s:?}; against f32 {f32s:?}");
    let limit = (FEW * batch.sample_count() as f64) as usize + 1;
    assert!(f64s.excused <= limit && f32s.excused <= limit, "{name}");
    found
}

fn gpu(device: Device, plan: &Plan) -> Gpu {
    Gpu::new(device, plan, Precision::F32).unwrap()
}

/// With the kernels of hardware, on any device.
fn gpu_as_hardware(device: Device, plan: &Plan) -> Gpu {
    let kernel = Kernel::new(&KERNELS[0], plan, Precision::F32, false).unwrap();
    Gpu::with_kernel(device, plan, &kernel).unwrap().with_stages(true).unwrap()
}

/// Which terms a random scene has.
#[derive(Clone, Copy, Debug)]
struct Kind {
    segments: &'static str,
    force: bool,
    load: bool,
    moment: bool,
    anisotropic: bool,
    stepper: Stepper,
    steps: usize,
    sensitivity: Sensitivity,
}

/// Segments by letter: flexible, coil, bare rigid, and flexible with everything that varies along it.
const KINDS: [Kind; 8] = {
    let plain = Kind {
        segments: "fcf",
        force: true,
        load: false,
        moment: false,
        anisotropic: false,
        stepper: Stepper::Dop853,
        steps: 6,
        sensitivity: Sensitivity::Auto,
    };
    [
        plain,
        Kind { segments: "fcfcf", load: true, moment: true, anisotropic: true, ..plain },
        Kind { segments: "cfrf", moment: true, stepper: Stepper::Rk4, steps: 24, ..plain },
        Kind { segments: "fc", force: false, stepper: Stepper::Rk4, steps: 16, ..plain },
        Kind { segments: "f", load: true, anisotropic: true, stepper: Stepper::Rk4, steps: 16, ..plain },
        Kind { segments: "rffcr", load: true, ..plain },
        Kind { segments: "vcf", stepper: Stepper::Rk4, steps: 24, ..plain },
        Kind {
            segments: "fcv",
            load: true,
            stepper: Stepper::Rk4,
            steps: 24,
            sensitivity: Sensitivity::Forward,
            ..plain
        },
    ]
};

fn random_scene(kind: Kind, random: &mut Random) -> Scene {
    let segment = |(index, letter): (usize, char)| {
        let alike = random.within(2e-5, 8e-5);
        let other = if kind.anisotropic { random.within(2e-5, 8e-5) } else { alike };
        let stiffness = Stiffness::Direct { bending_x: alike, bending_y: other, torsion: random.within(2e-5, 8e-5) };
        let rest_curvature = random.vector(5.0);
        let winding = CoilWinding::Axes { turns: [100.0; 3], area: [1e-5; 3] };
        let coil = Coil { winding, current: random.vector(0.1), alignment: [0.0; 3] };
        let (length, kind) = match letter {
            'f' => (random.within(0.02, 0.05), SegmentKind::Flexible(flexible(stiffness, rest_curvature))),
            'v' => {
                let node = |at: f64, value: Vector| Node { at, value };
                let stiff = |random: &mut Random| [0; 3].map(|_| random.within(2e-5, 8e-5));
                let stiffness = Stiffness::Nodes(vec![node(0.0, stiff(random)), node(0.02, stiff(random))]);
                let nodes = vec![node(0.005, random.vector(5.0)), node(0.02, random.vector(5.0))];
                let varying = Flexible {
                    stiffness,
                    rest_curvature: Profile::Nodes(nodes),
                    stiffness_shear: Some([random.within(0.1, 0.5), random.within(0.1, 0.5)]),
                    stiffness_axial: Some(random.within(0.1, 1.0)),
                    density: None,
                    dipole_per_length: Some(random.vector(4e-4)),
                    magnet: None,
                };
                (random.within(0.02, 0.05), SegmentKind::Flexible(varying))
            }
            'c' => (random.within(0.005, 0.02), SegmentKind::Rigid(Rigid { coil: Some(coil), ..Rigid::default() })),
            _ => (random.within(0.005, 0.02), SegmentKind::Rigid(Rigid::default())),
        };
        Segment { name: format!("s{index}"), length, kind }
    };
    let segments = kind.segments.chars().enumerate().map(segment).collect();
    Scene {
        name: kind.segments.into(),
        base: Base { position: random.vector(0.05), rotation: random.vector(1.5) },
        flux_density: random.vector(2.0),
        sources: Default::default(),
        loads: Loads {
            tip_force: kind.force.then(|| random.vector(4e-3)),
            tip_moment: kind.moment.then(|| random.vector(1e-4)),
            distributed_force: kind.load.then(|| random.vector(8e-3)),
            ..Loads::default()
        },
        segments,
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    }
}

/// Parameters of a segment with everything that varies along it.
const VARYING: [&str; 7] = [
    "rest_curvature.node_1",
    "rest_curvature.node_2.x",
    "stiffness.node_1.torsion",
    "stiffness.node_2.bending_x",
    "stiffness_shear.y",
    "stiffness_axial",
    "dipole_per_length",
];

/// What a random batch sweeps and differentiates by.
fn parameters(scene: &Scene, kind: Kind) -> Vec<Parameter> {
    let mut names = vec!["field.flux_density".to_owned(), "base.rotation".into()];
    names.extend(kind.force.then(|| "loads.tip_force".into()));
    names.extend(kind.moment.then(|| "loads.tip_moment".into()));
    names.extend(kind.load.then(|| "loads.distributed_force".into()));
    for (segment, letter) in scene.segments.iter().zip(kind.segments.chars()) {
        let of = |what: &str| format!("{}.{what}", segment.name);
        names.push(of("length"));
        match letter {
            'f' if kind.anisotropic => {
                names.extend(["rest_curvature", "stiffness.bending_x", "stiffness.torsion"].map(of))
            }
            'f' => names.extend(["rest_curvature", "stiffness.bending", "stiffness.torsion"].map(of)),
            'c' => names.push(of("current")),
            'v' => names.extend(VARYING.map(of)),
            _ => {}
        }
    }
    names.iter().flat_map(|name| Parameter::parse(scene, name).unwrap()).collect()
}

/// Each day a quarter of the kinds, since a software driver compiles for minutes. What varies along a segment takes it longest: one of
/// these two kinds has the kernels of hardware here, and the other those of the device.
#[test]
fn random_rods() {
    check_random_rods(|number, kind, as_hardware| {
        let is_graded = kind.segments.contains('v');
        let for_hardware = is_graded && kind.sensitivity == Sensitivity::Auto;
        is_of_today(number / 2, 4) && as_hardware == for_hardware
    });
}

#[test]
#[ignore = "minutes of compiling on a software driver"]
fn random_rods_with_either_kernels() {
    check_random_rods(|_, kind, as_hardware| !as_hardware || kind.segments.contains('v'));
}

/// Two kinds at a time: a software driver compiles the kernels of a device one after the other.
fn check_random_rods(takes: impl Fn(usize, Kind, bool) -> bool + Sync) {
    let check_some = |remainder| {
        for (number, kind) in KINDS.into_iter().enumerate().filter(|(number, _)| number % 2 == remainder) {
            let Some(device) = device_or_skip("random_rods") else { return };
            let (plan, batch) = random_batch(number, kind);
            if takes(number, kind, false) {
                check_plan(&format!("{kind:?}"), gpu(device.clone(), &plan), &plan, &batch);
            }
            if takes(number, kind, true) {
                check_plan(&format!("{kind:?} as on hardware"), gpu_as_hardware(device, &plan), &plan, &batch);
            }
        }
    };
    thread::scope(|scope| {
        scope.spawn(|| check_some(0));
        check_some(1);
    });
}

/// A hundred rods of a kind, with and without the columns by base rotation.
fn random_batch(number: usize, kind: Kind) -> (Plan, Batch) {
    let mut random = Random(number as u64 + 1);
    let scene = random_scene(kind, &mut random);
    let swept = parameters(&scene, kind);
    let axes: Vec<Vec<Parameter>> = swept.iter().map(|parameter| vec![*parameter]).collect();
    let Kind { stepper, steps, sensitivity, .. } = kind;
    let base_moment_rows = number.is_multiple_of(2);
    let options = PlanOptions { stepper, steps, sensitivity, base_moment_rows, ..PlanOptions::default() };
    let mut wrt = swept.clone();
    if kind.segments.starts_with(['f', 'v']) {
        wrt.push(Parameter::Insertion);
    }
    wrt.extend(Axis::ALL.map(Parameter::BasePosition));
    wrt.extend(Axis::ALL.map(Parameter::TipForce));
    let plan = Plan::new(&scene, &axes, &wrt, options).unwrap();
    let samples: Vec<Vec<f64>> = (0..100)
        .map(|_| {
            let other = random_scene(kind, &mut random);
            swept.iter().map(|parameter| parameter.get(&other)).collect()
        })
        .collect();
    let batch = plan.batch(samples.len(), |i, row| {
        if let Some(sample) = samples.get(i) {
            row.copy_from_slice(sample);
        }
    });
    (plan, batch)
}

/// The catheter P6 over currents of +-0.3 A, with the published map's insertion.
fn p6(points: usize, arm: bool, names: &[&str]) -> (Plan, Batch) {
    let mut scene = golden::p6_scene();
    scene.rigid_force_arm = arm;
    scene.segments[0].length = 0.0943 - 0.0183 - 0.0185;
    let axes: Vec<_> = scenes::parameters(&scene, &["coil.current"]).into_iter().map(|p| vec![p]).collect();
    let wrt = scenes::parameters(&scene, names);
    let plan = Plan::new(&scene, &axes, &wrt, PlanOptions::default()).unwrap();
    let batch = p6_batch(&plan, points, 0, points.pow(3));
    (plan, batch)
}

fn p6_batch(plan: &Plan, points: usize, first: usize, count: usize) -> Batch {
    plan.batch(count, |i, row| {
        for (axis, value) in row.iter_mut().enumerate() {
            let at = (first + i) / points.pow(axis as u32) % points;
            *value = -0.3 + 0.6 * at as f64 / (points - 1) as f64;
        }
    })
}

#[test]
fn a_catheter_over_its_currents_however_the_batch_is_cut() {
    let Some(device) = device_or_skip("a_catheter_over_its_currents") else { return };
    let (plan, batch) = p6(9, true, &["coil.current", "insertion", "loads.tip_force"]);
    let whole = check_plan("P6", gpu(device.clone(), &plan), &plan, &batch);
    let mut gpu = Gpu::new(device, &plan, Precision::F32).unwrap();
    let mut first = 0;
    for count in [1, 63, 64, 65, 255, 257, 24] {
        let part = gpu.solve(&p6_batch(&plan, 9, first, count)).unwrap();
        for sample in 0..count {
            for column in 0..part.values.column_count() {
                let (a, b) = (whole.values.get(first + sample, column), part.values.get(sample, column));
                assert_eq!(a.to_bits(), b.to_bits(), "{first} {sample} {column}");
            }
        }
        first += count;
    }
    assert_eq!(first, batch.sample_count());
}

#[test]
fn rigid_segments_without_a_force_arm() {
    let Some(device) = device_or_skip("rigid_segments_without_a_force_arm") else { return };
    let (plan, batch) = p6(5, false, &["coil.current", "insertion", "loads.tip_force"]);
    assert!(plan.forward);
    check_plan("P6 without arm", gpu(device, &plan), &plan, &batch);
}

#[test]
fn the_hardest_samples_are_right_or_say_that_passes_ran_out() {
    let Some(device) = device_or_skip("the_hardest_samples") else { return };
    let mut scene = scenes::catheter();
    scene.loads.distributed_force = Some([0.0, 0.0, -0.1]);
    let axes: Vec<_> = scenes::parameters(&scene, &["loads.distributed_force", "loads.tip_force"]);
    let axes: Vec<_> = axes.into_iter().map(|parameter| vec![parameter]).collect();
    let options = PlanOptions { stepper: Stepper::Rk4, steps: MOST_STEPS, ..PlanOptions::default() };
    let plan = Plan::new(&scene, &axes, &[], options).unwrap();
    let mut random = Random(7);
    let mut row = |k: i32| (0..6).map(|_| 1e-6 * random.within(-1.0, 1.0) * 1.05f64.powi(k)).collect();
    let rows: Vec<Vec<f64>> = (0..256).map(&mut row).collect();
    let batch = plan.batch(rows.len(), |i, row| {
        if let Some(values) = rows.get(i) {
            row.copy_from_slice(values);
        }
    });
    let found = Gpu::new(device.clone(), &plan, Precision::F32).unwrap().solve(&batch).unwrap();
    let expected = Cpu::new(&plan, Precision::F64).unwrap().solve(&batch).unwrap();
    let mut counts = [0; Status::ALL.len()];
    let (mut worst, mut differing) = (0.0f64, Vec::new());
    for sample in 0..rows.len() {
        let (a, b) = (found.status(sample), expected.status(sample));
        counts[a.code() as usize] += 1;
        if a.is_success() && b.is_success() {
            let p = expected.vector(sample, Quantity::TipPosition);
            worst = worst.max(pose_error(&found, sample, &p, &expected.tip_rotation(sample), plan.units.length));
        } else if a != b && a != Status::StepLimit {
            // Nodes, which the CPU has, solve rods on which no single pass in f32 tells anything.
            let growth = plan.sample_rod(&batch, sample).growth();
            let is_limp = growth > growth_limit(Precision::F32.epsilon()) && b == Status::Ramped;
            if !(is_limp && matches!(a, Status::NotConverged | Status::NonFinite)) {
                differing.push((sample, a, b));
            }
        }
    }
    eprintln!("{counts:?}, worst pose {worst:.1e}, differing {differing:?}");
    assert!(counts[Status::StepLimit.code() as usize] > 0, "{counts:?}");
    assert!(worst < HARDEST_POSE && differing.len() <= HARDEST_DIFFERING, "{worst} {differing:?}");

    let plan = plan.with_options(PlanOptions { steps: 10 * MOST_STEPS, ..options });
    let error = Gpu::new(device, &plan, Precision::F32).err().unwrap();
    assert!(matches!(error, BackendError::Unsupported { .. }), "{error}");
}
