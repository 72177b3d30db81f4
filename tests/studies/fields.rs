//! Studies in a field that varies in space: commands for a magnet on an arm, a fit of its strength, one solution in full.

use crate::common::root;
use rodsweep::backend::{Backend, BackendError, BackendKind, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::engines::EngineRequest;
use rodsweep::input::read_scene;
use rodsweep::model::{Axis, MagnetParameter, Parameter, Plan, Scene, Stepper};
use rodsweep::reference::{shape, solve_rod};
use rodsweep::spec::{ControlInput, ObservedPoint, ObservedShape, ObservedShapes, Target, Trajectory};
use rodsweep::study::{ControlOptions, Controller, FitJob, Outcome, Solve};

fn cpu(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Cpu::new(plan, Precision::F64)?))
}

fn arm() -> Scene {
    read_scene(&root().join("sweeps/scenes/arm_magnet.toml")).expect("the scene")
}

fn place(axis: Axis) -> Parameter {
    Parameter::Magnet(0, MagnetParameter::Position(axis))
}

/// The arm brings the tip where the reference finds it with the arm there.
#[test]
fn a_magnet_on_an_arm_leads_the_tip() {
    let scene = arm();
    let inputs = [
        ControlInput { parameter: place(Axis::Y), low: -0.1, high: 0.1 },
        ControlInput { parameter: place(Axis::Z), low: -0.06, high: 0.14 },
    ];
    let at = |k: usize| {
        let (sine, cosine) = (k as f64 * 0.5).sin_cos();
        Target { position: [0.0, 0.003 * cosine, 0.055 + 0.003 * sine], ..Target::default() }
    };
    let targets: Vec<Target> = (0..12).map(at).collect();
    let mut trajectory = Trajectory::new("ring", targets.clone());
    trajectory.coordinates = [false, true, true];
    let options = ControlOptions::of(&trajectory);
    let mut controller = Controller::new(&scene, &inputs, options, Stepper::Dop853, &mut cpu).expect("a controller");
    for point in controller.follow(&targets).expect("points") {
        assert_eq!(point.outcome, Outcome::Reached, "{point:?}");
        let mut there = scene.clone();
        let values = inputs.iter().map(|input| input.parameter).zip(point.inputs.iter().copied());
        Parameter::set_all(&mut there, values).expect("parameters");
        let found = solve_rod(&there.rod(), &[]);
        let off = (1..3).map(|k| (found.p_tip[k] - point.target.position[k]).powi(2)).sum::<f64>().sqrt();
        assert!(found.status.is_success() && off < 1e-6, "{off:e} m off: {:?}", found.status);
    }
}

/// Points along the rod tell how strong the magnet is.
#[test]
fn the_strength_of_a_magnet_comes_back() {
    let truth = arm();
    let known = vec![place(Axis::Y), place(Axis::Z)];
    let of = |places: [f64; 2]| {
        let mut scene = truth.clone();
        Parameter::set_all(&mut scene, known.iter().copied().zip(places)).expect("parameters");
        let rod = scene.rod();
        let at = [0.03, 0.05, scene.total_length()];
        let poses = shape(&rod, &solve_rod(&rod, &[]), &at);
        let point = |(pose, at): (&rodsweep::reference::Pose, f64)| ObservedPoint {
            arc_length: Some(at),
            position: pose.position,
        };
        ObservedShape {
            known: places.to_vec(),
            points: poses.iter().zip(at).map(point).collect(),
            ..ObservedShape::default()
        }
    };
    let shapes = [[0.0, 0.06], [0.04, 0.06], [-0.04, 0.07]].into_iter().map(of).collect();
    let mut start = truth.clone();
    start.sources.magnets[0].strength = 0.8;
    let fit = FitJob::new(start, ObservedShapes { shapes, known: known.clone() });
    let fit = fit.free(&["magnets.arm.strength"]).expect("a parameter").run_on(&mut cpu).expect("a fit");
    assert!(fit.converged && (fit.parameters[0].value - 1.0).abs() < 1e-7, "{fit:?}");
}

#[test]
fn a_solution_is_told_in_full() {
    let solve = |kind| Solve::new(arm()).engine(EngineRequest::of(kind)).run();
    let by_cpu = solve(BackendKind::Cpu).expect("a solution");
    let by_reference = solve(BackendKind::Reference).expect("a solution");
    let off = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max);
    assert!(off(by_cpu.tip_position(), by_reference.tip_position()) < 1e-9);
    let found = solve_rod(&arm().rod(), &[]);
    // From the tip backwards over the rigid segment: what the field does there counts.
    assert!(off(by_cpu.tip_curvature(), found.u_tip) < 1e-6, "{:?} {:?}", by_cpu.tip_curvature(), found.u_tip);
    assert!(off(by_cpu.base_curvature(), found.u0) < 1e-6);
    let explained = by_cpu.explain().expect("a plan").to_string();
    assert!(explained.contains("a field that varies in space") && !explained.contains("chord step"), "{explained}");
    match solve(BackendKind::Gpu) {
        Ok(by_gpu) => assert!(off(by_gpu.tip_position(), by_reference.tip_position()) < 1e-6),
        Err(error) => assert!(error.to_string().contains("no usable GPU"), "{error}"),
    }
}
