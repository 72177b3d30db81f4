//! A wall that the tip may touch: its gap at a point, what the boundary conditions become, and stability with it. W1, W3, W5
#![allow(clippy::needless_range_loop)]

use super::program_wall::ProgramWall;
use crate::cpu::algebra::{Mat3, Vec3, axpy, cross, dot, inverse, length, outer, row_times};
use crate::cpu::equilibrium::field::base_load::Load;
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::rod::field::state::State;
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::segments::Rod;
use crate::cpu::simd::lane::Lane;
use crate::model::record::BASE_POSITION_AT;
use crate::model::{Surface, WallKind};

/// Places on a step of the rod where its gap is looked at.
const PLACES: usize = 8;

/// A wall of a group of samples, and how its tips touch it. Positions count from the base.
pub struct Wall<L: Lane> {
    pub kind: WallKind,
    position: Vec3<L>,
    /// Normal of a plane, axis of a cylinder.
    axis: Vec3<L>,
    anchor: Vec3<L>,
    radius: L,
    tip_radius: L,
    pub compliance: L,
    pub friction: L,
    /// Where the tip is held.
    pub held_at: Vec3<L>,
    /// Lanes whose tip the wall presses or holds.
    pub touching: L::Mask,
    /// Sign (1 or -1) that picks the chart of the tangent frame across the normal.
    pub sign: L,
    /// Shift of the contact rows while the wall comes; zero once it is in its place. W4
    pub shift: Vec3<L>,
    /// Least gap of the rod beyond where it first is before the wall, and whether it has been.
    body_gap: L,
    seen: L::Mask,
    /// The tip is to be held farther away than the rod is long.
    pub out_of_reach: L::Mask,
    /// The wall has no normal there.
    pub undefined: L::Mask,
}

/// A gap, its gradient and its second derivatives. W1
#[derive(Clone, Copy, Debug)]
pub struct Near<L> {
    pub gap: L,
    pub normal: Vec3<L>,
    pub curvature: Mat3<L>,
}

/// How a wall moves: its position, turned about that, its numbers, and where the tip is held.
#[derive(Clone, Copy, Debug)]
pub struct WallChange<L> {
    pub position: Vec3<L>,
    pub turn: Vec3<L>,
    pub radius: L,
    pub tip_radius: L,
    pub compliance: L,
    pub anchor: Vec3<L>,
}

impl<L: Lane> WallChange<L> {
    #[inline(always)]
    pub fn none(zero: L) -> Self {
        let v = Vec3::splat(zero);
        Self { position: v, turn: v, radius: zero, tip_radius: zero, compliance: zero, anchor: v }
    }
}

/// Two directions across one, all of length 1 and right-handed with it last. They follow it smoothly but where its z is minus `sign`.
#[inline(always)]
fn across<L: Lane>(n: Vec3<L>, sign: L) -> [Vec3<L>; 2] {
    let one = n.x.constant(1.0);
    let a = -one / (sign + n.z);
    let b = n.x * n.y * a;
    let first = Vec3 { x: (sign * n.x * n.x).mul_add(a, one), y: sign * b, z: -(sign * n.x) };
    [first, Vec3 { x: b, y: (n.y * n.y).mul_add(a, sign), z: -n.y }]
}

/// Negative eigenvalues of a symmetric matrix, by the signs of its invariants.
#[inline(always)]
fn negative<L: Lane>(m: Mat3<L>) -> L {
    let trace = m.x.x + m.y.y + m.z.z;
    let minors = m.x.x * m.y.y - m.x.y * m.x.y + m.y.y * m.z.z - m.y.z * m.y.z + m.x.x * m.z.z - m.x.z * m.x.z;
    let determinant = dot(m.x, cross(m.y, m.z));
    changes([trace, minors, determinant])
}

/// Changes of sign in a sequence that begins with 1: the negative roots of a polynomial whose roots are all real.
#[inline(always)]
fn changes<L: Lane, const N: usize>(sequence: [L; N]) -> L {
    let zero = sequence[0].constant(0.0);
    let one = zero.constant(1.0);
    let (mut count, mut last) = (zero, one);
    for x in sequence {
        count = L::select((x * last).lt(zero), count + one, count);
        last = x;
    }
    count
}

