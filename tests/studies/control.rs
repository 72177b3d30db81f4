//! Currents for trajectories and targets: reached where that is possible, flagged where it is not.

use crate::common::root;
use crate::controllers::{circle, cpu, inputs, p6};
use rodsweep::backend::{Backend, BackendError, BackendKind, Precision};
use rodsweep::cpu::{Cpu, InstructionSet};
use rodsweep::engines::EngineRequest;
use rodsweep::gpu::Gpu;
use rodsweep::gpu::testing::device_or_skip;
use rodsweep::input::read_trajectory;
use rodsweep::model::{Parameter, Plan, PlanOptions, Quantity, Scene, Stepper};
use rodsweep::reference::solve_rod;
use rodsweep::spec::{ControlInput, Redundancy, Target, Trajectory};
use rodsweep::study::{
    CommandedPath, ControlJob, ControlOptions, Controller, Imperfection, MakeEngine, Outcome, TargetOptions,
    TargetResult, simulate,
};
use rodsweep_bench::random::Random;

/// What the tip may be off by at a point that is called reached [m].
const TIP: f64 = 1e-6;
const LIMIT: f64 = 0.3;

/// One sample at a time.
fn narrow(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Cpu::with_instruction_set(plan, Precision::F64, InstructionSet::Scalar)?))
}

/// The same, columns side by side in its lanes.
fn alone(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Cpu::with_instruction_set(plan, Precision::F64, InstructionSet::for_one())?))
}

fn control(scene: &Scene, inputs: &[ControlInput], options: ControlOptions) -> Controller {
    Controller::new(scene, inputs, options, Stepper::Dop853, &mut narrow).expect("a controller")
}

/// Distance from the target in some coordinates, of the tip that the reference finds from rest with the same inputs.
fn off_by_reference(scene: &Scene, inputs: &[ControlInput], point: &TargetResult, coordinates: [bool; 3]) -> f64 {
    let mut scene = scene.clone();
    let values = inputs.iter().map(|input| input.parameter).zip(point.inputs.iter().copied());
    Parameter::set_all(&mut scene, values).expect("parameters");
    let equilibrium = solve_rod(&scene.rod(), &[]);
    assert!(equilibrium.status.is_success(), "{:?}", equilibrium.status);
    let square = |a: usize| (equilibrium.p_tip[a] - point.target.position[a]).powi(2);
    (0..3).filter(|a| coordinates[*a]).map(square).sum::<f64>().sqrt()
}

fn assert_within_limits(inputs: &[ControlInput], points: &[TargetResult]) {
    for (k, point) in points.iter().enumerate() {
        for (value, input) in point.inputs.iter().zip(inputs) {
            assert!((input.low..=input.high).contains(value), "point {k}: {value} beyond {input:?}");
        }
    }
}

#[test]
fn the_four_trajectories_are_followed() {
    let scene = p6();
    for name in ["circle", "lemniscate", "rectangle", "butterfly"] {
        let file = root().join(format!("sweeps/trajectories/{name}.toml"));
        let trajectory = read_trajectory(&file, &scene).expect("a trajectory");
        assert_eq!(trajectory.coordinates, [true, true, false], "{name}");
        let (inputs, targets) = (trajectory.inputs.clone(), trajectory.targets.clone());
        assert_eq!((inputs.len(), targets.len()), (3, 200));
        let options = ControlOptions::of(&trajectory);
        let mut quick = control(&scene, &inputs, options).for_trajectories(&mut cpu, &mut alone).expect("engines");
        let ways = [control(&scene, &inputs, options).follow(&targets), quick.follow_singly(&targets)];
        for points in ways.map(|points| points.expect("points")) {
            assert_within_limits(&inputs, &points);
            let mut worst = 0.0f64;
            for (k, point) in points.iter().enumerate() {
                assert_eq!(point.outcome, Outcome::Reached, "{name} {k}: {point:?}");
                assert!(point.from_rest && point.margin > 0.3, "{name} {k}: {point:?}");
                worst = worst.max(off_by_reference(&scene, &inputs, point, trajectory.coordinates));
            }
            eprintln!("{name}: at most {worst:.1e} m off");
            // What the integration may add is a small share.
            assert!(worst < 1.1 * options.tolerance, "{name}: {worst:e} m");
            let iterations: usize = points.iter().map(|point| point.iterations).sum();
            assert!(iterations < 4 * points.len(), "{name}: {iterations} iterations");
        }
    }
}

