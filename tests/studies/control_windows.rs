//! Points of a trajectory that are solved together: the same inputs as a point at a time, and nothing crossed unseen.

use crate::common::root;
use crate::controllers::{circle, cpu, inputs, p6};
use rodsweep::backend::{Backend, BackendError, Precision};
use rodsweep::cpu::{Cpu, InstructionSet};
use rodsweep::input::{parse_scene, read_trajectory};
use rodsweep::model::{Parameter, Plan, PlanOptions, Quantity, Scene, Stepper};
use rodsweep::spec::{ControlInput, Target};
use rodsweep::study::{ControlOptions, Controller, Outcome, TargetResult};
use std::path::Path;

/// Inputs differ by less, over half their range: what is left over where a point counts as settled, over a lap.
const SAME: f64 = 200.0 * SETTLED;
const SETTLED: f64 = 1e-7;
const LIMIT: f64 = 0.3;

fn narrow(plan: &Plan) -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(Cpu::with_instruction_set(plan, Precision::F64, InstructionSet::for_one())?))
}

/// Together and a point at a time.
fn both(
    scene: &Scene,
    inputs: &[ControlInput],
    options: ControlOptions,
    targets: &[Target],
) -> (Vec<TargetResult>, Vec<TargetResult>) {
    let control = Controller::new(scene, inputs, options, Stepper::Dop853, &mut cpu).expect("a controller");
    let mut control = control.for_trajectories(&mut cpu, &mut narrow).expect("a controller");
    let together = control.follow(targets).expect("points");
    (together, control.follow_singly(targets).expect("points"))
}

/// The largest difference of an input, over half its range.
fn assert_same(name: &str, inputs: &[ControlInput], together: &[TargetResult], singly: &[TargetResult]) {
    let mut most = 0.0f64;
    for (k, (a, b)) in together.iter().zip(singly).enumerate() {
        assert_eq!((a.outcome, a.from_rest), (b.outcome, b.from_rest), "{name} {k}: {a:?} {b:?}");
        for (input, (a, b)) in inputs.iter().zip(a.inputs.iter().zip(&b.inputs)) {
            most = most.max((a - b).abs() / (0.5 * (input.high - input.low)));
        }
    }
    eprintln!("{name}: inputs differ by {most:.1e}");
    assert!(most < SAME, "{name}: {most:e}");
}

fn number(points: &[TargetResult], outcome: Outcome) -> usize {
    points.iter().filter(|point| point.outcome == outcome).count()
}

#[test]
fn trajectories_are_the_same_together_and_singly() {
    let scene = p6();
    for name in ["circle", "lemniscate", "rectangle", "butterfly"] {
        let file = root().join(format!("sweeps/trajectories/{name}.toml"));
        let trajectory = read_trajectory(&file, &scene).expect("a trajectory");
        let (inputs, targets) = (trajectory.inputs, trajectory.targets);
        let options = ControlOptions::default().with_coordinates(trajectory.coordinates);
        let (together, singly) = both(&scene, &inputs, options, &targets);
        assert_same(name, &inputs, &together, &singly);
        assert_eq!(number(&together, Outcome::Reached), targets.len(), "{name}");
    }
}

#[test]
fn inputs_change_as_little_as_possible() {
    let scene = p6();
    let inputs = inputs(&scene, &[("coil.current", -LIMIT, LIMIT)]);
    let options = ControlOptions::default().with_coordinates([true, true, false]);
    let (together, _) = both(&scene, &inputs, options, &circle([0.0, -0.04, 0.0], 0.01, 100));
    let axes: Vec<Vec<Parameter>> = inputs.iter().map(|input| vec![input.parameter]).collect();
    let wrt: Vec<Parameter> = inputs.iter().map(|input| input.parameter).collect();
    let plan = Plan::new(&scene, &axes, &wrt, PlanOptions::default()).expect("a plan");
    let batch = plan.batch(together.len(), |i, row| row.copy_from_slice(&together[i].inputs));
    let solutions = cpu(&plan).expect("an engine").solve(&batch).expect("solutions");
    // What moves neither x nor y is at right angles to both rows of the Jacobian, and to every change.
    for k in 4..together.len() {
        let row = |row: usize| -> [f64; 3] { std::array::from_fn(|input| solutions.derivative(k, input, row)) };
        let (a, b) = (row(0), row(1));
        let unnoticed = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let change: [f64; 3] = std::array::from_fn(|input| together[k].inputs[input] - together[k - 1].inputs[input]);
        let size = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let along = (0..3).map(|i| unnoticed[i] * change[i]).sum::<f64>() / size(unnoticed);
        assert!(along.abs() < 2.0 * SETTLED * LIMIT, "{k}: {along:e} of {:e}", size(change));
    }
}

