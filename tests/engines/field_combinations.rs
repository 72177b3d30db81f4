//! Fields that vary in space with a rigid first segment, and without the force arm of rigid segments.
#![allow(non_snake_case)]

use super::common::check::{column_error, difference, norm};
use super::common::fields::{FieldCase, cases};
use super::fields::{plan_by_slots, slots as golden_slots};
use super::rods::{all_slots, moved, rod_units};
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::model::{
    Axis, Loads, Plan, PlanOptions, Quantity, Rigid, RigidRod, Rod, RodSegment, Scene, Segment, SegmentKind, Slot,
    Solutions, Stepper, Vector,
};
use rodsweep::reference::{base_curvature, solve_rod};

/// A holder in front of the rod that ends where the rod began.
fn held(case: &FieldCase, dipole: Vector) -> Scene {
    const LENGTH: f64 = 0.011;
    let mut scene = case.scene.clone();
    let R = scene.rod().base_rotation;
    for (x, row) in scene.base.position.iter_mut().zip(R) {
        *x -= LENGTH * row[2];
    }
    let holder = Rigid { dipole_per_length: Some(dipole.map(|x| x / LENGTH)), ..Rigid::default() };
    scene.segments.insert(0, Segment { name: "holder".into(), length: LENGTH, kind: SegmentKind::Rigid(holder) });
    scene
}

/// What the golden scene has columns by, of a rod with so many segments in front of it, and the curvature at rest.
fn slots(case: &FieldCase, in_front: usize) -> Vec<Slot> {
    let mut slots: Vec<Slot> = golden_slots(case).into_iter().map(|slot| behind(slot, in_front)).collect();
    slots.extend(Axis::ALL.map(|axis| Slot::RestCurvature(in_front, axis)));
    slots.extend((0..in_front).flat_map(|j| Axis::ALL.map(|axis| Slot::Dipole(j, axis))));
    slots
}

fn behind(slot: Slot, by: usize) -> Slot {
    match slot {
        Slot::Length(j) => Slot::Length(j + by),
        Slot::Stiffness(j, axis) => Slot::Stiffness(j + by, axis),
        Slot::Load(j, axis) => Slot::Load(j + by, axis),
        Slot::Weight(j, axis) => Slot::Weight(j + by, axis),
        Slot::Dipole(j, axis) => Slot::Dipole(j + by, axis),
        Slot::DipolePerLength(j, axis) => Slot::DipolePerLength(j + by, axis),
        Slot::RestCurvature(j, axis) => Slot::RestCurvature(j + by, axis),
        other => {
            assert!(other.segment().is_none(), "{other:?}");
            other
        }
    }
}

pub fn by_lanes(scene: &Scene, slots: &[Slot]) -> (Plan, Solutions) {
    let options = PlanOptions { tolerance: 1e-11, stepper: Stepper::Dop853, steps: 24, ..PlanOptions::default() };
    let plan = plan_by_slots(scene, slots, options);
    let batch = plan.batch(1, |_, _| {});
    let solutions = Cpu::new(&plan, Precision::F64).expect("an engine").solve(&batch).expect("a solved batch");
    (plan, solutions)
}

