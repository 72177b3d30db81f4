//! Fields that vary in space: golden scenes, invariances, limits.
#![allow(non_snake_case)]

use super::common::check::{column_error, difference, norm};
use super::common::fields::{SMALL, cases, engine_errors, worst_column};
pub use super::common::fields::{plan_by_slots, slots};
use super::common::root;
use super::field_combinations::by_lanes;
use super::rods::{moved, rod_units};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rodsweep::backend::{Backend, Precision};
use rodsweep::cpu::Cpu;
use rodsweep::input::read_scene;
use rodsweep::model::{
    Axis, Plan, PlanOptions, Rod, RodSegment, Scene, Slot, Status, Stepper, Vector, gradient_matrix,
};
use rodsweep::reference::{Equilibrium, SlotDerivative, energy_of, solve_rod};

/// What two computations of golden data agree to, with room for the reference's own integration.
const POSE: f64 = 1e-9;
const COLUMNS: f64 = 1e-9;
/// Six numbers of the tip and six of the base by column k.
fn found_column(slots: &[Slot], found: &Equilibrium, column: &[(Slot, f64)]) -> ([f64; 6], [f64; 6]) {
    let (mut tip, mut base) = ([0.0; 6], [0.0; 6]);
    for (slot, rate) in column {
        let at = slots.iter().position(|other| other == slot).expect("a slot asked for");
        let d = &found.derivatives[at];
        tip.iter_mut().zip(d.dp.iter().chain(&d.w)).for_each(|(sum, x)| *sum += rate * x);
        base.iter_mut().zip(d.dn0.iter().chain(&d.dm0)).for_each(|(sum, x)| *sum += rate * x);
    }
    (tip, base)
}

#[test]
fn reference_matches_golden_fields() {
    let (mut pose, mut base, mut columns) = (0.0_f64, 0.0_f64, (0.0, String::new()));
    let mut worst_base = (0.0, String::new());
    for case in cases() {
        let rod = case.scene.rod();
        let slots = slots(&case);
        let found = solve_rod(&rod, &slots);
        let name = &case.scene.name;
        assert!(found.status.is_success(), "{name}: {:?} at {}", found.status, found.load_fraction);
        assert_eq!(found.index as u64, case.index, "{name}");
        let length = rod.total_length();
        let rotation = (0..9).map(|k| (found.R_tip[k / 3][k % 3] - case.R_tip[k / 3][k % 3]).abs()).fold(0.0, f64::max);
        pose = pose.max(difference(&found.p_tip, &case.p_tip) / length).max(rotation);
        base = base.max(difference(&found.n0, &case.n0) / norm(&case.n0));
        base = base.max(difference(&found.m0, &case.m0) / norm(&case.m0));
        // Of the golden energies, dead loads count from the world's origin.
        let weight = case.scene.loads.distributed_force.unwrap_or_default();
        let lifted = |k: usize| rod.base_position[k] * (rod.tip_force[k] + length * weight[k]);
        let energy = energy_of(&rod, &found).expect("an energy") - (0..3).map(lifted).sum::<f64>();
        assert!((energy - case.energy).abs() <= POSE * case.energy.abs(), "{name}: {energy} for {}", case.energy);
        let tip = worst_column(&case, &case.J, length, |_| 0.0, |k| found_column(&slots, &found, &case.columns[k].1).0);
        let at_base = worst_column(
            &case,
            &case.J_base,
            1.0 / length,
            |_| 0.0,
            |k| found_column(&slots, &found, &case.columns[k].1).1,
        );
        columns = if tip.0 > columns.0 || tip.0.is_nan() { tip } else { columns };
        worst_base = if at_base.0 > worst_base.0 || at_base.0.is_nan() { at_base } else { worst_base };
    }
    println!("pose {pose:.1e}, base {base:.1e}, columns {columns:?}, of the base {worst_base:?}");
    assert!(pose <= POSE && base <= POSE, "pose {pose:e}, base {base:e}");
    assert!(columns.0 <= COLUMNS && worst_base.0 <= COLUMNS, "{columns:?}, {worst_base:?}");
}

