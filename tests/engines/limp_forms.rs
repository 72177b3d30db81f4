//! Limp and taut rods where something is known of them: in the limit of a thin layer at the clamp, at a fold, where both
//! ways of the reference work.
#![allow(non_snake_case)]

use crate::common::limp;
use crate::common::strategy::some_scenes;
use crate::rods::{all_slots, moved, rod_units};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use rodsweep::model::{Axis, FlexibleRod, RigidRod, Rod, RodSegment, Slot, Status};
use rodsweep::reference::{
    Equilibrium, Pose, base_curvature, energy, energy_of, growth_exponent, residual_by_base_moment, shape,
    shape_with_derivatives, solve_rod, solve_rod_by_nodes, stability_at,
};

/// A straight uniform rod of EI = 1 N·m² and length 1 m, its tangent at the clamp along x.
fn unit_rod(load: [f64; 3], tip_force: [f64; 3]) -> Rod {
    let segment = FlexibleRod { length: 1.0, stiffness: [1.0, 1.0, 0.8], load, ..FlexibleRod::default() };
    Rod {
        base_position: [0.0; 3],
        base_rotation: [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        flux_density: [0.0; 3],
        field: None,
        wall: None,
        tip_force,
        tip_moment: [0.0; 3],
        rigid_force_arm: true,
        segments: vec![RodSegment::Flexible(segment)],
    }
}

fn vector(v: [f64; 3]) -> Vector3<f64> {
    Vector3::from(v)
}

fn solved(rod: &Rod) -> Equilibrium {
    let found = solve_rod(rod, &[]);
    assert!(found.status.is_success() && found.index == 0, "{:?} at {}", found.status, found.load_fraction);
    found
}

/// Tip and base moment of a rod of EI = L = 1 that is pulled by n0 along d, theta0 from its tangent x in the plane of x
/// and z: a layer of thickness l at the clamp, straight beyond.
fn layer(n0: f64, theta0: f64) -> (Vector3<f64>, f64) {
    let l = 1.0 / n0.sqrt();
    let d = Vector3::new(theta0.cos(), 0.0, -theta0.sin());
    let e = Vector3::new(theta0.sin(), 0.0, theta0.cos());
    let tip = d * (1.0 - 2.0 * l * (1.0 - (theta0 / 2.0).cos())) + 2.0 * l * (theta0 / 2.0).sin() * e;
    (tip, 2.0 / l * (theta0 / 2.0).sin())
}

/// What the layer leaves out is e^(-2 k).
#[test]
fn a_taut_rod_is_a_layer_and_a_straight_line() {
    let theta0: f64 = 2.1;
    let off = |k: f64| {
        let found = solved(&unit_rod([0.0; 3], [k * k * theta0.cos(), 0.0, -k * k * theta0.sin()]));
        let (tip, m0) = layer(k * k, theta0);
        ((vector(found.p_tip) - tip).norm(), vector(found.m0).norm() / m0 - 1.0)
    };
    let (at_4, at_8) = (off(4.0).0, off(8.0).0);
    let order = (at_4 / at_8).ln() / 4.0;
    assert!((order - 2.0).abs() < 0.1, "{at_4:e} {at_8:e}: e^(-{order} k)");
    for k in [20.0, 60.0, 200.0] {
        let (tip, m0) = off(k);
        assert!(tip < 1e-12 && m0.abs() < 1e-11, "k = {k}: tip {tip:e}, m0 {m0:e}");
    }
}

/// What the layer leaves out under weight is of the order (l / L)^2 = EI / (w L^3).
#[test]
fn a_limp_rod_is_a_layer_and_a_plumb_line() {
    let theta0 = std::f64::consts::FRAC_PI_2;
    let off = |limpness: f64| {
        let found = solved(&unit_rod([0.0, 0.0, -limpness], [0.0; 3]));
        let (tip, _) = layer(limpness, theta0);
        let l = 1.0 / limpness.sqrt();
        let m0 = (2.0 * limpness * ((1.0 - theta0.cos()) - 2.0 * l * (1.0 - (theta0 / 2.0).cos()))).sqrt();
        [(vector(found.p_tip) - tip).norm(), (vector(found.m0).norm() / m0 - 1.0).abs()]
    };
    let (at_1e4, at_1e5) = (off(1e4), off(1e5));
    for (what, (coarse, fine)) in ["tip", "m0"].iter().zip(at_1e4.iter().zip(at_1e5)) {
        let order = (coarse / fine).log10();
        assert!((order - 1.0).abs() < 0.05, "{what}: {coarse:e}, {fine:e}: order {order}");
    }
    assert!(at_1e5[0] < 2e-5 && at_1e5[1] < 1e-5, "{at_1e5:?}");
}

/// A rod from stiff to limp, out of any plane.
fn from_stiff_to_limp(growth: f64) -> Rod {
    let limpness = (1.5 * growth).powi(2);
    let mut rod = unit_rod([0.2, 0.3, -1.0].map(|x| x * limpness / 1.13_f64.sqrt()), [0.0; 3]);
    let RodSegment::Flexible(segment) = &mut rod.segments[0] else { unreachable!("one flexible segment") };
    segment.rest_curvature = [0.3, -0.5, 0.4];
    rod
}

#[test]
fn no_growth_exponent_is_left_out() {
    const POINTS: usize = 48;
    let growth = |k: usize| 0.1 * 3000.0_f64.powf(k as f64 / (POINTS - 1) as f64);
    let solve = |k: usize| {
        let rod = from_stiff_to_limp(growth(k));
        let found = solve_rod(&rod, &[]);
        assert!((growth_exponent(&rod) / (growth(k) * 1.25_f64.sqrt()) - 1.0).abs() < 1e-3);
        (found, solve_rod_by_nodes(&rod, &[]))
    };
    let all: Vec<(Equilibrium, Equilibrium)> = (0..POINTS).into_par_iter().map(solve).collect();
    let mut by_both = 0;
    for (k, (found, by_nodes)) in all.iter().enumerate() {
        let at = growth(k);
        assert!(found.status.is_success() && found.index == 0, "growth {at}: {:?}", found.status);
        let apart = (vector(found.p_tip) - vector(by_nodes.p_tip)).norm();
        assert!(apart <= 1e-10 + found.error_estimate, "growth {at}: {apart:e}");
        by_both += usize::from(found != by_nodes);
        assert!(found.error_estimate <= 1e-8, "growth {at}: {:e}", found.error_estimate);
        if k > 0 {
            let moved = (vector(found.p_tip) - vector(all[k - 1].0.p_tip)).norm();
            assert!(moved < 0.2, "growth {at}: {moved}");
        }
    }
    assert!(by_both > POINTS / 2, "{by_both} points by both ways");
}

/// Where single shooting works, multiple shooting says the same: every term, every slot.
#[test]
fn both_ways_agree() {
    let scenes = some_scenes(24);
    scenes.par_iter().for_each(|scene| {
        let rod = scene.rod();
        let slots = all_slots(&rod);
        let (by_base, by_nodes) = (solve_rod(&rod, &slots), solve_rod_by_nodes(&rod, &slots));
        let name = format!("{}: {:?} {:?}", scene.name, by_base.status, by_nodes.status);
        assert_eq!(by_base.status.is_success(), by_nodes.status.is_success(), "{name}");
        if !by_base.status.is_success() {
            return;
        }
        let units = rod_units(&rod);
        let close = |a: [f64; 3], b: [f64; 3], size: f64, what: &str| {
            let error = (vector(a) - vector(b)).norm() / (vector(b).norm() + size);
            assert!(error <= 1e-8, "{name}: {what} off by {error:e}");
        };
        close(by_nodes.p_tip, by_base.p_tip, units.length, "tip");
        close(by_nodes.m0, by_base.m0, units.moment(), "m0");
        close(by_nodes.u0, by_base.u0, units.curvature(), "u0");
        close(by_nodes.u_tip, by_base.u_tip, units.curvature(), "u_tip");
        assert!((by_nodes.margin / by_base.margin - 1.0).abs() < 1e-6, "{name}");
        for ((slot, a), b) in slots.iter().zip(&by_nodes.derivatives).zip(&by_base.derivatives) {
            let per = 1.0 / slot.unit(&units);
            let what = format!("{slot:?}");
            close(a.dp, b.dp, units.length * per, &what);
            close(a.w, b.w, per, &what);
            close(a.dm0, b.dm0, units.moment() * per, &what);
            close(a.du0, b.du0, units.curvature() * per, &what);
        }
        let at: Vec<f64> = [0.0, 0.2, 0.55, 0.9, 1.0].map(|share| share * units.length).to_vec();
        for (a, b) in shape(&rod, &by_nodes, &at).iter().zip(shape(&rod, &by_base, &at)) {
            close(a.position, b.position, units.length, "shape");
            close(a.curvature, b.curvature, units.curvature(), "curvature");
        }
        let energies = (energy_of(&rod, &by_nodes), energy(&rod, by_base.m0));
        if let (Some(a), Some(b)) = energies {
            assert!((a - b).abs() <= 1e-8 * (b.abs() + units.moment()), "{name}: {a} {b}");
        }
        assert_eq!(energies.0.is_some(), energies.1.is_some());
    });
}

/// A coil against the field at the end of a taut rod: straight until lambda mu B = sqrt(lambda f EI).
#[test]
fn a_true_fold_stays_one() {
    for (tension, torque, expected) in [(400.0, 40.0, 0.25), (9.0, 6.0, 0.25)] {
        let mut rod = unit_rod([0.0; 3], [tension, 0.0, 0.0]);
        rod.flux_density = [1.0, 0.0, 0.0];
        let coil = RigidRod { dipole: [0.0, 0.0, -torque], ..RigidRod::default() };
        rod.segments.push(RodSegment::Rigid(coil));
        let found = solve_rod(&rod, &[]);
        assert_eq!(found.status, Status::Fold, "{tension}");
        // The shorter rod's clamp is felt at its tip: coth(sqrt(lambda f)).
        let coth = 1.0 / (expected * tension).sqrt().tanh();
        let slack = 1e-4 + 3.0 * (coth - 1.0);
        assert!((found.load_fraction / expected - 1.0).abs() < slack, "{tension}: at {}", found.load_fraction);
    }
}

/// A flexible magnet in its field is as taut as a rod that is pulled.
#[test]
fn magnets_count_as_tension() {
    let mut rod = unit_rod([0.0; 3], [0.0, 0.1, 0.0]);
    rod.flux_density = [0.0, 0.0, 2.0];
    let RodSegment::Flexible(segment) = &mut rod.segments[0] else { unreachable!("one flexible segment") };
    (segment.dipole, segment.stiffness) = ([0.0, 0.0, 800.0], [1.0, 1.0, 1.0]);
    assert!((growth_exponent(&rod) - 1600.1_f64.sqrt()).abs() < 0.01, "{}", growth_exponent(&rod));
    let found = solved(&rod);
    // All but a layer points along the field.
    assert!((found.p_tip[2] - 1.0).abs() < 0.05 && found.R_tip[2][2] > 0.999, "{found:?}");
}

/// Points along a limp rod: the last is the tip, derivatives are those of differences.
#[test]
fn shapes_of_limp_rods() {
    let cases = limp::cases();
    for name in ["guidewire_tip_coil_1.5m", "rigid_base_stiff_then_limp"] {
        let rod = cases.iter().find(|case| case.scene.name == name).expect("one of them").scene.rod();
        let (units, coil) =
            (rod_units(&rod), rod.segments.iter().position(|segment| !segment.is_flexible()).expect("a coil"));
        let slots = [
            Slot::TipForce(Axis::X),
            Slot::TipMoment(Axis::Z),
            Slot::BaseRotation(Axis::Y),
            Slot::BasePosition(Axis::X),
            Slot::FluxDensity(Axis::X),
            Slot::Dipole(coil, Axis::Y),
            Slot::Load(1, Axis::X),
            Slot::RestCurvature(1, Axis::Y),
            Slot::Stiffness(1, Axis::X),
        ];
        let at: Vec<f64> = [0.02, 0.31, 0.77, 0.96, 1.0].map(|share| share * rod.total_length()).to_vec();
        let here = solve_rod(&rod, &slots);
        let poses = shape_with_derivatives(&rod, here.m0, &at, &slots).expect("a shape");
        for (plain, pose) in shape(&rod, &here, &at).iter().zip(&poses) {
            assert!((vector(plain.position) - vector(pose.position)).norm() < 1e-10 * units.length, "{name}");
        }
        let tip = poses.last().expect("the tip");
        assert!((vector(tip.position) - vector(here.p_tip)).norm() < 1e-10 * units.length, "{name}");
        let check = |k: usize| {
            let slot = slots[k];
            let of_tip = here.derivatives[k];
            let moved_by = |pose: &Pose| {
                let d = pose.derivatives[k];
                vector(d.w).norm().max(vector(d.dp).norm() / units.length)
            };
            // Turns no point by more than a thousandth.
            let h = (1e-3 / poses.iter().map(moved_by).fold(0.0, f64::max)).min(1e-4 * slot.unit(&units));
            let [plus, minus] = [h, -h].map(|by| {
                let rod = moved(&rod, slot, by);
                shape(&rod, &solved(&rod), &at)
            });
            assert!((vector(of_tip.dp) - vector(tip.derivatives[k].dp)).norm() * h < 1e-9 * units.length, "{slot:?}");
            for ((pose, plus), minus) in poses.iter().zip(&plus).zip(&minus) {
                let found = pose.derivatives[k];
                let dp = (vector(plus.position) - vector(minus.position)) / (2.0 * h);
                let matrix = |rows: [[f64; 3]; 3]| Matrix3::from_fn(|row, col| rows[row][col]);
                let turn = matrix(plus.rotation) * matrix(minus.rotation).transpose();
                let w = Vector3::new(turn.m32 - turn.m23, turn.m13 - turn.m31, turn.m21 - turn.m12) / (4.0 * h);
                let off = (vector(found.dp) - dp).norm() * h / units.length;
                assert!(off < 1e-9 + 1e-4 * dp.norm() * h / units.length, "{name}, {slot:?}: {found:?}, not {dp}");
                let off = (vector(found.w) - w).norm() * h;
                assert!(off < 1e-9 + 1e-4 * w.norm() * h, "{name}, {slot:?}: {found:?}, not {w}");
            }
        };
        (0..slots.len()).into_par_iter().for_each(check);
    }
}

/// Hellmann and Feynman: dE/d(tip force) is minus the tip's place.
#[test]
fn energies_of_limp_rods() {
    let at = |force: f64| {
        let rod = unit_rod([0.0, 0.0, -3000.0], [0.0, force, 0.0]);
        let found = solved(&rod);
        let energies = [energy_of(&rod, &found), energy(&rod, found.m0)].map(|energy| energy.expect("an energy"));
        assert!((energies[0] / energies[1] - 1.0).abs() < 1e-10, "{energies:?}");
        (energies[0], found.p_tip[1])
    };
    let (plus, minus, middle) = (at(11.0).0, at(9.0).0, at(10.0).1);
    let slope = (plus - minus) / 2.0;
    assert!((slope + middle).abs() < 1e-6, "{slope}, not {}", -middle);
}

/// A base moment alone does not tell the state of a limp rod: there is an answer for that of the equilibrium from rest,
/// and none for others.
#[test]
fn base_moments_of_limp_rods() {
    let case = limp::cases().into_iter().find(|case| case.scene.name == "two_coils_limp").expect("one of them");
    let rod = case.scene.rod();
    let other = case.m0.map(|m| 1.3 * m);
    let stable = stability_at(&rod, case.m0).expect("the equilibrium from rest");
    assert!(stable.index == 0 && (stable.margin / case.margin - 1.0).abs() < 1e-5, "{stable:?}");
    assert_eq!(stability_at(&rod, other), None);
    assert!(shape_with_derivatives(&rod, case.m0, &[0.1], &[]).is_some());
    assert!(shape_with_derivatives(&rod, other, &[0.1], &[]).is_none());
    assert!(energy(&rod, case.m0).is_some() && energy(&rod, other).is_none());
    assert!(residual_by_base_moment(&rod, case.m0).is_none());
    for case in limp::cases() {
        let Some(expected) = case.u0 else { continue };
        let u0 = base_curvature(&case.scene.rod(), case.m0).expect("a curvature");
        assert!((vector(u0) - vector(expected)).norm() < 1e-10 * vector(expected).norm(), "{}", case.scene.name);
    }
}
