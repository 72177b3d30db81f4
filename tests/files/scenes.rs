//! Scene files that say much: what they mean, and that they read back as they were written.

use crate::common::strategy::some_scenes;
use crate::common::texts::SCENE;
use rodsweep::input::{assign, parse_scene, write_scene};
use rodsweep::model::{Flexible, Node, Parameter, Plan, PlanOptions, Profile, Scene, SegmentKind, Stiffness};
use rodsweep::reference::solve_rod;
use std::path::Path;

const NODES: &str = r#"stiffness = [
  { at = "10 mm", bending = "2e-5 N·m²", torsion = "1.5e-5 N·m²" },
  { at = "60 mm", bending_x = 1e-5, bending_y = 1.2e-5, torsion = 1e-5 },
]
stiffness_shear = ["3 N", 2]
stiffness_axial = "50 N"
linear_density = "2.9e-4 kg/m"
dipole_per_length = [0, 0, "0.1 A·m"]
rest_curvature = [{ at = 0, value = [0, 0, 0] }, { at = "80 mm", value = ["20 1/m", 0, 1] }]
"#;

/// The scene of all tests with another description of its tube.
fn with_tube(description: &str) -> Scene {
    let start = SCENE.find("tube = {").expect("a tube");
    let end = SCENE.rfind("[[segment]]").expect("two segments");
    let text = format!("{}{description}{}", &SCENE[..start], &SCENE[end..]);
    parse_scene(Path::new("x.toml"), &text).expect("a good scene")
}

fn tube(scene: &Scene) -> &Flexible {
    let SegmentKind::Flexible(flexible) = &scene.segments[0].kind else { panic!("{scene:?}") };
    flexible
}

#[test]
fn nodes_shear_stretch_and_magnets_are_read() {
    let scene = with_tube(NODES);
    let flexible = tube(&scene);
    let stiffness =
        vec![Node { at: 0.01, value: [2e-5, 2e-5, 1.5e-5] }, Node { at: 0.06, value: [1e-5, 1.2e-5, 1e-5] }];
    assert_eq!(flexible.stiffness, Stiffness::Nodes(stiffness));
    let curvature = vec![Node { at: 0.0, value: [0.0; 3] }, Node { at: 0.08, value: [20.0, 0.0, 1.0] }];
    assert_eq!(flexible.rest_curvature, Profile::Nodes(curvature));
    assert_eq!((flexible.stiffness_shear, flexible.stiffness_axial), (Some([3.0, 2.0]), Some(50.0)));
    assert_eq!(flexible.dipole_per_length, Some([0.0, 0.0, 0.1]));
    let same = with_tube("stiffness = { bending = 1e-5, torsion = 1e-5 }\nstiffness_shear = \"3 N\"\n");
    assert_eq!(tube(&same).stiffness_shear, Some([3.0; 2]));
}

#[test]
fn what_is_written_reads_back() {
    let scene = with_tube(NODES);
    let text = write_scene(&scene);
    assert_eq!(parse_scene(Path::new("x.toml"), &text).expect(&text), scene);
}

/// A segment shortened behind its last nodes is the same rod when it is written and read, or set on a command line.
#[test]
fn nodes_beyond_a_shorter_segment_are_cut() {
    let mut scene = with_tube(NODES);
    scene.segments[0].length = 0.05;
    let read = parse_scene(Path::new("x.toml"), &write_scene(&scene)).expect("a good scene");
    let mut set = with_tube(NODES);
    assign(&mut set, &["tube.length=50 mm"]).expect("settable");
    assert_eq!(set, read);
    let (before, after) = (solve_rod(&scene.rod(), &[]), solve_rod(&read.rod(), &[]));
    assert!((0..3).all(|k| (before.p_tip[k] - after.p_tip[k]).abs() < 1e-14), "{before:?} {after:?}");
    assert!((before.m0[0] - after.m0[0]).abs() < 1e-14 && before.p_tip[2] != 0.063, "{before:?} {after:?}");
}

#[test]
fn random_scenes_read_back() {
    for scene in some_scenes(300) {
        let mut written = scene.clone();
        written.absorb_insertion();
        let text = write_scene(&scene);
        assert_eq!(parse_scene(Path::new("x.toml"), &text).expect(&text), written, "{text}");
    }
}

