//! The rod in the reduced form: R1 (balance of force and moment), R2 (shape), R3 (rigid segments).

use super::algebra::{Vec3, axpy, cross, cross_add, cross_sub, dot};
use super::lane::Lane;
use super::program::{Inputs, Program};
use std::marker::PhantomData;

/// Which terms are compiled into a kernel.
pub trait Terms: Copy {
    /// An internal force n.
    const FORCE: bool;
    /// A force per length w; implies `FORCE`.
    const LOAD: bool;
    /// Different stiffness about body x and y.
    const ANISOTROPIC: bool;
}

#[derive(Clone, Copy)]
pub struct TermSet<const FORCE: bool, const LOAD: bool, const ANISOTROPIC: bool>(PhantomData<()>);

impl<const FORCE: bool, const LOAD: bool, const ANISOTROPIC: bool> Terms for TermSet<FORCE, LOAD, ANISOTROPIC> {
    const FORCE: bool = FORCE;
    const LOAD: bool = LOAD;
    const ANISOTROPIC: bool = ANISOTROPIC;
}

/// Where the rod is: position, first director, tangent, and M = m + p x n.
#[derive(Clone, Copy, Debug)]
pub struct State<L> {
    pub p: Vec3<L>,
    pub d1: Vec3<L>,
    pub t: Vec3<L>,
    pub M: Vec3<L>,
}

#[derive(Clone, Copy, Debug)]
pub struct Flexible<L> {
    pub length: L,
    pub compliance: Vec3<L>,
    pub u_star: Vec3<L>,
    pub w: Vec3<L>,
}

#[derive(Clone, Copy, Debug)]
pub struct Rigid<L> {
    pub length: L,
    pub mu: Vec3<L>,
    pub w: Vec3<L>,
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
    pub segments: Vec<Segment<L>>,
}

impl<L: Lane> Rod<L> {
    /// Reads the records of a group.
    #[inline(always)]
    pub fn load(&mut self, program: &Program, token: L::Token, inputs: &Inputs<'_, L::Scalar>) {
        (self.d1, self.t) = (program.vector(token, inputs, 0), program.vector(token, inputs, 3));
        self.B = program.vector(token, inputs, 6);
        (self.f_tip, self.l_tip) = (program.vector(token, inputs, 9), program.vector(token, inputs, 12));
        self.segments.clear();
        for segment in &program.segments {
            let at = segment.record + 1;
            let length: L = program.entry(token, inputs, segment.record);
            self.segments.push(if segment.is_flexible {
                let stiffness = program.vector::<L>(token, inputs, at);
                let one = length.constant(1.0);
                let compliance = Vec3 { x: one / stiffness.x, y: one / stiffness.y, z: one / stiffness.z };
                let u_star = program.vector(token, inputs, at + 3);
                Segment::Flexible(Flexible { length, compliance, u_star, w: program.vector(token, inputs, at + 6) })
            } else {
                let (mu, w) = (program.vector(token, inputs, at), program.vector(token, inputs, at + 3));
                Segment::Rigid(Rigid { length, mu, w })
            });
        }
    }

    /// n at the base under full loads: tip force and all the weight.
    #[inline(always)]
    pub fn base_force<T: Terms>(&self) -> Vec3<L> {
        let mut n = self.f_tip;
        if T::LOAD {
            for segment in &self.segments {
                let (length, w) = match segment {
                    Segment::Flexible(flexible) => (flexible.length, flexible.w),
                    Segment::Rigid(rigid) => (rigid.length, rigid.w),
                };
                n = axpy(length, w, n); // R1
            }
        }
        n
    }

    pub fn new(token: L::Token) -> Self {
        let zero = Vec3::splat(L::splat(token, 0.0));
        Self { d1: zero, t: zero, B: zero, f_tip: zero, l_tip: zero, segments: Vec::new() }
    }
}

/// Moment from M = m + p x n.
#[inline(always)]
pub fn moment<L: Lane, T: Terms>(p: Vec3<L>, M: Vec3<L>, n: Vec3<L>) -> Vec3<L> {
    if T::FORCE { cross_sub(p, n, M) } else { M } // R1
}

/// Curvature in the world frame, R u = R u* + R K^-1 R^T m.
#[inline(always)]
pub fn curvature<L: Lane, T: Terms>(
    segment: &Flexible<L>,
    d1: Vec3<L>,
    d2: Vec3<L>,
    t: Vec3<L>,
    m: Vec3<L>,
) -> Vec3<L> {
    let (u_star, k) = (segment.u_star, segment.compliance);
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
    let mu_world = world_dipole(segment, state, lambda);
    state.M = cross_sub(mu_world, rod.B, state.M); // R3
    state.p = axpy(length, t, p); // R3
    if T::LOAD {
        let weight = segment.w * (lambda * length);
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
    let d2 = cross(state.t, state.d1);
    axpy(segment.mu.x, state.d1, axpy(segment.mu.y, d2, state.t * segment.mu.z)) * lambda
}
