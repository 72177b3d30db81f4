//! What a thread holds of an interval.

use super::super::path::follow_nodes;
use super::super::responses::tip_response;
use super::super::state::{Nodes, What};
use super::chain::Column;
use super::{L, lane};
use crate::lanes::lane::Lane;
use crate::lanes::problem::{Problem, Workspace};
use crate::lanes::program::{Inputs, Program};
use crate::lanes::rod::Rod;
use crate::lanes::terms::ProgramTerms;
use crate::model::path::NODE_PACES;
use crate::model::{Parameter, Plan, PlanOptions};

/// Numbers of an interval in one lane, rows included.
const NUMBERS: usize = 200;

#[test]
fn an_interval_takes_few_numbers() {
    let none = [0.0; 3];
    let taut = Column { stiffness: [1.0, 1.0, 0.8], rest: none, force: [1.0, 0.0, 2500.0], field: none, dipole: none };
    let scene = taut.scene();
    let names = ["loads.tip_force", "rod.stiffness.bending", "rod.stiffness.torsion"];
    let wrt: Vec<Parameter> =
        names.iter().flat_map(|name| Parameter::parse(&scene, name).expect("parameters")).collect();
    let plan = Plan::new(&scene, &[], &wrt, PlanOptions::default()).expect("a plan");
    let (token, one) = (pulp::Scalar::new(), lane(1.0));
    let mut program = Program::new(&plan, f64::EPSILON);
    program.terms = ProgramTerms::EVERY;
    assert!(!program.forward && program.collects());
    let inputs = Inputs { data: &[], stride: 1, offset: 0 };
    let (mut rod, mut workspace) = (Rod::new(token), Workspace::new(token, &program));
    rod.load(&program, token, &inputs);
    let problem = Problem { program: &program, inputs, rod: &rod };
    let mut nodes = Nodes::<L>::new(token, &program);
    nodes.mesh.cut(&problem, 1.0);
    nodes.resolve(plan.options.stepper.tableau(), 1);
    let end = follow_nodes(&problem, &mut nodes, NODE_PACES[1], lane(0.0).lt(one), &mut workspace);
    assert!(L::any(end.reached));
    nodes.pass(&problem, one, What::Drives, &mut workspace);
    nodes.newton_step(&problem, one);
    tip_response(&mut nodes);
    let bytes = size_of_val(&nodes.nodes[..])
        + size_of_val(&nodes.accepted[..])
        + size_of_val(&nodes.before[..])
        + size_of_val(&nodes.earlier[..])
        + size_of_val(&nodes.transfers[..])
        + size_of_val(&nodes.defects[..])
        + size_of_val(&nodes.drives[..])
        + size_of_val(&nodes.traces[..])
        + size_of_val(&nodes.elimination.pivots[..])
        + size_of_val(&nodes.changes[..])
        + size_of_val(&nodes.by_moment[..]);
    let intervals = nodes.mesh.intervals.len();
    let numbers = bytes / size_of::<f64>() / intervals;
    println!("{numbers} numbers for each of {intervals} intervals");
    assert!(intervals > 40 && numbers <= NUMBERS, "{numbers} numbers for each of {intervals} intervals");
}