/// A sweep along any parameter: the batch's rods are those of its scenes, and so are the rates of its derivatives.
#[test]
fn plans_follow_every_parameter() {
    for scene in some_scenes(60) {
        let all = Parameter::all(&scene);
        let is_rigid = matches!(scene.segments[0].kind, SegmentKind::Rigid(_));
        let all: Vec<_> = all.into_iter().filter(|p| !is_rigid || *p != Parameter::Insertion).collect();
        let mut probe = scene.clone();
        let settable: Vec<_> = all.iter().filter(|p| p.set(&mut probe, p.get(&scene)).is_ok()).collect();
        for parameter in settable {
            let plan = Plan::new(&scene, &[vec![*parameter]], &all, PlanOptions::default()).expect("a plan");
            let value = parameter.get(&scene) * 1.01 + 1e-3 * f64::from(u8::from(parameter.get(&scene) == 0.0));
            let batch = plan.batch(1, |_, row| row[0] = value);
            let moved = plan.sample_scene(&[value]);
            let name = parameter.name(&scene);
            let (mut found, mut expected) = (Vec::new(), Vec::new());
            plan.sample_rod(&batch, 0).write_record(&mut found);
            moved.rod().write_record(&mut expected);
            assert_eq!(found, expected, "{name}\n{}", write_scene(&scene));
            for derivative in &plan.derivatives {
                let by = derivative.parameter;
                let mut rates: Vec<_> = by.chain(&moved).into_iter().filter(|(_, rate)| *rate != 0.0).collect();
                for (slot, entry) in &derivative.terms {
                    let rate = plan.entry(&batch, 0, *entry);
                    let of_slot: Vec<_> = rates.iter().filter(|(other, _)| other == slot).collect();
                    let expected: f64 = of_slot.iter().map(|(_, rate)| rate).sum();
                    assert_eq!(rate, expected, "{} along {name}: {slot:?}\n{}", derivative.name, write_scene(&scene));
                    rates.retain(|(other, _)| other != slot);
                }
                assert!(rates.is_empty(), "{} along {name}: {rates:?}\n{}", derivative.name, write_scene(&scene));
            }
        }
    }
}

/// Every parameter has a name of its own, which means it.
#[test]
fn parameters_are_named() {
    let scene = with_tube(NODES);
    let all = Parameter::all(&scene);
    for parameter in &all {
        let name = parameter.name(&scene);
        assert_eq!(Parameter::parse(&scene, &name).expect(&name), [*parameter], "{name}");
    }
    let group = |name: &str| Parameter::parse(&scene, name).expect(name).len();
    assert_eq!(group("tube.rest_curvature"), 6);
    assert_eq!(group("tube.rest_curvature.node_2"), 3);
    assert_eq!(group("tube.stiffness.node_1"), 3);
    assert_eq!(group("tube.dipole_per_length"), 3);
    let get = |name: &str| Parameter::parse(&scene, name).expect(name)[0].get(&scene);
    assert_eq!(get("tube.stiffness.node_2.bending_y"), 1.2e-5);
    assert_eq!(get("tube.stiffness_shear.x"), 3.0);
    assert_eq!(get("tube.rest_curvature.node_2.x"), 20.0);
}

/// An insertion is kept as a longer segment whose nodes have moved on.
#[test]
fn insertion_is_written_as_length() {
    let mut scene = with_tube(NODES);
    Parameter::Insertion.set(&mut scene, 0.083).expect("settable");
    let read = parse_scene(Path::new("x.toml"), &write_scene(&scene)).expect("a good scene");
    assert!((read.segments[0].length - 0.07).abs() < 1e-15 && read.inserted == 0.0);
    let Profile::Nodes(nodes) = &tube(&read).rest_curvature else { panic!() };
    assert!((nodes[0].at + 0.01).abs() < 1e-15 && (nodes[1].at - 0.07).abs() < 1e-15, "{nodes:?}");
    let (before, after) = (scene.rod(), read.rod());
    assert_eq!(before.segments.len(), after.segments.len());
    assert!((before.total_length() - after.total_length()).abs() < 1e-15);
}
