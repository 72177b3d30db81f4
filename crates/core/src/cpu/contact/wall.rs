//! A wall that the tip may touch: its gap at a point, what the boundary conditions become, and stability with it. W1, W3, W5
#![allow(clippy::needless_range_loop)]

use super::course::{Course, along};
use super::program_wall::ProgramWall;
use crate::cpu::algebra::{Mat3, Vec3, axpy, cross, dot, inverse, length, outer, row_times};
use crate::cpu::equilibrium::field::base_load::Load;
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::rod::field::state::State;
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::segments::Rod;
use crate::cpu::simd::lane::{Lane, Scalar};
use crate::model::record::BASE_POSITION_AT;
use crate::model::{RodWall, Surface, WallKind};

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
    /// How far the wall is off from the base by round-off of where both are.
    off: L,
    /// Shift of the contact rows while the wall comes; zero once it is in its place. W4
    pub shift: Vec3<L>,
    /// Compliance added to that of the tissue while a held tip is drawn to its point: at the start of the way, and now. W4
    pub softness: L,
    yields_now: L,
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

/// How the tip follows a dead force there, from how pose and load at the tip follow the load at the base.
#[inline(always)]
fn dead_compliance<L: Lane>(pose: &Mat6<L>, matrix: &Mat6<L>) -> Mat3<L> {
    symmetric(pose.times(&matrix.solve(&Mat6::identity(pose.0[0][0].constant(1.0)))).block(0, 0))
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
            off: (length(base) + length(vector(0)).max(length(vector(6)))) * zero.constant(0.5 * L::Scalar::EPSILON),
            shift: Vec3::splat(zero),
            softness: zero,
            yields_now: zero,
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

    /// Makes the hold of a straight rod soft at the start of its way: no force on its end draws that inward, unless it buckles. `pose` and
    /// `matrix` are those of the free rod. W4
    #[inline(always)]
    pub fn soften(&mut self, pose: &Mat6<L>, matrix: &Mat6<L>) {
        let one = self.radius.constant(1.0);
        let zero = one.constant(0.0);
        let compliance = dead_compliance(pose, matrix);
        let size = compliance.x.x + compliance.y.y + compliance.z.z;
        let held = compliance + Mat3::identity(one) * self.compliance;
        let volume = dot(held.x, cross(held.y, held.z));
        let is_straight = volume.lt(size * size * size * one.constant(RodWall::STRAIGHT));
        let softness = L::select(is_straight, size * one.constant(RodWall::SOFTNESS), zero);
        self.softness = if self.kind.sticks { softness } else { zero };
    }

    /// Sets it where a share of its way is left. W4
    #[inline(always)]
    pub fn set_out(&mut self, way: Vec3<L>, left: L) {
        self.shift = way * left;
        self.yields_now = self.softness * left;
    }

    /// How the contact rows follow the share of the way that is done, the load at the base held. W4
    #[inline(always)]
    pub fn rows_by_share(&self, way: Vec3<L>, rod: &Rod<L>, tip: &State<L>) -> Vec3<L> {
        -axpy(self.softness, self.force(rod, tip), way)
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
            axpy(self.compliance + self.yields_now, f, tip.p - self.held_at) + self.shift
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
        let is_pressed = !zero.lt(self.pull(rod, tip, Vec3::splat(zero)));
        (self.touching & is_pressed) | self.lets_be(tip, zero)
    }

    /// Whether it does not touch a tip, which is behind it by this little at most.
    #[inline(always)]
    pub fn lets_be(&self, tip: &State<L>, little: L) -> L::Mask {
        let zero = little.constant(0.0);
        let is_before = if self.kind.sticks { zero.lt(zero) } else { !(self.near(tip.p).gap + little).lt(zero) };
        !self.touching & is_before
    }

    /// By how much a sliding tip is pulled once the force has changed by `df`: none of a held one. W2
    #[inline(always)]
    pub fn pull(&self, rod: &Rod<L>, tip: &State<L>, df: Vec3<L>) -> L {
        let zero = self.radius.constant(0.0);
        if self.kind.sticks { zero } else { -dot(self.near(tip.p).normal, self.force(rod, tip) + df) }
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
            return axpy(self.compliance + self.yields_now, df, dp);
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

    /// Round-off of the contact rows by that of where wall and base are. W3
    #[inline(always)]
    pub fn round_off(&self, rod: &Rod<L>, tip: &State<L>) -> L {
        let zero = self.radius.constant(0.0);
        let one = zero.constant(1.0);
        // A normal that is off turns the force.
        let Mat3 { x, y, z } = self.near(tip.p).curvature;
        let turned = length(self.force(rod, tip)) * length(x).max(length(y)).max(length(z));
        let off = self.off * if self.kind.sticks { one } else { one + turned };
        L::select(self.touching, off, zero)
    }

    /// Index of rod and wall together, from that of the rod under its force as a dead one. W5
    #[inline(always)]
    pub fn index(&self, rod: &Rod<L>, tip: &State<L>, dead: L, pose: &Mat6<L>, matrix: &Mat6<L>) -> L {
        let one = self.radius.constant(1.0);
        let compliance = dead_compliance(pose, matrix);
        if self.kind.sticks {
            let held = compliance + Mat3::identity(one) * (self.compliance + self.yields_now);
            return L::select(self.touching, dead - negative(held), dead);
        }
        let near = self.near(tip.p);
        let lambda = dot(near.normal, self.force(rod, tip));
        let bent = symmetric(inverse(compliance)) + near.curvature * -lambda;
        let more = if self.kind.yields {
            negative(outer(near.normal * (one / self.compliance), near.normal, bent))
        } else {
            let [first, second] = across(near.normal, self.sign);
            let (by_first, by_second) = (row_times(first, bent), row_times(second, bent));
            let (a, b, c) = (dot(by_first, first), dot(by_first, second), dot(by_second, second));
            changes([a + c, a * c - b * b])
        };
        L::select(self.touching, dead - negative(compliance) + more, dead)
    }

    /// Forgets what was seen of the rod.
    #[inline(always)]
    pub fn watch(&mut self) {
        let one = self.radius.constant(1.0);
        (self.seen, self.body_gap) = (one.lt(one), one.constant(crate::cpu::rod::field::program_field::FAR));
    }

    /// Looks at so many places from one station of the rod to the next, at this distance along it.
    #[inline(always)]
    pub fn watch_step(&mut self, before: &Course<L>, after: &Course<L>, span: L, places: usize) {
        let one = span.constant(1.0);
        let zero = one.constant(0.0);
        let (mut last_gap, mut last_slope) = (zero, zero);
        for k in 0..=places {
            let u = k as f64 / places as f64;
            let (at, way) = along(u, before, after, span);
            let Near { gap, normal, .. } = self.near(at);
            let slope = dot(normal, way);
            // Between two places the gap is a parabola.
            let turns = if k > 0 { (last_slope * slope).lt(zero) } else { one.lt(zero) };
            let share = last_slope / (last_slope - slope) * one.constant(0.5 / places as f64);
            let extreme = share.mul_add(last_slope, last_gap);
            self.seen = self.seen | (turns & !extreme.lt(zero));
            self.body_gap = L::select(self.seen & turns, self.body_gap.min(extreme), self.body_gap);
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
