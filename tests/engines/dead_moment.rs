//! Rods under a dead moment at the tip: no energy tells their stability, and the path from rest ends where dr/dm0 is singular.

use crate::common::root;
use crate::stretches::{file, loaded, solve};
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::gpu::Gpu;
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::input::{parse_scene, read_scene};
use rodsweep::model::{Plan, PlanOptions, Quantity, Scene, Solutions, Status, Stepper, Vector, rotation_angle};
use rodsweep::reference::{Reference, solve_rod, solve_rod_by_nodes, stability_at};
use rodsweep_bench::judge::{Word, judge};
use serde_json::Value;
use std::f64::consts::PI;

const LENGTH: f64 = 10.0;
const EI: f64 = 1e4;
/// Stiffness in bending about x and y and in torsion.
const STIFFNESS: [Vector; 4] = [[EI; 3], [EI, EI, EI / 1.3], [EI, EI, 0.3 * EI], [0.2 * EI, EI, EI / 1.3]];
/// Largest error of a pose (over the length, or rad), by precision.
const POSE: [(Precision, f64); 2] = [(Precision::F64, 1e-8), (Precision::F32, 1e-4)];

fn scene(stiffness: Vector, moment: Vector, force: Vector, weight: Vector) -> Scene {
    let [x, y, z] = stiffness;
    let text = format!(
        "[loads]\ntip_moment = {moment:?}\ntip_force = {force:?}\ndistributed_force = {weight:?}\n[[segment]]\nname = \"beam\"\n\
         kind = \"flexible\"\nlength = {LENGTH}\nstiffness = {{ bending_x = {x}, bending_y = {y}, torsion = {z} }}\n"
    );
    parse_scene("scene.toml".as_ref(), &text).expect("a scene")
}

fn plan(scene: &Scene, precision: Precision) -> Plan {
    let tolerance = if precision == Precision::F64 { 1e-9 } else { 2e-5 };
    let options = PlanOptions { stepper: Stepper::Dop853, steps: 24, tolerance, ..PlanOptions::default() };
    Plan::new(scene, &[], &[], options).expect("the scene plans")
}

/// The answer of each engine: its name, its solution, the largest error of a pose.
fn engines(scene: &Scene) -> Vec<(String, Solutions, f64)> {
    let mut all = Vec::new();
    for (precision, pose) in POSE {
        let plan = plan(scene, precision);
        let mut engine = Cpu::new(&plan, precision).expect("supported");
        all.push((format!("cpu {precision}"), solve(&plan, &mut engine), pose));
    }
    let plan = plan(scene, Precision::F64);
    all.push(("reference".into(), solve(&plan, &mut Reference::new(&plan)), 1e-9));
    all
}

/// Position over the length, or rotation in rad, whichever differs more.
fn apart(found: &Solutions, position: Vector, rotation: &[Vector; 3]) -> f64 {
    let p = found.vector(0, Quantity::TipPosition);
    let away = (0..3).map(|k| (p[k] - position[k]).powi(2)).sum::<f64>().sqrt() / LENGTH;
    away.max(rotation_angle(&found.tip_rotation(0), rotation))
}

