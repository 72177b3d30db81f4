//! Rods that are symmetric about the tangent of their base, and searches that break a symmetry: small loads across.

use crate::model::vectors::{cross, norm};
use crate::model::{Rod, RodSegment, Vector};
use crate::reference::solve_rod;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Vectors across are none below this share of what they belong to.
const NONE: f64 = 1e-9;
/// Loads across that break a symmetry, over the largest load.
const ACROSS: [f64; 2] = [3e-2, 1e-3];
/// Base moments that are tried beside the ends of such rods.
const MOMENTS: usize = 256;

/// Whether a rod is the same, turned about the tangent of its base by any angle: it bends alike about all axes, is straight at
/// rest, and loads, dipoles and field lie along the tangent.
pub(super) fn is_symmetric(rod: &Rod) -> bool {
    let tangent = tangent(rod);
    let is_along = |v: &Vector, axis: &Vector| norm(cross(*v, *axis)) <= NONE * norm(*v);
    let z = [0.0, 0.0, 1.0];
    let of = |segment: &RodSegment| match segment {
        RodSegment::Flexible(flexible) => {
            let bends_alike = |k: &Vector| (k[0] - k[1]).abs() <= NONE * k[0].abs();
            let far = std::array::from_fn(|k| flexible.stiffness[k] + flexible.stiffness_rise[k]);
            bends_alike(&flexible.stiffness)
                && bends_alike(&far)
                && (flexible.shear_compliance[0] - flexible.shear_compliance[1]).abs()
                    <= NONE * flexible.shear_compliance[0].abs()
                && [flexible.rest_curvature, flexible.rest_curvature_rise, flexible.dipole]
                    .iter()
                    .all(|v| is_along(v, &z))
                && is_along(&flexible.load, &tangent)
        }
        RodSegment::Rigid(rigid) => is_along(&rigid.dipole, &z) && is_along(&rigid.weight, &tangent),
    };
    rod.field.is_none()
        && [rod.flux_density, rod.tip_force, rod.tip_moment].iter().all(|v| is_along(v, &tangent))
        && rod.segments.iter().all(of)
}

/// Whether a change of the base moment is that of a turn about the base's tangent.
pub(super) fn is_turn(rod: &Rod, m0: Vector, by: Vector) -> bool {
    let turn = cross(tangent(rod), m0);
    is_symmetric(rod) && norm(cross(turn, by)) <= 1e-3 * norm(turn) * norm(by) && norm(turn) > NONE * norm(m0)
}

/// Whether two points lie on one circle about the base's tangent.
pub(super) fn is_on_circle(rod: &Rod, a: Vector, b: Vector, within: f64) -> bool {
    let tangent = tangent(rod);
    let of = |p: Vector| {
        let way: Vector = std::array::from_fn(|k| p[k] - rod.base_position[k]);
        let height: f64 = (0..3).map(|k| way[k] * tangent[k]).sum();
        (height, norm(cross(way, tangent)))
    };
    let (a, b) = (of(a), of(b));
    (a.0 - b.0).abs() < within && (a.1 - b.1).abs() < within
}

/// Base moments to search from (N·m): what is known, the ends of rods with a little load across, none, points in the ball of what a
/// base moment can be.
pub(super) fn starts(rod: &Rod, bound: f64, own: Option<Vector>) -> Vec<Vector> {
    let tangent = tangent(rod);
    let least = (0..3).min_by(|a, b| tangent[*a].abs().total_cmp(&tangent[*b].abs())).unwrap_or(0);
    let x = unit(cross(tangent, std::array::from_fn(|k| if k == least { 1.0 } else { 0.0 })));
    let y = cross(tangent, x);
    let signed = [x, y].into_iter().flat_map(|axis| [1.0, -1.0].map(|sign| axis.map(|v| sign * v)));
    let around: Vec<(f64, Vector)> = signed.flat_map(|axis| ACROSS.map(|share| (share, axis))).collect();
    let disturbed = around.par_iter().filter_map(|(share, axis)| {
        let mut rod = rod.clone();
        let across = |v: Vector| -> Vector { std::array::from_fn(|k| v[k] + share * norm(v) * axis[k]) };
        (rod.flux_density, rod.tip_force) = (across(rod.flux_density), across(rod.tip_force));
        for segment in &mut rod.segments {
            match segment {
                RodSegment::Flexible(flexible) => flexible.load = across(flexible.load),
                RodSegment::Rigid(rigid) => rigid.weight = across(rigid.weight),
            }
        }
        let end = solve_rod(&rod, &[]);
        end.status.is_converged().then_some(end.m0)
    });
    let disturbed: Vec<Vector> = disturbed.collect();
    own.into_iter().chain(disturbed).chain([[0.0; 3]]).chain((0..MOMENTS).map(|k| in_ball(k, bound))).collect()
}

/// Point k of a sequence that fills a ball, more densely towards its centre (Kronecker's, of the roots of 2, 3 and 5).
fn in_ball(k: usize, radius: f64) -> Vector {
    let [x, y, z] = [2.0f64, 3.0, 5.0].map(|prime| ((k as f64 + 0.5) * prime.sqrt()).fract());
    let (height, angle) = (2.0 * y - 1.0, 2.0 * PI * z);
    let across = (1.0 - height * height).max(0.0).sqrt();
    [angle.cos() * across, angle.sin() * across, height].map(|v| v * radius * x)
}

fn tangent(rod: &Rod) -> Vector {
    rod.base_rotation.map(|row| row[2])
}

fn unit(v: Vector) -> Vector {
    let size = norm(v);
    v.map(|x| x / size)
}
