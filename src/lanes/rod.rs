//! The rod in the reduced form: R1 (balance of force and moment), R2 (shape), R3 (rigid segments), R5 (shear and
//! stretch), R6 (unloaded distal part).

use super::algebra::{Vec3, axpy, cross, cross_add, cross_sub, dot};
use super::lane::Lane;
use super::program::{Inputs, Program};
use crate::model::SegmentPlan;
use crate::model::rod::{
    DIPOLE_AT, DIPOLE_PER_LENGTH_AT, LOAD_AT, REST_CURVATURE_AT, REST_CURVATURE_RISE_AT, SHEAR_COMPLIANCE_AT,
    STIFFNESS_AT, STIFFNESS_RISE_AT, WEIGHT_AT,
};
use std::marker::PhantomData;

/// Which terms are compiled into a kernel.
pub trait Terms: Copy {
    /// An internal force n.
    const FORCE: bool;
    /// A force per length w; implies `FORCE`.
    const LOAD: bool;
    /// Different stiffness about body x and y.
    const ANISOTROPIC: bool;
    /// What few scenes use: stiffness and rest curvature that vary along a segment, shear, magnets, forward columns.
    /// Inside, each segment says which.
    const GENERAL: bool;
}

#[derive(Clone, Copy)]
pub struct TermSet<const FORCE: bool, const LOAD: bool, const ANISOTROPIC: bool, const GENERAL: bool>(PhantomData<()>);

impl<const FORCE: bool, const LOAD: bool, const ANISOTROPIC: bool, const GENERAL: bool> Terms
    for TermSet<FORCE, LOAD, ANISOTROPIC, GENERAL>
{
    const FORCE: bool = FORCE;
    const LOAD: bool = LOAD;
    const ANISOTROPIC: bool = ANISOTROPIC;
    const GENERAL: bool = GENERAL;
}

/// Where the rod is: position, first director, tangent, and M = m + p x n.
#[derive(Clone, Copy, Debug)]
pub struct State<L> {
    pub p: Vec3<L>,
    pub d1: Vec3<L>,
    pub t: Vec3<L>,
    pub M: Vec3<L>,
}

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

#[derive(Clone, Copy, Debug)]
pub struct Rigid<L> {
    pub length: L,
    pub mu: Vec3<L>,
    /// The whole force on it.
    pub w: Vec3<L>,
    pub has_dipole: bool,
}

#[derive(Clone, Copy, Debug)]
pub enum Segment<L> {
    Flexible(Flexible<L>),
    Rigid(Rigid<L>),
}

/// A group of rods, one a lane, under full loads.
pub struct Rod<L> {
    pub d1: Vec3<L>,
    pub t: Vec3<L>,
    pub B: Vec3<L>,
    pub f_tip: Vec3<L>,
    pub l_tip: Vec3<L>,
    /// Those that must be integrated.
    pub segments: Vec<Segment<L>>,
    /// The distal part beyond them, which nothing loads: its rest shape.
    pub free: Option<Free<L>>,
}

/// The tip's pose in the frame at the start of an unloaded distal part.
#[derive(Clone, Copy, Debug)]
pub struct Free<L> {
    pub p: Vec3<L>,
    pub d1: Vec3<L>,
    pub t: Vec3<L>,
}

impl<L: Lane> Rod<L> {
    /// Reads the records of a group.
    #[inline(always)]
    pub fn load(&mut self, program: &Program, token: L::Token, inputs: &Inputs<'_, L::Scalar>) {
        (self.d1, self.t) = (program.vector(token, inputs, 0), program.vector(token, inputs, 3));
        self.B = program.vector(token, inputs, 6);
        (self.f_tip, self.l_tip) = (program.vector(token, inputs, 9), program.vector(token, inputs, 12));
        self.segments.clear();
        for plan in &program.segments {
            self.segments.push(if plan.is_flexible {
                Segment::Flexible(load_flexible(program, token, inputs, plan))
            } else {
                let length = program.entry(token, inputs, plan.record);
                let mu = program.vector(token, inputs, plan.record + DIPOLE_AT);
                let w = program.vector(token, inputs, plan.record + WEIGHT_AT);
                Segment::Rigid(Rigid { length, mu, w, has_dipole: plan.has_dipole })
            });
        }
        self.free = match program.free {
            None => None,
            Some(entry) => Some(Free {
                p: program.vector(token, inputs, entry),
                d1: program.vector(token, inputs, entry + 3),
                t: program.vector(token, inputs, entry + 6),
            }),
        };
    }

    /// n at the base under full loads: tip force and all the weight.
    #[inline(always)]
    pub fn base_force<T: Terms>(&self) -> Vec3<L> {
        let mut n = self.f_tip;
        if T::LOAD {
            for segment in &self.segments {
                n = match segment {
                    Segment::Flexible(flexible) => axpy(flexible.length, flexible.w, n), // R1
                    Segment::Rigid(rigid) => n + rigid.w,                                // R1
                };
            }
        }
        n
    }

    /// Length of the flexible segments.
    #[inline(always)]
    pub fn flexible_length(&self) -> L {
        let mut length = self.t.x.constant(0.0);
        for segment in &self.segments {
            if let Segment::Flexible(flexible) = segment {
                length = length + flexible.length;
            }
        }
        length
    }

