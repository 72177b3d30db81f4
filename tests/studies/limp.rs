//! Control and fit of a limp wire, whose equilibria are found by nodes.

use crate::controllers::{cpu, inputs};
use rodsweep::input::parse_scene;
use rodsweep::model::{Parameter, Scene, Stepper};
use rodsweep::reference::{Equilibrium, growth_exponent, shape, solve_rod};
use rodsweep::spec::{ObservedPoint, ObservedShape, ObservedShapes, Target, Trajectory};
use rodsweep::study::{ControlOptions, Controller, FitJob, Outcome};
use std::path::Path;

/// Where the tip may be beside the reference's at a point that is called reached [m]: 5e-7 of the length.
const TIP: f64 = 1e-6;
/// What a fit may err by, relative: shapes are without noise, the fit's engine is good to 1e-9 of the length.
const FITTED: f64 = 1e-6;
/// A growth exponent from which on a single pass in f64 keeps no digits of its columns.
const LIMP: f64 = 20.0;

const WIRE: &str = r#"
[field]
flux_density = [0, "0.05 T", 0]

[loads]
gravity = ["9.81 m/s^2", 0, 0]

[[segment]]
name = "wire"
kind = "flexible"
length = "2 m"
stiffness = { bending = "2e-5 N·m²", torsion = "1.6e-5 N·m²" }
linear_density = "2.9e-4 kg/m"

[[segment]]
name = "coil"
kind = "rigid"
length = "13 mm"
mass = "58 mg"
coil = { turns_area = [[1.4e-3, 0, 0], [0, 1.4e-3, 0], [0, 0, 1.6e-3]], current = [0, 0, 0] }
"#;

fn wire() -> Scene {
    let scene = parse_scene(Path::new("wire.toml"), WIRE).expect("a scene");
    let growth = growth_exponent(&scene.rod());
    assert!(growth > LIMP, "{growth}");
    scene
}

fn with(scene: &Scene, name: &str, values: &[f64]) -> Scene {
    let mut scene = scene.clone();
    let parameters = Parameter::parse(&scene, name).expect("parameters");
    Parameter::set_all(&mut scene, parameters.into_iter().zip(values.iter().copied())).expect("values");
    scene
}

fn by_reference(scene: &Scene) -> Equilibrium {
    let equilibrium = solve_rod(&scene.rod(), &[]);
    assert!(equilibrium.status.is_success(), "{:?}", equilibrium.status);
    equilibrium
}

#[test]
fn a_limp_wire_is_steered() {
    let scene = wire();
    let inputs = inputs(&scene, &[("coil.current", -0.15, 0.15)]);
    let tip = |currents: [f64; 3]| {
        let p = by_reference(&with(&scene, "coil.current", &currents)).p_tip;
        [p[0], p[1], p[2]]
    };
    let targets: Vec<Target> = (0..8)
        .map(|k| {
            let (sine, cosine) = (std::f64::consts::TAU * f64::from(k) / 8.0).sin_cos();
            Target::at(tip([0.08 * cosine, 0.0, 0.06 * sine]))
        })
        .collect();
    let farthest = targets.iter().map(|target| target.position[1].abs()).fold(0.0, f64::max);
    assert!(farthest > 1000.0 * TIP, "{farthest:e} m: the targets are all where the tip rests");
    // It hangs, so that to first order its tip moves along y alone.
    let mut trajectory = Trajectory::new("ring", targets.clone());
    trajectory.coordinates = [false, true, false];
    let options = ControlOptions::of(&trajectory);
    let mut controller = Controller::new(&scene, &inputs, options, Stepper::Dop853, &mut cpu).expect("a controller");
    let points = controller.follow(&targets).expect("points");
    assert_eq!(points.len(), targets.len());
    for (point, target) in points.iter().zip(&targets) {
        assert_eq!(point.outcome, Outcome::Reached, "{point:?}");
        let found = tip([point.inputs[0], point.inputs[1], point.inputs[2]]);
        let off = (found[1] - target.position[1]).abs();
        assert!(off < TIP, "{off:e} m: {point:?}");
    }
}

#[test]
fn stiffness_of_a_limp_wire_comes_back() {
    const BENDING: f64 = 2.4e-5;
    let scene = wire();
    let truth = with(&scene, "wire.stiffness.bending", &[BENDING]);
    let known = Parameter::parse(&scene, "coil.current").expect("parameters");
    let markers = [0.5, 1.0, 1.5, 2.013];
    let of = |currents: [f64; 3]| {
        let bent = with(&truth, "coil.current", &currents);
        let poses = shape(&bent.rod(), &by_reference(&bent), &markers);
        let points = poses.iter().zip(markers);
        let points =
            points.map(|(pose, arc_length)| ObservedPoint { arc_length: Some(arc_length), position: pose.position });
        ObservedShape { known: currents.to_vec(), points: points.collect() }
    };
    let shapes = [[0.1, 0.0, 0.0], [0.0, 0.0, 0.1], [-0.05, 0.0, 0.08]].map(of).into();
    let job =
        FitJob::new(scene, ObservedShapes { shapes, known }).free(&["wire.stiffness.bending"]).expect("a parameter");
    let fit = job.run_on(&mut cpu).expect("a fit");
    assert!(fit.converged, "{fit:?}");
    let fitted = fit.parameters[0].value;
    assert!((fitted / BENDING - 1.0).abs() < FITTED, "{fitted:e}");
}
