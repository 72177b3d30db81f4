//! One step of the rod: the stages once, for every column to use.

use super::section::{Flexible, curvature, to_world, velocity};
use super::segments::{Rod, State, moment};
use super::terms::Terms;
use crate::cpu::algebra::{Vec3, axpy, cross, cross_sub};
use crate::cpu::simd::lane::Lane;
use crate::model::Tableau;

/// Room for the stages of the largest tableau; a power of two, so that a number below it needs no check.
pub const STAGES: usize = 16;
/// Room for its coefficients that are not zero, and its weights.
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
    pub fn velocity(&self, terms: impl Terms) -> Vec3<L> {
        if terms.general() { self.v } else { self.t }
    }
}

/// How fast the rod changes at one stage; p' is in the stage.
#[derive(Clone, Copy, Debug)]
pub struct Slope<L> {
    pub dd1: Vec3<L>,
    pub dt: Vec3<L>,
    pub dM: Vec3<L>,
}

/// The same of one column.
#[derive(Clone, Copy, Debug)]
pub struct ColumnSlope<L> {
    pub dw: Vec3<L>,
    pub ddp: Vec3<L>,
    pub ddM: Vec3<L>,
}

/// Stages and slopes of a step, reused from step to step.
pub struct Stages<L> {
    pub tableau: &'static Tableau,
    /// The coefficients that are not zero, row by row, then the weights.
    coefficients: Vec<f64>,
    /// The stage whose slope each of them weighs.
    from: [u8; COEFFICIENTS],
    /// Where each row starts; the weights' is the row after the last stage's.
    start: [usize; STAGES + 2],
    /// Step length times the coefficients.
    ha: [L; COEFFICIENTS],
    pub stage: [Stage<L>; STAGES],
    pub slope: [Slope<L>; STAGES],
    pub column_slope: [ColumnSlope<L>; STAGES],
    /// -m_b,j / K_j² at each stage, for the integrals of the columns.
    pub strain: [Vec3<L>; STAGES],
}

impl<L: Lane> Stages<L> {
    pub fn new(token: L::Token, tableau: &'static Tableau) -> Self {
        let zero = L::splat(token, 0.0);
        let v = Vec3::splat(zero);
        let mut stages = Self {
            tableau,
            coefficients: Vec::new(),
            from: [0; COEFFICIENTS],
            start: [0; STAGES + 2],
            ha: [zero; COEFFICIENTS],
            stage: [Stage { p: v, d1: v, d2: v, t: v, v, m: v, n: v, compliance: v }; STAGES],
            slope: [Slope { dd1: v, dt: v, dM: v }; STAGES],
            column_slope: [ColumnSlope { dw: v, ddp: v, ddM: v }; STAGES],
            strain: [v; STAGES],
        };
        stages.set_tableau(tableau);
        stages
    }

    fn set_tableau(&mut self, tableau: &'static Tableau) {
        self.tableau = tableau;
        self.coefficients.clear();
        for (i, row) in tableau.a.iter().chain([&tableau.b]).enumerate() {
            self.start[i] = self.coefficients.len();
            for (j, a) in row.iter().enumerate().filter(|(_, a)| **a != 0.0) {
                self.from[self.coefficients.len()] = j as u8;
                self.coefficients.push(*a);
            }
        }
        self.start[tableau.a.len() + 1] = self.coefficients.len();
    }

    /// Prepares the coefficients for steps of length `h`.
    #[inline(always)]
    pub fn set_step(&mut self, tableau: &'static Tableau, h: L) {
        if !std::ptr::eq(tableau, self.tableau) {
            self.set_tableau(tableau);
        }
        for (ha, a) in self.ha.iter_mut().zip(&self.coefficients) {
            *ha = h * h.constant(*a);
        }
    }

    /// Step length times coefficient, and the stage whose slope it weighs: of stage `i`, or the weights.
    #[inline(always)]
    pub fn row(&self, i: usize) -> impl Iterator<Item = (L, usize)> {
        let row = self.start[i % STAGES]..self.start[i % STAGES + 1];
        self.ha[row.clone()].iter().zip(&self.from[row]).map(|(ha, j)| (*ha, *j as usize % STAGES))
    }
}

/// One step of several equal ones over a flexible segment of a rod under part of its loads.
pub struct Step<'a, L, T> {
    pub terms: T,
    pub rod: &'a Rod<L>,
    pub segment: &'a Flexible<L>,
    pub lambda: L,
    /// Its length.
    pub h: L,
    /// Its start and its length as shares of the segment.
    pub start: f64,
    pub share: f64,
    /// Force at its start.
    pub n: Vec3<L>,
    /// Of three columns, one after the other; one where they lie side by side.
    pub turns: usize,
}

/// Takes the rod over one step.
#[inline(always)]
pub fn step_rod<L: Lane, T: Terms>(step: &Step<'_, L, T>, stages: &mut Stages<L>, state: &mut State<L>) {
    let Step { terms, rod, segment, lambda, .. } = *step;
    let stage_count = stages.tableau.a.len();
    let weight = segment.w * lambda;
    let mu = segment.mu * lambda;
    for i in 0..stage_count {
        let State { mut p, mut d1, mut t, mut M } = *state;
        for (ha, j) in stages.row(i) {
            let slope = &stages.slope[j];
            p = axpy(ha, stages.stage[j].velocity(terms), p); // R2
            d1 = axpy(ha, slope.dd1, d1);
            t = axpy(ha, slope.dt, t);
            if terms.load() {
                M = axpy(ha, slope.dM, M);
            }
        }
        let c = stages.tableau.c[i];
        let section = segment.section(terms, c.mul_add(step.share, step.start));
        let mut n = step.n;
        if terms.load() {
            n = axpy(-step.h * step.h.constant(c), weight, n); // R1
        }
        let d2 = cross(t, d1);
        let m = moment(terms, p, M, n);
        let omega = curvature(terms, &section, d1, d2, t, m);
        let stage = &mut stages.stage[i % STAGES];
        (stage.p, stage.d1, stage.d2, stage.t, stage.m, stage.n) = (p, d1, d2, t, m, n);
        if terms.general() {
            stage.v = velocity(terms, segment, d1, d2, t, n);
            stage.compliance = section.compliance;
        }
        let slope = &mut stages.slope[i % STAGES];
        slope.dd1 = cross(omega, d1); // R2
        slope.dt = cross(omega, t); // R2
        if terms.load() {
            slope.dM = cross(weight, p); // R1
            if terms.general() && segment.has_magnet {
                slope.dM = cross_sub(to_world(d1, d2, t, mu), rod.B, slope.dM); // R1
            }
        }
    }
    let State { mut p, mut d1, mut t, mut M } = *state;
    for (hb, j) in stages.row(stage_count) {
        let slope = &stages.slope[j];
        p = axpy(hb, stages.stage[j].velocity(terms), p);
        d1 = axpy(hb, slope.dd1, d1);
        t = axpy(hb, slope.dt, t);
        if terms.load() {
            M = axpy(hb, slope.dM, M);
        }
    }
    *state = State { p, d1, t, M };
}
