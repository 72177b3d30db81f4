//! The shape of a stretch of rod that nothing loads: closed form.

use super::vectors::cross;
use super::{RodSegment, Vector};

/// Entries of a rest pose: position, d1, t.
pub const REST_POSE: usize = 9;

/// Pose of the distal end of some segments at rest, in the frame of their proximal end: position (m), d1, t.
///
/// Rest curvature must be constant on each segment: a helix, R = exp(s hat(u*)).
pub(super) fn rest_pose(segments: &[RodSegment]) -> [f64; REST_POSE] {
    let mut p = [0.0; 3];
    let mut directors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for segment in segments {
        let u = match segment {
            RodSegment::Flexible(flexible) => flexible.rest_curvature,
            RodSegment::Rigid(_) => [0.0; 3],
        };
        let (step, turn) = helix(u, segment.length());
        p = sum(p, combine(&directors, step));
        directors = turn.map(|column| combine(&directors, column));
    }
    let [d1, _, t] = directors;
    std::array::from_fn(|k| [p, d1, t][k / 3][k % 3])
}

/// Integral of R e3 over a length, and R at its end by columns, for constant u.
fn helix(u: Vector, length: f64) -> (Vector, [Vector; 3]) {
    let angle2 = u.iter().map(|x| x * x).sum::<f64>() * length * length;
    let angle = angle2.sqrt();
    // sin(a)/a, (1 - cos(a))/a², (a - sin(a))/a³; the series are exact to the last bit below the bound.
    let (a, b, c) = if angle < 1e-2 {
        (
            1.0 - angle2 / 6.0 * (1.0 - angle2 / 20.0 * (1.0 - angle2 / 42.0)),
            0.5 * (1.0 - angle2 / 12.0 * (1.0 - angle2 / 30.0 * (1.0 - angle2 / 56.0))),
            (1.0 - angle2 / 20.0 * (1.0 - angle2 / 42.0 * (1.0 - angle2 / 72.0))) / 6.0,
        )
    } else {
        let half = (0.5 * angle).sin();
        (angle.sin() / angle, 2.0 * half * half / angle2, (angle - angle.sin()) / (angle2 * angle))
    };
    let v = u.map(|x| x * length);
    let rotated = |e: Vector, first: f64, second: f64| {
        let once = cross(v, e);
        let twice = cross(v, once);
        std::array::from_fn(|k| e[k] + first * once[k] + second * twice[k])
    };
    let unit = |k: usize| std::array::from_fn(|axis| f64::from(u8::from(axis == k)));
    let step: Vector = rotated(unit(2), b, c);
    (step.map(|x| x * length), std::array::from_fn(|k| rotated(unit(k), a, b)))
}

fn combine(directors: &[Vector; 3], v: Vector) -> Vector {
    std::array::from_fn(|row| (0..3).map(|k| directors[k][row] * v[k]).sum())
}

fn sum(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] + b[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::FlexibleRod;

    fn flexible(length: f64, rest_curvature: Vector) -> RodSegment {
        RodSegment::Flexible(FlexibleRod { length, rest_curvature, ..FlexibleRod::default() })
    }

    #[test]
    fn an_arc_and_its_halves() {
        for angle in [1e-9, 1e-3, 0.00999, 0.01001, 0.3, 4.0] {
            let u = [angle / 0.1, 0.0, 0.0];
            let whole = rest_pose(&[flexible(0.1, u)]);
            // The rod starts along z and turns about x.
            let expected = [0.0, -0.1 * (1.0 - angle.cos()) / angle, 0.1 * angle.sin() / angle];
            for k in 0..3 {
                assert!((whole[k] - expected[k]).abs() < 1e-9 * 0.1 + 1e-16, "{angle}: {whole:?}");
            }
            let halves = rest_pose(&[flexible(0.05, u), flexible(0.05, u)]);
            assert!(whole.iter().zip(halves).all(|(a, b)| (a - b).abs() < 1e-14), "{angle}");
        }
    }

    #[test]
    fn a_rigid_part_is_straight() {
        let rod =
            [flexible(0.0, [3.0; 3]), RodSegment::Rigid(crate::model::RigidRod { length: 0.02, ..Default::default() })];
        assert_eq!(rest_pose(&rod), [0.0, 0.0, 0.02, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    }
}
