//! The wall comes, along the curve of equilibria: by its arclength in the load at the base and the share of the wall's way, to the wall's
//! place or to where that share turns. W4, C1 to C6

use super::wall::Wall;
use crate::cpu::algebra::Vec3;
use crate::cpu::equilibrium::curve::follow_curve;
use crate::cpu::equilibrium::equations::{Equations, Point, Seen};
use crate::cpu::equilibrium::field::arrival::VaryingPath;
use crate::cpu::equilibrium::field::base_load::{margin, select};
use crate::cpu::equilibrium::field::curve::{Loaded, Metric, load_by, newton_and_tangent};
use crate::cpu::equilibrium::field::path::{leaps, narrowed};
use crate::cpu::rod::field::index::index;
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::rod::field::pass::{Pass, VaryingPasses};
use crate::cpu::rod::field::workspace::{Carried, VaryingWorkspace};
use crate::cpu::rod::problem::Problem;
use crate::cpu::simd::lane::Lane;
use crate::model::tolerances::{CURVE_LIMIT, FIRST_BEND, SAFE_MARGIN, WALL_LEAST_PULL};

/// A group of rods under their full loads, and how far the wall is on its way.
struct Pressed<'a, L: Lane> {
    problem: &'a Problem<'a, L>,
    workspace: &'a mut VaryingWorkspace<L>,
    wall: Wall<L>,
    /// The shift of the wall where it begins.
    way: Vec3<L>,
    /// Derivative of the boundary conditions by the load at the base at the last pass, and the same bordered by the row of the curve.
    rows: Mat6<L>,
    matrix: [[L; 7]; 7],
    /// Lanes in which the wall comes nearer along the curve there.
    comes: L::Mask,
    /// The inverse of the contact rows, and the margin: at the last point that was looked at whole, and at the point kept last.
    found: (Mat6<L>, L),
    kept: (Mat6<L>, L),
    /// Lanes whose margin has been small: other branches are as near.
    doubtful: L::Mask,
}

impl<L: VaryingPasses> Pressed<'_, L> {
    /// A pass with the wall at a share of its way, and the residual there.
    #[inline(always)]
    fn residual(&mut self, at: Loaded<L>, fine: bool, what: Carried) -> [L; 6] {
        let program = &self.problem.program;
        let resolution = match (what, fine) {
            (Carried::State, _) => &program.check,
            (_, true) => &program.fine,
            (_, false) => &program.curve,
        };
        let points = program.field.as_ref().map_or(&[][..], |field| match what {
            Carried::State => &field.check_points[..],
            _ => field.points,
        });
        let lambda = at.lambda.constant(1.0);
        let (problem, base) = (*self.problem, at.base);
        L::varying_pass(Pass { problem, resolution, lambda, base, what, points, workspace: self.workspace });
        self.wall.set_out(self.way, lambda - at.lambda);
        let (force, moment) = self.wall.lack(self.problem.rod, &self.workspace.tip);
        [-force.x, -force.y, -force.z, -moment.x, -moment.y, -moment.z]
    }
}