#[inline(always)]
fn symmetric<L: Lane>(m: Mat3<L>) -> Mat3<L> {
    let half = m.x.x.constant(0.5);
    let (xy, xz, yz) = ((m.x.y + m.y.x) * half, (m.x.z + m.z.x) * half, (m.y.z + m.z.y) * half);
    Mat3 { x: Vec3 { x: m.x.x, y: xy, z: xz }, y: Vec3 { x: xy, y: m.y.y, z: yz }, z: Vec3 { x: xz, y: yz, z: m.z.z } }
}

impl<L: Lane> Wall<L> {
    /// Reads the walls of a group.
    #[inline(always)]
    pub fn load(wall: &ProgramWall, problem: &Problem<'_, L>) -> Self {
        let Problem { program, inputs, rod } = *problem;
        let token = problem.token();
        let entry = |k: usize| program.entry::<L>(token, &inputs, wall.entry + k);
        let vector = |k: usize| program.vector::<L>(token, &inputs, wall.entry + k);
        let base = program.vector::<L>(token, &inputs, BASE_POSITION_AT);
        let zero = L::splat(token, 0.0);
        let nobody = zero.lt(zero);
        let mut all = Self {
            kind: wall.kind,
            position: vector(0) - base,
            axis: vector(3),
            anchor: vector(6) - base,
            radius: entry(9),
            tip_radius: entry(10),
            compliance: entry(11),
            friction: entry(12),
            held_at: Vec3::splat(zero),
            touching: nobody,
            sign: L::splat(token, 1.0),
            shift: Vec3::splat(zero),
            body_gap: zero,
            seen: nobody,
            out_of_reach: nobody,
            undefined: nobody,
        };
        if wall.kind.sticks {
            let Near { gap, normal, .. } = all.near(all.anchor);
            all.held_at = axpy(-gap, normal, all.anchor);
            if !wall.kind.yields {
                all.out_of_reach = rod.length().lt(length(all.held_at));
            }
            all.undefined = !gap.is_finite() | !length(normal).is_finite();
        }
        all
    }

    /// Gap at a point. W1
    #[inline(always)]
    pub fn near(&self, at: Vec3<L>) -> Near<L> {
        let zero = self.radius.constant(0.0);
        let one = zero.constant(1.0);
        let d = at - self.position;
        let (a, mut arm, mut lines) = (self.axis, d, Mat3::identity(one));
        match self.kind.surface {
            Surface::Plane => {
                return Near { gap: dot(a, d) - self.tip_radius, normal: a, curvature: Mat3::zero(zero) };
            }
            Surface::Sphere => {}
            Surface::Cylinder => {
                arm = axpy(-dot(a, d), a, d);
                lines = outer(-a, a, lines);
            }
        }
        let sign = one.constant(if self.kind.outside { 1.0 } else { -1.0 });
        let distance = length(arm);
        let e = arm * (one / distance);
        Near {
            gap: sign * (distance - self.radius) - self.tip_radius,
            normal: e * sign,
            curvature: outer(-e, e, lines) * (sign / distance),
        }
    }

    /// Force of the wall on the rod. W2
    #[inline(always)]
    pub fn force(&self, rod: &Rod<L>, tip: &State<L>) -> Vec3<L> {
        tip.n - rod.f_tip
    }

    /// Residual of the boundary conditions with its sign reversed: three contact rows, and the moment. W3
    #[inline(always)]
    pub fn lack(&self, rod: &Rod<L>, tip: &State<L>) -> Load<L> {
        let f = self.force(rod, tip);
        let rows = if self.kind.sticks {
            axpy(self.compliance, f, tip.p - self.held_at) + self.shift
        } else {
            let Near { gap, normal, .. } = self.near(tip.p);
            let [first, second] = across(normal, self.sign);
            let pressed = self.compliance.mul_add(dot(normal, f), gap) + self.shift.z;
            Vec3 { x: dot(first, f), y: dot(second, f), z: pressed }
        };
        (-Vec3::select(self.touching, rows, f), rod.l_tip - tip.m)
    }

    /// Whether a sliding tip is on the side of the wall, or pressed by it, as it is taken to be.
    #[inline(always)]
    pub fn agrees(&self, rod: &Rod<L>, tip: &State<L>) -> L::Mask {
        let zero = self.radius.constant(0.0);
        let is_pressed = !zero.lt(self.pull(rod, tip));
        (self.touching & is_pressed) | self.lets_be(tip, zero)
    }