#[test]
fn shapes_have_their_size_and_the_rectangle_its_corners() {
    let scene = p6();
    let points = |name: &str| -> Vec<[f64; 2]> {
        let file = root().join(format!("sweeps/trajectories/{name}.toml"));
        let trajectory = read_trajectory(&file, &scene).expect("a trajectory");
        trajectory.targets.iter().map(|target| [target.position[0], target.position[1] + 0.04]).collect()
    };
    for (name, width, height) in
        [("circle", 0.01, 0.01), ("lemniscate", 0.01, 0.01 / 8f64.sqrt()), ("rectangle", 0.009, 0.006)]
    {
        let most = |axis: usize| points(name).iter().map(|point| point[axis].abs()).fold(0.0, f64::max);
        assert!((most(0) - width).abs() < 1e-5 && (most(1) - height).abs() < 1e-5, "{name}: {} {}", most(0), most(1));
    }
    let butterfly = points("butterfly").iter().map(|point| point[0].abs()).fold(0.0, f64::max);
    assert!((butterfly - 0.01).abs() < 2e-5, "{butterfly}");
    let rectangle = points("rectangle");
    for corner in [[0.009, 0.006], [-0.009, 0.006], [-0.009, -0.006], [0.009, -0.006]] {
        let near = |point: &&[f64; 2]| (point[0] - corner[0]).hypot(point[1] - corner[1]) < 1e-12;
        assert_eq!(rectangle.iter().filter(near).count(), 1, "{corner:?}");
    }
    // Neighbours are neighbours: no shape jumps.
    for name in ["circle", "lemniscate", "rectangle", "butterfly"] {
        let points = points(name);
        for (k, point) in points.iter().enumerate() {
            let next = points[(k + 1) % points.len()];
            assert!((point[0] - next[0]).hypot(point[1] - next[1]) < 1.5e-3, "{name} {k}");
        }
    }
}

/// No permitted inputs nearby bring the tip nearer than the answer; returns how many were tried with success.
fn assert_locally_best(scene: &Scene, inputs: &[ControlInput], point: &TargetResult, coordinates: [bool; 3]) -> usize {
    let axes: Vec<Vec<Parameter>> = inputs.iter().map(|input| vec![input.parameter]).collect();
    let plan = Plan::new(scene, &axes, &[], PlanOptions { steps: 24, ..PlanOptions::default() }).expect("a plan");
    let mut random = Random(5);
    let tries: Vec<Vec<f64>> = (0..400)
        .map(|k| {
            let reach = 0.1 * 0.97f64.powi(k);
            let of = |(value, input): (&f64, &ControlInput)| {
                let range = input.high - input.low;
                (value + reach * range * random.within(-1.0, 1.0)).clamp(input.low, input.high)
            };
            point.inputs.iter().zip(inputs).map(of).collect()
        })
        .collect();
    let batch = plan.batch(tries.len(), |i, row| row.copy_from_slice(&tries[i]));
    let solutions = cpu(&plan).expect("an engine").solve(&batch).expect("solutions");
    let solved: Vec<usize> = (0..tries.len()).filter(|row| solutions.status(*row).is_success()).collect();
    for row in &solved {
        let tip = solutions.vector(*row, Quantity::TipPosition);
        let square = |a: usize| (tip[a] - point.target.position[a]).powi(2);
        let distance = (0..3).filter(|a| coordinates[*a]).map(square).sum::<f64>().sqrt();
        assert!(distance > 0.999 * point.residual, "{:?}: {distance} beats {point:?}", tries[*row]);
    }
    solved.len()
}

#[test]
fn limits_hold_and_the_nearest_permitted_point_is_flagged() {
    let scene = p6();
    let inputs = inputs(&scene, &[("coil.current", -0.05, 0.05)]);
    let coordinates = [true, true, false];
    let options = ControlOptions::default().with_coordinates(coordinates);
    let points = control(&scene, &inputs, options).follow(&circle([0.0, -0.04, 0.0], 0.01, 60)).expect("points");
    assert_within_limits(&inputs, &points);
    let held: Vec<&TargetResult> = points.iter().filter(|point| point.outcome == Outcome::AtLimit).collect();
    assert!(held.len() > 10, "{:?}", points.iter().map(|point| point.outcome).collect::<Vec<_>>());
    assert!(points.iter().any(|point| point.outcome == Outcome::Reached));
    for point in held.iter().step_by(5) {
        assert!(point.residual > 1e-4);
        assert!(point.inputs.iter().any(|value| value.abs() == 0.05), "{point:?}");
        assert!(assert_locally_best(&scene, &inputs, point, coordinates) > 200);
    }
}

