//! Points along the rod and their derivatives: against the tip, against differences, against the command line.

#![allow(non_snake_case)]

use crate::common::strategy::some_scenes;
use crate::rods::{all_slots, rod_units};
use nalgebra::{Matrix3, Vector3};
use rodsweep::model::{Parameter, Rod, Scene, Slot};
use rodsweep::reference::{Pose, PoseDerivative, shape, shape_with_derivatives, solve_rod};

fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, col| rows[row][col])
}

fn poses(rod: &Rod, slots: &[Slot], shares: &[f64]) -> Vec<Pose> {
    let at: Vec<f64> = shares.iter().map(|share| share * rod.total_length()).collect();
    let solved = solve_rod(rod, &[]);
    assert!(solved.status.is_success(), "{:?}", solved.status);
    shape_with_derivatives(rod, solved.m0, &at, slots).expect("a shape")
}

#[test]
fn the_last_point_is_the_tip() {
    for scene in some_scenes(20) {
        let rod = scene.rod();
        let slots = all_slots(&rod);
        let solved = solve_rod(&rod, &slots);
        let tip = &poses(&rod, &slots, &[1.0])[0];
        let units = rod_units(&rod);
        let size = units.length;
        assert!((Vector3::from(tip.position) - Vector3::from(solved.p_tip)).norm() < 1e-11 * size);
        // More of the last segment grows beyond the point, which is one of the material.
        let last = rod.segments.iter().rposition(|segment| segment.length() > 0.0).expect("a length");
        let derivatives = slots.iter().zip(&solved.derivatives).zip(&tip.derivatives);
        for ((slot, of_tip), of_shape) in
            derivatives.filter(|((slot, _), _)| !matches!(slot, Slot::Length(j) if *j >= last))
        {
            let floor = 1e-12 / slot.unit(&units);
            let (a, b) = (Vector3::from(of_tip.dp), Vector3::from(of_shape.dp));
            assert!((a - b).norm() <= 1e-9 * (a.norm() + b.norm()) + floor * size, "{slot:?}: {a} {b}");
            let (a, b) = (Vector3::from(of_tip.w), Vector3::from(of_shape.w));
            assert!((a - b).norm() <= 1e-9 * (a.norm() + b.norm()) + floor, "{slot:?}: {a} {b}");
        }
    }
}

#[test]
fn both_forms_agree() {
    for scene in some_scenes(20) {
        let rod = scene.rod();
        let at: Vec<f64> = [0.7, 0.1, 0.4].map(|share| share * rod.total_length()).to_vec();
        let solved = solve_rod(&rod, &[]);
        let plain = shape(&rod, &solved, &at);
        // A base moment that is a little off is put right.
        let off = solved.m0.map(|m| m * (1.0 + 1e-7));
        let corrected = shape_with_derivatives(&rod, off, &at, &[]).expect("a shape");
        for (a, b) in plain.iter().zip(&corrected) {
            assert_eq!(a.arc_length, b.arc_length);
            let error = (Vector3::from(a.position) - Vector3::from(b.position)).norm() / rod.total_length();
            assert!(error < 1e-10, "{error:e}");
        }
    }
}

/// Sum of the slots' derivatives, as the chain rule says.
fn by_chain(pose: &Pose, slots: &[Slot], chain: &[(Slot, f64)]) -> PoseDerivative {
    let mut sum = PoseDerivative::default();
    for (slot, rate) in chain {
        let at = slots.iter().position(|other| other == slot).expect("a slot of the rod");
        for axis in 0..3 {
            sum.dp[axis] += rate * pose.derivatives[at].dp[axis];
            sum.w[axis] += rate * pose.derivatives[at].w[axis];
            sum.du[axis] += rate * pose.derivatives[at].du[axis];
        }
    }
    sum
}

/// Points before what lengthens: a point of the material stays at its arc length.
const SHARES: [f64; 3] = [0.11, 0.43, 0.79];

fn moved(scene: &Scene, parameter: Parameter, by: f64) -> Vec<Pose> {
    let value = parameter.get(scene) + by;
    let mut scene = scene.clone();
    parameter.set(&mut scene, value).expect("a parameter that can be set");
    poses(&scene.rod(), &[], &SHARES)
}

#[test]
fn derivatives_are_those_of_differences() {
    let mut checked = 0;
    for scene in some_scenes(12) {
        let rod = scene.rod();
        let slots = all_slots(&rod);
        let length = rod.total_length();
        let here = poses(&rod, &slots, &SHARES);
        for parameter in Parameter::all(&scene) {
            let value = parameter.get(&scene);
            let name = parameter.name(&scene);
            let derived = parameter.set(&mut scene.clone(), value).is_err();
            // Joint parameters make two numbers equal; with a length the same share of the rod is another point.
            let joint = name.ends_with("bending") || name.ends_with("stiffness_shear");
            if derived || joint || !value.is_finite() || name.ends_with(".length") || name == "insertion" {
                continue;
            }
            let chain = parameter.chain(&scene);
            let h = 1e-4 * if value == 0.0 { natural(&parameter) } else { value.abs() };
            let (plus, minus) = (moved(&scene, parameter, h), moved(&scene, parameter, -h));
            for ((here, plus), minus) in here.iter().zip(&plus).zip(&minus) {
                let found = by_chain(here, &slots, &chain);
                let difference = |a: [f64; 3], b: [f64; 3]| (Vector3::from(a) - Vector3::from(b)) / (2.0 * h);
                let turn = matrix(&plus.rotation) * matrix(&minus.rotation).transpose();
                let w = 0.5 * Vector3::new(turn.m32 - turn.m23, turn.m13 - turn.m31, turn.m21 - turn.m12) / (2.0 * h);
                for (found, expected, floor) in [
                    (found.dp, difference(plus.position, minus.position), 1e-11 * length),
                    (found.w, w, 1e-11),
                    (found.du, difference(plus.curvature, minus.curvature), 1e-11 / length),
                ] {
                    let error = (Vector3::from(found) - expected).norm();
                    assert!(error <= 1e-5 * expected.norm() + floor / h, "{name}: {found:?}, not {expected:?}");
                }
            }
            checked += 1;
        }
    }
    assert!(checked > 200, "{checked}");
}

/// A step for what is zero in the scene.
fn natural(parameter: &Parameter) -> f64 {
    match parameter.unit() {
        "N" => 1e-3,
        "N·m" => 1e-5,
        "N/m" => 1e-2,
        "1/m" => 1.0,
        "A" => 0.1,
        "A·m" => 1e-4,
        "m²" => 1e-4,
        "m" => 1e-2,
        "kg" => 1e-4,
        _ => 1.0,
    }
}
