//! Equilibria of a rod in a field that varies along their curve: load at the base and load fraction, their matrix of 7 rows. C1, C2
#![allow(clippy::needless_range_loop)]

use super::arrival::VaryingPath;
use super::base_load::{Load, margin, norm};
use super::path::{departure, leaps, narrowed};
use super::rest::Rest;
use crate::cpu::algebra::{Vec3, axpy, dot, length};
use crate::cpu::equilibrium::curve::follow_curve;
use crate::cpu::equilibrium::equations::{Equations, Point, Seen, further};
use crate::cpu::rod::field::index::index;
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::rod::field::pass::{Pass, VaryingPasses};
use crate::cpu::rod::field::workspace::{Carried, VaryingWorkspace};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::stability::has_no_energy;
use crate::cpu::simd::apart::apart;
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::tolerances::{
    DEPARTURE, FIELD_CURVE_CAREFUL_LIMIT, FIELD_CURVE_LIMIT, FIRST_BEND, NEAR_MARGIN, ROUND_OFF,
};

/// Load at the base and load fraction, or their change.
#[derive(Clone, Copy)]
pub struct Loaded<L> {
    pub base: Load<L>,
    pub lambda: L,
}

impl<L: Lane> Loaded<L> {
    #[inline(always)]
    pub fn numbers(&self) -> [L; 7] {
        let (n, m) = self.base;
        [n.x, n.y, n.z, m.x, m.y, m.z, self.lambda]
    }

    #[inline(always)]
    pub fn of([a, b, c, d, e, f, lambda]: [L; 7]) -> Self {
        Self { base: (Vec3 { x: a, y: b, z: c }, Vec3 { x: d, y: e, z: f }), lambda }
    }
}

impl<L: Lane> Point<L> for Loaded<L> {
    #[inline(always)]
    fn select(mask: L::Mask, a: Self, b: Self) -> Self {
        Self { base: super::base_load::select::<L>(mask, a.base, b.base), lambda: L::select(mask, a.lambda, b.lambda) }
    }

    #[inline(always)]
    fn plus(self, s: L, a: Self) -> Self {
        let base = (axpy(s, a.base.0, self.base.0), axpy(s, a.base.1, self.base.1));
        Self { base, lambda: s.mul_add(a.lambda, self.lambda) }
    }

    #[inline(always)]
    fn times(self, s: L) -> Self {
        Self { base: (self.base.0 * s, self.base.1 * s), lambda: self.lambda * s }
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
        norm(self.base)
    }
}

/// How the pose of the tip follows the load at the base, and the square of how much a force counts.
#[derive(Clone, Copy)]
pub struct Metric<L> {
    pub pose: Mat6<L>,
    pub force: L,
}

impl<L: Lane> Metric<L> {
    /// Where a force counts as a moment does.
    #[inline(always)]
    pub fn plain(one: L) -> Self {
        Self { pose: Mat6::identity(one), force: one }
    }

    #[inline(always)]
    pub fn product(&self, a: Loaded<L>, b: Loaded<L>) -> L {
        let (pa, pb) = (self.pose.on(a.base.0, a.base.1), self.pose.on(b.base.0, b.base.1));
        let tip = dot(pa.0, pb.0) + dot(pa.1, pb.1) + dot(a.base.1, b.base.1);
        self.force.mul_add(dot(a.base.0, b.base.0), a.lambda.mul_add(b.lambda, tip))
    }

    /// The row that measures along a change of length 1.
    #[inline(always)]
    pub fn row(&self, a: Loaded<L>) -> Loaded<L> {
        let (dp, w) = self.pose.on(a.base.0, a.base.1);
        let (n, m) = self.pose.transposed().on(dp, w);
        Loaded { base: (axpy(self.force, a.base.0, n), m + a.base.1), lambda: a.lambda }
    }

    #[inline(always)]
    pub fn select(mask: L::Mask, a: &Self, b: &Self) -> Self {
        Self { pose: Mat6::select(mask, &a.pose, &b.pose), force: L::select(mask, a.force, b.force) }
    }
}

/// A pass at a point near the curve.
pub type SeenLoaded<L> = Seen<L, Loaded<L>, Metric<L>>;