    /// Whether it does not touch a tip, which is behind it by this little at most.
    #[inline(always)]
    pub fn lets_be(&self, tip: &State<L>, little: L) -> L::Mask {
        let zero = little.constant(0.0);
        let is_before = if self.kind.sticks { zero.lt(zero) } else { !(self.near(tip.p).gap + little).lt(zero) };
        !self.touching & is_before
    }

    /// By how much a sliding tip is pulled: none of a held one. W2
    #[inline(always)]
    pub fn pull(&self, rod: &Rod<L>, tip: &State<L>) -> L {
        let zero = self.radius.constant(0.0);
        if self.kind.sticks { zero } else { -dot(self.near(tip.p).normal, self.force(rod, tip)) }
    }

    /// How those rows follow the load at the base, from how pose and load at the tip do. W3
    #[inline(always)]
    pub fn rows(&self, rod: &Rod<L>, tip: &State<L>, pose: &Mat6<L>, matrix: &Mat6<L>) -> Mat6<L> {
        let mut all = *matrix;
        let near = self.near(tip.p);
        let f = self.force(rod, tip);
        for column in 0..6 {
            let of = |m: &Mat6<L>| Vec3 { x: m.0[0][column], y: m.0[1][column], z: m.0[2][column] };
            let (dp, df) = (of(pose), of(matrix));
            let row = self.change_of_rows(&near, f, dp, df);
            for (k, x) in [row.x, row.y, row.z].into_iter().enumerate() {
                all.0[k][column] = L::select(self.touching, x, all.0[k][column]);
            }
        }
        all
    }

    /// How the contact rows follow a change of the tip's place and of the force there, the wall held. W3
    #[inline(always)]
    fn change_of_rows(&self, near: &Near<L>, f: Vec3<L>, dp: Vec3<L>, df: Vec3<L>) -> Vec3<L> {
        if self.kind.sticks {
            return axpy(self.compliance, df, dp);
        }
        let lambda = dot(near.normal, f);
        let [first, second] = across(near.normal, self.sign);
        let slid = axpy(-lambda, near.curvature * dp, df);
        let along = self.compliance.mul_add(dot(near.normal, df), dot(near.normal, dp));
        Vec3 { x: dot(first, slid), y: dot(second, slid), z: along }
    }

    /// How gap and normal at a point that stays follow a change of the wall. W1
    #[inline(always)]
    fn moved(&self, near: &Near<L>, at: Vec3<L>, change: &WallChange<L>) -> (L, Vec3<L>) {
        let sign = self.radius.constant(if self.kind.outside { 1.0 } else { -1.0 });
        let way = change.position + cross(change.turn, at - self.position);
        let gap = -dot(near.normal, way) - sign * change.radius - change.tip_radius;
        (gap, cross(change.turn, near.normal) - near.curvature * way)
    }

    /// Derivative of the contact rows by a parameter at a fixed load at the base, from its columns `dp` and `df` at the tip. W6
    #[inline(always)]
    pub fn rows_by(
        &self,
        (rod, tip): (&Rod<L>, &State<L>),
        dp: Vec3<L>,
        df: Vec3<L>,
        change: &WallChange<L>,
    ) -> Vec3<L> {
        let near = self.near(tip.p);
        let f = self.force(rod, tip);
        let rows = self.change_of_rows(&near, f, dp, df);
        if self.kind.sticks {
            let at = self.near(self.anchor);
            let (gap, normal) = self.moved(&at, self.anchor, change);
            let along = gap + dot(at.normal, change.anchor);
            let turned = normal + at.curvature * change.anchor;
            let held_at = change.anchor - at.normal * along - turned * at.gap;
            return axpy(change.compliance, f, rows) - held_at;
        }
        let lambda = dot(near.normal, f);
        let (gap, normal) = self.moved(&near, tip.p, change);
        let [first, second] = across(near.normal, self.sign);
        let pressed = change.compliance.mul_add(lambda, gap);
        rows + Vec3 { x: -(lambda * dot(first, normal)), y: -(lambda * dot(second, normal)), z: pressed }
    }

    /// How the normal force follows a parameter, from how the tip's place and the force do. W6
    #[inline(always)]
    pub fn normal_force_by(
        &self,
        (rod, tip): (&Rod<L>, &State<L>),
        dp: Vec3<L>,
        df: Vec3<L>,
        change: &WallChange<L>,
    ) -> L {
        let near = self.near(tip.p);
        let (_, normal) = self.moved(&near, tip.p, change);
        dot(near.normal, df) + dot(self.force(rod, tip), normal + near.curvature * dp)
    }

