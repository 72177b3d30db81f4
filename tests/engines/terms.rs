//! Every optional term of the model, alone and together: engines against the reference, forward columns against
//! reciprocity, for every parameter of the scene.

use crate::common::day::is_of_today;
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::gpu::Gpu;
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::input::parse_scene;
use rodsweep::model::{Parameter, Plan, PlanOptions, Quantity, Scene, Sensitivity, Solutions, Stepper};
use rodsweep::reference::Reference;
use std::path::Path;

/// 32 steps of order eight and the reference's own tolerance; scenes with every load amplify both.
const F64: f64 = 1e-9;
/// Round-off of f32 (6e-8) over some ten steps of four to twelve stages.
const F32: f64 = 2e-5;
/// In f64, columns smaller than this share of their natural size are measured against it.
const IN_F64: f64 = 1e-3;
/// In f32 a column is a sum of terms of its natural size, rounded to 1e-7 of that: it is measured against at least it.
const IN_F32: f64 = 1.0;

/// What a scene is put together from; a rod is one choice of each.
const FIELD: &str =
    "[field]\nflux_density = [0.4, 2.8, -0.6]\n[base]\nposition = [0.01, -0.02, 0.03]\nrotation = [0.3, -0.5, 0.2]\n";
const COIL: &str = "[[segment]]\nname = \"coil\"\nkind = \"rigid\"\nlength = 0.013\nmass = \"58 mg\"\n\
    coil = { turns = [30, 30, 100], area = [46.7e-6, 46.7e-6, 11.3e-6], current = [0.02, -0.03, 0.04], alignment = [0.1, 0.2, -0.1] }\n";
const MATRIX_COIL: &str = "[[segment]]\nname = \"coil\"\nkind = \"rigid\"\nlength = 0.013\n\
    coil = { turns_area = [[1.4e-3, 1e-4, 0], [0, 1.3e-3, 2e-4], [1e-4, 0, 1.1e-3]], current = [0.02, -0.03, 0.04] }\n";
const MAGNET: &str =
    "[[segment]]\nname = \"magnet\"\nkind = \"rigid\"\nlength = 0.004\ndipole_per_length = [1e-3, 2e-3, 8e-3]\n";

fn flexible(name: &str, rest: &str) -> String {
    format!("[[segment]]\nname = \"{name}\"\nkind = \"flexible\"\n{rest}\n")
}

const CONSTANT: &str =
    "length = 0.06\nstiffness = { bending = 4e-5, torsion = 3e-5 }\nrest_curvature = [3.0, -2.0, 1.0]";
const TUBE: &str = "length = 0.05\ntube = { inner_radius = \"0.8 mm\", outer_radius = \"1.3 mm\" }\n\
    youngs_modulus = \"31.03 MPa\"\npoisson_ratio = 0.4\ndensity = \"1510 kg/m^3\"";
const ANISOTROPIC: &str =
    "length = 0.05\nstiffness = { bending_x = 3e-5, bending_y = 6e-5, torsion = 3e-5 }\nlinear_density = 3e-4";
const CURVED: &str = "length = 0.05\nstiffness = { bending = 4e-5, torsion = 3e-5 }\n\
    rest_curvature = [{ at = 0.01, value = [2, 1, 0] }, { at = 0.03, value = [-6, 4, 2] }, { at = 0.05, value = [1, 1, 1] }]";
const TAPERED: &str = "length = 0.05\nstiffness = [{ at = 0, bending = 6e-5, torsion = 5e-5 }, \
    { at = 0.04, bending_x = 3e-5, bending_y = 2e-5, torsion = 2e-5 }]\nrest_curvature = [1, 2, 3]";
const BOTH: &str = "length = 0.05\nstiffness = [{ at = 0, bending = 6e-5, torsion = 5e-5 }, \
    { at = 0.04, bending = 3e-5, torsion = 2e-5 }]\n\
    rest_curvature = [{ at = 0.0, value = [2, 1, 0] }, { at = 0.03, value = [-6, 4, 2] }]";
const SHEAR: &str = "length = 0.05\nstiffness = { bending = 4e-5, torsion = 3e-5 }\nrest_curvature = [2, 0, 1]\n\
    stiffness_shear = [0.5, 0.8]\nstiffness_axial = 2.0";