    pub fn new(token: L::Token) -> Self {
        let zero = Vec3::splat(L::splat(token, 0.0));
        Self { d1: zero, t: zero, B: zero, f_tip: zero, l_tip: zero, segments: Vec::new(), free: None }
    }
}

#[inline(always)]
fn load_flexible<L: Lane>(
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

/// Moment from M = m + p x n.
#[inline(always)]
pub fn moment<L: Lane, T: Terms>(p: Vec3<L>, M: Vec3<L>, n: Vec3<L>) -> Vec3<L> {
    if T::FORCE { cross_sub(p, n, M) } else { M } // R1
}

impl<L: Lane> Flexible<L> {
    /// The cross-section at a share `x` of the length.
    #[inline(always)]
    pub fn section<T: Terms>(&self, x: f64) -> Section<L> {
        let x = self.length.constant(x);
        let mut section = Section { compliance: self.compliance, u_star: self.u_star };
        if T::GENERAL && self.tapers {
            let stiffness = axpy(x, self.stiffness_rise, self.stiffness);
            let one = x.constant(1.0);
            section.compliance = Vec3 { x: one / stiffness.x, y: one / stiffness.y, z: one / stiffness.z };
        }
        if T::GENERAL && self.curvature_rises {
            section.u_star = axpy(x, self.u_star_rise, self.u_star);
        }
        section
    }

    /// The compliance at a cross-section whose own is known.
    #[inline(always)]
    pub fn compliance_at<T: Terms>(&self, section: Vec3<L>) -> Vec3<L> {
        if T::GENERAL && self.tapers { section } else { self.compliance }
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
pub fn curvature<L: Lane, T: Terms>(section: &Section<L>, d1: Vec3<L>, d2: Vec3<L>, t: Vec3<L>, m: Vec3<L>) -> Vec3<L> {
    let (u_star, k) = (section.u_star, section.compliance);
    if T::ANISOTROPIC {
        let ux = k.x.mul_add(dot(d1, m), u_star.x);
        let uy = k.y.mul_add(dot(d2, m), u_star.y);
        let uz = k.z.mul_add(dot(t, m), u_star.z);
        axpy(ux, d1, axpy(uy, d2, t * uz)) // R1
    } else {
        let uz = (k.z - k.x).mul_add(dot(t, m), u_star.z);
        axpy(k.x, m, axpy(u_star.x, d1, axpy(u_star.y, d2, t * uz))) // R1
    }
}

/// p' = R nu, the tangent where the segment neither shears nor stretches.
#[inline(always)]
pub fn velocity<L: Lane, T: Terms>(segment: &Flexible<L>, d1: Vec3<L>, d2: Vec3<L>, t: Vec3<L>, n: Vec3<L>) -> Vec3<L> {
    if T::GENERAL && segment.shears {
        let c = segment.shear;
        axpy(c.x * dot(d1, n), d1, axpy(c.y * dot(d2, n), d2, axpy(c.z * dot(t, n), t, t))) // R5
    } else {
        t
    }
}

/// R v for a vector of the body frame.
#[inline(always)]
pub fn to_world<L: Lane>(d1: Vec3<L>, d2: Vec3<L>, t: Vec3<L>, v: Vec3<L>) -> Vec3<L> {
    axpy(v.x, d1, axpy(v.y, d2, t * v.z))
}

/// Crosses a rigid segment: position and moment jump, the orientation stays.
#[inline(always)]
pub fn cross_rigid<L: Lane, T: Terms>(
    rod: &Rod<L>,
    segment: &Rigid<L>,
    lambda: L,
    force_arm: bool,
    n: &mut Vec3<L>,
    state: &mut State<L>,
) {
    let (length, p, t) = (segment.length, state.p, state.t);
    if segment.has_dipole {
        let mu_world = world_dipole(segment, state, lambda);
        state.M = cross_sub(mu_world, rod.B, state.M); // R3
    }
    state.p = axpy(length, t, p); // R3
    if T::LOAD {
        let weight = segment.w * lambda;
        let middle = if force_arm { axpy(length * length.constant(0.5), t, p) } else { p };
        state.M = cross_sub(middle, weight, state.M); // R3
        *n = *n - weight; // R1
    }
    if T::FORCE && !force_arm {
        state.M = cross_add(t * length, *n, state.M);
    }
}

/// R mu, scaled by the load fraction.
#[inline(always)]
pub fn world_dipole<L: Lane>(segment: &Rigid<L>, state: &State<L>, lambda: L) -> Vec3<L> {
    to_world(state.d1, cross(state.t, state.d1), state.t, segment.mu) * lambda
}

/// Takes the state over the unloaded distal part, which keeps its rest shape.
#[inline(always)]
pub fn cross_free<L: Lane>(free: &Free<L>, state: &mut State<L>) {
    let State { p, d1, t, .. } = *state;
    let d2 = cross(t, d1);
    state.p = p + to_world(d1, d2, t, free.p); // R6
    (state.d1, state.t) = (to_world(d1, d2, t, free.d1), to_world(d1, d2, t, free.t)); // R6
}