/// Pose, moment, curvature and every column of the CPU engine are those of the reference.
fn engines_agree(scene: &Scene, slots: &[Slot]) {
    let (rod, name) = (scene.rod(), &scene.name);
    let (plan, solutions) = by_lanes(scene, slots);
    let found = solve_rod(&rod, slots);
    assert!(found.status.is_success(), "{name}: {:?}", found.status);
    assert!(solutions.status(0).is_success(), "{name}: {:?}", solutions.status(0));
    assert_eq!(solutions.get(0, Quantity::StabilityIndex), found.index as f64, "{name}");
    let margin = solutions.get(0, Quantity::StabilityMargin);
    assert!((margin - found.margin).abs() <= 1e-8, "{name}: margin {margin}, {}", found.margin);
    let units = plan.units;
    let off = difference(&solutions.vector(0, Quantity::TipPosition), &found.p_tip) / units.length;
    assert!(off <= 1e-9, "{name}: {off:e}");
    let off = difference(&solutions.vector(0, Quantity::BaseMoment), &found.m0);
    assert!(off <= 1e-9 * norm(&found.m0).max(units.moment()), "{name}: {off:e}");
    let is_held = !rod.segments[0].is_flexible();
    assert_eq!(solutions.own_curvature(0).is_some(), is_held);
    if let Some(u) = solutions.own_curvature(0) {
        assert!(difference(&u, &found.u0) <= 1e-9 * norm(&found.u0).max(units.curvature()), "{name}: {u:?}");
    }
    let scales = [units.length, 1.0, units.moment(), units.curvature()];
    let rows = plan.rows() / 3;
    for (k, (slot, expected)) in slots.iter().zip(&found.derivatives).enumerate() {
        let expected = [expected.dp, expected.w, expected.dm0, expected.du0];
        let natural = |row: usize| scales[row] / slot.unit(&units);
        for (row, expected) in expected.iter().enumerate().take(rows) {
            let column: Vector = std::array::from_fn(|axis| solutions.derivative(0, k, 3 * row + axis));
            let off = difference(&column, expected) / norm(expected).max(1e-2 * natural(row));
            assert!(off <= 2e-8, "{name} {slot:?} {row}: {off:e}: {column:?} {expected:?}");
        }
    }
}

/// What is rigid at the base moves the clamp and takes up what the field does to it; the rest of the rod knows nothing.
#[test]
fn a_rigid_start_moves_the_base() {
    for case in cases().into_iter().step_by(3) {
        let rod = case.scene.rod();
        let free: Vec<Slot> = all_slots(&rod)
            .into_iter()
            .filter(|slot| slot.segment().is_none() && *slot != Slot::Insertion)
            .filter(|slot| !matches!(slot, Slot::BaseRotation(_)))
            .collect();
        let before = solve_rod(&rod, &free);
        let there = held(&case, [0.01, -0.02, 0.03]).rod();
        let after = solve_rod(&there, &free);
        let (name, length) = (&case.scene.name, rod.total_length());
        assert!(after.status.is_success(), "{name}: {:?}", after.status);
        assert!(difference(&before.p_tip, &after.p_tip) <= 1e-11 * length, "{name}");
        assert!(difference(&before.u0, &after.u0) <= 1e-10 * norm(&before.u0).max(1.0 / length), "{name}");
        assert_eq!(base_curvature(&there, after.m0).map(|u| difference(&u, &after.u0) <= 1e-9 / length), Some(true));
        for (slot, (a, b)) in free.iter().zip(before.derivatives.iter().zip(&after.derivatives)) {
            let column =
                |d: &rodsweep::reference::SlotDerivative| [d.dp, d.w].concat().try_into().expect("six numbers");
            let small = 1e-3 / slot.unit(&rod_units(&rod));
            let error = column_error(&column(b), &column(a), small, length);
            assert!(error <= 1e-9, "{name} {slot:?}: {error:e}");
            let natural = 1e-3 / (length * slot.unit(&rod_units(&rod)));
            assert!(difference(&a.du0, &b.du0) <= 1e-9 * norm(&a.du0).max(natural), "{name} {slot:?}");
        }
        // What the field does to the holder's dipole is all that the clamp feels more, but for weight.
        let field = there.field.as_ref().expect("a field that varies");
        let RodSegment::Rigid(RigidRod { length: holder, dipole, weight, .. }) = there.segments[0] else {
            panic!("rigid")
        };
        let R = there.base_rotation;
        let mu: Vector = std::array::from_fn(|row| (0..3).map(|k| R[row][k] * dipole[k]).sum());
        let mut force = weight;
        for (xi, share) in field.coil_load.points() {
            let at = std::array::from_fn(|k| there.base_position[k] + xi * holder * R[k][2]);
            let (of_point, _) = field.load(at, mu);
            (0..3).for_each(|k| force[k] += share * of_point[k]);
        }
        let expected: Vector = std::array::from_fn(|k| before.n0[k] + force[k]);
        assert!(difference(&expected, &after.n0) <= 1e-6 * norm(&after.n0), "{name}: {expected:?} {:?}", after.n0);
    }
}