const SOFT_MAGNET: &str = "length = 0.04\nstiffness = { bending = 4e-5, torsion = 3e-5 }\nrest_curvature = [2, 0, 1]\n\
    dipole_per_length = [1e-4, -2e-4, 4e-4]";

const LOADS: [(&str, &str); 5] = [
    ("no load", ""),
    ("tip force", "[loads]\ntip_force = [2e-3, -1e-3, 1.5e-3]\n"),
    ("tip moment", "[loads]\ntip_moment = [5e-5, -2e-5, 3e-5]\n"),
    ("force per length", "[loads]\ndistributed_force = [5e-3, 2e-3, -3e-3]\n"),
    (
        "weight and all",
        "[loads]\ngravity = [1, -2, -9.4]\nfluid_density = 1060.0\ndistributed_force = [1e-3, 0, 2e-3]\n\
         tip_force = [1e-3, 0, 1e-3]\ntip_moment = [1e-5, 0, -2e-5]\n",
    ),
];

fn rods() -> Vec<(&'static str, Vec<String>)> {
    let distal = || flexible("distal", CONSTANT);
    vec![
        ("plain", vec![flexible("proximal", CONSTANT), COIL.into(), distal()]),
        ("no coil", vec![flexible("proximal", CONSTANT)]),
        ("coil at the tip", vec![flexible("proximal", TUBE), COIL.into()]),
        ("coil first", vec![MATRIX_COIL.into(), flexible("proximal", ANISOTROPIC)]),
        ("anisotropic", vec![flexible("proximal", ANISOTROPIC), COIL.into(), flexible("distal", TUBE)]),
        ("nodes of rest curvature", vec![flexible("proximal", CURVED), COIL.into(), distal()]),
        ("taper", vec![flexible("proximal", TAPERED), COIL.into(), flexible("distal", TAPERED)]),
        ("nodes of both", vec![flexible("proximal", BOTH), COIL.into(), flexible("distal", CURVED)]),
        ("shear", vec![flexible("proximal", SHEAR), COIL.into(), flexible("distal", SHEAR)]),
        ("magnets", vec![flexible("proximal", SOFT_MAGNET), MAGNET.into(), flexible("distal", SOFT_MAGNET)]),
        (
            "everything",
            vec![
                flexible("proximal", &format!("{BOTH}\nstiffness_axial = 3.0\nlinear_density = 3e-4")),
                COIL.into(),
                flexible("distal", &format!("{CURVED}\nstiffness_shear = 0.5\ndipole_per_length = [0, 1e-4, 3e-4]")),
                MAGNET.into(),
                flexible("end", TUBE),
            ],
        ),
    ]
}

fn scenes() -> Vec<(String, Scene)> {
    let mut scenes = Vec::new();
    for (rod, segments) in rods() {
        for (load, loads) in LOADS {
            let massive = segments.iter().any(|s| s.contains("mass") || s.contains("density"));
            let loads = if massive { loads.to_owned() } else { loads.replace("gravity = [1, -2, -9.4]\n", "") };
            let text = format!("{FIELD}{loads}{}", segments.concat());
            let name = format!("{rod}, {load}");
            let scene = parse_scene(Path::new(&name), &text).unwrap_or_else(|error| panic!("{name}: {error}"));
            scenes.push((name, scene));
        }
    }
    scenes
}

/// Every parameter that the scene takes.
fn parameters(scene: &Scene) -> Vec<Parameter> {
    let inserts = scene.rod().segments[0].is_flexible();
    let all = Parameter::all(scene).into_iter();
    all.filter(|parameter| inserts || *parameter != Parameter::Insertion).collect()
}

fn plan(scene: &Scene, wrt: &[Parameter], sensitivity: Sensitivity, stepper: Stepper, steps: usize) -> Plan {
    Plan::single(scene, wrt, PlanOptions { tolerance: 1e-12, stepper, steps, sensitivity, ..PlanOptions::default() })
        .expect("a plan")
}

fn solve(backend: &mut dyn Backend) -> Solutions {
    let batch = backend.plan().batch(1, |_, _| {});
    backend.solve(&batch).expect("solutions")
}

