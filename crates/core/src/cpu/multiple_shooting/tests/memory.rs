//! What a thread holds of an interval.

use super::chain::Column;
use super::{L, Single, lane};
use crate::cpu::multiple_shooting::path::follow_nodes;
use crate::cpu::multiple_shooting::responses::tip_response;
use crate::cpu::multiple_shooting::state::Purpose;
use crate::cpu::simd::lane::Lane;
use crate::model::tolerances::NODE_PACES;

/// Numbers of an interval in one lane, rows included.
const NUMBERS: usize = 200;

#[test]
fn an_interval_takes_few_numbers() {
    let none = [0.0; 3];
    let taut = Column { stiffness: [1.0, 1.0, 0.8], rest: none, force: [1.0, 0.0, 2500.0], field: none, dipole: none };
    let single = Single::new(&taut.scene(), &["loads.tip_force", "rod.stiffness.bending", "rod.stiffness.torsion"]);
    assert!(!single.program.forward && single.program.collects());
    let (problem, one) = (single.problem(), lane(1.0));
    let (mut nodes, mut workspace) = single.nodes(1.0, 1);
    let end = follow_nodes(&problem, &mut nodes, NODE_PACES[1], lane(0.0).lt(one), &mut workspace);
    assert!(L::any(end.reached));
    nodes.pass(&problem, one, Purpose::Drives, &mut workspace);
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
