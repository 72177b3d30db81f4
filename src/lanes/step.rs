//! One step of the rod: the stages once, for every column to use.

use super::algebra::{Mat3, Vec3, axpy, cross, cross_sub};
use super::lane::Lane;
use super::rod::{Rod, State, Terms, moment};
use super::section::{Flexible, curvature, to_world, velocity};
use crate::model::Tableau;

/// The largest number of stages of a tableau.
const STAGES: usize = 12;
/// Coefficients below the diagonal and the weights of the largest tableau.
const COEFFICIENTS: usize = STAGES * (STAGES - 1) / 2 + STAGES;

/// The rod at one stage.
#[derive(Clone, Copy, Debug)]
pub struct Stage<L> {
    pub p: Vec3<L>,
    pub d1: Vec3<L>,
    pub d2: Vec3<L>,
    pub t: Vec3<L>,
    pub m: Vec3<L>,
    pub n: Vec3<L>,
    /// p' = R nu and the section's compliance, where they are needed.
    pub v: Vec3<L>,
    pub compliance: Vec3<L>,
}

impl<L: Lane> Stage<L> {
    /// p'
    #[inline(always)]
    pub fn velocity<T: Terms>(&self) -> Vec3<L> {
        if T::GENERAL { self.v } else { self.t }
    }
}

/// Stages and slopes of a step, reused from step to step.
pub struct Stages<L> {
    pub tableau: &'static Tableau,
    /// Step length times the coefficients, row by row, then times the weights.
    pub ha: [L; COEFFICIENTS],
    pub stage: [Stage<L>; STAGES],
    pub dd1: [Vec3<L>; STAGES],
    pub dt: [Vec3<L>; STAGES],
    pub dM: [Vec3<L>; STAGES],
    pub dw: [Mat3<L>; STAGES],
    pub ddp: [Mat3<L>; STAGES],
    pub ddM: [Mat3<L>; STAGES],
    /// w, dm - w x m and dp of the last columns, for their integrals.
    pub w: [Mat3<L>; STAGES],
    pub x: [Mat3<L>; STAGES],
    pub dp: [Mat3<L>; STAGES],
}

impl<L: Lane> Stages<L> {
    pub fn new(token: L::Token, tableau: &'static Tableau) -> Self {
        let zero = L::splat(token, 0.0);
        let v = Vec3::splat(zero);
        let a = Mat3 { x: v, y: v, z: v };
        Self {
            tableau,
            ha: [zero; COEFFICIENTS],
            stage: [Stage { p: v, d1: v, d2: v, t: v, v, m: v, n: v, compliance: v }; STAGES],
            dd1: [v; STAGES],
            dt: [v; STAGES],
            dM: [v; STAGES],
            dw: [a; STAGES],
            ddp: [a; STAGES],
            ddM: [a; STAGES],
            w: [a; STAGES],
            x: [a; STAGES],
            dp: [a; STAGES],
        }
    }

    /// Prepares the coefficients for steps of length `h`.
    #[inline(always)]
    pub fn set_step(&mut self, tableau: &'static Tableau, h: L) {
        self.tableau = tableau;
        let coefficients = tableau.a.iter().flat_map(|row| row.iter()).chain(tableau.b);
        for (ha, a) in self.ha.iter_mut().zip(coefficients) {
            *ha = h * h.constant(*a);
        }
    }
}

/// One step of several equal ones over a segment.
#[derive(Clone, Copy, Debug)]
pub struct Step<L> {
    /// Its length.
    pub h: L,
    /// Its start and its length as shares of the segment.
    pub start: f64,
    pub share: f64,
    /// Force at its start.
    pub n: Vec3<L>,
}

/// Takes the rod over one step.
#[inline(always)]
pub fn step_rod<L: Lane, T: Terms>(
    rod: &Rod<L>,
    segment: &Flexible<L>,
    lambda: L,
    step: &Step<L>,
    stages: &mut Stages<L>,
    state: &mut State<L>,
) {
    let stage_count = stages.tableau.a.len();
    let mut at = 0;
    let weight = segment.w * lambda;
    let mu = segment.mu * lambda;
    for i in 0..stage_count {
        let State { mut p, mut d1, mut t, mut M } = *state;
        for j in 0..i {
            let ha = stages.ha[at + j];
            p = axpy(ha, stages.stage[j].velocity::<T>(), p); // R2
            d1 = axpy(ha, stages.dd1[j], d1);
            t = axpy(ha, stages.dt[j], t);
            if T::LOAD {
                M = axpy(ha, stages.dM[j], M);
            }
        }
        at += i;
        let c = stages.tableau.c[i];
        let section = segment.section::<T>(c.mul_add(step.share, step.start));
        let mut n = step.n;
        if T::LOAD {
            n = axpy(-step.h * step.h.constant(c), weight, n); // R1
        }
        let d2 = cross(t, d1);
        let m = moment::<L, T>(p, M, n);
        let omega = curvature::<L, T>(&section, d1, d2, t, m);
        let stage = &mut stages.stage[i];
        (stage.p, stage.d1, stage.d2, stage.t, stage.m, stage.n) = (p, d1, d2, t, m, n);
        if T::GENERAL {
            stage.v = velocity::<L, T>(segment, d1, d2, t, n);
            stage.compliance = section.compliance;
        }
        stages.dd1[i] = cross(omega, d1); // R2
        stages.dt[i] = cross(omega, t); // R2
        if T::LOAD {
            stages.dM[i] = -cross(p, weight); // R1
            if T::GENERAL && segment.has_magnet {
                stages.dM[i] = cross_sub(to_world(d1, d2, t, mu), rod.B, stages.dM[i]); // R1
            }
        }
    }
    for j in 0..stage_count {
        let hb = stages.ha[at + j];
        state.p = axpy(hb, stages.stage[j].velocity::<T>(), state.p);
        state.d1 = axpy(hb, stages.dd1[j], state.d1);
        state.t = axpy(hb, stages.dt[j], state.t);
        if T::LOAD {
            state.M = axpy(hb, stages.dM[j], state.M);
        }
    }
}