/// Largest difference of tip, moment and derivatives, each in the plan's units; columns relative to their size, or to
/// `small` of their natural size where that is larger.
fn difference(plan: &Plan, a: &Solutions, b: &Solutions, small: f64) -> (f64, String) {
    let units = &plan.units;
    let mut worst = (0.0, "tip".to_owned());
    let mut note = |error: f64, name: String| {
        if error.is_nan() || error > worst.0 {
            worst = (error, name);
        }
    };
    for (quantity, unit) in [
        (Quantity::TipPosition, units.length),
        (Quantity::TipD1, 1.0),
        (Quantity::TipTangent, 1.0),
        (Quantity::BaseMoment, units.moment()),
    ] {
        let (x, y) = (a.vector(0, quantity), b.vector(0, quantity));
        (0..3).for_each(|k| note((x[k] - y[k]).abs() / unit, format!("{quantity:?}")));
    }
    for (k, derivative) in plan.derivatives.iter().enumerate() {
        // In the unit of its largest slot, so that a small column is measured against its natural size.
        let natural = derivative.terms.iter().map(|(slot, entry)| match plan.entries[*entry] {
            rodsweep::model::Entry::Constant(rate) => (rate / slot.unit(units)).abs(),
            rodsweep::model::Entry::Varying(_) => 0.0,
        });
        let natural = natural.fold(0.0, f64::max);
        let pure = |s: &Solutions, row: usize| s.derivative(0, k, row) / [units.length, 1.0, units.moment()][row / 3];
        let size = (0..9).map(|row| pure(b, row).abs()).fold((small * natural).max(f64::MIN_POSITIVE), f64::max);
        for row in 0..9 {
            note((pure(a, row) - pure(b, row)).abs() / size, format!("{} row {row}", derivative.name));
        }
    }
    worst
}

/// Scenes of the table and, for both sensitivities, the answers of the reference.
fn expected() -> Vec<(String, Scene, Solutions)> {
    let solved = |(name, scene): (String, Scene)| {
        let plan = plan(&scene, &parameters(&scene), Sensitivity::Forward, Stepper::Dop853, 32);
        let expected = solve(&mut Reference::new(&plan));
        assert!(expected.status(0).is_success(), "{name}: {:?}", expected.status(0));
        (name, scene, expected)
    };
    scenes().into_iter().map(solved).collect()
}

/// Compares the CPU engine with the reference on every scene; returns the worst.
fn check_lanes(precision: Precision, steps: usize, small: f64, limit: f64) {
    let mut failures = Vec::new();
    let mut worst = (0.0, String::new());
    for (name, scene, expected) in expected() {
        for sensitivity in [Sensitivity::Forward, Sensitivity::Reciprocity] {
            let plan = plan(&scene, &parameters(&scene), sensitivity, Stepper::Dop853, steps);
            let found = solve(&mut Cpu::new(&plan, precision).expect("lanes"));
            assert!(found.status(0).is_success(), "{name}, {sensitivity:?}: {:?}", found.status(0));
            let (error, what) = difference(&plan, &found, &expected, small);
            if error.is_nan() || error > limit {
                failures.push(format!("{name}, {sensitivity:?}: {error:.1e} in {what}"));
            }
            if error > worst.0 {
                worst = (error, format!("{name}, {sensitivity:?}, {what}"));
            }
        }
    }
    println!("{precision:?}: worst {worst:?}");
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn lanes_agree_with_the_reference() {
    check_lanes(Precision::F64, 32, IN_F64, F64);
}

#[test]
fn lanes_in_f32_agree_with_the_reference() {
    check_lanes(Precision::F32, 16, IN_F32, F32);
}

/// Rod, load, force arm, sensitivity, parameters.
type GpuCase = (&'static str, &'static str, bool, Sensitivity, Option<&'static [&'static str]>);

