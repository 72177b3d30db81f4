//! The reference against closed forms, quadratures and invariances.

#![allow(non_snake_case)]

use crate::common::check::{difference, norm};
use crate::rods::rod_units;
use nalgebra::{Matrix3, Rotation3, Vector3};
use rodsweep::model::{Axis, FlexibleRod, RigidRod, Rod, RodSegment, Slot, Status};
use rodsweep::reference::{Equilibrium, shape, solve_rod, stability_at};
use rodsweep_bench::random::Random;
use std::f64::consts::PI;

/// Closed forms: a hundred integration tolerances (1e-13).
const CLOSED_FORM: f64 = 1e-11;
/// Quadratures of this file are good to this.
const QUADRATURE: f64 = 1e-10;
/// The ramp halves its step down to 1e-5 of the load before it reports a fold.
const FOLD: f64 = 2e-5;

const LENGTH: f64 = 0.12;
const EI: f64 = 5e-5;
const GJ: f64 = 4e-5;

fn plain() -> FlexibleRod {
    FlexibleRod { length: LENGTH, stiffness: [EI, EI, GJ], ..FlexibleRod::default() }
}

/// A straight rod along world z: one flexible segment, no load.
fn straight() -> Rod {
    Rod {
        base_position: [0.0; 3],
        base_rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        flux_density: [0.0; 3],
        field: None,
        wall: None,
        tip_force: [0.0; 3],
        tip_moment: [0.0; 3],
        rigid_force_arm: true,
        segments: vec![RodSegment::Flexible(plain())],
    }
}

fn with_segment(mut rod: Rod, stiffness: [f64; 3], rest_curvature: [f64; 3]) -> Rod {
    rod.segments = vec![RodSegment::Flexible(FlexibleRod { stiffness, rest_curvature, ..plain() })];
    rod
}

fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, col| rows[row][col])
}

/// Integral of exp(s hat(omega)) v for s from 0 to length.
fn turned_path(omega: Vector3<f64>, v: Vector3<f64>, length: f64) -> Vector3<f64> {
    let (rate, axis) = (omega.norm(), omega.normalize());
    let angle = rate * length;
    let along = axis * axis.dot(&v);
    along * length + (v - along) * angle.sin() / rate + axis.cross(&v) * (1.0 - angle.cos()) / rate
}

fn assert_pose(found: &Equilibrium, p: Vector3<f64>, R: Matrix3<f64>) {
    assert!(found.status.is_success(), "{found:?}");
    let error = ((Vector3::from(found.p_tip) - p).norm() / LENGTH).max((matrix(&found.R_tip) - R).norm());
    assert!(error <= CLOSED_FORM, "pose error {error:e}");
}

#[test]
fn arc_and_helix_from_rest_curvature() {
    for u_star in [[12.0, 0.0, 0.0], [0.0, -30.0, 0.0], [9.0, 7.0, 25.0], [0.0, 3.0, -60.0]] {
        let rod = with_segment(straight(), [EI, 1.3 * EI, GJ], u_star);
        let u_star = Vector3::from(u_star);
        let R = Rotation3::new(u_star * LENGTH);
        let found = solve_rod(&rod, &[]);
        assert_pose(&found, turned_path(u_star, Vector3::z(), LENGTH), R.into_inner());
        assert_eq!((found.status, found.load_fraction, found.index), (Status::Ok, 1.0, 0));
        assert!((found.margin - 1.0).abs() <= CLOSED_FORM, "margin {}", found.margin);
    }
}

#[test]
fn end_moment_bends_to_a_helix() {
    for (moment, u3) in [([5e-4, 0.0, 0.0], 0.0), ([3e-4, -4e-4, 6e-4], 0.0), ([1e-3, 2e-4, -3e-4], 8.0)] {
        let mut rod = with_segment(straight(), [EI, EI, GJ], [0.0, 0.0, u3]);
        rod.tip_moment = moment;
        // The moment is the same everywhere, and so is its component along the tangent.
        let m = Vector3::from(moment);
        let spin = u3 + m.z * (1.0 / GJ - 1.0 / EI);
        let R = Rotation3::new(m / EI * LENGTH) * Rotation3::new(Vector3::z() * spin * LENGTH);
        assert_pose(&solve_rod(&rod, &[]), turned_path(m / EI, Vector3::z(), LENGTH), R.into_inner());
    }
}