#[test]
fn a_point_off_the_reachable_surface_is_flagged_with_its_distance() {
    let scene = p6();
    let inputs = inputs(&scene, &[("coil.current", -LIMIT, LIMIT)]);
    // On the surface z is about 82 mm here.
    let mut control = control(&scene, &inputs, ControlOptions::default());
    let points = control.follow(&circle([0.0, -0.04, 0.087], 0.002, 12)).expect("points");
    for point in &points {
        assert_eq!(point.outcome, Outcome::Unreachable, "{point:?}");
        assert!(point.residual > 1e-3 && point.residual < 6e-3, "{point:?}");
        assert!(assert_locally_best(&scene, &inputs, point, [true; 3]) > 200);
    }
}

#[test]
fn insertion_makes_all_three_coordinates_reachable() {
    let scene = p6();
    let inputs = inputs(&scene, &[("coil.current", -LIMIT, LIMIT), ("insertion", 0.085, 0.11)]);
    let options = ControlOptions::default();
    let points = control(&scene, &inputs, options).follow(&circle([0.0, -0.04, 0.082], 0.008, 80)).expect("points");
    assert_within_limits(&inputs, &points);
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for point in &points {
        assert_eq!(point.outcome, Outcome::Reached, "{point:?}");
        assert!(off_by_reference(&scene, &inputs, point, [true; 3]) < TIP, "{point:?}");
        (least, most) = (least.min(point.inputs[3]), most.max(point.inputs[3]));
    }
    assert!(most - least > 2e-3, "insertion moves from {least} to {most} m");
}

/// Tips and tangents of random permitted inputs.
fn reachable(scene: &Scene, inputs: &[ControlInput], share: f64, count: usize, with_tangent: bool) -> Vec<Target> {
    let axes: Vec<Vec<Parameter>> = inputs.iter().map(|input| vec![input.parameter]).collect();
    let plan = Plan::new(scene, &axes, &[], PlanOptions { steps: 24, ..PlanOptions::default() }).expect("a plan");
    let mut random = Random(11);
    let rows: Vec<Vec<f64>> = (0..count)
        .map(|_| {
            let of = |input: &ControlInput| {
                0.5 * (input.low + input.high) + share * 0.5 * (input.high - input.low) * random.within(-1.0, 1.0)
            };
            inputs.iter().map(of).collect()
        })
        .collect();
    let batch = plan.batch(count, |i, row| row.copy_from_slice(&rows[i]));
    let solutions = cpu(&plan).expect("an engine").solve(&batch).expect("solutions");
    let target = |row: usize| Target {
        position: solutions.vector(row, Quantity::TipPosition),
        tangent: with_tangent.then(|| solutions.vector(row, Quantity::TipTangent)),
        ..Target::default()
    };
    (0..count).filter(|row| solutions.get(*row, Quantity::StabilityMargin) > 0.5).map(target).collect()
}

#[test]
fn tangents_are_reached_where_they_can_be() {
    let scene = p6();
    let inputs = inputs(&scene, &[("coil.current", -LIMIT, LIMIT), ("insertion", 0.085, 0.11)]);
    let targets = reachable(&scene, &inputs, 0.3, 40, true);
    assert!(targets.len() > 30);
    let mut control = control(&scene, &inputs, ControlOptions::default());
    let points = control.reach(&targets, &TargetOptions::default(), &mut |_| {}).expect("points");
    for point in &points {
        assert_eq!(point.outcome, Outcome::Reached, "{point:?}");
        let tangent = point.target.tangent.expect("a tangent");
        let angle = (0..3).map(|a| (point.tangent[a] - tangent[a]).powi(2)).sum::<f64>().sqrt();
        assert!(angle < 2e-6, "{angle} rad: {point:?}");
        assert!(off_by_reference(&scene, &inputs, point, [true; 3]) < TIP, "{point:?}");
    }
    // The same places with other tangents cannot be.
    let turned: Vec<Target> = targets
        .iter()
        .map(|target| Target { tangent: target.tangent.map(|t| [t[0], -t[1], t[2]]), ..*target })
        .filter(|target| target.tangent.is_some_and(|t| t[1].abs() > 0.2))
        .collect();
    assert!(turned.len() > 5, "{}", turned.len());
    let points = control.reach(&turned, &TargetOptions::default(), &mut |_| {}).expect("points");
    for point in &points {
        assert!(point.outcome != Outcome::Reached && point.residual > 1e-5, "{point:?}");
    }
}

