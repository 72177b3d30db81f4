//! Derivatives of the reference on random scenes: by slots against automatic differentiation and against differences
//! on the manifold, by parameters against differences of everything from the scene on.

#![allow(non_snake_case)]

use crate::common::strategy::{Count, check_scenes};
use crate::dual::{Shot, dual_rod, shoot};
use crate::rods::{all_slots, moved, rod_units};
use nalgebra::{Matrix3, Vector3};
use num_dual::Dual64;
use rodsweep::model::{
    Density, Flexible, Parameter, Rod, RodSegment, Scene, SegmentKind, SegmentParameter, ShearAxis, Slot, Stiffness,
    StiffnessAxis, Units, base_curvature_rate,
};
use rodsweep::reference::{Equilibrium, SlotDerivative, solve_rod};

const SCENES: Count = Count { scenes: 205, most_unsolved: 5 };
const FEWER_SCENES: Count = Count { scenes: 82, most_unsolved: 2 };
/// Relative to each column (at least `SMALL` of its natural size). Rounding of both integrations, 1e-14, over `SMALL`
/// and the conditioning of the rod.
const AUTOMATIC: f64 = 1e-10;
/// Columns below this share of their natural size are measured against it.
const SMALL: f64 = 1e-3;
/// Step of differences, in natural units of what moves.
const STEP: f64 = 1e-3;
/// Step of differences over what must not change by much.
const SHARE: f64 = 1e-2;
/// Differences of fourth order err by the fourth power of the step, 1e-12, times what five derivatives grow by, and
/// by 1e-14 over the step and over `SMALL`.
const DIFFERENCES: f64 = 1e-6;
/// Rods closer to a fold than this are not differentiated by differences of this step.
const MARGIN: f64 = 0.1;

/// (dp/L, w, dm0/M, du0 L) per natural unit: pure numbers, of order one for the natural column.
fn pure(units: &Units, unit: f64, d: &SlotDerivative) -> [f64; 12] {
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
        SlotDerivative {
            dp: total(|s| rate(s.p)),
            w: total(spin),
            dm0: dm0.into(),
            du0: total(|s| rate(s.u0)),
            ..SlotDerivative::default()
        }
    };
    slots.iter().map(derivative).collect()
}

/// Where a number may be moved to.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Both,
    Up,
    Down,
}

/// Multiples of the step and their weights: first derivative to the fourth order.
fn stencil(side: Side) -> Vec<(f64, f64)> {
    let one_sided = [(0.0, -25.0 / 12.0), (1.0, 4.0), (2.0, -3.0), (3.0, 4.0 / 3.0), (4.0, -0.25)];
    match side {
        Side::Both => vec![(-2.0, 1.0 / 12.0), (-1.0, -2.0 / 3.0), (1.0, 2.0 / 3.0), (2.0, -1.0 / 12.0)],
        Side::Up => one_sided.to_vec(),
        Side::Down => one_sided.map(|(at, weight)| (-at, -weight)).to_vec(),
    }
}

/// Rotation vector of a small turn.
fn logarithm(turn: &Matrix3<f64>) -> Vector3<f64> {
    let axis = 0.5 * Vector3::new(turn.m32 - turn.m23, turn.m13 - turn.m31, turn.m21 - turn.m12);
    let sine = axis.norm();
    if sine > 0.0 { axis * (sine.asin() / sine) } else { axis }
}

/// Derivative by differences of solutions; `None` where one of them is missing.
fn difference(at: &Equilibrium, side: Side, h: f64, solve: impl Fn(f64) -> Equilibrium) -> Option<SlotDerivative> {
    let matrix = |R: &[[f64; 3]; 3]| Matrix3::from_fn(|row, col| R[row][col]);
    let mut total = SlotDerivative::default();
    for (multiple, weight) in stencil(side) {
        let other = solve(multiple * h);
        if !other.status.is_success() {
            return None;
        }
        let w = logarithm(&(matrix(&other.R_tip) * matrix(&at.R_tip).transpose()));
        let add = |sum: &mut [f64; 3], to: [f64; 3], from: [f64; 3]| {
            (0..3).for_each(|k| sum[k] += weight / h * (to[k] - from[k]));
        };
        add(&mut total.dp, other.p_tip, at.p_tip);
        add(&mut total.w, w.into(), [0.0; 3]);
        add(&mut total.dm0, other.m0, at.m0);
        add(&mut total.du0, other.u0, at.u0);
    }
    Some(total)
}

/// The worst of several columns, `None` without a solution.
fn worst(columns: impl Iterator<Item = (f64, String)>) -> Option<(f64, String)> {
    let size = |error: f64| if error.is_nan() { f64::INFINITY } else { error };
    columns.max_by(|a, b| size(a.0).total_cmp(&size(b.0)))
}