#[test]
fn torsion() {
    let mut rod = straight();
    rod.tip_moment = [0.0, 0.0, 7e-4];
    let angle = 7e-4 * LENGTH / GJ;
    assert_pose(&solve_rod(&rod, &[]), Vector3::z() * LENGTH, Rotation3::new(Vector3::z() * angle).into_inner());
}

/// Simpson's rule, refined until doubling changes nothing.
fn integral(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let panels = 20_000;
    let h = (b - a) / panels as f64;
    let inner: f64 = (1..panels).map(|k| f(a + k as f64 * h) * if k % 2 == 0 { 2.0 } else { 4.0 }).sum();
    h / 3.0 * (f(a) + inner + f(b))
}

/// A cantilever under a transverse dead force that turns its tip by `angle`: by elliptic integrals.
#[test]
fn planar_elastica() {
    for angle in [0.1, 0.7, 1.2, 1.5] {
        // With 1 + sin(theta) = 2 k^2 sin^2(phi): s sqrt(F/EI) = integral of d phi / sqrt(1 - k^2 sin^2(phi)).
        let k2 = 0.5 * (1.0 + f64::sin(angle));
        let start = (0.5 / k2).sqrt().asin();
        let root = |phi: f64| (1.0 - k2 * phi.sin().powi(2)).sqrt();
        let load = integral(|phi| 1.0 / root(phi), start, PI / 2.0);
        let deflection = integral(|phi| (2.0 * k2 * phi.sin().powi(2) - 1.0) / root(phi), start, PI / 2.0) / load;
        let reach = (2.0 * f64::sin(angle)).sqrt() / load;
        let mut rod = straight();
        rod.tip_force = [EI * (load / LENGTH).powi(2), 0.0, 0.0];
        let found = solve_rod(&rod, &[]);
        let expected = Vector3::new(deflection, 0.0, reach);
        let error = (Vector3::from(found.p_tip) / LENGTH - expected).norm();
        assert!(error <= QUADRATURE, "angle {angle}: {error:e}");
        let turn = matrix(&found.R_tip).column(2).x.asin();
        assert!((turn - angle).abs() <= QUADRATURE, "angle {angle}: {turn}");
        assert_eq!(found.index, 0);
    }
}

#[test]
fn cantilever_compliances_at_no_load() {
    let rod = straight();
    let slots = [Slot::TipForce(Axis::X), Slot::TipMoment(Axis::Y), Slot::Load(0, Axis::X), Slot::TipMoment(Axis::Z)];
    let found = solve_rod(&rod, &slots);
    let close = |found: f64, expected: f64| {
        assert!((found / expected - 1.0).abs() <= CLOSED_FORM, "{found} against {expected}")
    };
    let [force, moment, load, twist] = [0, 1, 2, 3].map(|k| found.derivatives[k]);
    close(force.dp[0], LENGTH.powi(3) / (3.0 * EI));
    close(force.w[1], LENGTH.powi(2) / (2.0 * EI));
    close(force.dm0[1], LENGTH);
    close(moment.dp[0], LENGTH.powi(2) / (2.0 * EI));
    close(moment.w[1], LENGTH / EI);
    close(load.dp[0], LENGTH.powi(4) / (8.0 * EI));
    close(load.w[1], LENGTH.powi(3) / (6.0 * EI));
    close(twist.w[2], LENGTH / GJ);
    close(twist.du0[2], 1.0 / GJ);
}

#[test]
fn small_load_bends_as_the_linear_beam() {
    let mut rod = straight();
    let small = 1e-4;
    rod.tip_force = [small * EI / LENGTH.powi(2), 0.0, 0.0];
    let found = solve_rod(&rod, &[]);
    // The next term of the series is of relative order small^2.
    assert!((found.p_tip[0] / LENGTH / (small / 3.0) - 1.0).abs() <= small * small);
}