/// Newton's step and the tangent at a point, from the residual there, its derivatives by the load at the base and by the load fraction, and
/// the row that a step leaves as it is. Returns the bordered matrix, too. C1, C2
#[inline(always)]
pub fn newton_and_tangent<L: Lane>(
    at: Loaded<L>,
    (residual, matrix, by_lambda): ([L; 6], &Mat6<L>, [L; 6]),
    row: Loaded<L>,
    pose: &Mat6<L>,
) -> (SeenLoaded<L>, [[L; 7]; 7]) {
    let one = at.lambda.constant(1.0);
    let zero = one.constant(0.0);
    let (mut a, mut b) = ([[zero; 7]; 7], [[zero; 2]; 7]);
    for k in 0..6 {
        a[k][..6].copy_from_slice(&matrix.0[k]);
        a[k][6] = by_lambda[k];
        b[k][0] = -residual[k];
    }
    a[6] = row.numbers();
    b[6][1] = one;
    let (found, whole) = solve_bordered(a, b);
    let (mut delta, mut along) = ([zero; 7], [zero; 7]);
    for k in 0..7 {
        (delta[k], along[k]) = (found[k][0], found[k][1]);
    }
    let (delta, along) = (Loaded::of(delta), Loaded::of(along)); // C1, C2
    let force = one / (one + length(at.base.0));
    let metric = Metric { pose: *pose, force: force * force };
    let tangent = along.times(one / metric.product(along, along).sqrt());
    let (dp, w) = pose.on(delta.base.0, delta.base.1);
    let size = length(delta.base.1).max(length(w)).max(length(dp)).max(delta.lambda.abs());
    let size = size.max(length(delta.base.0) * force);
    (Seen { delta, size, tangent, whole, metric, square: one }, a)
}

/// How a residual moves the load fraction, by the bordered matrix, and what round-off of the pass that tells it may. C5
#[inline(always)]
pub fn load_by<L: Lane>(residual: [L; 6], matrix: &[[L; 7]; 7], base: Load<L>) -> (L, L) {
    let one = residual[0].constant(1.0);
    let by_residual = load_by_residual(matrix);
    let (mut change, mut square) = (one.constant(0.0), one.constant(0.0));
    for k in 0..6 {
        change = by_residual[k].mul_add(residual[k], change);
        square = by_residual[k].mul_add(by_residual[k], square);
    }
    let noise = (one + norm(base)) * one.constant(ROUND_OFF * L::Scalar::EPSILON);
    (change, square.sqrt() * noise)
}

/// A group of rods, and what the last pass told.
struct Varying<'a, L: Lane> {
    problem: &'a Problem<'a, L>,
    workspace: &'a mut VaryingWorkspace<L>,
    /// Lanes whose loads have no energy: the load turns where they diverge, and no index tells. S6
    dead: L::Mask,
    /// Tip and leeway of the last pass, and at the point kept last.
    tip: Vec3<L>,
    kept_tip: Vec3<L>,
    kept_leeway: L,
    /// Of the last pass, bordered by its row.
    matrix: [[L; 7]; 7],
    /// The inverse of dr/d(n0, m0) and the margin at the point of the last converged pass, and at the point kept last.
    found: (Mat6<L>, L),
    kept: (Mat6<L>, L),
    /// The curve is followed on the fine grid, and no step is taken over which the margin leaps.
    careful: bool,
    /// Lanes whose load rises along the curve at the point of the last pass, and lanes that have left rest.
    rises: L::Mask,
    begun: L::Mask,
    /// Lanes whose margin has been small or has leapt: stability may have been lost and won again between.
    doubtful: L::Mask,
}

/// Solves A x = b for both b, the largest pivot of each column chosen lane by lane; returns det A, too.
#[inline(always)]
fn solve_bordered<L: Lane>(a: [[L; 7]; 7], b: [[L; 2]; 7]) -> ([[L; 2]; 7], L) {
    L::apart(a[0][0].token(), SolveBordered { a: &a, b: &b })
}