#[test]
fn automatic_differentiation() {
    check_scenes("automatic differentiation", FEWER_SCENES, AUTOMATIC, |scene| {
        let rod = scene.rod();
        let slots = all_slots(&rod);
        let equilibrium = solve_rod(&rod, &slots);
        if !equilibrium.status.is_success() {
            return None;
        }
        let units = rod_units(&rod);
        let expected = automatic(&rod, equilibrium.m0, &slots);
        let columns = slots.iter().zip(&equilibrium.derivatives).zip(&expected);
        worst(columns.map(|((slot, found), expected)| {
            // No plan inserts a rigid segment.
            let is_planned = *slot != Slot::Insertion || rod.segments[0].is_flexible();
            let du0 = base_curvature_rate(&rod, equilibrium.m0, *slot, found.dm0);
            let by_model = SlotDerivative { du0: if is_planned { du0 } else { expected.du0 }, ..*expected };
            let [found, expected, by_model] = [found, expected, &by_model].map(|d| pure(&units, slot.unit(&units), d));
            let error = relative_error(&found, &expected);
            (error.max(relative_error(&by_model, &expected)), format!("{slot:?}"))
        }))
    });
}

#[test]
fn independent_integration_agrees() {
    check_scenes("independent integration", SCENES, 1e-12, |scene| {
        let rod = scene.rod();
        let equilibrium = solve_rod(&rod, &[]);
        if !equilibrium.status.is_success() {
            return None;
        }
        let shot = shoot(&dual_rod(&rod, &[]), equilibrium.m0.map(Dual64::from));
        let units = rod_units(&rod);
        let errors = [
            ((value(shot.p) - Vector3::from(equilibrium.p_tip)).norm() / units.length, "position".to_owned()),
            (value(shot.residual).norm() / units.moment(), "moment".to_owned()),
            ((value(shot.u0) - Vector3::from(equilibrium.u0)).norm() / units.curvature(), "curvature".to_owned()),
        ];
        worst(errors.into_iter())
    });
}

#[test]
fn slots_by_differences() {
    check_scenes("slots by differences", FEWER_SCENES, DIFFERENCES, |scene| {
        let rod = scene.rod();
        let slots = all_slots(&rod);
        let equilibrium = solve_rod(&rod, &slots);
        if !equilibrium.status.is_success() || equilibrium.margin < MARGIN {
            return None;
        }
        let units = rod_units(&rod);
        let columns = slots.iter().zip(&equilibrium.derivatives).filter_map(|(slot, found)| {
            let unit = slot.unit(&units);
            let side = match slot {
                // Insertion into a rigid segment is by the base's pose alone.
                Slot::Insertion if !rod.segments[0].is_flexible() => return None,
                Slot::Insertion if rod.segments[0].length() < 4.0 * STEP * unit => return None,
                Slot::Length(j) if rod.segments[*j].length() == 0.0 => Side::Up,
                // Compliances are not negative.
                Slot::ShearCompliance(..) => Side::Up,
                _ => Side::Both,
            };
            let h = match slot {
                // What varies goes on, for a share of the length.
                Slot::Length(j) if side == Side::Both => (STEP * unit).min(SHARE * rod.segments[*j].length()),
                _ => STEP * unit,
            };
            let expected = difference(&equilibrium, side, h, |by| solve_rod(&moved(&rod, *slot, by), &[]));
            let Some(expected) = expected else { return Some((f64::NAN, format!("{slot:?}, unsolved beside"))) };
            let [found, expected] = [found, &expected].map(|d| pure(&units, unit, d));
            Some((relative_error(&found, &expected), format!("{slot:?}")))
        });
        worst(columns)
    });
}

/// Derivative by a parameter: its chain of slots.
fn chained(scene: &Scene, parameter: Parameter, slots: &[Slot], of_slots: &[SlotDerivative]) -> SlotDerivative {
    let mut total = SlotDerivative::default();
    for (slot, rate) in parameter.chain(scene) {
        let k = slots.iter().position(|other| *other == slot).expect("one of all slots");
        let add = |sum: &mut [f64; 3], by: &[f64; 3]| (0..3).for_each(|axis| sum[axis] += rate * by[axis]);
        let of_slot = &of_slots[k];
        add(&mut total.dp, &of_slot.dp);
        add(&mut total.w, &of_slot.w);
        add(&mut total.dm0, &of_slot.dm0);
        add(&mut total.du0, &of_slot.du0);
    }
    total
}

