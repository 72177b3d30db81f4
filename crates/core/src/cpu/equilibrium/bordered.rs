//! Equilibria of a rod in a uniform field along their curve: base moment and load fraction, dr/dm0 bordered. C1, C2

use super::curve::follow_curve;
use super::equations::{Equations, Point, Seen, further};
use super::path::{PathEnd, RestSlope};
use crate::cpu::algebra::{Mat3, Vec3, adjugate, axpy, cross, dot, inverse, length, row_times, select_matrix};
use crate::cpu::rod::base::{moment_columns, rotation_columns};
use crate::cpu::rod::problem::shoot;
use crate::cpu::rod::problem::{Problem, Record, Workspace};
use crate::cpu::rod::shoot::tip_moment_columns;
use crate::cpu::rod::stability::{departure, has_no_energy, squared_norm, stability_index};
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::tolerances::{CURVE_LIMIT, DEPARTURE, FIRST_BEND, ROUND_OFF};

/// Base moment and load fraction, or their change.
#[derive(Clone, Copy)]
pub struct Loaded<L> {
    m0: Vec3<L>,
    lambda: L,
}

impl<L: Lane> Point<L> for Loaded<L> {
    #[inline(always)]
    fn select(mask: L::Mask, a: Self, b: Self) -> Self {
        Self { m0: Vec3::select(mask, a.m0, b.m0), lambda: L::select(mask, a.lambda, b.lambda) }
    }

    #[inline(always)]
    fn plus(self, s: L, a: Self) -> Self {
        Self { m0: axpy(s, a.m0, self.m0), lambda: s.mul_add(a.lambda, self.lambda) }
    }

    #[inline(always)]
    fn times(self, s: L) -> Self {
        Self { m0: self.m0 * s, lambda: self.lambda * s }
    }

    #[inline(always)]
    fn lambda(&self) -> L {
        self.lambda
    }

    #[inline(always)]
    fn with_lambda(self, lambda: L) -> Self {
        Self { lambda, ..self }
    }

    #[inline(always)]
    fn size(&self) -> L {
        length(self.m0)
    }
}

/// A group of rods, and what the last pass told.
struct Uniform<'a, L: Lane> {
    problem: &'a Problem<'a, L>,
    workspace: &'a mut Workspace<L>,
    /// Lanes whose loads have no energy: det(dr/dm0) tells where they diverge, and no index. S6
    dead: L::Mask,
    index: L,
    /// dr/dm0 at the last pass, and its inverse at the point kept last, where there is one.
    w: Mat3<L>,
    kept: Mat3<L>,
    begun: L::Mask,
    /// How the load fraction follows a residual.
    load_by_residual: Vec3<L>,
}