impl<L: VaryingPasses> Equations<L> for Pressed<'_, L> {
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

    #[inline(always)]
    fn look(&mut self, fine: bool, at: Loaded<L>, row: Loaded<L>) -> Seen<L, Loaded<L>, Metric<L>> {
        let zero = at.lambda.constant(0.0);
        let residual = self.residual(at, fine, if fine { Carried::Base } else { Carried::Transfers });
        let VaryingWorkspace { tip, pose, matrix, .. } = &*self.workspace;
        self.rows = self.wall.rows(self.problem.rod, tip, pose, matrix);
        let by_share = self.wall.rows_by_share(self.way, self.problem.rod, tip);
        let comes = Vec3::select(self.wall.touching, by_share, Vec3::splat(zero));
        let by_share = [comes.x, comes.y, comes.z, zero, zero, zero];
        let (seen, bordered) = newton_and_tangent(at, (residual, &self.rows, by_share), row, pose);
        self.matrix = bordered;
        self.comes = zero.lt(seen.tangent.lambda);
        seen
    }

    #[inline(always)]
    fn index(&mut self) -> L {
        let VaryingWorkspace { tip, pose, matrix, transfers, .. } = &*self.workspace;
        let dead = index(transfers, self.kept.1.constant(1.0)).index;
        self.wall.index(self.problem.rod, tip, dead, pose, matrix).abs()
    }

    #[inline(always)]
    fn is_clear(&mut self) -> L::Mask {
        let zero = self.kept.1.constant(0.0);
        let inverse = self.rows.solve(&Mat6::identity(zero.constant(1.0)));
        self.found = (inverse, margin(&inverse));
        let pull = self.wall.pull(self.problem.rod, &self.workspace.tip, Vec3::splat(zero));
        let presses = pull.lt(zero.constant(WALL_LEAST_PULL));
        // At a turn the margin is none.
        let calm = !(self.comes & leaps(self.found.1, self.kept.1));
        calm & presses & zero.lt(self.workspace.leeway) & zero.lt(self.workspace.inside)
    }

    #[inline(always)]
    fn keep(&mut self, lanes: L::Mask) {
        let (inverse, margin) = &self.found;
        self.doubtful = self.doubtful | (lanes & !margin.constant(SAFE_MARGIN).lt(*margin));
        self.kept = (Mat6::select(lanes, inverse, &self.kept.0), L::select(lanes, *margin, self.kept.1));
    }

    #[inline(always)]
    fn caution(&self, _: L) -> L {
        narrowed(self.kept.1, true)
    }

    #[inline(always)]
    fn check(&mut self, at: Loaded<L>) -> (L, L) {
        let residual = self.residual(at, true, Carried::State);
        load_by(residual, &self.matrix, at.base)
    }
}

/// Brings the wall to free rods under their full loads. Lanes whose way ends are at a fold, at 1 and the share of the way.
#[inline(always)]
pub fn follow_press<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    end: &mut VaryingPath<L>,
    workspace: &mut VaryingWorkspace<L>,
) {
    let Some(mut wall) = workspace.wall.take() else { return };
    let one = end.lambda.constant(1.0);
    let zero = one.constant(0.0);
    let free = Loaded { base: end.base, lambda: zero };
    let nobody = one.lt(zero);
    let matrix = [[zero; 7]; 7];
    let (kept, way) = ((Mat6::identity(one), one), Vec3::splat(zero));
    // Nobody is pressed in the first pass: it tells the free tip.
    let mut pressed = Pressed {
        problem,
        workspace,
        wall,
        way,
        rows: kept.0,
        matrix,
        comes: nobody,
        found: kept,
        kept,
        doubtful: nobody,
    };
    pressed.look(false, free, Loaded { base: (way, way), lambda: one });
    let stable = index(&pressed.workspace.transfers, one).index.lt(one.constant(0.5));
    let tip = pressed.workspace.tip;
    pressed.way = pressed.wall.meet(&tip, false, end);
    pressed.wall.leave_unstable(stable, end);
    pressed.wall.soften(&pressed.workspace.pose, &pressed.workspace.matrix);
    let comes = pressed.wall.touching;
    if L::any(comes) {
        let row = Loaded { base: (Vec3::splat(zero), Vec3::splat(zero)), lambda: one };
        let begin = pressed.look(false, free, row);
        pressed.is_clear();
        pressed.keep(comes);
        let slope = begin.tangent.times(one / begin.tangent.lambda);
        let bound = one.constant(FIRST_BEND * problem.program.pace);
        let first = bound / begin.metric.product(slope, slope).sqrt().max(bound);
        let found =
            follow_curve(&mut pressed, (free, slope, begin.metric), (first, problem.program.pace, CURVE_LIMIT), comes);
        let arrived = comes & found.reached & !pressed.doubtful;
        end.base = select::<L>(comes, found.at.base, end.base);
        end.inverse = Mat6::select(comes, &pressed.kept.0, &end.inverse);
        end.lambda = L::select(comes & !arrived, one + found.at.lambda, end.lambda);
        end.fold = end.fold | (comes & found.fold);
        end.load_error = L::select(comes, found.load_error, end.load_error);
        end.passes = L::select(comes, end.passes + found.passes, end.passes);
        end.reached = end.reached & (!comes | arrived);
        pressed.wall.touching = arrived;
    }
    wall = pressed.wall;
    wall.set_out(Vec3::splat(zero), zero);
    workspace.wall = Some(wall);
}
