//! Derivatives of the reference against automatic differentiation and against differences on the manifold.

#![allow(non_snake_case)]

mod common;

use common::dual::{Shot, dual_rod, shoot};
use common::random::{Random, all_slots, moved, rod_units};
use nalgebra::{Matrix3, Vector3};
use num_dual::Dual64;
use rodsweep::model::{Rod, Slot};
use rodsweep::reference::{Equilibrium, SlotDerivative, solve_rod};

const ROD_COUNT: u64 = 60;
/// Relative to each column (at least `SMALL` of its natural size). Rounding of both integrations, 1e-14, over `SMALL`.
const AUTOMATIC: f64 = 1e-10;
/// Central differences with a relative step of 1e-5 err by its square, and by 1e-13 over it.
const DIFFERENCES: f64 = 1e-6;
/// Columns below this share of their natural size are measured against it.
const SMALL: f64 = 1e-3;

/// (dp/L, w, dm0/M, du0 L) times the slot's unit: pure numbers, of order one for the natural column.
fn pure(rod: &Rod, slot: Slot, d: &SlotDerivative) -> [f64; 12] {
    let units = rod_units(rod);
    let unit = slot.unit(&units);
    std::array::from_fn(|row| {
        unit * match row / 3 {
            0 => d.dp[row] / units.length,
            1 => d.w[row - 3],
            2 => d.dm0[row - 6] / units.moment(),
            _ => d.du0[row - 9] / units.curvature(),
        }
    })
}

fn relative_error(found: &[f64; 12], expected: &[f64; 12]) -> f64 {
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let error: Vec<f64> = (0..12).map(|k| found[k] - expected[k]).collect();
    // Pose and base apart: one may be large where the other is small.
    let part = |range: std::ops::Range<usize>| norm(&error[range.clone()]) / norm(&expected[range]).max(SMALL);
    let (tip, base) = (part(0..6), part(6..12));
    if tip.is_nan() { tip } else { tip.max(base) }
}

fn value(v: [Dual64; 3]) -> Vector3<f64> {
    Vector3::from(v.map(|x| x.re))
}

fn rate(v: [Dual64; 3]) -> Vector3<f64> {
    Vector3::from(v.map(|x| x.eps))
}

/// w with dR = hat(w) R.
fn spin(shot: &Shot<Dual64>) -> Vector3<f64> {
    (0..3).map(|k| 0.5 * value(shot.R[k]).cross(&rate(shot.R[k]))).sum()
}

/// Total derivatives by the implicit function theorem, every partial derivative by dual numbers.
fn automatic(rod: &Rod, m0: [f64; 3], slots: &[Slot]) -> Vec<SlotDerivative> {
    let constant = m0.map(Dual64::from);
    let base: [Shot<Dual64>; 3] = std::array::from_fn(|k| {
        let mut m0 = constant;
        m0[k].eps = 1.0;
        shoot(&dual_rod(rod, &[]), m0)
    });
    let matrix = Matrix3::from_columns(&[0, 1, 2].map(|k| rate(base[k].residual)));
    let inverse = matrix.try_inverse().expect("a regular equilibrium");
    let derivative = |slot: &Slot| {
        let shot = shoot(&dual_rod(rod, &[(*slot, Dual64::new(0.0, 1.0))]), constant);
        let dm0 = -inverse * rate(shot.residual);
        let total = |of: fn(&Shot<Dual64>) -> Vector3<f64>| -> [f64; 3] {
            (of(&shot) + (0..3).map(|k| of(&base[k]) * dm0[k]).sum::<Vector3<f64>>()).into()
        };
        SlotDerivative { dp: total(|s| rate(s.p)), w: total(spin), dm0: dm0.into(), du0: total(|s| rate(s.u0)) }
    };
    slots.iter().map(derivative).collect()
}

/// Derivative by central differences of two solutions.
fn difference(plus: &Equilibrium, minus: &Equilibrium, h: f64) -> SlotDerivative {
    let half = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|k| (a[k] - b[k]) / (2.0 * h));
    let matrix = |R: &[[f64; 3]; 3]| Matrix3::from_fn(|row, col| R[row][col]);
    // The turn is small: its sine is its angle.
    let turn = matrix(&plus.R_tip) * matrix(&minus.R_tip).transpose();
    let axis = 0.5 * Vector3::new(turn.m32 - turn.m23, turn.m13 - turn.m31, turn.m21 - turn.m12);
    SlotDerivative {
        dp: half(plus.p_tip, minus.p_tip),
        w: (axis / (2.0 * h)).into(),
        dm0: half(plus.m0, minus.m0),
        du0: half(plus.u0, minus.u0),
    }
}

fn random_rods() -> impl Iterator<Item = (u64, Rod)> {
    (0..ROD_COUNT).map(|seed| {
        let mut rod = Random(seed).rod();
        rod.rigid_force_arm = seed % 5 != 0;
        (seed, rod)
    })
}

#[test]
fn automatic_differentiation() {
    let mut worst = (0.0, 0, Slot::Insertion);
    for (seed, rod) in random_rods() {
        let slots = all_slots(&rod);
        let equilibrium = solve_rod(&rod, &slots);
        assert!(equilibrium.status.is_success(), "rod {seed}: {:?}", equilibrium.status);
        let expected = automatic(&rod, equilibrium.m0, &slots);
        for ((slot, found), expected) in slots.iter().zip(&equilibrium.derivatives).zip(&expected) {
            let error = relative_error(&pure(&rod, *slot, found), &pure(&rod, *slot, expected));
            if error.is_nan() || error > worst.0 {
                worst = (error, seed, *slot);
            }
        }
    }
    println!("worst against automatic differentiation: {worst:?}");
    assert!(worst.0 <= AUTOMATIC, "{worst:?}");
}

#[test]
fn independent_integration_agrees() {
    let mut worst = (0.0, 0);
    for (seed, rod) in random_rods() {
        let equilibrium = solve_rod(&rod, &[]);
        let shot = shoot(&dual_rod(&rod, &[]), equilibrium.m0.map(Dual64::from));
        let units = rod_units(&rod);
        let error = ((value(shot.p) - Vector3::from(equilibrium.p_tip)).norm() / units.length)
            .max(value(shot.residual).norm() / units.moment())
            .max((value(shot.u0) - Vector3::from(equilibrium.u0)).norm() / units.curvature());
        if error.is_nan() || error > worst.0 {
            worst = (error, seed);
        }
    }
    println!("worst solution: {worst:?}");
    assert!(worst.0 <= 1e-12, "{worst:?}");
}

#[test]
fn differences_on_the_manifold() {
    let mut worst = (0.0, 0, Slot::Insertion);
    for (seed, rod) in random_rods() {
        let slots = all_slots(&rod);
        let equilibrium = solve_rod(&rod, &slots);
        for (slot, found) in slots.iter().zip(&equilibrium.derivatives) {
            if *slot == Slot::Insertion && !rod.segments[0].is_flexible() {
                continue;
            }
            let h = 1e-5 * slot.unit(&rod_units(&rod));
            let [plus, minus] = [h, -h].map(|by| solve_rod(&moved(&rod, *slot, by), &[]));
            assert!(plus.status.is_success() && minus.status.is_success(), "rod {seed} moved along {slot:?}");
            let expected = difference(&plus, &minus, h);
            let error = relative_error(&pure(&rod, *slot, found), &pure(&rod, *slot, &expected));
            if error.is_nan() || error > worst.0 {
                worst = (error, seed, *slot);
            }
        }
    }
    println!("worst against differences: {worst:?}");
    assert!(worst.0 <= DIFFERENCES, "{worst:?}");
}