#[test]
fn targets_are_reached_together_in_any_order_and_precision() {
    let scene = p6();
    let inputs = inputs(&scene, &[("coil.current", -LIMIT, LIMIT)]);
    let coordinates = [true, true, false];
    let options = ControlOptions::default().with_coordinates(coordinates);
    // Near the rod's axis the reachable x narrows to nothing, and searches crawl.
    let mut targets = reachable(&scene, &inputs, 0.5, 400, false);
    targets.retain(|target| target.position[1].abs() > 0.01);
    assert!(targets.len() > 200, "{}", targets.len());
    let reach = |targets: &[Target]| {
        let mut control = Controller::new(&scene, &inputs, options, Stepper::Dop853, &mut cpu).expect("a controller");
        control.reach(targets, &TargetOptions::default(), &mut |_| {}).expect("points")
    };
    let points = reach(&targets);
    assert_within_limits(&inputs, &points);
    for point in &points {
        assert_eq!(point.outcome, Outcome::Reached, "{point:?}");
        assert!(point.residual <= options.tolerance);
        if point.from_rest {
            assert!(off_by_reference(&scene, &inputs, point, coordinates) < TIP, "{point:?}");
        }
    }
    assert!(points.iter().filter(|point| point.from_rest).count() * 10 > 9 * points.len());
    let reversed: Vec<Target> = targets.iter().rev().copied().collect();
    for (a, b) in points.iter().zip(reach(&reversed).iter().rev()) {
        assert_eq!((&a.inputs, a.iterations, a.outcome), (&b.inputs, b.iterations, b.outcome));
    }

    let coarse =
        |plan: &Plan| -> Result<Box<dyn Backend>, BackendError> { Ok(Box::new(Cpu::new(plan, Precision::F32)?)) };
    finish_in_f64(&scene, &inputs, options, &targets, Stepper::Dop853, &mut { coarse });
    if device_or_skip("targets on the GPU").is_none() {
        return;
    }
    let mut on_gpu = |plan: &Plan| -> Result<Box<dyn Backend>, BackendError> {
        let device = device_or_skip("targets on the GPU").expect("it was there before");
        Ok(Box::new(Gpu::new(device, plan, Precision::F32)?))
    };
    finish_in_f64(&scene, &inputs, options, &targets, Stepper::Rk4, &mut on_gpu);
}

/// Solves in f32, which is held to what it can do, and goes on in f64.
fn finish_in_f64(
    scene: &Scene,
    inputs: &[ControlInput],
    options: ControlOptions,
    targets: &[Target],
    stepper: Stepper,
    make: &mut MakeEngine,
) {
    let mut control = Controller::new(scene, inputs, options, stepper, make).expect("a controller");
    let tolerance = control.options().tolerance;
    assert!(tolerance > options.tolerance && tolerance < 1e-6, "{tolerance}");
    let mut points = control.reach(targets, &TargetOptions::default(), &mut |_| {}).expect("points");
    let reached = points.iter().filter(|point| point.outcome == Outcome::Reached).count();
    assert!(reached * 100 >= 99 * points.len(), "{} {reached} of {}", control.engine(), points.len());
    let mut fine = Controller::new(scene, inputs, options, Stepper::Dop853, &mut cpu).expect("a controller");
    fine.finish(&mut points).expect("points");
    for point in &points {
        assert_eq!(point.outcome, Outcome::Reached, "{}: {point:?}", control.engine());
        assert!(point.residual <= options.tolerance);
    }
}

#[test]
fn currents_that_the_tip_does_not_need_can_be_saved() {
    let scene = p6();
    let inputs = inputs(&scene, &[("coil.current", -LIMIT, LIMIT)]);
    let targets = circle([0.0, -0.04, 0.0], 0.01, 100);
    let heat = |redundancy: Redundancy| {
        let options = ControlOptions::default().with_coordinates([true, true, false]).with_redundancy(redundancy);
        let points = control(&scene, &inputs, options).follow(&targets).expect("points");
        assert!(points.iter().all(|point| point.outcome == Outcome::Reached && point.from_rest));
        points.iter().flat_map(|point| &point.inputs).map(|current| current * current).sum::<f64>()
    };
    let (change, current) = (heat(Redundancy::LeastChange), heat(Redundancy::LeastCurrent));
    assert!(current < 0.6 * change, "{current} {change}");
}

