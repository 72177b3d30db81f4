//! Control, fit and workspace of a limp wire, whose equilibria are found by nodes.

use crate::common::root;
use crate::controllers::{cpu, inputs};
use rodsweep::backend::{Backend, BackendKind, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::engines::EngineRequest;
use rodsweep::model::{Parameter, Plan, PlanOptions, Quantity, Scene, Status, Stepper};
use rodsweep::reference::{Equilibrium, growth_exponent, shape, solve_rod};
use rodsweep::spec::{ObservedPoint, ObservedShape, ObservedShapes, Target, Trajectory};
use rodsweep::study::workspace::{
    BaseLoad, EngineMap, Inputs, MOST_INPUTS, MapOptions, MeasureOptions, Tip, TipMap, WorkspaceInput, measure,
    shifted_lattice,
};
use rodsweep::study::{ControlOptions, Controller, FitJob, Outcome};
use rodsweep_bench::BenchSpec;

/// Where the tip may be beside the reference's at a point that is called reached [m]: 5e-7 of the length.
const TIP: f64 = 1e-6;
/// What a fit may err by, relative: shapes are without noise, the fit's engine is good to 1e-9 of the length.
const FITTED: f64 = 1e-6;
/// A line through points on a curve is shorter than that, relative.
const LINE: f64 = 0.01;
/// Of the coil, at most [A].
const CURRENT: f64 = 0.15;
/// A growth exponent from which on a single pass in f64 keeps no digits of its columns.
const LIMP: f64 = 20.0;

fn wire() -> Scene {
    let scene = BenchSpec::read(&root().join("sweeps/bench/limp.toml")).expect("a bench file").sweep.scene;
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
    let inputs = inputs(&scene, &[("coil.current", -CURRENT, CURRENT)]);
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
        ObservedShape { known: currents.to_vec(), points: points.collect(), ..ObservedShape::default() }
    };
    let shapes = [[0.1, 0.0, 0.0], [0.0, 0.0, 0.1], [-0.05, 0.0, 0.08]].map(of).into();
    let job =
        FitJob::new(scene, ObservedShapes { shapes, known }).free(&["wire.stiffness.bending"]).expect("a parameter");
    let fit = job.run_on(&mut cpu).expect("a fit");
    assert!(fit.converged, "{fit:?}");
    let fitted = fit.parameters[0].value;
    assert!((fitted / BENDING - 1.0).abs() < FITTED, "{fitted:e}");
}

/// Of the wire, by some components of the current.
fn map(axes: &[&str]) -> (Scene, EngineMap) {
    let scene = wire();
    let input = |axis: &&str| {
        let parameters = Parameter::parse(&scene, &format!("coil.current.{axis}")).expect("a parameter");
        WorkspaceInput { parameters, rates: vec![1.0], low: -CURRENT, high: CURRENT }
    };
    let engine = EngineRequest::of(BackendKind::Cpu).choose_for(&scene, 1e-6).expect("an engine");
    let options = MapOptions { engine, tolerance: 1e-6, steps: None };
    let inputs: Vec<WorkspaceInput> = axes.iter().map(input).collect();
    let map = EngineMap::new(&scene, &inputs, &options).expect("a map");
    (scene, map)
}

fn at(x: f64, z: f64) -> Inputs {
    let mut at = [0.0; MOST_INPUTS];
    (at[0], at[1]) = (x, z);
    at
}

fn distance(a: impl Fn(usize) -> f64, b: impl Fn(usize) -> f64) -> f64 {
    (0..3).map(|k| (a(k) - b(k)).powi(2)).sum::<f64>().sqrt()
}