impl<L: Lane> Equations<L> for Uniform<'_, L> {
    type Point = Loaded<L>;
    /// Rotation of the tip by base moment.
    type Metric = Mat3<L>;
    /// Guarded load steps arrive at less.
    const ARRIVES: bool = false;

    #[inline(always)]
    fn product(w: &Mat3<L>, a: Loaded<L>, b: Loaded<L>) -> L {
        a.lambda.mul_add(b.lambda, dot(a.m0, b.m0) + dot(*w * a.m0, *w * b.m0))
    }

    #[inline(always)]
    fn row(w: &Mat3<L>, a: Loaded<L>) -> Loaded<L> {
        Loaded { m0: a.m0 + row_times(*w * a.m0, *w), lambda: a.lambda }
    }

    #[inline(always)]
    fn select_metric(mask: L::Mask, a: &Mat3<L>, b: &Mat3<L>) -> Mat3<L> {
        select_matrix::<L>(mask, *a, *b)
    }

    /// By Cramer's rule, so that dr/dm0 may be singular. The change by load fraction is a difference: Newton's method corrects
    /// itself.
    #[inline(always)]
    fn look(&mut self, fine: bool, at: Loaded<L>, row: Loaded<L>) -> Seen<L, Loaded<L>, Mat3<L>> {
        let Problem { program, rod, .. } = *self.problem;
        let one = at.lambda.constant(1.0);
        let resolution = if fine { &program.fine } else { &program.curve };
        let mut columns = [moment_columns(one), rotation_columns(at.m0)];
        let (threes, record) = if fine { (1, Record::Nothing) } else { (2, Record::Stability) };
        let columns = &mut columns[..threes];
        let tip = shoot(self.problem, resolution, at.lambda, at.m0, columns, record, self.workspace);
        if !fine {
            self.index = stability_index(program.terms, &self.workspace.station, &tip, columns);
        }
        let r = tip.m - rod.l_tip * at.lambda;
        let w = tip_moment_columns(program.terms, &tip, &columns[0]);
        let turned = columns[0].w;
        let further = one.constant(further::<L>());
        let lambda = at.lambda + further;
        let tip = shoot(self.problem, resolution, lambda, at.m0, &mut [], Record::Nothing, self.workspace);
        let q = (tip.m - rod.l_tip * lambda - r) * (one / further);

        let (adjugate, determinant) = adjugate(w);
        let zero = one.constant(0.0);
        if !fine {
            self.index = L::select(self.dead, L::select(determinant.lt(zero), one, zero), self.index);
            self.w = w;
        }
        let (by_r, by_q) = (adjugate * r, adjugate * q);
        let whole = row.lambda * determinant - dot(row.m0, by_q);
        let per = one / whole;
        let across = cross(row.m0, row_times(cross(q, r), w));
        let delta = Loaded { m0: axpy(row.lambda, by_r, across) * -per, lambda: dot(row.m0, by_r) * per }; // C1
        self.load_by_residual = row_times(row.m0, adjugate) * per;
        let inverse = adjugate * (one / determinant);
        let along = Loaded { m0: -by_q, lambda: determinant }; // C2
        let tangent = along.times(one / Self::product(&turned, along, along).sqrt());
        Seen {
            delta,
            size: length(delta.m0).max(length(turned * delta.m0)).max(delta.lambda.abs()),
            tangent,
            whole,
            metric: turned,
            square: squared_norm(&inverse),
        }
    }

    #[inline(always)]
    fn index(&mut self) -> L {
        self.index
    }

    #[inline(always)]
    fn is_clear(&mut self) -> L::Mask {
        let clear = !self.index.lt(self.index.constant(0.0));
        if !self.problem.program.load_without_energy {
            return clear;
        }
        // Two modes that diverge at once leave the determinant its sign. At a turn it loses it.
        let departs = !departure(&self.kept, &self.w).lt(self.index.constant(DEPARTURE));
        clear & !(self.dead & self.begun & self.index.lt(self.index.constant(0.5)) & departs)
    }

    #[inline(always)]
    fn keep(&mut self, lanes: L::Mask) {
        if self.problem.program.load_without_energy {
            self.kept = select_matrix::<L>(lanes, inverse(self.w), self.kept);
            self.begun = self.begun | lanes;
        }
    }

    #[inline(always)]
    fn check(&mut self, at: Loaded<L>) -> (L, L) {
        let Problem { program, rod, .. } = *self.problem;
        let tip = shoot(self.problem, &program.check, at.lambda, at.m0, &mut [], Record::Nothing, self.workspace);
        let change = dot(self.load_by_residual, tip.m - rod.l_tip * at.lambda);
        let one = at.lambda.constant(1.0);
        let noise = (one + length(at.m0)) * one.constant(ROUND_OFF * L::Scalar::EPSILON);
        (change, length(self.load_by_residual) * noise)
    }
}

/// Follows the curve of a group from rest.
#[inline(always)]
pub fn follow_uniform<L: Lane>(
    problem: &Problem<'_, L>,
    rest: RestSlope<L>,
    workspace: &mut Workspace<L>,
) -> PathEnd<L> {
    let one = rest.largest.constant(1.0);
    let zero = Mat3::zero(one);
    let nobody = one.lt(one);
    let load_by_residual = zero.x;
    let dead = if problem.program.load_without_energy { has_no_energy(problem.rod) } else { nobody };
    let mut uniform =
        Uniform { problem, workspace, dead, index: one, w: zero, kept: zero, begun: nobody, load_by_residual };
    let start = Loaded { m0: zero.x, lambda: zero.x.x };
    let slope = Loaded { m0: rest.m0, lambda: one };
    let pace = problem.program.pace;
    let bound = one.constant(FIRST_BEND * pace);
    let first = bound / rest.largest.max(bound);
    let end = follow_curve(&mut uniform, (start, slope, Mat3::identity(one)), (first, pace, CURVE_LIMIT), !nobody);
    // Across a fold is along its curve.
    let across = Mat3 { x: end.tangent.m0, ..zero };
    PathEnd {
        m0: end.at.m0,
        inverse: across,
        lambda: end.at.lambda,
        heading: end.tangent.m0,
        passes: end.passes,
        reached: nobody,
        ramped: nobody,
        close: nobody,
        exhausted: nobody,
        fold: end.fold,
        turned: end.turned,
        load_error: end.load_error,
    }
}