#[test]
fn a_controller_without_sense_is_refused() {
    let scene = p6();
    let none = Controller::new(&scene, &[], ControlOptions::default(), Stepper::Dop853, &mut cpu);
    assert!(none.err().expect("an error").to_string().contains("at least 1"));
    let turned = inputs(&scene, &[("coil.current", 0.3, -0.3)]);
    let turned = Controller::new(&scene, &turned, ControlOptions::default(), Stepper::Dop853, &mut cpu);
    let text = turned.err().expect("an error").to_string();
    assert!(text.contains("coil.current.x") && text.contains("limit"), "{text}");
    let never = ControlJob::new(p6()).tolerance(0.0).follow(&Trajectory::from(vec![Target::default()]));
    assert!(never.expect_err("an error").to_string().contains("positive tolerance"));
}

#[test]
fn a_job_does_what_its_parts_do() {
    let scene = p6();
    let limits = inputs(&scene, &[("coil.current", -LIMIT, LIMIT)]);
    let mut lap = Trajectory::new("lap", circle([0.0, -0.04, 0.0], 0.01, 60));
    lap.coordinates = [true, true, false];
    lap.tolerance = Some(1e-7);
    let job = ControlJob::new(scene.clone()).engine(EngineRequest::of(BackendKind::Cpu));
    let run = job.clone().input("coil.current=0.3").expect("limits").follow(&lap).expect("a run");
    assert_eq!((run.inputs(), run.options().tolerance, run.missed_count()), (&limits[..], 1e-7, 0));
    // Every current within the same limits is what a job takes that is told nothing.
    assert_eq!(job.follow(&lap).expect("a run").inputs(), run.inputs());
    let mut narrow_too = control(&scene, &limits, *run.options());
    for (of_job, alone) in run.results().iter().zip(narrow_too.follow(&lap.targets).expect("points")) {
        let apart = of_job.inputs.iter().zip(&alone.inputs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-5, "{of_job:?} {alone:?}");
    }
    let table = run.to_json();
    assert_eq!(table["counts"]["reached"], 60);
    let together = job.reach(&lap).expect("a run");
    assert!(together.missed_count() == 0 && !together.is_in_order() && run.is_in_order());
    assert!(job.input("coil.current=0.3").and_then(|job| job.input("coil.current.x=0.1")).is_err());
}

#[test]
fn a_simulated_experiment_says_what_it_is_told() {
    let scene = p6();
    let inputs = inputs(&scene, &[("coil.current", -LIMIT, LIMIT)]);
    let options = ControlOptions::default().with_coordinates([true, true, false]);
    let points = control(&scene, &inputs, options).follow(&circle([0.0, -0.04, 0.0], 0.01, 50)).expect("points");
    let commands: Vec<Vec<f64>> = points.iter().map(|point| point.inputs.clone()).collect();
    let desired: Vec<[f64; 3]> = points.iter().map(|point| point.tip).collect();
    let parameters: Vec<Parameter> = inputs.iter().map(|input| input.parameter).collect();
    let run = |imperfection: Imperfection, seed: u64| {
        let path = CommandedPath { scene: &scene, parameters: &parameters, commands: &commands, desired: &desired };
        simulate(&path, &imperfection, 10, seed, &mut cpu).expect("a simulation")
    };
    // The model itself, seen without noise.
    let same = run(Imperfection::NONE, 1);
    assert!(same.rmse < 1e-8 && same.aligned_rmse < 1e-8 && same.repeatability < 1e-12 && same.lost == 0, "{same:?}");
    // Noise alone: three coordinates, and a mean over ten trials.
    let noise = 3e-4;
    let mut seen_with_noise = Imperfection::NONE;
    seen_with_noise.noise = noise;
    let noisy = run(seen_with_noise, 2);
    assert!((noisy.rmse / (noise * 3f64.sqrt()) - 1.0).abs() < 0.1, "{}", noisy.rmse);
    assert!((noisy.repeatability / (noise * 2.7f64.sqrt()) - 1.0).abs() < 0.1, "{}", noisy.repeatability);
    assert!(noisy.aligned_rmse < noisy.rmse);
    // Another catheter: alignment takes most of the error away, and trials agree better than they are right.
    let other = run(Imperfection::default(), 3);
    assert!(other.rmse > 2.0 * other.aligned_rmse && other.rmse > 2.0 * other.repeatability, "{}", other.rmse);
    assert_eq!(run(Imperfection::default(), 3), other);
    assert_ne!(run(Imperfection::default(), 4).rmse, other.rmse);
}