#[test]
fn euler_load() {
    let critical = PI * PI * EI / (4.0 * LENGTH * LENGTH);
    for (stiffness, beyond) in [([EI, EI, GJ], 2), ([EI, 1.5 * EI, GJ], 1)] {
        let compressed = |share: f64| {
            let mut rod = with_segment(straight(), stiffness, [0.0; 3]);
            rod.tip_force = [0.0, 0.0, -share * critical];
            rod
        };
        for (share, index) in [(0.5, 0), (0.99, 0), (0.9999, 0), (1.0001, beyond), (1.2, beyond)] {
            let found = stability_at(&compressed(share), [0.0; 3]).expect("integrable");
            assert_eq!(found.index, index, "at {share} of the Euler load");
            // dr/dm0 = diag(cos kx L, cos ky L, 1)
            let cos = |k: f64| (PI / 2.0 * (share * EI / k).sqrt()).cos();
            let size = (3.0 / (cos(stiffness[0]).powi(-2) + cos(stiffness[1]).powi(-2) + 1.0)).sqrt();
            let margin = if index > 0 { -size } else { size };
            assert!((found.margin - margin).abs() <= CLOSED_FORM, "{} against {margin} at {share}", found.margin);
        }
        for share in [1.001, 1.37, 2.0, 7.3] {
            let folded = solve_rod(&compressed(share), &[]);
            assert_eq!(folded.status, Status::Fold, "at {share} of the Euler load");
            assert!((folded.load_fraction - 1.0 / share).abs() <= FOLD, "{}", folded.load_fraction);
            assert!(folded.p_tip.iter().all(|x| x.is_finite()));
        }
    }
}

/// m0 = moments of all loads about the base, from the shape; dead couples and dipoles as they are.
#[test]
fn base_moment_balances_the_loads() {
    let mut worst = (0.0, 0);
    for seed in 0..40 {
        let rod = Random(1000 + seed).rod();
        let found = solve_rod(&rod, &[]);
        let p0 = Vector3::from(rod.base_position);
        let mut m =
            Vector3::from(rod.tip_moment) + (Vector3::from(found.p_tip) - p0).cross(&Vector3::from(rod.tip_force));
        let mut start = 0.0;
        for segment in &rod.segments {
            let length = segment.length();
            // Simpson's rule.
            let panels = 200;
            let at: Vec<f64> = (0..=panels).map(|k| start + length * k as f64 / panels as f64).collect();
            let poses = shape(&rod, &found, &at);
            assert_eq!(poses.len(), panels + 1);
            for (k, pose) in poses.iter().enumerate() {
                let weight = if k == 0 || k == panels {
                    1.0
                } else if k % 2 == 0 {
                    2.0
                } else {
                    4.0
                };
                let (load, mu) = match segment {
                    RodSegment::Flexible(flexible) => (Vector3::from(flexible.load), Vector3::from(flexible.dipole)),
                    RodSegment::Rigid(rigid) => {
                        (Vector3::from(rigid.weight) / length, Vector3::from(rigid.dipole) / length)
                    }
                };
                let share = weight * length / (3.0 * panels as f64);
                m += share * (Vector3::from(pose.position) - p0).cross(&load);
                m += share * (matrix(&pose.rotation) * mu).cross(&Vector3::from(rod.flux_density));
            }
            start += length;
        }
        let error = (m - Vector3::from(found.m0)).norm() / rod_units(&rod).moment();
        if error.is_nan() || error > worst.0 {
            worst = (error, seed);
        }
    }
    println!("worst balance: {worst:?}");
    assert!(worst.0 <= QUADRATURE, "{worst:?}");
}

#[test]
fn shape_meets_both_ends() {
    for seed in 0..20 {
        let rod = Random(2000 + seed).rod();
        let found = solve_rod(&rod, &[]);
        let length = rod.total_length();
        let poses = shape(&rod, &found, &[length, 0.0, 0.5 * length]);
        assert!(difference(&poses[0].position, &found.p_tip) <= CLOSED_FORM * length);
        assert!((matrix(&poses[0].rotation) - matrix(&found.R_tip)).norm() <= CLOSED_FORM);
        assert!(difference(&poses[1].position, &rod.base_position) <= CLOSED_FORM * length);
        assert_eq!(poses[2].arc_length, 0.5 * length);
        if rod.segments[0].is_flexible() {
            assert!(difference(&poses[1].curvature, &found.u0) <= CLOSED_FORM * norm(&found.u0).max(1.0 / length));
        }
    }
}