#[test]
fn engines_agree_beyond_a_rigid_start() {
    for (k, case) in cases().into_iter().step_by(4).enumerate() {
        let mut scene = held(&case, [0.01, -0.02, 0.03]);
        scene.rigid_force_arm = k % 2 == 0;
        engines_agree(&scene, &slots(&case, 1));
    }
}

#[test]
fn engines_agree_without_the_force_arm() {
    for case in cases().into_iter().step_by(3) {
        let slots = slots(&case, 0);
        engines_agree(&Scene { rigid_force_arm: false, ..case.scene }, &slots);
    }
}

/// What the field does to a dipole shears and stretches a rod that nothing else loads, with derivatives and without.
#[test]
fn engines_agree_on_shear_by_the_field_alone() {
    let case = cases().into_iter().find(|case| case.scene.name == "golden-dipole-4 middle").expect("a scene");
    let mut scene = Scene { loads: Loads::default(), ..case.scene };
    let stiff = solve_rod(&scene.rod(), &[]);
    let SegmentKind::Flexible(first) = &mut scene.segments[0].kind else { panic!("flexible") };
    (first.stiffness_shear, first.stiffness_axial) = (Some([0.05; 2]), Some(0.05));
    let soft = solve_rod(&scene.rod(), &[]);
    assert!(difference(&stiff.p_tip, &soft.p_tip) > 1e-3 * scene.total_length());
    for slots in [&[][..], &[Slot::SourcePosition(0, Axis::X), Slot::ShearCompliance(0, Axis::X)]] {
        engines_agree(&scene, slots);
    }
}

/// Columns of the curvature at the start are its differences; so are those of the tip without the force arm.
#[test]
fn columns_of_combinations_are_differences() {
    for (case, is_armless) in cases().into_iter().step_by(18).flat_map(|case| [(case.clone(), true), (case, false)]) {
        let scene = Scene { rigid_force_arm: !is_armless, ..held(&case, [0.01, -0.02, 0.03]) };
        let rod = scene.rod();
        let units = rod_units(&rod);
        // Half of them are enough.
        let slots: Vec<Slot> = slots(&case, 1).into_iter().step_by(2).collect();
        let found = solve_rod(&rod, &slots);
        for (slot, d) in slots.iter().zip(&found.derivatives) {
            let natural = [units.length, units.curvature()].map(|unit| 1e-2 * unit / slot.unit(&units));
            let size = (norm(&d.dp) / units.length).max(norm(&d.du0) * units.length).max(0.1 / slot.unit(&units));
            let h = 1e-3 / size;
            let at = |steps: f64| {
                let there = solve_rod(&moved(&rod, *slot, steps * h), &[]);
                [there.p_tip, there.u0]
            };
            let [up, down, far_up, far_down] = [1.0, -1.0, 2.0, -2.0].map(at);
            for (row, column) in [d.dp, d.du0].iter().enumerate() {
                let by: Vector = std::array::from_fn(|k| {
                    (8.0 * (up[row][k] - down[row][k]) - far_up[row][k] + far_down[row][k]) / (12.0 * h)
                });
                let off = difference(&by, column) / norm(column).max(natural[row]);
                assert!(off <= 1e-5, "{} {slot:?} {row} {is_armless}: {by:?} {column:?}", scene.name);
            }
        }
    }
}

