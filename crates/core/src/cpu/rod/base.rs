//! Where a pass starts: the columns at the base, and how the rod goes on from there.

use super::columns::{By, Columns};
use super::section::{curvature, to_world, velocity};
use super::segments::{Rod, Segment};
use super::source::Sources;
use super::terms::Terms;
use crate::cpu::algebra::{Mat3, Vec3, columns_cross, cross, hat, outer};
use crate::cpu::simd::lane::Lane;

/// Three columns at the base: by the base moment.
#[inline(always)]
pub fn moment_columns<L: Lane>(one: L) -> Columns<L> {
    let zero = Mat3::zero(one);
    Columns { w: zero, dp: zero, dM: Mat3::identity(one), by: By::BaseMoment, dn: zero }
}

/// Three columns at the base: by a virtual rotation of the base, in canonical form (dm = w x m0 / 2).
#[inline(always)]
pub fn rotation_columns<L: Lane>(m0: Vec3<L>) -> Columns<L> {
    let half = m0.x.constant(0.5);
    let zero = Mat3::zero(half);
    Columns { w: Mat3::identity(half), dp: zero, dM: hat(m0) * -half, by: By::BaseRotation, dn: zero }
}

/// Three columns at the base: by the tip force.
#[inline(always)]
pub fn force_columns<L: Lane>(one: L) -> Columns<L> {
    let zero = Mat3::zero(one);
    Columns { w: zero, dp: zero, dM: zero, by: By::TipForce, dn: Mat3::identity(one) }
}

/// Three columns at the base: by three parameters, the base moment held.
#[inline(always)]
pub fn forward_columns<L: Lane>(terms: impl Terms, rod: &Rod<L>, sources: &Sources<L>, m0: Vec3<L>) -> Columns<L> {
    let n0 = rod.base_force(terms);
    let BaseSlope { omega, v, .. } = base_slope(terms, rod, m0, n0);
    let dp = outer(v, sources.insertion, sources.dp0);
    let dM = if terms.force() { columns_cross(dp, n0) } else { Mat3::zero(m0.x) };
    Columns { w: outer(omega, sources.insertion, sources.w0), dp, dM, by: By::Parameters, dn: sources.dn0 }
}

/// How the rod goes on at its base, where it is flexible: R u, p' and -m'.
pub struct BaseSlope<L> {
    pub omega: Vec3<L>,
    pub v: Vec3<L>,
    pub torque: Vec3<L>,
}

#[inline(always)]
pub fn base_slope<L: Lane>(terms: impl Terms, rod: &Rod<L>, m0: Vec3<L>, n0: Vec3<L>) -> BaseSlope<L> {
    let zero = Vec3::splat(m0.x.constant(0.0));
    let Some(Segment::Flexible(first)) = rod.segments.first() else {
        return BaseSlope { omega: zero, v: zero, torque: zero };
    };
    let d2 = cross(rod.t, rod.d1);
    let omega = curvature(terms, &first.section(terms, 0.0), rod.d1, d2, rod.t, m0);
    let v = velocity(terms, first, rod.d1, d2, rod.t, n0);
    let mut torque = zero;
    if terms.force() {
        torque = cross(v, n0);
    }
    if terms.general() && first.has_magnet {
        torque = torque + cross(to_world(rod.d1, d2, rod.t, first.mu), rod.B);
    }
    BaseSlope { omega, v, torque }
}