    /// Index of rod and wall together, from that of the rod under its force as a dead one. W5
    #[inline(always)]
    pub fn index(&self, rod: &Rod<L>, tip: &State<L>, dead: L, pose: &Mat6<L>, matrix: &Mat6<L>) -> L {
        let zero = self.radius.constant(0.0);
        let one = zero.constant(1.0);
        let compliance = symmetric(pose.times(&matrix.solve(&Mat6::identity(one))).block(0, 0));
        let pinned = dead - negative(compliance);
        let stiffness = symmetric(inverse(compliance));
        let soft = one / self.compliance;
        let more = if self.kind.sticks {
            if self.kind.yields { negative(stiffness + Mat3::identity(one) * soft) } else { zero }
        } else {
            let near = self.near(tip.p);
            let lambda = dot(near.normal, self.force(rod, tip));
            let bent = stiffness + near.curvature * -lambda;
            if self.kind.yields {
                negative(outer(near.normal * soft, near.normal, bent))
            } else {
                let [first, second] = across(near.normal, self.sign);
                let (by_first, by_second) = (row_times(first, bent), row_times(second, bent));
                let (a, b, c) = (dot(by_first, first), dot(by_first, second), dot(by_second, second));
                changes([a + c, a * c - b * b])
            }
        };
        L::select(self.touching, pinned + more, dead)
    }

    /// Forgets what was seen of the rod.
    #[inline(always)]
    pub fn watch(&mut self) {
        let one = self.radius.constant(1.0);
        (self.seen, self.body_gap) = (one.lt(one), one.constant(crate::cpu::rod::field::program_field::FAR));
    }

    /// Looks at places from one state of the rod to the next, at this distance along it.
    #[inline(always)]
    pub fn watch_step(&mut self, before: &State<L>, after: &State<L>, span: L) {
        let one = span.constant(1.0);
        let zero = one.constant(0.0);
        let (mut last_gap, mut last_slope) = (zero, zero);
        for k in 0..=PLACES {
            // The cubic through both ends and their tangents, and its derivative.
            let u = k as f64 / PLACES as f64;
            let (square, left) = (u * u, (1.0 - u) * (1.0 - u));
            let at = cubic(
                [left * (1.0 + 2.0 * u), square * (3.0 - 2.0 * u), u * left, square * (u - 1.0)],
                before,
                after,
                span,
            );
            let turn = 6.0 * u * (1.0 - u);
            let way = cubic([-turn, turn, (1.0 - u) * (1.0 - 3.0 * u), u * (3.0 * u - 2.0)], before, after, span);
            let Near { gap, normal, .. } = self.near(at);
            let slope = dot(normal, way);
            // Between two places the gap is a parabola.
            let turns = if k > 0 { last_slope.lt(zero) & zero.lt(slope) } else { one.lt(zero) };
            let share = last_slope / (last_slope - slope) * one.constant(0.5 / PLACES as f64);
            let lowest = share.mul_add(last_slope, last_gap);
            self.body_gap = L::select(self.seen & turns, self.body_gap.min(lowest), self.body_gap);
            self.seen = self.seen | !gap.lt(zero);
            self.body_gap = L::select(self.seen, self.body_gap.min(gap), self.body_gap);
            (last_gap, last_slope) = (gap, slope);
        }
    }

    /// Least gap of the rod after a pass that has watched it, behind a wall that tissue yields to its tip; that of the tip, where no
    /// part of the rod is before the wall.
    #[inline(always)]
    pub fn body_gap(&self, tip: &State<L>) -> L {
        let gap = self.near(tip.p).gap;
        let zero = gap.constant(0.0);
        L::select(self.seen, self.body_gap, gap) - L::select(gap.lt(zero), gap, zero)
    }
}

/// A cubic along a step of the rod, from its weights of both ends and of both tangents.
#[inline(always)]
fn cubic<L: Lane>([start, end, out, into]: [f64; 4], before: &State<L>, after: &State<L>, span: L) -> Vec3<L> {
    let chord = before.p * span.constant(start) + after.p * span.constant(end);
    axpy(span.constant(into) * span, after.t, axpy(span.constant(out) * span, before.t, chord))
}