apart!(SolveBordered<'a, L: Lane>(a: &'a [[L; 7]; 7], b: &'a [[L; 2]; 7]) -> ([[L; 2]; 7], L), solve_bordered_apart(*a, *b));

#[inline(always)]
fn solve_bordered_apart<L: Lane>(mut a: [[L; 7]; 7], mut b: [[L; 2]; 7]) -> ([[L; 2]; 7], L) {
    let one = a[0][0].constant(1.0);
    let mut determinant = one;
    for k in 0..7 {
        for row in k + 1..7 {
            let larger = a[k][k].abs().lt(a[row][k].abs());
            for column in k..7 {
                let (up, down) = (a[k][column], a[row][column]);
                a[k][column] = L::select(larger, down, up);
                a[row][column] = L::select(larger, up, down);
            }
            for column in 0..2 {
                let (up, down) = (b[k][column], b[row][column]);
                b[k][column] = L::select(larger, down, up);
                b[row][column] = L::select(larger, up, down);
            }
            determinant = L::select(larger, -determinant, determinant);
        }
        let inverse = one / a[k][k];
        determinant = determinant * a[k][k];
        for row in k + 1..7 {
            let factor = a[row][k] * inverse;
            for column in k + 1..7 {
                a[row][column] = factor.neg_mul_add(a[k][column], a[row][column]);
            }
            for column in 0..2 {
                b[row][column] = factor.neg_mul_add(b[k][column], b[row][column]);
            }
        }
    }
    for k in (0..7).rev() {
        let inverse = one / a[k][k];
        for column in 0..2 {
            let mut x = b[k][column];
            for j in k + 1..7 {
                x = a[k][j].neg_mul_add(b[j][column], x);
            }
            b[k][column] = x * inverse;
        }
    }
    (b, determinant)
}

/// How the load fraction follows a residual, by a matrix bordered by q and a row: the last row of its inverse. C5
#[inline(always)]
pub fn load_by_residual<L: Lane>(matrix: &[[L; 7]; 7]) -> [L; 7] {
    let one = matrix[0][0].constant(1.0);
    let (mut a, mut b) = (*matrix, [[one.constant(0.0); 2]; 7]);
    for row in 0..7 {
        for column in 0..7 {
            a[row][column] = matrix[column][row];
        }
    }
    b[6] = [one; 2];
    solve_bordered(a, b).0.map(|[x, _]| -x)
}

impl<L: VaryingPasses> Varying<'_, L> {
    #[inline(always)]
    fn pass(&mut self, fine: bool, lambda: L, base: Load<L>, what: Carried) {
        let program = &self.problem.program;
        let resolution = if fine || self.careful { &program.fine } else { &program.curve };
        let points = program.field.as_ref().map_or(&[][..], |field| field.points);
        let problem = *self.problem;
        L::varying_pass(Pass { problem, resolution, lambda, base, what, points, workspace: self.workspace });
    }

    /// dr after a pass under part of the load.
    #[inline(always)]
    fn residual(&self, lambda: L) -> [L; 6] {
        let (rod, tip) = (self.problem.rod, &self.workspace.tip);
        let (n, m) = (tip.n - rod.f_tip * lambda, tip.m - rod.l_tip * lambda);
        [n.x, n.y, n.z, m.x, m.y, m.z]
    }
}

