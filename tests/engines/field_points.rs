//! How many points of a rigid segment the field acts at: few do where magnets are far, and error estimates see what they leave.
#![allow(non_snake_case)]

use super::common::check::difference;
use super::field_folds::both;
use nalgebra::Vector3;
use rodsweep::model::{CoilLoad, PlanOptions, Quantity, Stepper};
use rodsweep::spec::SweepSpec;
use std::path::Path;

/// The longest segment, over the least distance of a magnet, for which few points do.
const SHORT: f64 = 1.0 / 6.0;
/// What three and four points leave there of the force on a segment, over that on a dipole in line at its nearer end:
/// 0.03 (L/r)^6 and 4e-3 (L/r)^8.
const LEFT: [f64; 2] = [6.5e-7, 2.4e-9];

/// Force of a dipole M on a dipole mu at a distance r, but for mu0 / 4 pi. F1
fn force(r: Vector3<f64>, M: Vector3<f64>, mu: Vector3<f64>) -> Vector3<f64> {
    let r2 = r.norm_squared();
    let (a, b) = (mu.dot(&r), M.dot(&r));
    (mu * b + M * a + r * (mu.dot(&M) - 5.0 * a * b / r2)) * (3.0 / (r2 * r2 * r.norm()))
}

/// Mean force over a segment of length `L` that starts at `start`.
fn mean(
    points: &[(f64, f64)],
    start: Vector3<f64>,
    arm: Vector3<f64>,
    M: Vector3<f64>,
    mu: Vector3<f64>,
) -> Vector3<f64> {
    points.iter().map(|(xi, share)| force(start + arm * *xi, M, mu) * *share).sum()
}

fn unit(turn: f64, lift: f64) -> Vector3<f64> {
    Vector3::new(turn.cos() * lift.cos(), turn.sin() * lift.cos(), lift.sin())
}

#[test]
fn few_points_do_where_magnets_are_far() {
    let load = CoilLoad::Distributed;
    let few = load.points_within(SHORT, 1e-6);
    let many = load.points_within(SHORT * 1.0001, 1e-6);
    assert_eq!(few.map(<[_]>::len), [3, 4]);
    assert_eq!(many, [load.points(), load.check_points()]);
    assert_eq!(load.points_within(f64::NAN, 1e-6), many, "a length that is not known");
    assert_eq!(load.points_within(SHORT, 5e-7), many, "less is asked for than they leave");
    assert_eq!(load.points_within(0.05, 1e-9), few);
    assert_eq!(CoilLoad::Middle.points_within(SHORT, 1e-6), [CoilLoad::Middle.points(); 2]);
    let mut worst = [0.0_f64; 2];
    for step in 0..2000 {
        let k = f64::from(step);
        // Nowhere nearer than 1; the arm points away from the magnet, across, or in between.
        let start = Vector3::x();
        let arm = unit(0.0, 0.5 * std::f64::consts::PI * (k % 11.0) / 10.0) * SHORT;
        let (M, mu) = (unit(0.7 * k, (0.3 * k).sin() * 1.5), unit(1.1 * k, (0.9 * k).cos() * 1.5));
        // Eight points on each of eight parts.
        let exact: Vector3<f64> = (0..8)
            .map(|part| mean(load.check_points(), start + arm * (f64::from(part) / 8.0), arm / 8.0, M, mu) / 8.0)
            .sum();
        for (worst, points) in worst.iter_mut().zip(few) {
            *worst = worst.max((mean(points, start, arm, M, mu) - exact).norm() / 6.0);
        }
    }
    println!("{worst:?} of {LEFT:?}");
    for (worst, left) in worst.into_iter().zip(LEFT) {
        assert!(worst < left && worst > 0.1 * left, "{worst:e} of {left:e}");
    }
}

/// A tip of 8 mm that comes as near as 48 mm to a magnet, and no nearer: at the switch.
const NEAR: &str = "
[sampling]
method = \"sobol\"
samples = 256
[[axis]]
parameter = \"magnets.arm.position.x\"
from = \"-12 mm\"
to = \"12 mm\"
[[axis]]
parameter = \"magnets.arm.position.z\"
from = \"97 mm\"
to = \"104 mm\"
[[axis]]
parameter = \"magnets.arm.rotation.y\"
from = \"-180 deg\"
to = \"180 deg\"
[scene]
name = \"near\"
[[scene.magnet]]
name = \"arm\"
position = [0, 0, \"100 mm\"]
moment = [0, 0, \"20 A·m^2\"]
clearance = \"48 mm\"
[[scene.segment]]
name = \"tube\"
kind = \"flexible\"
length = \"40 mm\"
stiffness = { bending = \"8e-6 N·m²\", torsion = \"6e-6 N·m²\" }
[[scene.segment]]
name = \"tip\"
kind = \"rigid\"
length = \"8 mm\"
dipole_per_length = [0, 0, \"0.5 A·m\"]
";

#[test]
fn error_estimates_see_what_few_points_leave() {
    let spec = SweepSpec::parse(Path::new("near.toml"), NEAR).expect("a sweep");
    let samples: Vec<u64> = (0..256).collect();
    // With few steps and with so many that the points alone are left.
    for (steps, least) in [(2, 0.0), (40, 1e-10)] {
        let options = PlanOptions { stepper: Stepper::Dop853, steps, ..PlanOptions::default() };
        let [found, truth] = both(&spec, &samples, options);
        let (mut solved, mut worst, mut estimated) = (0, 0.0_f64, 0.0_f64);
        for at in 0..samples.len() {
            // One sample is next to a fold.
            if !found.status(at).is_success() {
                continue;
            }
            let [p, q] = [&found, &truth].map(|of| of.vector(at, Quantity::TipPosition));
            let error = difference(&p, &q) / spec.scene.total_length();
            let estimate = found.get(at, Quantity::ErrorEstimate);
            assert!(error < estimate, "{steps} steps, sample {at}: {error:e} of {estimate:e}");
            (worst, estimated, solved) = (worst.max(error), estimated.max(estimate), solved + 1);
        }
        println!("{steps} steps: {solved} solved, worst error {worst:.1e}, worst estimate {estimated:.1e}");
        assert!(solved > 250 && estimated > least && estimated < 1e-6, "{solved} solved, {estimated:e}");
    }
}
