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
    pub fn load(&mut self, program: &Program, token: L::Token, inputs: &Inputs<'_, L::Scalar>) {
        let scalar = |entry: usize| program.entry::<L>(token, inputs, entry);
        let vector = |entry: usize| Vec3 { x: scalar(entry), y: scalar(entry + 1), z: scalar(entry + 2) };
        (self.d1, self.t) = (vector(0), vector(3));
        (self.B, self.f_tip, self.l_tip) = (vector(6), vector(9), vector(12));
        self.segments.clear();
        for segment in &program.segments {
            let (length, at) = (scalar(segment.record), segment.record + 1);
            self.segments.push(if segment.is_flexible {
                let stiffness = vector(at);
                let one = length.constant(1.0);
                let compliance = Vec3 { x: one / stiffness.x, y: one / stiffness.y, z: one / stiffness.z };
                Segment::Flexible(Flexible { length, compliance, u_star: vector(at + 3), w: vector(at + 6) })
            } else {
                Segment::Rigid(Rigid { length, mu: vector(at), w: vector(at + 3) })
            });
        }
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