fn lanes(plan: &Plan, precision: Precision) -> Box<dyn Backend> {
    Box::new(Cpu::new(plan, precision).expect("an engine"))
}

#[test]
fn lanes_match_golden_fields() {
    let options = PlanOptions { tolerance: 1e-11, stepper: Stepper::Dop853, steps: 24, ..PlanOptions::default() };
    let (pose, moment, columns) = engine_errors(cases(), options, SMALL, |plan| lanes(plan, Precision::F64));
    assert!(pose <= POSE && moment <= POSE && columns.0 <= COLUMNS, "{pose:e} {moment:e} {columns:?}");
}

#[test]
fn lanes_in_single_precision_match_golden_fields() {
    let options = PlanOptions { tolerance: 2e-5, stepper: Stepper::Tp7, steps: 12, ..PlanOptions::default() };
    let (pose, moment, columns) = engine_errors(cases(), options, 1.0, |plan| lanes(plan, Precision::F32));
    assert!(pose <= 2e-5 && moment <= 2e-5 && columns.0 <= 2e-5, "{pose:e} {moment:e} {columns:?}");
}

/// A uniform field through the new way is the old one.
#[test]
fn a_gradient_of_nothing_changes_nothing() {
    for case in cases().into_iter().step_by(5) {
        let slots: Vec<Slot> = slots(&case).into_iter().filter(|slot| !slot.is_of_sources()).collect();
        let uniform = Rod { field: None, ..case.scene.rod() };
        let mut varying = case.scene.rod();
        let field = varying.field.as_mut().expect("a field that varies");
        field.gradient = [0.0; 5];
        field.dipoles.iter_mut().for_each(|dipole| dipole.moment = [0.0; 3]);
        let (old, new) = (solve_rod(&uniform, &slots), solve_rod(&varying, &slots));
        assert!(old.status.is_success() && new.status.is_success(), "{:?} {:?}", old.status, new.status);
        let length = uniform.total_length();
        assert!(difference(&old.p_tip, &new.p_tip) <= 1e-12 * length);
        assert!(difference(&old.m0, &new.m0) <= 1e-11 * norm(&old.m0).max(1e-9), "{:?} {:?}", old.m0, new.m0);
        assert!((old.margin - new.margin).abs() <= 1e-10, "{} {}", old.margin, new.margin);
        for (slot, (a, b)) in slots.iter().zip(old.derivatives.iter().zip(&new.derivatives)) {
            let column = |d: &SlotDerivative| [d.dp, d.w].concat().try_into().expect("six numbers");
            let small = SMALL / slot.unit(&rod_units(&uniform));
            let error = column_error(&column(b), &column(a), small, length);
            assert!(error <= 1e-10, "{slot:?}: {error:e}");
        }
        assert!(new.status == Status::Ok || new.status == Status::Ramped);
    }
}

fn vector(v: Vector3<f64>) -> Vector {
    v.into()
}

/// The rod and its field moved by a rotation about the world's origin and a shift.
fn carried(rod: &Rod, Q: &Rotation3<f64>, shift: Vector3<f64>) -> Rod {
    let turned = |v: Vector| vector(Q * Vector3::from(v));
    let moved = |v: Vector| vector(Q * Vector3::from(v) + shift);
    let mut rod = rod.clone();
    rod.base_position = moved(rod.base_position);
    let R = Q.matrix() * Matrix3::from_fn(|row, col| rod.base_rotation[row][col]);
    rod.base_rotation = std::array::from_fn(|row| std::array::from_fn(|col| R[(row, col)]));
    for v in [&mut rod.flux_density, &mut rod.tip_force, &mut rod.tip_moment] {
        *v = turned(*v);
    }
    for segment in &mut rod.segments {
        match segment {
            RodSegment::Flexible(flexible) => flexible.load = turned(flexible.load),
            RodSegment::Rigid(rigid) => rigid.weight = turned(rigid.weight),
        }
    }
    let field = rod.field.as_mut().expect("a field that varies");
    let rows = gradient_matrix(field.gradient);
    let G = Q.matrix() * Matrix3::from_fn(|row, col| rows[row][col]) * Q.matrix().transpose();
    field.gradient = [G[(0, 0)], G[(0, 1)], G[(0, 2)], G[(1, 1)], G[(1, 2)]];
    field.origin = moved(field.origin);
    for dipole in &mut field.dipoles {
        (dipole.position, dipole.moment) = (moved(dipole.position), turned(dipole.moment));
    }
    rod
}