impl<L: VaryingPasses> Equations<L> for Varying<'_, L> {
    type Point = Loaded<L>;
    type Metric = Metric<L>;
    const ARRIVES: bool = true;

    #[inline(always)]
    fn product(metric: &Metric<L>, a: Loaded<L>, b: Loaded<L>) -> L {
        metric.product(a, b)
    }

    #[inline(always)]
    fn row(metric: &Metric<L>, a: Loaded<L>) -> Loaded<L> {
        metric.row(a)
    }

    #[inline(always)]
    fn select_metric(mask: L::Mask, a: &Metric<L>, b: &Metric<L>) -> Metric<L> {
        Metric::select(mask, a, b)
    }

    /// The change by load fraction is a difference: Newton's method corrects itself.
    #[inline(always)]
    fn look(&mut self, fine: bool, at: Loaded<L>, row: Loaded<L>) -> Seen<L, Loaded<L>, Metric<L>> {
        let further = at.lambda.constant(further::<L>());
        self.pass(fine, at.lambda, at.base, if fine { Carried::Base } else { Carried::Transfers });
        let r = self.residual(at.lambda);
        self.tip = self.workspace.tip.p;
        self.pass(fine, at.lambda + further, at.base, Carried::State);
        let mut by_lambda = self.residual(at.lambda + further);
        for k in 0..6 {
            by_lambda[k] = (by_lambda[k] - r[k]) / further;
        }
        let VaryingWorkspace { matrix, pose, .. } = &*self.workspace;
        let (seen, matrix) = newton_and_tangent(at, (r, matrix, by_lambda), row, pose);
        self.matrix = matrix;
        self.rises = at.lambda.constant(0.0).lt(seen.tangent.lambda);
        seen
    }

    #[inline(always)]
    fn index(&mut self) -> L {
        let one = self.kept_leeway.constant(1.0);
        let index = index(&self.workspace.transfers, one).index;
        L::select(self.dead, L::select(self.rises, one.constant(0.0), one), index)
    }

    #[inline(always)]
    fn is_clear(&mut self) -> L::Mask {
        let zero = self.kept_leeway.constant(0.0);
        let leeway = self.workspace.leeway;
        let passes_by = !length(self.tip - self.kept_tip).lt(self.kept_leeway + leeway);
        let inverse = self.workspace.matrix.solve_soon(&Mat6::identity(zero.constant(1.0)));
        self.found = (inverse, margin(&inverse));
        let mut clear = zero.lt(leeway) & zero.lt(self.workspace.inside) & !passes_by;
        if self.problem.program.load_without_energy {
            let departs = !departure(&self.kept.0, &self.workspace.matrix).lt(zero.constant(DEPARTURE));
            clear = clear & !(self.dead & self.begun & self.rises & departs);
        }
        // At a turn the margin is none.
        if self.careful { clear & !(self.rises & leaps(self.found.1, self.kept.1)) } else { clear }
    }

    #[inline(always)]
    fn keep(&mut self, lanes: L::Mask) {
        self.kept_tip = Vec3::select(lanes, self.tip, self.kept_tip);
        self.kept_leeway = L::select(lanes, self.workspace.leeway, self.kept_leeway);
        self.begun = self.begun | lanes;
        let (inverse, margin) = &self.found;
        let is_small = !margin.constant(NEAR_MARGIN).lt(*margin);
        if !self.careful {
            self.doubtful = self.doubtful | (lanes & (is_small | leaps(*margin, self.kept.1)));
        }
        self.kept = (Mat6::select(lanes, inverse, &self.kept.0), L::select(lanes, *margin, self.kept.1));
    }

    #[inline(always)]
    fn caution(&self, _: L) -> L {
        narrowed(self.kept.1, self.careful)
    }

    #[inline(always)]
    fn check(&mut self, at: Loaded<L>) -> (L, L) {
        let field = self.problem.program.field.as_ref();
        let (resolution, points) =
            (&self.problem.program.check, field.map_or(&[][..], |field| &field.check_points[..]));
        let (problem, what, base) = (*self.problem, Carried::State, at.base);
        let workspace = &mut *self.workspace;
        L::varying_pass(Pass { problem, resolution, lambda: at.lambda, base, what, points, workspace });
        load_by(self.residual(at.lambda), &self.matrix, base)
    }
}

/// Follows the curve of a group from rest; `careful`: see [`Varying`]. Else lanes do not arrive whose margin was small, or leapt, on the way.
#[inline(always)]
pub fn follow_bordered<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    careful: bool,
    rest: &Rest<L>,
    workspace: &mut VaryingWorkspace<L>,
) -> VaryingPath<L> {
    let one = rest.leeway.constant(1.0);
    let zero = one.constant(0.0);
    let none = (Vec3::splat(zero), Vec3::splat(zero));
    let nobody = one.lt(zero);
    let matrix = [[zero; 7]; 7];
    let (tip, kept_tip, kept_leeway) = (rest.tip, rest.tip, rest.leeway);
    let kept = (Mat6::identity(one), one);
    let (found, doubtful, rises, begun) = (kept, nobody, nobody, nobody);
    let dead = if problem.program.load_without_energy { has_no_energy(problem.rod) } else { nobody };
    let mut varying = Varying {
        problem,
        workspace,
        dead,
        tip,
        kept_tip,
        kept_leeway,
        matrix,
        found,
        kept,
        careful,
        rises,
        begun,
        doubtful,
    };
    let start = Loaded { base: none, lambda: zero };
    let slope = Loaded { base: rest.slope, lambda: one };
    let pace = problem.program.pace;
    let bound = one.constant(FIRST_BEND * pace);
    let first = bound / rest.largest.max(bound);
    let metric = Metric::plain(one);
    let wanted = zero.lt(rest.leeway) & zero.lt(rest.inside);
    let limit = if careful { FIELD_CURVE_CAREFUL_LIMIT } else { FIELD_CURVE_LIMIT };
    let end = follow_curve(&mut varying, (start, slope, metric), (first, pace, limit), wanted);
    VaryingPath {
        base: end.at.base,
        inverse: varying.kept.0,
        reached: end.reached & !varying.doubtful,
        fold: end.fold,
        turned: end.turned,
        along: end.tangent.base,
        too_near: nobody,
        outside: nobody,
        exhausted: nobody,
        lambda: end.at.lambda,
        load_error: end.load_error,
        passes: end.passes,
    }
}