/// Where a parameter may be moved to, and at most by how much.
fn reach(scene: &Scene, parameter: Parameter) -> (Side, f64) {
    use SegmentParameter as S;
    match parameter {
        // Withdrawn: at a node the slope is that of the piece that lies in the body. Weight changes nothing: what is
        // pushed in lies at the clamp, without an arm.
        Parameter::Insertion => {
            let rod = scene.rod();
            let pieces = scene.piece_indices(0).map(|piece| rod.segments[piece]);
            let outermost =
                pieces.filter(RodSegment::is_flexible).map(|piece| piece.length()).find(|length| *length > 0.0);
            (Side::Down, outermost.map_or(f64::NAN, |length| SHARE * length))
        }
        // Pushed on: a shorter segment may lose its last node.
        Parameter::Segment(_, S::Length) => (Side::Up, f64::INFINITY),
        // Far from linear.
        Parameter::Segment(_, S::StiffnessShear(_) | S::StiffnessAxial | S::InnerRadius) => {
            let least = components(parameter).iter().map(|part| part.get(scene)).fold(f64::INFINITY, f64::min);
            (Side::Both, SHARE * least)
        }
        Parameter::Segment(_, S::Alignment(_)) => (Side::Both, SHARE),
        _ => (Side::Both, f64::INFINITY),
    }
}

/// What a parameter drives together moves by the same amount.
fn components(parameter: Parameter) -> Vec<Parameter> {
    use SegmentParameter as S;
    use StiffnessAxis::{Bending, BendingX, BendingY};
    let both = |segment: usize, parts: [S; 2]| parts.map(|part| Parameter::Segment(segment, part)).to_vec();
    match parameter {
        Parameter::Segment(j, S::Stiffness(Bending)) => both(j, [BendingX, BendingY].map(S::Stiffness)),
        Parameter::Segment(j, S::StiffnessNode(k, Bending)) => {
            both(j, [BendingX, BendingY].map(|axis| S::StiffnessNode(k, axis)))
        }
        Parameter::Segment(j, S::StiffnessShear(ShearAxis::Both)) => {
            both(j, [ShearAxis::X, ShearAxis::Y].map(S::StiffnessShear))
        }
        _ => vec![parameter],
    }
}

/// The scene with a tube described by what it comes to, where its stiffness is to be moved.
fn settable(scene: &Scene, parameter: Parameter) -> Scene {
    let mut scene = scene.clone();
    let Parameter::Segment(j, SegmentParameter::Stiffness(_)) = parameter else { return scene };
    let SegmentKind::Flexible(flexible) = &scene.segments[j].kind else { return scene };
    let [bending_x, bending_y, torsion] = flexible.stiffness.principal();
    let density = flexible.density.map(|_| Density::Linear(scene.linear_density(flexible)));
    let stiffness = Stiffness::Direct { bending_x, bending_y, torsion };
    scene.segments[j].kind = SegmentKind::Flexible(Flexible { stiffness, density, ..flexible.clone() });
    scene
}

#[test]
fn parameters_by_differences() {
    check_scenes("parameters by differences", FEWER_SCENES, DIFFERENCES, |scene| {
        let rod = scene.rod();
        let slots = all_slots(&rod);
        let equilibrium = solve_rod(&rod, &slots);
        if !equilibrium.status.is_success() || equilibrium.margin < MARGIN {
            return None;
        }
        let units = rod_units(&rod);
        let columns = Parameter::all(scene).into_iter().filter_map(|parameter| {
            let rates = parameter.chain(scene);
            let natural = rates.iter().map(|(slot, rate)| (rate / slot.unit(&units)).powi(2)).sum::<f64>().sqrt();
            // A parameter that moves nothing may be moved by anything.
            let unit = if natural > 0.0 { 1.0 / natural } else { 1.0 };
            let (side, most) = reach(scene, parameter);
            let h = (STEP * unit).min(most);
            // Nothing can be withdrawn from a first segment that is rigid or has no length.
            if parameter == Parameter::Insertion && most.is_nan() {
                return None;
            }
            let settable = settable(scene, parameter);
            let solve = |by: f64| {
                let mut scene = settable.clone();
                for component in components(parameter) {
                    let value = component.get(&scene) + by;
                    component.set(&mut scene, value).expect("settable");
                }
                solve_rod(&scene.rod(), &[])
            };
            let name = parameter.name(scene);
            let Some(expected) = difference(&equilibrium, side, h, solve) else {
                return Some((f64::NAN, format!("{name}, unsolved beside")));
            };
            let found = chained(scene, parameter, &slots, &equilibrium.derivatives);
            let [found, expected] = [&found, &expected].map(|d| pure(&units, unit, d));
            Some((relative_error(&found, &expected), name))
        });
        worst(columns)
    });
}
