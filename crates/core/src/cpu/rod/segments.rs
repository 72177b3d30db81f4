//! The rod in the reduced form: R1 (balance of force and moment), R3 (rigid segments), R6 (unloaded distal part).

use super::program::{Inputs, Program};
use super::section::{Flexible, load_flexible, to_world};
use super::terms::Terms;
use crate::cpu::algebra::{Vec3, axpy, cross, cross_add, cross_sub};
use crate::cpu::simd::lane::Lane;
use crate::model::SegmentPlan;
use crate::model::record::{
    BASE_D1_AT, BASE_T_AT, COUPLE_AT, DIPOLE_AT, FLUX_DENSITY_AT, TIP_FORCE_AT, TIP_MOMENT_AT, WEIGHT_AT,
};

/// Where the rod is: position, first director, tangent, and M = m + p x n.
#[derive(Clone, Copy, Debug)]
pub struct State<L> {
    pub p: Vec3<L>,
    pub d1: Vec3<L>,
    pub t: Vec3<L>,
    pub M: Vec3<L>,
}

#[derive(Clone, Copy, Debug)]
pub struct Rigid<L> {
    pub length: L,
    pub mu: Vec3<L>,
    /// The whole force on it.
    pub w: Vec3<L>,
    /// A couple on it, in a field that varies alone.
    pub c: Vec3<L>,
    pub has_dipole: bool,
    pub has_couple: bool,
    /// Whether force and couple are in the body frame.
    pub follows: bool,
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
    /// The first of its segments in the program.
    pub first: usize,
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
        self.d1 = program.vector(token, inputs, BASE_D1_AT);
        self.t = program.vector(token, inputs, BASE_T_AT);
        self.B = program.vector(token, inputs, FLUX_DENSITY_AT);
        self.f_tip = program.vector(token, inputs, TIP_FORCE_AT);
        self.l_tip = program.vector(token, inputs, TIP_MOMENT_AT);
        self.segments.clear();
        for plan in &program.segments {
            self.segments.push(if plan.is_flexible {
                Segment::Flexible(load_flexible(program, token, inputs, plan))
            } else {
                let length = program.entry(token, inputs, plan.record);
                let mu = program.vector(token, inputs, plan.record + DIPOLE_AT);
                let w = program.vector(token, inputs, plan.record + WEIGHT_AT);
                let mut c = Vec3::splat(L::splat(token, 0.0));
                if plan.has_couple {
                    c = program.vector(token, inputs, plan.record + COUPLE_AT);
                }
                let SegmentPlan { has_dipole, has_couple, follows, .. } = *plan;
                Segment::Rigid(Rigid { length, mu, w, c, has_dipole, has_couple, follows })
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
    pub fn base_force(&self, terms: impl Terms) -> Vec3<L> {
        let mut n = self.f_tip;
        if terms.load() {
            for segment in &self.segments {
                n = match segment {
                    Segment::Flexible(flexible) => axpy(flexible.length, flexible.w, n), // R1
                    Segment::Rigid(rigid) => n + rigid.w,                                // R1
                };
            }
        }
        n
    }

    /// The same rod whose full loads are this share of these; dipoles stay what they are.
    #[inline(always)]
    pub fn under(&self, share: L) -> Self {
        let part = |segment: &Segment<L>| match segment {
            Segment::Flexible(flexible) => Segment::Flexible(Flexible { w: flexible.w * share, ..*flexible }),
            Segment::Rigid(rigid) => Segment::Rigid(Rigid { w: rigid.w * share, c: rigid.c * share, ..*rigid }),
        };
        Self {
            B: self.B * share,
            f_tip: self.f_tip * share,
            l_tip: self.l_tip * share,
            segments: self.segments.iter().map(part).collect(),
            ..*self
        }
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

    /// Length of what is integrated.
    #[inline(always)]
    pub fn length(&self) -> L {
        let mut length = self.t.x.constant(0.0);
        for segment in &self.segments {
            length = length
                + match segment {
                    Segment::Flexible(flexible) => flexible.length,
                    Segment::Rigid(rigid) => rigid.length,
                };
        }
        length
    }

    pub fn new(token: L::Token) -> Self {
        let zero = Vec3::splat(L::splat(token, 0.0));
        Self { d1: zero, t: zero, B: zero, f_tip: zero, l_tip: zero, first: 0, segments: Vec::new(), free: None }
    }
}

/// Moment from M = m + p x n.
#[inline(always)]
pub fn moment<L: Lane>(terms: impl Terms, p: Vec3<L>, M: Vec3<L>, n: Vec3<L>) -> Vec3<L> {
    if terms.force() { cross_sub(p, n, M) } else { M } // R1
}

/// A rigid segment of a rod under part of its loads.
pub struct Crossing<'a, L, T> {
    pub terms: T,
    pub rod: &'a Rod<L>,
    pub segment: &'a Rigid<L>,
    pub lambda: L,
    /// Whether a force acts on the segment's lever arm.
    pub force_arm: bool,
}

/// Crosses a rigid segment: position and moment jump, the orientation stays.
#[inline(always)]
pub fn cross_rigid<L: Lane, T: Terms>(crossing: &Crossing<'_, L, T>, n: &mut Vec3<L>, state: &mut State<L>) {
    let Crossing { terms, rod, segment, lambda, force_arm } = *crossing;
    let (length, p, t) = (segment.length, state.p, state.t);
    if segment.has_dipole {
        let mu_world = world_dipole(segment, state, lambda);
        state.M = cross_sub(mu_world, rod.B, state.M); // R3
    }
    state.p = axpy(length, t, p); // R3
    if terms.load() {
        let weight = segment.w * lambda;
        let middle = if force_arm { axpy(length * length.constant(0.5), t, p) } else { p };
        state.M = cross_sub(middle, weight, state.M); // R3
        *n = *n - weight; // R1
    }
    if terms.force() && !force_arm {
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