/// Turning and moving base, field and loads together turns and moves the rod.
#[test]
fn moving_everything_changes_nothing() {
    let Q = Rotation3::new(Vector3::new(0.7, -1.1, 0.4));
    let shift = Vector3::new(0.3, -0.2, 0.15);
    for case in cases() {
        let rod = case.scene.rod();
        let (here, there) = (solve_rod(&rod, &[]), solve_rod(&carried(&rod, &Q, shift), &[]));
        let expected = Q * Vector3::from(here.p_tip) + shift;
        let error = (Vector3::from(there.p_tip) - expected).norm() / rod.total_length();
        assert!(error <= 2e-12, "{}: {error:e}", case.scene.name);
        let m0 = Q * Vector3::from(here.m0);
        assert!((Vector3::from(there.m0) - m0).norm() <= 1e-11 * m0.norm(), "{}", case.scene.name);
    }
}

/// How far the response of a tip (displacement, rotation) to tip forces and moments, a column each, is from symmetric, over
/// its largest entry, and where.
pub fn asymmetry(columns: &[[f64; 6]], length: f64) -> (f64, (usize, usize)) {
    // Force times length beside moment.
    let entry = |row: usize, column: usize| {
        let value = columns[column][row];
        let value = if row < 3 { value / length } else { value };
        if column < 3 { value / length } else { value }
    };
    let places = || (0..36).map(|k| (k / 6, k % 6));
    let largest = places().map(|(row, column)| entry(row, column).abs()).fold(0.0, f64::max);
    let error = |(row, column)| (entry(row, column) - entry(column, row)).abs() / largest;
    // A NaN stays the worst.
    let worse = |worst: (f64, _), next: (f64, _)| if next.0 > worst.0 || next.0.is_nan() { next } else { worst };
    places().map(|place| (error(place), place)).fold((0.0, (0, 0)), worse)
}

/// Tip displacement and rotation, as columns.
pub fn tip_columns(found: &Equilibrium) -> Vec<[f64; 6]> {
    found.derivatives.iter().map(|d| [d.dp[0], d.dp[1], d.dp[2], d.w[0], d.w[1], d.w[2]]).collect()
}

/// The response to loads at the tip is symmetric (Betti), by the reference and by the CPU engine.
#[test]
fn load_responses_are_symmetric() {
    let loads: Vec<Slot> = Axis::ALL.map(Slot::TipForce).into_iter().chain(Axis::ALL.map(Slot::TipMoment)).collect();
    for case in cases() {
        let (name, length) = (&case.scene.name, case.scene.rod().total_length());
        let (error, place) = asymmetry(&tip_columns(&solve_rod(&case.scene.rod(), &loads)), length);
        assert!(error <= 1e-12, "{name} {place:?} by the reference: {error:e}");
        let (_, found) = by_lanes(&case.scene, &loads);
        let column = |k: usize| std::array::from_fn(|row| found.derivative(0, k, row));
        let (error, place) = asymmetry(&(0..6).map(column).collect::<Vec<_>>(), length);
        // Its columns are those before the last of Newton's steps.
        assert!(error <= 1e-10, "{name} {place:?} by the CPU engine: {error:e}");
    }
}

