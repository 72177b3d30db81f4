//! The stability margin of taut rods: folds far from the base, of which nothing is to be seen there.

use crate::common::scenes::flexible;
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{Base, Loads, Plan, PlanOptions, Quantity, Rigid, Scene, Segment, SegmentKind, Stiffness};
use rodsweep::reference::{Reference, solve_rod};

const LENGTH: f64 = 0.3;
const BENDING: f64 = 2e-5;
const COIL: f64 = 1e-3;
const FIELD: f64 = 1.5;
/// sqrt(f / EI) L
const TAUTNESS: f64 = 20.0;
/// Compliance that tells of no fold.
const USUAL: f64 = 2.0;

/// A straight rod pulled along its axis, at its tip a magnet against the field: it wants to turn over, the pull holds it.
/// `excess` is how much more moment by angle the pull has than the magnet, of what the rod has without both, EI / L.
fn scene(excess: f64) -> Scene {
    let stiffness = Stiffness::Direct { bending_x: BENDING, bending_y: BENDING, torsion: 0.8 * BENDING };
    let rod =
        Segment { name: "rod".into(), length: LENGTH, kind: SegmentKind::Flexible(flexible(stiffness, [0.0; 3])) };
    let pull = (TAUTNESS / LENGTH).powi(2) * BENDING;
    let held = TAUTNESS / TAUTNESS.tanh() * BENDING / LENGTH + pull * COIL;
    let dipole = (held - excess * BENDING / LENGTH) / FIELD;
    let magnet = Rigid { dipole_per_length: Some([0.0, 0.0, -dipole / COIL]), ..Rigid::default() };
    let magnet = Segment { name: "magnet".into(), length: COIL, kind: SegmentKind::Rigid(magnet) };
    Scene {
        name: "a magnet against the field".into(),
        base: Base::default(),
        flux_density: [0.0, 0.0, FIELD],
        sources: Default::default(),
        loads: Loads { tip_force: Some([0.0, 0.0, pull]), ..Loads::default() },
        segments: vec![rod, magnet],
        inner_loads: Vec::new(),
        wall: None,
        inserted: 0.0,
        rigid_force_arm: true,
    }
}

/// By the closed form: at the tip a moment across turns 1 / excess of what it does without loads, one along it as much.
fn margin(excess: f64) -> f64 {
    let compliance = ((2.0 / excess.powi(2) + 1.0) / 3.0).sqrt();
    1.0 / (compliance - USUAL)
}

#[test]
fn a_fold_at_the_tip_is_seen() {
    for excess in [0.2, 0.1, 0.03, 0.01] {
        let scene = scene(excess);
        let options = PlanOptions { tolerance: 1e-9, ..PlanOptions::default() };
        let plan = Plan::single(&scene, &[], options).expect("a plan");
        let solve = |mut backend: Box<dyn Backend>| {
            let found = backend.solve(&plan.batch(1, |_, _| {})).expect("solved");
            assert!(found.status(0).is_success(), "{excess}: {:?}", found.status(0));
            found.get(0, Quantity::StabilityMargin)
        };
        let cpu = |precision| Box::new(Cpu::new(&plan, precision).expect("available")) as Box<dyn Backend>;
        let expected = margin(excess);
        let found = [solve(Box::new(Reference::new(&plan))), solve(cpu(Precision::F64)), solve(cpu(Precision::F32))];
        println!("{excess}: {expected:.6} {found:?}");
        for (found, tolerance) in found.into_iter().zip([1e-7, 1e-7, 2e-3]) {
            assert!((found / expected - 1.0).abs() < tolerance, "{excess}: {found} for {expected}");
        }
    }
}

/// Beyond it the rod has snapped.
#[test]
fn beyond_it_the_rod_is_no_longer_solved() {
    let scene = scene(-0.05);
    let plan = Plan::single(&scene, &[], PlanOptions::default()).expect("a plan");
    let found = Cpu::new(&plan, Precision::F64).expect("available").solve(&plan.batch(1, |_, _| {})).expect("solved");
    assert!(!found.status(0).is_success() && !solve_rod(&scene.rod(), &[]).status.is_success());
}

/// Where no fold is near, the margin is that of the tip.
#[test]
fn an_ordinary_taut_rod_keeps_its_margin() {
    let scene = scene(15.0);
    let plan = Plan::single(&scene, &[], PlanOptions::default()).expect("a plan");
    let found = Cpu::new(&plan, Precision::F64).expect("available").solve(&plan.batch(1, |_, _| {})).expect("solved");
    assert!(found.get(0, Quantity::StabilityMargin) > 1.0);
}
