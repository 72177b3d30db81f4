//! The stability index against the Hessian of a chain's energy.

use super::chain::{Column, HELICES, LENGTH, helix};
use super::{Random, Single, lane, lanes, matrix, number, numbers};
use crate::cpu::multiple_shooting::interval::Node;
use crate::cpu::multiple_shooting::mesh::Interval;
use crate::cpu::multiple_shooting::state::Purpose;
use crate::cpu::simd::lane::Lane;
use nalgebra::DVector;
use std::collections::BTreeMap;

/// Index by nodes at the equilibrium next to that of a chain; `None` where Newton's method leads elsewhere.
fn index_by_nodes(column: &Column, u: &DVector<f64>) -> Option<usize> {
    let single = Single::new(&column.scene(), &[]);
    let (problem, units, one) = (single.problem(), single.plan.units, lane(1.0));
    let (mut nodes, mut workspace) = single.nodes(0.5, 4);
    let frames = Column::frames(u);
    for interval in &nodes.mesh.intervals {
        let s = match interval {
            Interval::Piece { start, .. } => number(*start) * LENGTH,
            Interval::Rigid { .. } => LENGTH,
        };
        let k = ((s / LENGTH * HELICES as f64) as usize).min(HELICES - 1);
        let h = LENGTH / HELICES as f64;
        let (_, R) = helix(frames[k], Column::curvature(u, k), s - k as f64 * h);
        let m = R * column.moment(u, s) / units.moment();
        nodes.nodes.push(Node::new(lanes(R.column(0).into()), lanes(R.column(2).into()), lanes(m)));
    }
    nodes.hold_base(&problem);
    let mut size = f64::INFINITY;
    for _ in 0..20 {
        nodes.pass(&problem, one, Purpose::Transfers, &mut workspace);
        size = number(nodes.newton_step(&problem, one));
        if size < 1e-10 {
            break;
        }
        nodes.take_step(lane(0.0).lt(one));
    }
    assert!(size < 1e-10, "{size:e}");
    let off = numbers(nodes.tip.p) * units.length - Column::tip(u).0;
    nodes.factor_symmetric();
    for (transfer, pivot) in nodes.transfers.iter().zip(&nodes.elimination.pivots) {
        // The transfers are symplectic: a + b S = P^-T.
        let (forward, inverse) = (matrix(transfer.a) + matrix(transfer.b) * matrix(pivot.s), matrix(pivot.inverse));
        let scale = inverse.amax() + matrix(transfer.b).amax() * matrix(pivot.s).amax();
        assert!((forward - inverse.transpose()).amax() < 1e-8 * scale, "{forward} {inverse}");
    }
    (off.norm() < 0.05 * LENGTH).then(|| number(nodes.elimination.index) as usize)
}

#[test]
fn the_index_is_that_of_the_energy() {
    let none = [0.0; 3];
    let columns = [
        Column { stiffness: [1.0, 1.6, 0.9], rest: none, force: [0.3, 0.2, -12.0], field: none, dipole: none },
        Column { stiffness: [1.0, 1.6, 0.9], rest: none, force: [0.5, 0.2, -40.0], field: none, dipole: none },
        Column {
            stiffness: [1.0, 1.3, 0.8],
            rest: [0.5, 0.2, 0.3],
            force: [0.2, 0.0, 0.1],
            field: [0.1, 0.4, -6.0],
            dipole: [0.1, 0.0, 2.0],
        },
    ];
    let mut random = Random(11);
    let (mut seen, mut elsewhere) = (BTreeMap::new(), 0);
    for column in &columns {
        for start in 0..12 {
            let amplitude = f64::from(start) * 0.8;
            let waves: Vec<f64> = (0..9).map(|_| amplitude * random.number()).collect();
            let at = |row: usize, _: usize| {
                let s = (row / 3) as f64 / HELICES as f64;
                let wave = |j: usize| waves[3 * j + row % 3] * (std::f64::consts::PI * j as f64 * s).cos();
                column.rest[row % 3] + (0..3).map(wave).sum::<f64>()
            };
            let Some((u, index)) = column.equilibrium(DVector::from_fn(3 * HELICES, at)) else { continue };
            match index_by_nodes(column, &u) {
                Some(found) => assert_eq!(found, index, "{u}"),
                None => elsewhere += 1,
            }
            *seen.entry(index).or_insert(0) += 1;
        }
    }
    println!("equilibria by index: {seen:?}, {elsewhere} of them left by Newton's method");
    assert!(seen.values().sum::<usize>() >= 18 && elsewhere <= 2, "{seen:?}, {elsewhere}");
    assert!((0..4).all(|index| seen.contains_key(&index)), "{seen:?}");
}