/// A neighbour is followed from a base moment that says nothing of it: it is found all the same.
#[test]
fn neighbours_of_a_limp_wire_are_found() {
    let (scene, mut map) = map(&["x", "z"]);
    let places: Vec<Inputs> = (0..16).map(|k| at((0.4 * f64::from(k)).cos(), (0.7 * f64::from(k)).sin())).collect();
    let from_rest = map.solve_from_rest(&places).expect("tips");
    let wrong_load = |tip: &Tip| BaseLoad { moment: tip.base.moment.map(|m| 1.2 * m + 1e-6), ..tip.base };
    let wrong = |k: usize| (places[k], wrong_load(&from_rest[(k + 5) % places.len()]));
    let near = map.near(&(0..places.len()).map(wrong).collect::<Vec<_>>()).expect("tips");
    for ((place, tip), other) in places.iter().zip(&near).zip(&from_rest) {
        let bent = with(&scene, "coil.current", &[CURRENT * place[0], 0.0, CURRENT * place[1]]);
        let truth = by_reference(&bent).p_tip;
        for tip in [tip, other] {
            let off = distance(|k| tip.position[k], |k| truth[k]);
            assert!(tip.usable && off < TIP, "{off:e} m: {tip:?}");
        }
    }
}

/// By one current the tip reaches a curve. Its length is that of a line through tips by the reference.
#[test]
fn the_workspace_of_a_limp_wire() {
    const POINTS: usize = 49;
    let (scene, mut map) = map(&["x"]);
    let share = |k: usize| 2.0 * k as f64 / (POINTS - 1) as f64 - 1.0;
    let tip = |k: usize| by_reference(&with(&scene, "coil.current.x", &[CURRENT * share(k)])).p_tip;
    let line: Vec<_> = (0..POINTS).map(tip).collect();
    let truth: f64 = line.windows(2).map(|pair| distance(|k| pair[0][k], |k| pair[1][k])).sum();
    let starts: Vec<Inputs> = (0..POINTS).map(|k| at(share(k), 0.0)).collect();
    let voxels = shifted_lattice(1e-4, 1);
    let found = measure(&mut map, voxels, &starts, MeasureOptions::default()).expect("a workspace");
    let length = found.length.expect("a curve").value;
    assert!((length / truth - 1.0).abs() < LINE, "{length} m, by the reference {truth} m");
    assert!(found.check.expect("a second number").agrees);
}

/// Where stiffness is swept, starts of limp rods alone are left aside.
#[test]
fn starts_are_left_aside_where_they_say_nothing() {
    let scene = wire();
    let axis = Parameter::parse(&scene, "wire.stiffness.bending").expect("a parameter");
    let torsion = Parameter::parse(&scene, "wire.stiffness.torsion").expect("a parameter");
    let current = Parameter::parse(&scene, "coil.current.x").expect("a parameter");
    let options = PlanOptions { steps: 32, ..PlanOptions::default() };
    let plan = Plan::new(&scene, &[axis, torsion, current], &[], options).expect("a plan").with_lone_starts();
    assert_eq!(plan.leaves_starts(), None);
    let stiffnesses = [2e-5, 0.2, 1e-4, 0.05, 4e-5, 0.1];
    let mut batch = plan.batch(stiffnesses.len(), |row, values| {
        (values[0], values[1], values[2]) = (stiffnesses[row], 0.8 * stiffnesses[row], 0.1);
    });
    let truths: Vec<_> = (0..stiffnesses.len()).map(|row| solve_rod(&plan.sample_rod(&batch, row), &[])).collect();
    let is_limp = |row: usize| plan.sample_rod(&batch, row).is_too_limp();
    assert_eq!((0..stiffnesses.len()).filter(|row| is_limp(*row)).count(), 3);
    // Of those the starts are far off.
    let starts: Vec<_> =
        (0..stiffnesses.len()).map(|row| if is_limp(row) { [0.0, 3e-3, 2e-3] } else { truths[row].m0 }).collect();
    starts.into_iter().enumerate().for_each(|(row, m0)| plan.set_lone_start(&mut batch, row, m0));
    let solutions = Cpu::new(&plan, Precision::F64).expect("supported").solve(&batch).expect("solved");
    for (row, truth) in truths.iter().enumerate() {
        let (status, p) = (solutions.status(row), solutions.vector(row, Quantity::TipPosition));
        let off = distance(|k| p[k], |k| truth.p_tip[k]);
        assert!(status.is_success() && off < TIP, "{}: {status:?}, {off:e} m", stiffnesses[row]);
        let by_nodes = status == Status::Ramped;
        assert_eq!(by_nodes, plan.sample_rod(&batch, row).is_too_limp(), "{}: {status:?}", stiffnesses[row]);
    }
}
