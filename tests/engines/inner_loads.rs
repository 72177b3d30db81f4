//! Dead forces inside of the rod: at a station, at the middle of a rigid segment, along a segment.

use crate::common::root;
use crate::stretches::{plan, solve};
use rodsweep::backend::Precision;
use rodsweep::cpu::Cpu;
use rodsweep::gpu::Gpu;
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::input::parse_scene;
use rodsweep::model::{Parameter, Plan, PlanOptions, Quantity, Scene, Solutions, Stepper, Vector, rotation_angle};
use rodsweep::reference::Reference;
use rodsweep_bench::judge::{Word, judge};
use serde_json::Value;

/// Half a metre of steel, one piece or two.
fn steel(base: &str, loads: &str, lengths: &[f64]) -> Scene {
    let mut text = format!("[base]\nrotation = {base}\n{loads}\n");
    for (k, length) in lengths.iter().enumerate() {
        text += &format!(
            "[[segment]]\nname = \"part{k}\"\nkind = \"flexible\"\nlength = {length}\ntube = {{ inner_radius = 0, outer_radius = \
             \"1 mm\" }}\nyoungs_modulus = \"207 GPa\"\npoisson_ratio = 0.3\ndensity = \"8000 kg/m^3\"\n"
        );
    }
    parse(&text)
}