#[test]
fn what_is_flagged_singly_is_flagged_together() {
    let scene = p6();
    let plane = ControlOptions::default().with_coordinates([true, true, false]);
    // In and out of the limits.
    let limited = inputs(&scene, &[("coil.current", -0.05, 0.05)]);
    let (together, singly) = both(&scene, &limited, plane, &circle([0.0, -0.04, 0.0], 0.01, 120));
    assert_same("beyond limits", &limited, &together, &singly);
    assert!(number(&together, Outcome::Reached) > 10 && number(&together, Outcome::AtLimit) > 10);
    // In and out of the reach of a longer rod.
    let longer = inputs(&scene, &[("coil.current", -LIMIT, LIMIT), ("insertion", 0.085, 0.1)]);
    let targets = circle([0.0, -0.04, 0.082], 0.012, 160);
    let (together, singly) = both(&scene, &longer, ControlOptions::default(), &targets);
    assert_same("insertion", &longer, &together, &singly);
    assert!(number(&together, Outcome::Reached) > 10, "{}", number(&together, Outcome::Reached));
    // Far apart: a lap of a few points, none of them a small step from the last.
    let far = inputs(&scene, &[("coil.current", -LIMIT, LIMIT)]);
    let (together, singly) = both(&scene, &far, plane, &circle([0.0, -0.03, 0.0], 0.03, 7));
    assert_same("far apart", &far, &together, &singly);
}

/// A magnet at the tip in a field against it: from one current on, the rod is stable to either side only.
const BISTABLE: &str = r#"
name = "bistable"
[field]
flux_density = [0, 0, "3 T"]
[[segment]]
name = "rod"
kind = "flexible"
length = "100 mm"
stiffness = { bending = "6e-5 N·m²", torsion = "5e-5 N·m²" }
[[segment]]
name = "coil"
kind = "rigid"
length = "5 mm"
coil = { turns = [100, 100, 100], area = ["10 mm^2", "10 mm^2", "10 mm^2"], current = [-0.2, 0, -0.24] }
"#;

#[test]
fn a_fold_is_not_crossed_unseen() {
    let scene = parse_scene(Path::new("bistable.toml"), BISTABLE).expect("a scene");
    // The torque of x tips the rod over; beyond the fold of the one side there is only the other.
    let inputs = inputs(&scene, &[("coil.current.x", -0.4, 0.4)]);
    let axes = vec![vec![inputs[0].parameter]];
    let plan = Plan::new(&scene, &axes, &[], PlanOptions { steps: 24, ..PlanOptions::default() }).expect("a plan");
    let values: Vec<f64> = (0..80).map(|k| -0.2 + 0.005 * f64::from(k)).collect();
    let batch = plan.batch(values.len(), |i, row| row[0] = values[i]);
    let solutions = cpu(&plan).expect("an engine").solve(&batch).expect("solutions");
    let tips: Vec<[f64; 3]> = (0..values.len())
        .filter(|row| solutions.status(*row).is_success())
        .map(|row| solutions.vector(row, Quantity::TipPosition))
        .collect();
    let targets: Vec<Target> = tips.iter().map(|position| Target::at(*position)).collect();
    let side = |tip: &[f64; 3]| tip[0].hypot(tip[1]) * (tip[0] + tip[1]).signum();
    let jump = tips.windows(2).map(|pair| (side(&pair[1]) - side(&pair[0])).abs()).fold(0.0, f64::max);
    assert!(jump > 0.03, "no jump: {jump}");
    let (together, singly) = both(&scene, &inputs, ControlOptions::default(), &targets);
    assert_same("bistable", &inputs, &together, &singly);
    // Tips of the other side are out of reach of a continuous path.
    assert!(number(&together, Outcome::Reached) > 20 && number(&together, Outcome::Reached) < targets.len());
    for (k, pair) in together.windows(2).enumerate() {
        let both = pair.iter().all(|point| point.outcome == Outcome::Reached);
        let moved = (0..3).map(|a| (pair[1].tip[a] - pair[0].tip[a]).powi(2)).sum::<f64>().sqrt();
        assert!(!both || moved < 0.5 * jump, "{k}: {moved} m in a step");
    }
}
