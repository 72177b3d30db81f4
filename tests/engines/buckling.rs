//! Straight rods pressed along their axis, with a little force across: where the engines answer, the rod has buckled to the
//! side of that force. Each load step next to the buckling load could lead to the other side.

use crate::common::scenes::flexible;
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{
    Axis, Base, Loads, Parameter, Plan, PlanOptions, Quantity, Scene, Segment, SegmentKind, Solutions, Stiffness,
};
use rodsweep::reference::Reference;
use std::f64::consts::PI;

const LENGTH: f64 = 0.2;
const BENDING: f64 = 1e-5;
/// Loads over the buckling load.
const LOADS: [f64; 12] = [1.3, 1.7, 2.3, 3.1, 5.0, 9.0, 16.0, 27.0, 48.0, 90.0, 150.0, 240.0];
/// Force across over the load.
const ACROSS: [f64; 6] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
const DIRECTIONS: [[f64; 2]; 3] = [[1.0, 0.0], [-1.0, 0.0], [0.6, -0.8]];

fn scene() -> Scene {
    let stiffness = Stiffness::Direct { bending_x: BENDING, bending_y: BENDING, torsion: 0.8 * BENDING };
    let rod =
        Segment { name: "rod".into(), length: LENGTH, kind: SegmentKind::Flexible(flexible(stiffness, [0.0; 3])) };
    Scene {
        name: "a pressed rod".into(),
        base: Base::default(),
        flux_density: [0.0; 3],
        sources: Default::default(),
        loads: Loads { tip_force: Some([0.0, 0.0, -1.0]), ..Loads::default() },
        segments: vec![rod],
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    }
}

/// Solves all cases; how many of each force across are answered. Fails where a rod buckles to another side.
fn buckled(make: &dyn Fn(&Plan) -> Box<dyn Backend>) -> [usize; ACROSS.len()] {
    let axes: Vec<Vec<Parameter>> = [Axis::X, Axis::Y, Axis::Z].map(|axis| vec![Parameter::TipForce(axis)]).into();
    let plan = Plan::new(&scene(), &axes, &[], PlanOptions { tolerance: 1e-9, steps: 32, ..PlanOptions::default() });
    let plan = plan.expect("a plan");
    let critical = (PI / 2.0 / LENGTH).powi(2) * BENDING;
    let count = LOADS.len() * ACROSS.len() * DIRECTIONS.len();
    let case = |number: usize| {
        let [x, y] = DIRECTIONS[number % DIRECTIONS.len()];
        let rest = number / DIRECTIONS.len();
        let (across, load) = (rest % ACROSS.len(), LOADS[rest / ACROSS.len()] * critical);
        (across, [x * ACROSS[across] * load, y * ACROSS[across] * load, -load])
    };
    let batch = plan.batch(count, |sample, values| values.copy_from_slice(&case(sample.min(count - 1)).1));
    let solutions: Solutions = make(&plan).solve(&batch).expect("solved");
    let mut answered = [0; ACROSS.len()];
    for number in 0..count {
        if !solutions.status(number).is_success() {
            continue;
        }
        let (across, force) = case(number);
        let p = solutions.vector(number, Quantity::TipPosition);
        let (along, beside) = (p[0] * force[0] + p[1] * force[1], p[0] * force[1] - p[1] * force[0]);
        let what = format!("force {force:?} N, tip {p:?} m, {:?}", solutions.status(number));
        assert!(along > 0.0 && beside.abs() < 1e-3 * along, "{what}");
        answered[across] += 1;
    }
    println!("{answered:?} of {} each", count / ACROSS.len());
    answered
}

#[test]
fn lanes_buckle_to_the_side_of_the_force() {
    let make =
        |precision| move |plan: &Plan| Box::new(Cpu::new(plan, precision).expect("available")) as Box<dyn Backend>;
    let found = buckled(&make(Precision::F64));
    assert!(found[..4].iter().all(|count| *count == LOADS.len() * DIRECTIONS.len()), "{found:?}");
    buckled(&make(Precision::F32));
}

#[test]
fn nodes_buckle_to_the_side_of_the_force() {
    let make = |precision| {
        move |plan: &Plan| {
            let lanes = Cpu::new(plan, precision).expect("available");
            Box::new(lanes.by_nodes()) as Box<dyn Backend>
        }
    };
    let found = buckled(&make(Precision::F64));
    assert!(found[..4].iter().all(|count| *count == LOADS.len() * DIRECTIONS.len()), "{found:?}");
    buckled(&make(Precision::F32));
}

#[test]
fn the_reference_buckles_to_the_side_of_the_force() {
    let found = buckled(&|plan| Box::new(Reference::new(plan)));
    assert!(found.iter().all(|count| *count == LOADS.len() * DIRECTIONS.len()), "{found:?}");
}