/// Tip of a rod with an end moment about y that turns it by this angle.
fn circle(angle: f64) -> (Vector, [Vector; 3]) {
    let (sin, cos) = angle.sin_cos();
    let position = match angle {
        0.0 => [0.0, 0.0, LENGTH],
        _ => [LENGTH * (1.0 - cos) / angle, 0.0, LENGTH * sin / angle],
    };
    (position, [[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
}

fn check_circle(name: &str, found: &Solutions, (angle, pose): (f64, f64), at: &str) {
    let (position, rotation) = circle(angle);
    assert!(found.status(0).is_success(), "{name}, {at}: {:?}", found.status(0));
    let error = apart(found, position, &rotation);
    assert!(error < pose * (1.0 + angle), "{name}, {at}: {error:.1e}");
    // dr/dm0 = 1 on every circle.
    let margin = found.get(0, Quantity::StabilityMargin);
    assert!((margin - 1.0).abs() < 1e-2, "{name}, {at}: margin {margin}");
    assert_eq!(found.get(0, Quantity::LoadFraction), 1.0, "{name}, {at}");
}

#[test]
fn an_end_moment_rolls_a_rod_up_as_far_as_one_likes() {
    for stiffness in STIFFNESS {
        for k in 0..=20 {
            let angle = 0.2 * PI * f64::from(k);
            let moment = angle * stiffness[1] / LENGTH;
            let at = format!("{stiffness:?}, {angle:.2} rad");
            let scene = scene(stiffness, [0.0, moment, 0.0], [0.0; 3], [0.0; 3]);
            for (name, found, pose) in engines(&scene) {
                check_circle(&name, &found, (angle, pose), &at);
                // With equal stiffness the symmetric part is positive up to half a turn.
                if stiffness == [EI; 3] && k != 5 {
                    let is_definite = found.get(0, Quantity::StabilityIndex) == 0.0;
                    assert_eq!(is_definite, k < 5, "{name}, {at}");
                }
            }
        }
    }
}

#[test]
fn the_gpu_rolls_it_up_as_far() {
    let Some(device) = device_or_skip("a roll-up on the GPU") else { return };
    for stiffness in [STIFFNESS[0], STIFFNESS[2]] {
        for k in [4, 7, 13, 20] {
            let angle = 0.2 * PI * f64::from(k);
            let scene = scene(stiffness, [0.0, angle * stiffness[1] / LENGTH, 0.0], [0.0; 3], [0.0; 3]);
            let plan = plan(&scene, Precision::F32);
            let mut engine = Gpu::new(device.clone(), &plan, Precision::F32).expect("supported");
            check_circle("gpu", &solve(&plan, &mut engine), (angle, 1e-4), &format!("{stiffness:?}, {angle:.2} rad"));
        }
    }
}

#[test]
fn an_axial_couple_twists_a_straight_rod() {
    for (stiffness, moment) in [(STIFFNESS[0], 5000.0), (STIFFNESS[0], -9000.0), (STIFFNESS[1], 6000.0)] {
        let angle = moment * LENGTH / stiffness[2];
        let (sin, cos) = angle.sin_cos();
        let scene = scene(stiffness, [0.0, 0.0, moment], [0.0; 3], [0.0; 3]);
        for (name, found, pose) in engines(&scene) {
            assert!(found.status(0).is_success(), "{name}, {moment}: {:?}", found.status(0));
            let error = apart(&found, [0.0, 0.0, LENGTH], &[[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]);
            assert!(error < 10.0 * pose, "{name}, {moment}: {error:.1e}");
        }
    }
}

/// Against solve_bvp of SciPy, followed from rest in small load steps; `tip_loads.py` beside the numbers is how they were made.
#[test]
fn with_forces_and_weight_rods_are_where_another_program_has_them() {
    let file = root().join("tests/data/reports/02-roll-up/tip_loads.json");
    let value: Value = serde_json::from_str(&std::fs::read_to_string(file).expect("there")).expect("JSON");
    let vector = |value: &Value| -> Vector { serde_json::from_value(value.clone()).expect("three numbers") };
    let cases = value["cases"].as_array().expect("cases");
    assert!(cases.len() > 4);
    let mut beyond = 0;
    for case in cases {
        let [stiffness, force, moment, weight] = ["K", "force", "moment", "weight"].map(|key| vector(&case[key]));
        let rotation: [Vector; 3] = serde_json::from_value(case["rotation"].clone()).expect("nine numbers");
        let scene = scene(stiffness, moment, force, weight);
        for (name, found, pose) in engines(&scene) {
            assert!(found.status(0).is_success(), "{name}, {moment:?}, {force:?}: {:?}", found.status(0));
            let error = apart(&found, vector(&case["tip"]), &rotation);
            assert!(error < 30.0 * pose.max(1e-8), "{name}, {moment:?}, {force:?}: {error:.1e}");
            beyond += usize::from(found.get(0, Quantity::StabilityIndex) > 0.0);
        }
        let by_nodes = solve_rod_by_nodes(&scene.rod(), &[]);
        assert!(by_nodes.status.is_success(), "by nodes, {moment:?}, {force:?}: {:?}", by_nodes.status);
        let away = by_nodes.p_tip.iter().zip(vector(&case["tip"])).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        assert!(away < 1e-6, "by nodes, {moment:?}, {force:?}: {away:.1e}");
    }
    // Several lie where the symmetric part is not positive.
    assert!(beyond > 6, "{beyond}");
}

#[test]
fn the_third_judge_goes_around_the_circle() {
    for stiffness in STIFFNESS {
        for angle in [2.0, 4.5, 9.0] {
            let scene = scene(stiffness, [0.0, angle * stiffness[1] / LENGTH, 0.0], [0.0; 3], [0.0; 3]);
            let Word::Arrives { position, rotation, .. } = judge(&scene.rod()) else {
                panic!("{stiffness:?}, {angle}")
            };
            let (p, turned) = circle(angle);
            let away = (0..3).map(|k| (p[k] - position[k]).powi(2)).sum::<f64>().sqrt() / LENGTH;
            assert!(away < 2e-3 && rotation_angle(&turned, &rotation) < 2e-2, "{stiffness:?}, {angle}: {away:.1e}");
        }
    }
}

/// An upright column buckles at (pi / 2)^2 EI / L^2. A moment of a billionth changes nothing: no path goes on straight.
#[test]
fn next_to_no_moment_a_column_buckles_where_it_would_without() {
    let critical = (0.5 * PI).powi(2) * EI / LENGTH.powi(2);
    for moment in [0.0, 1e-6] {
        for load in [1.05, 2.0] {
            let scene = scene(STIFFNESS[1], [0.0, 0.0, moment], [0.0, 0.0, -load * critical], [0.0; 3]);
            for (name, found, _) in engines(&scene) {
                assert!(!found.status(0).is_success(), "{name}, {moment}, {load}: {:?}", found.status(0));
                let at = found.get(0, Quantity::LoadFraction) * load;
                assert!((at - 1.0).abs() < 0.02, "{name}, {moment}, {load}: {at}");
            }
        }
    }
}

/// Stability of a base moment tells divergence, and no more.
#[test]
fn half_a_turn_further_the_circle_has_not_diverged() {
    let moment = 6.0 * EI / LENGTH;
    let rod = scene(STIFFNESS[0], [0.0, moment, 0.0], [0.0; 3], [0.0; 3]).rod();
    let found = solve_rod(&rod, &[]);
    let stability = stability_at(&rod, found.m0).expect("integrated");
    assert!(found.status.is_success() && found.index > 0 && (found.margin - 1.0).abs() < 1e-9);
    assert_eq!((stability.index, stability.margin > 0.99), (found.index, true));
}

/// Where a path under a moment ends, dr/dm0 is singular, and the third judge does not arrive either.
#[test]
fn a_true_turn_is_a_fold_at_the_same_load() {
    let scene = read_scene(&file("far_step.toml")).expect("the scene reads");
    let found = solve_rod(&scene.rod(), &[]);
    assert_eq!(found.status, Status::Fold);
    assert!((found.load_fraction - 0.4514).abs() < 1e-3, "{}", found.load_fraction);
    let near = solve_rod(&loaded(&scene, 0.9999 * found.load_fraction).rod(), &[]);
    let far = solve_rod(&loaded(&scene, 0.9 * found.load_fraction).rod(), &[]);
    assert!(near.status.is_success() && near.margin < 0.1, "{:?} {}", near.status, near.margin);
    assert!(far.margin > 3.0 * near.margin, "{} {}", far.margin, near.margin);
    match judge(&scene.rod()) {
        Word::Ends { load } => assert!((load - found.load_fraction).abs() < 1e-2, "{load}"),
        word => assert_eq!(word, Word::Unsure),
    }
}

/// Rods under a tip moment, wound by many radians or limp, whose paths end in a fold. Newton's steps shrink by half for a while beyond it:
/// multiple shooting once took that for arrival, and went on to another branch. On the limp rod a load step led over the gap at once:
/// both of its ends are regular, and far from singular.
#[test]
fn no_wound_rod_is_led_past_its_fold() {
    for name in ["wound-past-a-fold", "wound-past-a-fold-2", "limp-past-a-fold"] {
        let scene = read_scene(&root().join(format!("tests/data/found/{name}.toml"))).expect("the scene reads");
        for steps in [4, 8, 16] {
            let plan = Plan::new(&scene, &[], &[], PlanOptions { steps, ..PlanOptions::default() }).expect("a plan");
            for precision in [Precision::F64, Precision::F32] {
                let mut engine = Cpu::new(&plan, precision).expect("instructions of this machine");
                let solutions = engine.solve(&plan.batch(1, |_, _| {})).expect("solved");
                assert!(!solutions.status(0).is_success(), "{name}, {steps} steps: {}", solutions.status(0).name());
            }
        }
    }
}

/// A limp rod whose symmetric part loses its sign at 92.59 % of the load, and whose path comes near a fold at 92.61 % without one. The
/// reference once ended at the first, and the judge, on too few elements, at the second.
#[test]
fn limp_rods_go_on_next_to_a_cusp() {
    let scene = read_scene(&root().join("tests/data/found/limp-next-to-a-cusp.toml")).expect("the scene reads");
    let (rod, length) = (scene.rod(), scene.rod().total_length());
    let expected = solve_rod(&rod, &[]);
    assert!(expected.status.is_success(), "{}", expected.status.name());
    let plan = Plan::new(&scene, &[], &[], PlanOptions::default()).expect("a plan");
    let mut engine = Cpu::new(&plan, Precision::F64).expect("instructions of this machine");
    let solutions = engine.solve(&plan.batch(1, |_, _| {})).expect("solved");
    assert!(solutions.status(0).is_success(), "{}", solutions.status(0).name());
    let tip = solutions.vector(0, Quantity::TipPosition);
    let apart = (0..3).map(|k| (tip[k] - expected.p_tip[k]).powi(2)).sum::<f64>().sqrt();
    assert!(apart <= 1e-6 * length, "{apart:e}");
    assert!(!matches!(judge(&rod), Word::Ends { .. }));
}