#[test]
fn turning_the_world_turns_the_results() {
    for seed in 0..20 {
        let rod = Random(3000 + seed).rod();
        let turn = matrix(&Random(seed).rotation());
        let turned = |v: [f64; 3]| -> [f64; 3] { (turn * Vector3::from(v)).into() };
        let mut other = rod.clone();
        let R0 = turn * matrix(&rod.base_rotation);
        other.base_rotation = std::array::from_fn(|row| std::array::from_fn(|col| R0[(row, col)]));
        for v in [&mut other.base_position, &mut other.flux_density, &mut other.tip_force, &mut other.tip_moment] {
            *v = turned(*v);
        }
        for segment in &mut other.segments {
            match segment {
                RodSegment::Flexible(flexible) => flexible.load = turned(flexible.load),
                RodSegment::Rigid(rigid) => rigid.weight = turned(rigid.weight),
            }
        }
        let (a, b) = (solve_rod(&rod, &[]), solve_rod(&other, &[]));
        assert!(difference(&turned(a.p_tip), &b.p_tip) <= CLOSED_FORM * rod.total_length(), "rod {seed}");
        assert!(difference(&a.u0, &b.u0) <= CLOSED_FORM * norm(&a.u0).max(1.0 / rod.total_length()), "rod {seed}");
        assert!((a.margin - b.margin).abs() <= CLOSED_FORM, "rod {seed}");
    }
}

#[test]
fn segments_without_length_change_nothing() {
    for seed in 0..20 {
        let rod = Random(4000 + seed).rod();
        let mut other = rod.clone();
        let flexible = RodSegment::Flexible(FlexibleRod {
            length: 0.0,
            stiffness: [1e-3, 2e-6, 3e-5],
            rest_curvature: [50.0, 2.0, 1.0],
            load: [1.0, 2.0, 3.0],
            ..FlexibleRod::default()
        });
        let rigid = RodSegment::Rigid(RigidRod::default());
        for at in (0..=rod.segments.len()).rev() {
            other.segments.insert(at, if at % 2 == 0 { flexible } else { rigid });
        }
        let slots = [Slot::Length(0), Slot::Length(1), Slot::Insertion];
        let (a, b) = (solve_rod(&rod, &[Slot::TipForce(Axis::X)]), solve_rod(&other, &slots));
        assert!(difference(&a.p_tip, &b.p_tip) <= CLOSED_FORM * rod.total_length(), "rod {seed}");
        assert!(difference(&a.m0, &b.m0) <= CLOSED_FORM * norm(&a.m0).max(EI / LENGTH), "rod {seed}");
        assert_eq!((a.index, b.index), (0, 0));
        assert!(b.derivatives.iter().all(|d| d.dp.iter().chain(&d.w).all(|x| x.is_finite())));
    }
}

#[test]
fn scale_does_not_matter() {
    let rod = Random(5).rod();
    let found = solve_rod(&rod, &[]);
    // A suture and a mast: lengths by `a`, stiffness by `b`.
    for (a, b) in [(1e-3, 1e-9), (1e3, 1e14)] {
        let mut other = rod.clone();
        let by = |v: &mut [f64; 3], factor: f64| v.iter_mut().for_each(|x| *x *= factor);
        by(&mut other.base_position, a);
        by(&mut other.tip_force, b / (a * a));
        by(&mut other.tip_moment, b / a);
        for segment in &mut other.segments {
            match segment {
                RodSegment::Flexible(flexible) => {
                    flexible.length *= a;
                    by(&mut flexible.stiffness, b);
                    by(&mut flexible.stiffness_rise, b);
                    by(&mut flexible.rest_curvature, 1.0 / a);
                    by(&mut flexible.rest_curvature_rise, 1.0 / a);
                    by(&mut flexible.load, b / (a * a * a));
                    by(&mut flexible.dipole, b / (a * a));
                    by(&mut flexible.shear_compliance, a * a / b);
                }
                RodSegment::Rigid(rigid) => {
                    rigid.length *= a;
                    by(&mut rigid.dipole, b / a);
                    by(&mut rigid.weight, b / (a * a));
                }
            }
        }
        let scaled = solve_rod(&other, &[]);
        let length = rod.total_length();
        let p: [f64; 3] = scaled.p_tip.map(|x| x / a);
        assert!(difference(&p, &found.p_tip) <= CLOSED_FORM * length, "{a} {b}");
        assert!((scaled.margin - found.margin).abs() <= CLOSED_FORM);
    }
}
