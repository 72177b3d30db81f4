//! Flexible segments and their cross-sections: curvature from moment (R1), shear and stretch from force (R5).

use super::program::{Inputs, Program};
use super::terms::Terms;
use crate::cpu::algebra::{Vec3, axpy, dot};
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::SegmentPlan;
use crate::model::record::{
    DIPOLE_PER_LENGTH_AT, LOAD_AT, REST_CURVATURE_AT, REST_CURVATURE_RISE_AT, SHEAR_COMPLIANCE_AT, STIFFNESS_AT,
    STIFFNESS_RISE_AT,
};

/// What varies along it does so linearly: x(s) = x + (s / length) x_rise.
#[derive(Clone, Copy, Debug)]
pub struct Flexible<L> {
    pub length: L,
    /// Meant only where the segment does not taper.
    pub compliance: Vec3<L>,
    pub stiffness: Vec3<L>,
    pub stiffness_rise: Vec3<L>,
    pub u_star: Vec3<L>,
    pub u_star_rise: Vec3<L>,
    /// Force and dipole per length.
    pub w: Vec3<L>,
    pub mu: Vec3<L>,
    /// Diagonal of Kse^-1.
    pub shear: Vec3<L>,
    pub tapers: bool,
    pub curvature_rises: bool,
    pub shears: bool,
    pub has_magnet: bool,
}

/// A cross-section of a flexible segment.
#[derive(Clone, Copy, Debug)]
pub struct Section<L> {
    pub compliance: Vec3<L>,
    pub u_star: Vec3<L>,
}

#[inline(always)]
pub fn load_flexible<L: Lane>(
    program: &Program,
    token: L::Token,
    inputs: &Inputs<'_, L::Scalar>,
    plan: &SegmentPlan,
) -> Flexible<L> {
    let at = plan.record;
    let length: L = program.entry(token, inputs, at);
    let stiffness = program.vector::<L>(token, inputs, at + STIFFNESS_AT);
    let one = length.constant(1.0);
    let mut segment = Flexible {
        length,
        compliance: Vec3 { x: one / stiffness.x, y: one / stiffness.y, z: one / stiffness.z },
        stiffness,
        stiffness_rise: Vec3::splat(length.constant(0.0)),
        u_star: program.vector(token, inputs, at + REST_CURVATURE_AT),
        u_star_rise: Vec3::splat(length.constant(0.0)),
        w: program.vector(token, inputs, at + LOAD_AT),
        mu: Vec3::splat(length.constant(0.0)),
        shear: Vec3::splat(length.constant(0.0)),
        tapers: plan.tapers,
        curvature_rises: plan.curvature_rises,
        shears: plan.shears,
        has_magnet: plan.has_magnet,
    };
    if plan.tapers {
        segment.stiffness_rise = program.vector(token, inputs, at + STIFFNESS_RISE_AT);
    }
    if plan.curvature_rises {
        segment.u_star_rise = program.vector(token, inputs, at + REST_CURVATURE_RISE_AT);
    }
    if plan.has_magnet {
        segment.mu = program.vector(token, inputs, at + DIPOLE_PER_LENGTH_AT);
    }
    if plan.shears {
        segment.shear = program.vector(token, inputs, at + SHEAR_COMPLIANCE_AT);
    }
    segment
}

impl<L: Lane> Flexible<L> {
    /// The cross-section at a share `x` of the length.
    #[inline(always)]
    pub fn section(&self, terms: impl Terms, x: f64) -> Section<L> {
        let x = self.length.constant(x);
        let mut section = Section { compliance: self.compliance, u_star: self.u_star };
        if terms.general() && self.tapers {
            let stiffness = axpy(x, self.stiffness_rise, self.stiffness);
            let one = x.constant(1.0);
            section.compliance = Vec3 { x: one / stiffness.x, y: one / stiffness.y, z: one / stiffness.z };
        }
        if terms.general() && self.curvature_rises {
            section.u_star = axpy(x, self.u_star_rise, self.u_star);
        }
        section
    }

    /// The compliance at a cross-section whose own is known.
    #[inline(always)]
    pub fn compliance_at(&self, terms: impl Terms, section: Vec3<L>) -> Vec3<L> {
        if terms.general() && self.tapers { section } else { self.compliance }
    }

    /// The same rod unable to bend or shear.
    #[inline(always)]
    pub fn stiff(&self) -> Self {
        let zero = Vec3::splat(self.length.constant(0.0));
        Self { compliance: zero, tapers: false, shears: false, ..*self }
    }
}

/// Curvature in the world frame, R u = R u* + R K^-1 R^T m.
#[inline(always)]
pub fn curvature<L: Lane>(
    terms: impl Terms,
    section: &Section<L>,
    d1: Vec3<L>,
    d2: Vec3<L>,
    t: Vec3<L>,
    m: Vec3<L>,
) -> Vec3<L> {
    let (u_star, k) = (section.u_star, section.compliance);
    if terms.anisotropic() {
        let both = alike(k);
        let ux = (k.x - both).mul_add(dot(d1, m), u_star.x);
        let uy = (k.y - both).mul_add(dot(d2, m), u_star.y);
        let uz = (k.z - both).mul_add(dot(t, m), u_star.z);
        axpy(both, m, axpy(ux, d1, axpy(uy, d2, t * uz))) // R1
    } else {
        let uz = (k.z - k.x).mul_add(dot(t, m), u_star.z);
        axpy(k.x, m, axpy(u_star.x, d1, axpy(u_star.y, d2, t * uz))) // R1
    }
}

/// The compliance about d1 and d2 of a rod that bends alike about both, else 0. The sum over the directors counts from it, so that the
/// truncation error of d1 and d2 does not enter such a rod. In single precision it is 0: the engine tells no crossing of curves there, and
/// round-off of a large k.x would hide a small k.z.
#[inline(always)]
pub fn alike<L: Lane>(k: Vec3<L>) -> L {
    let zero = k.x.constant(0.0);
    if L::Scalar::SHARP { L::select(k.x.lt(k.y) | k.y.lt(k.x), zero, k.x) } else { zero }
}

/// p' = R nu, the tangent where the segment neither shears nor stretches.
#[inline(always)]
pub fn velocity<L: Lane>(
    terms: impl Terms,
    segment: &Flexible<L>,
    d1: Vec3<L>,
    d2: Vec3<L>,
    t: Vec3<L>,
    n: Vec3<L>,
) -> Vec3<L> {
    if terms.general() && segment.shears {
        let c = segment.shear;
        let both = alike(c);
        let along = axpy((c.z - both) * dot(t, n), t, t);
        axpy(both, n, axpy((c.x - both) * dot(d1, n), d1, axpy((c.y - both) * dot(d2, n), d2, along))) // R5
    } else {
        t
    }
}

/// R v for a vector of the body frame.
#[inline(always)]
pub fn to_world<L: Lane>(d1: Vec3<L>, d2: Vec3<L>, t: Vec3<L>, v: Vec3<L>) -> Vec3<L> {
    axpy(v.x, d1, axpy(v.y, d2, t * v.z))
}