/// Where it is asked for, the engine tells how the force at the base follows every slot; that is the reference's difference.
#[test]
fn the_force_at_the_base_follows_every_slot() {
    for (case, in_front) in cases().into_iter().step_by(18).flat_map(|case| [(case.clone(), 0), (case, 1)]) {
        let scene = if in_front == 1 { held(&case, [0.01, -0.02, 0.03]) } else { case.scene.clone() };
        let (name, rod) = (&scene.name, scene.rod());
        let mut slots: Vec<Slot> = slots(&case, in_front).into_iter().skip(1).step_by(2).collect();
        if rod.segments[0].is_flexible() {
            slots.push(Slot::Insertion);
        }
        let options = PlanOptions { tolerance: 1e-11, stepper: Stepper::Dop853, steps: 24, ..PlanOptions::default() };
        let plan = plan_by_slots(&scene, &slots, PlanOptions { base_force: true, ..options });
        let solutions = Cpu::new(&plan, Precision::F64).expect("an engine").solve(&plan.batch(1, |_, _| {}));
        let (solutions, first) =
            (solutions.expect("a solved batch"), plan.base_force_row().expect("rows of the force"));
        // The rows before are those that a plan without them has.
        let (fewer, without) = by_lanes(&scene, &slots);
        assert_eq!((fewer.rows(), fewer.base_force_row()), (first, None), "{name}");
        let units = plan.units;
        for (k, slot) in slots.iter().enumerate() {
            for row in 0..first {
                let (a, b) = (solutions.derivative(0, k, row), without.derivative(0, k, row));
                assert!((a - b).abs() <= 1e-12 * a.abs(), "{name} {slot:?} {row}: {a:e} {b:e}");
            }
            let column: Vector = std::array::from_fn(|axis| solutions.derivative(0, k, first + axis));
            let h = 1e-3 / (norm(&column) / units.force).max(1.0 / slot.unit(&units));
            let at = |steps: f64| solve_rod(&moved(&rod, *slot, steps * h), &[]).n0;
            let [up, down, far_up, far_down] = [1.0, -1.0, 2.0, -2.0].map(at);
            let by: Vector = std::array::from_fn(|k| (8.0 * (up[k] - down[k]) - far_up[k] + far_down[k]) / (12.0 * h));
            let off = difference(&by, &column) / norm(&column).max(1e-2 * units.force / slot.unit(&units));
            assert!(off <= 1e-5, "{name} {slot:?}: {off:e}: {by:?} {column:?}");
        }
    }
}

/// Without the force arm, too, a field that does not vary is the uniform one.
#[test]
fn without_the_arm_a_gradient_of_nothing_changes_nothing() {
    for case in cases().into_iter().step_by(5) {
        let scene = Scene { rigid_force_arm: false, ..case.scene };
        let uniform = Rod { field: None, ..scene.rod() };
        let mut varying = scene.rod();
        let field = varying.field.as_mut().expect("a field that varies");
        field.gradient = [0.0; 5];
        field.dipoles.iter_mut().for_each(|dipole| dipole.moment = [0.0; 3]);
        let (old, new) = (solve_rod(&uniform, &[]), solve_rod(&varying, &[]));
        assert!(old.status.is_success() && new.status.is_success(), "{:?} {:?}", old.status, new.status);
        assert!(difference(&old.p_tip, &new.p_tip) <= 1e-12 * uniform.total_length());
        assert!((old.margin - new.margin).abs() <= 1e-10, "{} {}", old.margin, new.margin);
        assert_eq!(old.index, new.index);
    }
}

/// Where sources stay in the world, more of the rod at the base is more of its first segment; and that is a difference.
#[test]
fn insertion_lengthens_the_first_segment() {
    let slots = [Slot::Insertion, Slot::Length(0)];
    for case in cases().into_iter().step_by(5).filter(|case| case.scene.rod().segments[0].is_flexible()) {
        let (name, rod) = (&case.scene.name, case.scene.rod());
        let found = solve_rod(&rod, &slots).derivatives;
        let (_, lanes) = by_lanes(&case.scene, &slots);
        let h = 1e-3 * rod.total_length();
        let at = |steps: f64| solve_rod(&moved(&rod, Slot::Length(0), steps * h), &[]).p_tip;
        let (up, down, far_up, far_down) = (at(1.0), at(-1.0), at(2.0), at(-2.0));
        let by: Vector = std::array::from_fn(|k| (8.0 * (up[k] - down[k]) - far_up[k] + far_down[k]) / (12.0 * h));
        for column in [found[0].dp, found[1].dp, lanes_tip(&lanes, 0), lanes_tip(&lanes, 1)] {
            assert!(difference(&by, &column) <= 2e-6 * norm(&by), "{name}: {by:?} {column:?}");
        }
        let apart = difference(&lanes_tip(&lanes, 0), &found[0].dp);
        assert!(apart <= 1e-9 * norm(&found[0].dp), "{name}: {apart:e}");
    }
}

fn lanes_tip(found: &Solutions, column: usize) -> Vector {
    std::array::from_fn(|axis| found.derivative(0, column, axis))
}