fn parse(text: &str) -> Scene {
    parse_scene("scene.toml".as_ref(), text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// The answer of each engine: its name, its solution, the largest error of a pose (over the length, rad).
fn engines(scene: &Scene) -> Vec<(String, Solutions, f64)> {
    let mut all = Vec::new();
    for (precision, pose) in [(Precision::F64, 1e-8), (Precision::F32, 1e-4)] {
        let plan = plan(scene, precision, 24);
        let mut engine = Cpu::new(&plan, precision).expect("supported");
        all.push((format!("cpu {precision}"), solve(&plan, &mut engine), pose));
    }
    let plan = plan(scene, Precision::F64, 24);
    all.push(("reference".into(), solve(&plan, &mut Reference::new(&plan)), 1e-9));
    all
}

fn away(found: &Solutions, tip: Vector) -> f64 {
    let p = found.vector(0, Quantity::TipPosition);
    (0..3).map(|k| (p[k] - tip[k]).powi(2)).sum::<f64>().sqrt()
}

/// Numbers of a shooting solver in SciPy that shares nothing with the engines.
#[test]
fn a_force_at_the_middle_bends_the_rod_as_another_program_has_it() {
    let file = root().join("tests/data/reports/04-point-force-inside/expected.json");
    let value: Value = serde_json::from_str(&std::fs::read_to_string(file).expect("there")).expect("JSON");
    let weight = "[loads]\ngravity = [0, 0, -9.81]\n";
    let (turned, upright) = ("[1.5707963267948966, 0, 0]", "[0, 0, 0]");
    let push = |force: &str| format!("{weight}[[load]]\nname = \"push\"\nat = \"250 mm\"\nforce = {force}\n");
    let cases = [
        ("weight_0_1_kg_middle", turned, push("[0, 0, -0.981]")),
        ("up_1_N_middle", turned, push("[0, 0, \"1 N\"]")),
        ("till_force_0_1_2_at_half", upright, push("[0, 1, 2]")),
    ];
    for (key, base, loads) in cases {
        let tip: Vector = serde_json::from_value(value["expected"][key].clone()).expect("three numbers");
        // In one piece, and cut elsewhere and at the force.
        for lengths in [&[0.5][..], &[0.25, 0.25], &[0.1, 0.3, 0.1]] {
            for (name, found, pose) in engines(&steel(base, &loads, lengths)) {
                assert!(found.status(0).is_success(), "{key}, {name}: {:?}", found.status(0));
                let error = away(&found, tip);
                assert!(error < 0.5 * pose + 2e-9, "{key}, {name}, {lengths:?}: {error:.1e} m");
            }
        }
    }
}

#[test]
fn a_force_is_the_weight_of_a_mass_there() {
    let before = "[base]\nrotation = [0.3, 1.2, -0.4]\n[loads]\ngravity = [1, -9, 3]\n";
    let tube = |name: &str, length: f64| {
        format!(
            "[[segment]]\nname = \"{name}\"\nkind = \"flexible\"\nlength = {length}\nstiffness = {{ bending_x = 2e-5, bending_y = 3e-5, \
             torsion = 1.5e-5 }}\nrest_curvature = [3, -2, 1]\nlinear_density = 1e-3\n"
        )
    };
    let lump = "[[segment]]\nname = \"lump\"\nkind = \"rigid\"\nlength = 0\nmass = 3e-4\n";
    let force = "[[load]]\nname = \"pull\"\nat = 0.03\nforce = [3e-4, -27e-4, 9e-4]\n";
    let heavy = parse(&format!("{before}{}{lump}{}", tube("first", 0.03), tube("second", 0.05)));
    let pulled = parse(&format!("{before}{force}{}", tube("whole", 0.08)));
    for ((name, one, pose), (_, other, _)) in engines(&heavy).iter().zip(engines(&pulled)) {
        let [p, q] = [one, &other].map(|found| found.vector(0, Quantity::TipPosition));
        let apart = (0..3).map(|k| (p[k] - q[k]).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-3 * pose, "{name}: {apart:.1e}");
    }
    // A mass in the middle of a rigid segment, and a force there.
    let rigid = "[[segment]]\nname = \"tip\"\nkind = \"rigid\"\nlength = 0.01\n";
    let heavy = parse(&format!("{before}{}{rigid}mass = 1e-4\n", tube("first", 0.05)));
    let force = "[[load]]\nname = \"pull\"\nsegment = \"tip\"\nforce = [1e-4, -9e-4, 3e-4]\n";
    let pulled = parse(&format!("{before}{force}{}{rigid}", tube("first", 0.05)));
    for ((name, one, _), (_, other, _)) in engines(&heavy).iter().zip(engines(&pulled)) {
        assert!(away(one, other.vector(0, Quantity::TipPosition)) < 1e-9, "{name}");
    }
}

/// Beyond the last force nothing bends the rod: its tip is that of a shorter rod, and a straight piece.
#[test]
fn beyond_the_force_the_rod_is_straight() {
    let beam = |length: f64, loads: &str| {
        parse(&format!(
            "{loads}\n[[segment]]\nname = \"beam\"\nkind = \"flexible\"\nlength = {length}\nstiffness = {{ bending = 0.1, torsion = 0.08 }}\n"
        ))
    };
    for (force, at) in [([0.0, 0.3, 0.0], 0.5), ([0.2, -0.1, -0.3], 0.31), ([0.9, 0.4, 0.7], 0.07)] {
        let short = beam(at, &format!("[loads]\ntip_force = {force:?}"));
        let long = beam(0.5, &format!("[[load]]\nname = \"push\"\nat = {at}\nforce = {force:?}"));
        for ((name, one, pose), (_, other, _)) in engines(&short).iter().zip(engines(&long)) {
            let (p, rotation) = (one.vector(0, Quantity::TipPosition), one.tip_rotation(0));
            let tip = [0, 1, 2].map(|k| p[k] + (0.5 - at) * rotation[k][2]);
            let error = away(&other, tip);
            assert!(error < *pose, "{name}, {force:?} at {at}: {error:.1e}");
            assert!(rotation_angle(&rotation, &other.tip_rotation(0)) < 2.0 * pose, "{name}, {force:?} at {at}");
        }
    }
}

/// Three kinds of force, nodes of stiffness and rest curvature, a magnet.
fn mixed() -> Scene {
    parse(
        "[base]\nrotation = [0.4, -0.9, 0.2]\n[field]\nflux_density = [0.02, -0.01, 0.03]\n[loads]\ntip_force = [1e-4, 0, -2e-4]\n\
         gravity = [0, -9.81, 0]\n\
         [[load]]\nname = \"push\"\nsegment = \"tube\"\nat = 0.02\nforce = [2e-4, 3e-4, -1e-4]\n\
         [[load]]\nname = \"again\"\nat = 0.02\nforce = [0, -1e-4, 2e-4]\n\
         [[load]]\nname = \"end\"\nsegment = \"tube\"\nat = 0.045\nforce = [-1e-4, 1e-4, 0]\n\
         [[load]]\nname = \"pull\"\nsegment = \"tip\"\nforce = [1e-4, -2e-4, 2e-4]\n\
         [[load]]\nname = \"wind\"\nsegment = \"tube\"\nforce_per_length = [0, 4e-3, 2e-3]\n\
         [[load]]\nname = \"flow\"\nsegment = \"tip\"\nforce_per_length = [1e-2, 0, 3e-3]\n\
         [[segment]]\nname = \"tube\"\nkind = \"flexible\"\nlength = 0.05\nlinear_density = 1e-3\n\
         stiffness = [{ at = 0, bending = 2e-5, torsion = 1.5e-5 }, { at = 0.02, bending = 1.5e-5, torsion = 1.2e-5 }]\n\
         rest_curvature = [{ at = 0.01, value = [4, 0, 1] }, { at = 0.04, value = [-3, 6, 0] }]\n\
         [[segment]]\nname = \"tip\"\nkind = \"rigid\"\nlength = 0.008\nmass = 2e-5\ndipole_per_length = [0, 0, 0.3]\n",
    )
}

#[test]
fn its_derivatives_are_those_of_neighbours() {
    let names = [
        "loads.push.force",
        "loads.end.force.y",
        "loads.pull.force",
        "loads.wind.force_per_length",
        "loads.flow.force_per_length",
        "tube.length",
        "tip.length",
        "tube.rest_curvature.node_1",
        "tube.stiffness.node_2.bending",
        "loads.gravity.y",
        "base.rotation.x",
    ];
    let scene = mixed();
    let wrt: Vec<Parameter> = names.iter().flat_map(|name| Parameter::parse(&scene, name).expect(name)).collect();
    for is_forward in [false, true] {
        let sensitivity = if is_forward { rodsweep::model::Sensitivity::Forward } else { Default::default() };
        let options = PlanOptions {
            stepper: Stepper::Dop853,
            steps: 32,
            tolerance: 1e-10,
            sensitivity,
            ..PlanOptions::default()
        };
        let plan = Plan::new(&scene, &[], &wrt, options).expect("the scene plans");
        let lanes = solve(&plan, &mut Cpu::new(&plan, Precision::F64).expect("supported"));
        let reference = solve(&plan, &mut Reference::new(&plan));
        for (k, parameter) in wrt.iter().enumerate() {
            let value = parameter.get(&scene);
            let size = match parameter.unit() {
                "N" => 1e-4,
                "N·m²" => value,
                _ => value.abs().max(1e-2),
            };
            let tip = |by: f64| {
                let mut moved = scene.clone();
                parameter.set(&mut moved, value + by * size).expect("a value");
                let plan = Plan::new(&moved, &[], &[], options).expect("the scene plans");
                solve(&plan, &mut Reference::new(&plan)).vector(0, Quantity::TipPosition)
            };
            let (low, high) = (tip(-1e-4), tip(1e-4));
            let slope = [0, 1, 2].map(|axis| (high[axis] - low[axis]) / (2e-4 * size));
            let length = slope.iter().map(|x| x * x).sum::<f64>().sqrt();
            for (engine, found) in [("cpu", &lanes), ("reference", &reference)] {
                for (axis, slope) in slope.iter().enumerate() {
                    let column = found.derivative(0, k, axis);
                    let error = (column - slope).abs() / length;
                    assert!(error < 1e-5, "{engine}, {}: {column:e}, {slope:e}", parameter.name(&scene));
                }
            }
        }
    }
}

#[test]
fn the_judge_has_the_same_tip() {
    let scene = mixed();
    let Word::Arrives { position, .. } = judge(&scene.rod()) else { panic!("the judge has no answer") };
    for (name, found, pose) in engines(&scene) {
        let error = away(&found, position) / 0.058;
        assert!(error < pose.max(1e-6), "{name}: {error:.1e}");
    }
}

#[test]
fn the_gpu_has_the_same_tip() {
    let Some(device) = device_or_skip("forces inside of the rod on the GPU") else { return };
    let scene = mixed();
    let plan = plan(&scene, Precision::F32, 24);
    let mut engine = Gpu::new(device, &plan, Precision::F32).expect("supported");
    let expected = solve(&plan, &mut Reference::new(&plan)).vector(0, Quantity::TipPosition);
    let error = away(&solve(&plan, &mut engine), expected) / 0.058;
    assert!(error < 1e-4, "{error:.1e}");
}
