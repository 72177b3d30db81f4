//! Loads without energy inside of the rod and at its tip: moments, and forces that turn with it. F11

use crate::common::{day, root};
use crate::stretches::solve;
use nalgebra::{Matrix3, Vector3};
use rodsweep::backend::{BackendKind, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::engines::EngineRequest;
use rodsweep::input::parse_scene;
use rodsweep::model::{
    Frame, Parameter, Plan, PlanOptions, Quantity, Scene, Solutions, Stepper, Vector, rotation_angle,
};
use rodsweep::reference::{Reference, energy, shape, solve_rod};
use rodsweep_bench::random::Random;
use serde_json::Value;
use std::f64::consts::PI;

const LENGTH: f64 = 0.5;
const STIFFNESS: Vector = [0.1, 0.07, 0.08];

fn parse(text: &str) -> Scene {
    parse_scene("scene.toml".as_ref(), text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn beam(length: f64) -> String {
    let [x, y, z] = STIFFNESS;
    format!(
        "[[segment]]\nname = \"beam\"\nkind = \"flexible\"\nlength = {length}\nstiffness = {{ bending_x = {x}, bending_y = {y}, torsion = {z} }}\n"
    )
}

fn plan(scene: &Scene, wrt: &[Parameter], precision: Precision) -> Plan {
    let tolerance = if precision == Precision::F64 { 1e-9 } else { 2e-5 };
    let options = PlanOptions { stepper: Stepper::Dop853, steps: 32, tolerance, ..PlanOptions::default() };
    Plan::new(scene, &[], wrt, options).expect("the scene plans")
}

/// The answer of each engine: its name, its solution, the largest error of a pose (over the length, rad).
fn engines(scene: &Scene) -> Vec<(String, Solutions, f64)> {
    let mut all = Vec::new();
    for (precision, pose) in [(Precision::F64, 1e-8), (Precision::F32, 1e-4)] {
        let plan = plan(scene, &[], precision);
        let mut engine = Cpu::new(&plan, precision).expect("supported");
        all.push((format!("cpu {precision}"), solve(&plan, &mut engine), pose));
    }
    let plan = plan(scene, &[], Precision::F64);
    all.push(("reference".into(), solve(&plan, &mut Reference::new(&plan)), 1e-9));
    all
}

/// Distance of tips over the length, or the angle between them, whichever is larger.
fn apart(found: &Solutions, (position, rotation): (Vector, [Vector; 3])) -> f64 {
    let p = found.vector(0, Quantity::TipPosition);
    let away = (0..3).map(|k| (p[k] - position[k]).powi(2)).sum::<f64>().sqrt() / LENGTH;
    away.max(rotation_angle(&found.tip_rotation(0), &rotation))
}

fn check(scene: &Scene, expected: (Vector, [Vector; 3]), what: &str) {
    for (name, found, pose) in engines(scene) {
        assert!(found.status(0).is_success(), "{name}, {what}: {:?}", found.status(0));
        let error = apart(&found, expected);
        assert!(error < 5.0 * pose, "{name}, {what}: {error:.1e}");
    }
}

/// A load that turns with the rod: distance from the base, force and moment there.
type Load = (f64, Vector, Vector);

/// The tip under such loads alone: with the tip's frame held still they are known from the tip on, and the base is where it comes to. Runge
/// and Kutta's fourth order.
#[expect(non_snake_case)]
fn from_the_tip(loads: &[Load]) -> (Vector, [Vector; 3]) {
    const STEPS: usize = 4000;
    let K = Vector3::from(STIFFNESS);
    let (mut p, mut R, mut m, mut n) = (Vector3::zeros(), Matrix3::identity(), Vector3::zeros(), Vector3::zeros());
    let mut ends: Vec<f64> = loads.iter().map(|(at, ..)| *at).collect();
    ends.extend([0.0, LENGTH]);
    ends.sort_by(|a, b| b.total_cmp(a));
    ends.dedup();
    for pair in ends.windows(2) {
        for (_, force, moment) in loads.iter().filter(|(at, ..)| *at == pair[0]) {
            n += R * Vector3::from(*force);
            m += R * Vector3::from(*moment);
        }
        let h = (pair[1] - pair[0]) / STEPS as f64;
        let slope = |R: Matrix3<f64>, m: Vector3<f64>| {
            let t: Vector3<f64> = R.column(2).into();
            let u = R.tr_mul(&m).component_div(&K);
            (t, R * u.cross_matrix(), -t.cross(&n))
        };
        for _ in 0..STEPS {
            let a = slope(R, m);
            let b = slope(R + a.1 * (h / 2.0), m + a.2 * (h / 2.0));
            let c = slope(R + b.1 * (h / 2.0), m + b.2 * (h / 2.0));
            let d = slope(R + c.1 * h, m + c.2 * h);
            p += (a.0 + 2.0 * b.0 + 2.0 * c.0 + d.0) * (h / 6.0);
            R += (a.1 + 2.0 * b.1 + 2.0 * c.1 + d.1) * (h / 6.0);
            m += (a.2 + 2.0 * b.2 + 2.0 * c.2 + d.2) * (h / 6.0);
        }
    }
    let tip = R.tr_mul(&-p);
    (tip.into(), std::array::from_fn(|row| std::array::from_fn(|col| R[(col, row)])))
}

/// Numbers of a program that shares nothing with the engines.
#[test]
fn a_force_that_stays_across_the_tip_bends_a_beam_as_another_program_has_it() {
    let file = root().join("tests/data/reports/05-follower-load/expected.json");
    let value: Value = serde_json::from_str(&std::fs::read_to_string(file).expect("there")).expect("JSON");
    let tip: Vector = serde_json::from_value(value["expected"]["tip"].clone()).expect("three numbers");
    let rest = "[[segment]]\nname = \"beam\"\nkind = \"flexible\"\nlength = \"0.5 m\"\nstiffness = { bending = 0.1, torsion = 0.08 }\n";
    let loads = [
        "[loads]\ntip_force = { value = [0, \"0.2 N\", 0], frame = \"body\" }\n",
        "[[load]]\nname = \"push\"\nat = 0.5\nforce = [0, \"0.2 N\", 0]\nframe = \"body\"\n",
    ];
    for text in loads {
        for (name, found, pose) in engines(&parse(&format!("{text}{rest}"))) {
            let p = found.vector(0, Quantity::TipPosition);
            let error = (0..3).map(|k| (p[k] - tip[k]).abs()).fold(0.0, f64::max);
            assert!(found.status(0).is_success() && error < 0.5 * pose + 1e-10, "{name}: {error:.1e} m");
        }
    }
}

/// A moment inside of the rod bends it to a circle as far as its place; beyond, the rod is straight. About y, world and body agree.
#[test]
fn a_moment_inside_bends_the_rod_to_a_circle_before_it() {
    for (angle, at) in [(0.5, 0.3), (2.0, 0.5), (-4.0, 0.2), (2.5 * PI, 0.45)] {
        let moment = angle * STIFFNESS[1] / at;
        let (sin, cos) = f64::sin_cos(angle);
        let (radius, rest) = (at / angle, LENGTH - at);
        let tip = [radius * (1.0 - cos) + rest * sin, 0.0, radius * sin + rest * cos];
        let rotation = [[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]];
        for frame in ["world", "body"] {
            let load = format!(
                "[[load]]\nname = \"turn\"\nat = {at}\nmoment = [0, {moment}, 0]\nframe = \"{frame}\"\n{}",
                beam(LENGTH)
            );
            check(&parse(&load), (tip, rotation), &format!("{angle} at {at}, {frame}"));
        }
    }
}

/// Several loads at once, up to large turns, against integration from the tip.
#[test]
fn loads_that_turn_with_the_rod_are_known_from_the_tip_on() {
    let cases: [&[Load]; 5] = [
        &[(0.5, [0.4, 0.7, -0.3], [0.05, -0.02, 0.03])],
        &[(0.2, [0.5, 0.0, 0.2], [0.0, 0.1, 0.0]), (0.5, [0.0, 0.3, 0.4], [0.0; 3])],
        &[(0.1, [0.0, 2.0, 0.0], [0.0; 3]), (0.3, [0.0; 3], [0.1, 0.0, 0.05]), (0.45, [-0.5, 0.2, -0.4], [0.0; 3])],
        // Across the tip: it turns by more than two right angles.
        &[(0.5, [0.0, 2.2, 0.0], [0.0; 3])],
        &[(0.5, [0.0, 0.0, -1.5], [0.02, 0.03, 0.0])],
    ];
    for (k, loads) in cases.iter().enumerate() {
        let mut text = String::new();
        for (index, (at, force, moment)) in loads.iter().enumerate() {
            let [fx, fy, fz] = force;
            let [mx, my, mz] = moment;
            text += &format!(
                "[[load]]\nname = \"load{index}\"\nat = {at}\nforce = [{fx}, {fy}, {fz}]\nmoment = [{mx}, {my}, {mz}]\nframe = \"body\"\n"
            );
        }
        check(&parse(&format!("{text}{}", beam(LENGTH))), from_the_tip(loads), &format!("case {k}"));
    }
}

/// Random designs: such loads at stations, on a rigid segment and at the tip, with weight, in a field.
fn random(random: &mut Random) -> Scene {
    let mut vector = |size: f64| -> String {
        let [x, y, z] = std::array::from_fn(|_| random.within(-size, size));
        format!("[{x}, {y}, {z}]")
    };
    // Moments that bend the tube by up to about a radian, and forces to match.
    let (moment, force) = (4e-4, 6e-3);
    let mut text = format!(
        "[base]\nrotation = {}\n[field]\nflux_density = {}\n[loads]\ngravity = {}\ntip_force = {{ value = {}, frame = \"body\" }}\n\
         tip_moment = {{ value = {}, frame = \"body\" }}\n",
        vector(1.5),
        vector(0.02),
        vector(5.0),
        vector(force),
        vector(moment)
    );
    for (name, place, frame) in [
        ("a", "at = 0.02", "body"),
        ("b", "segment = \"tip\"", "body"),
        ("c", "at = 0.035", "world"),
        ("d", "segment = \"ring\"", "world"),
    ] {
        text += &format!(
            "[[load]]\nname = \"{name}\"\n{place}\nforce = {}\nmoment = {}\nframe = \"{frame}\"\n",
            vector(force),
            vector(moment)
        );
    }
    text += &format!(
        "[[segment]]\nname = \"tube\"\nkind = \"flexible\"\nlength = 0.03\nlinear_density = 1e-3\nrest_curvature = {}\n\
         stiffness = {{ bending_x = 2e-5, bending_y = 3e-5, torsion = 1.5e-5 }}\n\
         [[segment]]\nname = \"ring\"\nkind = \"rigid\"\nlength = 0.004\nmass = 1e-5\n\
         [[segment]]\nname = \"end\"\nkind = \"flexible\"\nlength = 0.02\nlinear_density = 1e-3\n\
         stiffness = {{ bending = 1.5e-5, torsion = 1.2e-5 }}\n\
         [[segment]]\nname = \"tip\"\nkind = \"rigid\"\nlength = 0.006\nmass = 2e-5\ndipole_per_length = {}\n",
        vector(20.0),
        vector(0.3)
    );
    parse(&text)
}

#[test]
fn engines_agree_on_random_designs() {
    let seed = day::today();
    let mut generator = Random(seed);
    let (mut solved, mut compared) = (0, 0);
    for k in 0..150 {
        let scene = random(&mut generator);
        let plan_64 = plan(&scene, &[], Precision::F64);
        let truth = solve(&plan_64, &mut Reference::new(&plan_64));
        if !truth.status(0).is_success() {
            continue;
        }
        solved += 1;
        let expected = (truth.vector(0, Quantity::TipPosition), truth.tip_rotation(0));
        for (precision, pose) in [(Precision::F64, 1e-6), (Precision::F32, 2e-3)] {
            let plan = plan(&scene, &[], precision);
            let found = solve(&plan, &mut Cpu::new(&plan, precision).expect("supported"));
            if found.status(0).is_success() {
                compared += 1;
                let error = apart(&found, expected);
                assert!(
                    error < pose,
                    "seed {seed}, design {k}, {precision}: {error:.1e}\n{}",
                    rodsweep::input::write_scene(&scene)
                );
            }
        }
    }
    assert!(solved > 120 && compared > 2 * solved - 20, "seed {seed}: {solved} solved, {compared} compared");
}

/// In an equilibrium a follower load equals the dead load of its present direction: the rod under such dead loads has the same tip.
#[test]
fn in_its_equilibrium_such_a_load_is_a_dead_one() {
    let mut generator = Random(day::today());
    for _ in 0..10 {
        let scene = random(&mut generator);
        let rod = scene.rod();
        let equilibrium = solve_rod(&rod, &[]);
        if !equilibrium.status.is_success() {
            continue;
        }
        let mut dead = scene.clone();
        let at: Vec<f64> = scene.inner_loads.iter().map(|load| scene.arc_length_of(load)).collect();
        for (load, pose) in dead.inner_loads.iter_mut().zip(shape(&rod, &equilibrium, &at)) {
            if load.frame == Frame::Body {
                let turned = |v: Vector| pose.rotation.map(|row| (0..3).map(|k| row[k] * v[k]).sum());
                (load.force, load.moment) = (turned(load.force), load.moment.map(turned));
                load.frame = Frame::World;
            }
        }
        let other = solve_rod(&dead.rod(), &[]);
        let apart = (0..3).map(|k| (other.p_tip[k] - equilibrium.p_tip[k]).abs()).fold(0.0, f64::max);
        assert!(other.status.is_success() && apart < 1e-9, "{:?}: {apart:.1e}", other.status);
        assert!(energy(&rod, equilibrium.m0).is_none() && energy(&dead.rod(), other.m0).is_none());
    }
}

#[test]
fn its_derivatives_are_those_of_neighbours() {
    let names = [
        "loads.a.force",
        "loads.a.moment",
        "loads.b.force",
        "loads.b.moment",
        "loads.c.force.y",
        "loads.c.moment",
        "loads.d.force.z",
        "loads.d.moment",
        "loads.tip_force",
        "loads.tip_moment",
        "tube.length",
        "ring.length",
        "end.length",
        "tip.length",
        "end.stiffness.bending",
        "base.rotation.x",
        "insertion",
    ];
    let scene = random(&mut Random(5));
    let wrt: Vec<Parameter> = names.iter().flat_map(|name| Parameter::parse(&scene, name).expect(name)).collect();
    let plan_all = plan(&scene, &wrt, Precision::F64);
    let cpu = solve(&plan_all, &mut Cpu::new(&plan_all, Precision::F64).expect("supported"));
    let reference = solve(&plan_all, &mut Reference::new(&plan_all));
    assert!(cpu.status(0).is_success() && reference.status(0).is_success());
    for (k, parameter) in wrt.iter().enumerate() {
        let value = parameter.get(&scene);
        let size = match parameter.unit() {
            "N" => 6e-3,
            "N·m" => 4e-4,
            "N·m²" => value,
            "rad" => 1.0,
            _ => 0.02,
        };
        let tip = |by: f64| {
            let mut moved = scene.clone();
            parameter.set(&mut moved, value + by * size).expect("a value");
            let plan = plan(&moved, &[], Precision::F64);
            let found = solve(&plan, &mut Reference::new(&plan));
            (found.vector(0, Quantity::TipPosition), found.tip_rotation(0))
        };
        let (low, high) = (tip(-1e-4), tip(1e-4));
        let mut slope: Vec<f64> = (0..3).map(|axis| (high.0[axis] - low.0[axis]) / (2e-4 * size)).collect();
        let matrix = |rows: [Vector; 3]| Matrix3::from_fn(|row, col| rows[row][col]);
        // The rotation is small: its vector is the antisymmetric part of the matrix.
        let turned = matrix(high.1) * matrix(low.1).transpose();
        let turn = [turned[(2, 1)] - turned[(1, 2)], turned[(0, 2)] - turned[(2, 0)], turned[(1, 0)] - turned[(0, 1)]];
        let turn = turn.map(|x| 0.5 * x);
        slope.extend(turn.iter().map(|x| x * 0.06 / (2e-4 * size)));
        let length = slope.iter().map(|x| x * x).sum::<f64>().sqrt();
        for (engine, found) in [("cpu", &cpu), ("reference", &reference)] {
            for (axis, slope) in slope.iter().enumerate() {
                let column = found.derivative(0, k, axis) * if axis < 3 { 1.0 } else { 0.06 };
                let error = (column - slope).abs() / length;
                assert!(error < 1e-5, "{engine}, {}, {axis}: {column:e}, {slope:e}", parameter.name(&scene));
            }
        }
    }
}

#[test]
fn a_gpu_leaves_them_to_the_cpu_and_says_so() {
    let scene = parse(&format!("[[load]]\nname = \"turn\"\nat = 0.2\nmoment = [0, 0.1, 0]\n{}", beam(LENGTH)));
    for request in [EngineRequest::default(), EngineRequest::default().backend(Some(BackendKind::Gpu))] {
        let engine = request.choose_for(&scene, 1e-4).expect("an engine");
        assert_eq!(engine.kind(), BackendKind::Cpu);
        assert!(engine.reason().contains("a moment acts inside"), "{}", engine.reason());
    }
}