/// The GPU solves these cases of the table, half of them each day, since drivers compile each kernel for seconds. A case is a rod, a
/// load, whether the force arm of rigid segments counts, and what to differentiate by, all parameters or some.
///
/// Every term, alone where it is easily lost (magnets integrate M without a force, shear of a rod without force) and
/// together; both sensitivities, with many threes of forward columns and with one; no derivatives; a free distal part.
const ON_GPU: [GpuCase; 10] = {
    use Sensitivity::{Auto, Forward, Reciprocity};
    const CURRENTS: &[&str] = &["coil.current"];
    const FEW: &[&str] = &["coil.current", "insertion"];
    [
        ("everything", "weight and all", true, Reciprocity, None),
        ("everything", "weight and all", true, Forward, None),
        (
            "everything",
            "weight and all",
            false,
            Auto,
            Some(&["coil.current", "coil.length", "coil.mass", "magnet.length"]),
        ),
        ("magnets", "no load", true, Reciprocity, None),
        ("magnets", "no load", true, Forward, None),
        ("shear", "no load", true, Reciprocity, None),
        ("taper", "force per length", true, Auto, Some(&[])),
        (
            "coil first",
            "tip moment",
            true,
            Forward,
            Some(&["coil.turns_area", "proximal.length", "loads.distributed_force"]),
        ),
        ("plain", "no load", true, Auto, Some(FEW)),
        ("plain", "no load", true, Forward, Some(CURRENTS)),
    ]
};

#[test]
fn gpu_agrees_with_the_reference() {
    check_gpu(Precision::F32, &ON_GPU, IN_F32, F32);
}

/// The kernels with every term; 64 steps of fourth order leave 1e-6.
#[test]
fn gpu_in_f64_agrees_with_the_reference() {
    check_gpu(Precision::F64, &ON_GPU[..2], IN_F64, 2e-6);
}

fn check_gpu(precision: Precision, cases: &[GpuCase], small: f64, limit: f64) {
    for (number, (rod, load, force_arm, sensitivity, names)) in cases.iter().copied().enumerate() {
        if !is_of_today(number, 2) {
            continue;
        }
        let Some(device) = device_or_skip("terms on the GPU") else { return };
        if precision == Precision::F64 && !device.adapter().has_f64 {
            println!("skipped: {} has no f64", device.adapter().name);
            return;
        }
        let name = format!("{rod}, {load}, {sensitivity:?}");
        let (_, mut scene) = scenes().into_iter().find(|(name, _)| *name == format!("{rod}, {load}")).expect("a scene");
        scene.rigid_force_arm = force_arm;
        let named =
            |names: &[&str]| names.iter().flat_map(|name| Parameter::parse(&scene, name).expect("known")).collect();
        let wrt: Vec<Parameter> = names.map_or_else(|| parameters(&scene), named);
        let plan = plan(&scene, &wrt, sensitivity, Stepper::Rk4, 64);
        assert_eq!(plan.free.is_some(), rod == "plain", "{name}");
        assert!(plan.forward == (sensitivity == Sensitivity::Forward || !force_arm), "{name}");
        let mut gpu = Gpu::new(device, &plan, precision).expect("supported");
        let found = solve(&mut gpu);
        let compiled = gpu.timings().compile + gpu.timings().first_dispatch;
        let (error, what) = difference(&plan, &found, &solve(&mut Reference::new(&plan)), small);
        println!(
            "{name}, {precision}: {} derivatives, compiled in {compiled:.1} s, worst {error:.1e} in {what}",
            wrt.len()
        );
        assert!(found.status(0).is_success() && error <= limit, "{name}: {:?}, {error:.1e} in {what}", found.status(0));
    }
}

#[test]
fn without_the_force_arm_lanes_agree_with_the_reference() {
    let mut worst = (0.0, String::new());
    for (name, mut scene) in scenes() {
        scene.rigid_force_arm = false;
        let plan = plan(&scene, &parameters(&scene), Sensitivity::Auto, Stepper::Dop853, 32);
        let found = solve(&mut Cpu::new(&plan, Precision::F64).expect("lanes"));
        let (error, what) = difference(&plan, &found, &solve(&mut Reference::new(&plan)), IN_F64);
        assert!(found.status(0).is_success() && error <= F64, "{name}: {:?}, {error:.1e} in {what}", found.status(0));
        if error > worst.0 {
            worst = (error, format!("{name}, {what}"));
        }
    }
    println!("{worst:?}");
}