/// A dipole far away is its field and gradient at the rod, up to second differences: these fall with the square of the
/// rod's length over the distance.
#[test]
fn a_far_dipole_is_a_linear_field() {
    let case = cases().into_iter().find(|case| case.scene.name.starts_with("golden-dipole-3")).expect("a scene");
    let near = case.scene.rod();
    let mut errors = Vec::new();
    for far in [8.0, 16.0] {
        let mut rod = near.clone();
        let field = rod.field.as_mut().expect("a field that varies");
        let base = Vector3::from(near.base_position);
        for dipole in &mut field.dipoles {
            let r = Vector3::from(dipole.position) - base;
            dipole.position = vector(base + far * r);
            // The field at the base stays the same.
            dipole.moment = dipole.moment.map(|x| x * far.powi(3));
        }
        let mut linear = rod.clone();
        let flat = linear.field.as_mut().expect("a field that varies");
        let at_base = flat.flux_density(near.base_position);
        let by = |axis: usize| flat.load(near.base_position, std::array::from_fn(|k| f64::from(u8::from(k == axis)))).0;
        let rows = [by(0), by(1), by(2)];
        flat.gradient = [rows[0][0], rows[0][1], rows[0][2], rows[1][1], rows[1][2]];
        flat.origin = near.base_position;
        flat.dipoles.clear();
        linear.flux_density = std::array::from_fn(|k| near.flux_density[k] + at_base[k]);
        let (exact, model) = (solve_rod(&rod, &[]), solve_rod(&linear, &[]));
        assert!(exact.status.is_success() && model.status.is_success());
        errors.push(difference(&exact.p_tip, &model.p_tip) / near.total_length());
    }
    let order = (errors[0] / errors[1]).log2();
    assert!((1.7..2.3).contains(&order), "{errors:?}: order {order}");
}

/// Central differences over a rod's numbers, sources among them.
#[test]
fn columns_by_sources_are_differences() {
    for case in cases().into_iter().step_by(7) {
        let rod = case.scene.rod();
        let sources: Vec<Slot> = slots(&case).into_iter().filter(Slot::is_of_sources).collect();
        let found = solve_rod(&rod, &sources);
        for (slot, d) in sources.iter().zip(&found.derivatives) {
            // So far that the tip turns by a thousandth.
            let h = 1e-3 / norm(&d.w).max(0.1 / slot.unit(&rod_units(&rod)));
            let at = |steps: f64| solve_rod(&moved(&rod, *slot, steps * h), &[]).p_tip;
            let (up, down, far_up, far_down) = (at(1.0), at(-1.0), at(2.0), at(-2.0));
            let by: Vector = std::array::from_fn(|k| (8.0 * (up[k] - down[k]) - far_up[k] + far_down[k]) / (12.0 * h));
            let size = norm(&d.dp).max(1e-3 * rod.total_length() / slot.unit(&rod_units(&rod)));
            assert!(difference(&by, &d.dp) <= 2e-6 * size, "{} {slot:?}: {by:?} {:?}", case.scene.name, d.dp);
        }
    }
}

/// A rod within the clearance of a magnet has no answer, in either engine; nor has one that the magnet pulls in.
#[test]
fn magnets_keep_their_distance_and_pull_in() {
    let case = cases().into_iter().find(|case| case.scene.name.starts_with("golden-dipole-5")).expect("a scene");
    let solve = |scene: &Scene| {
        let plan = Plan::single(scene, &[], PlanOptions { steps: 12, ..PlanOptions::default() }).expect("a plan");
        let mut lanes = Cpu::new(&plan, Precision::F64).expect("an engine");
        let by_lanes = lanes.solve(&plan.batch(1, |_, _| {})).expect("a solved batch").status(0);
        (solve_rod(&scene.rod(), &[]).status, by_lanes)
    };
    let mut near = case.scene.clone();
    let tip = case.p_tip;
    near.sources.magnets[0].position = [tip[0] + 0.004, tip[1], tip[2]];
    near.sources.magnets[0].moment = [0.0, 0.0, 1e-3];
    near.sources.magnets[0].clearance = 0.03;
    assert_eq!(solve(&near), (Status::TooNearMagnet, Status::TooNearMagnet));
    let mut arm = read_scene(&root().join("sweeps/scenes/arm_magnet.toml")).expect("a good scene");
    arm.sources.magnets[0].position[0] = 0.09;
    assert_eq!(solve(&arm), (Status::Fold, Status::Fold));
}
