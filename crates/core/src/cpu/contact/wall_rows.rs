//! Output columns of the contact with a wall: gap, force, normal, and the derivatives of the force by each parameter. W6

use super::wall::{Near, Wall};
use crate::cpu::algebra::{Vec3, dot, length};
use crate::cpu::equilibrium::field::base_load::Load;
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::rod::field::parameters::Parameters;
use crate::cpu::rod::field::state::State;
use crate::cpu::rod::field::workspace::VaryingWorkspace;
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::program::Outputs;
use crate::cpu::rod::segments::Rod;
use crate::cpu::simd::lane::Lane;
use crate::model::ContactColumn;
use crate::model::tolerances::DIFFERENCE;

/// Two passes from which a contact is written: `check` on twice the fine steps, `fine` on those; the steps of the load at the base that
/// lead each to equilibrium, the share of their difference that estimates the error, and the round-off of the force.
#[derive(Clone, Copy)]
pub struct Answered<L> {
    pub p: Vec3<L>,
    pub check: State<L>,
    pub fine: State<L>,
    pub step: Load<L>,
    pub left: Load<L>,
    pub share: L,
    pub noise: L,
}

/// Derivative of the boundary conditions by a parameter at a fixed load at the base, with its sign reversed: force rows (contact rows
/// where the wall presses) and moment rows. `dp`, `dn` and `dm` are the parameter's columns at the tip. W6
#[inline(always)]
pub fn lack_by<L: Lane>(
    problem: &Problem<'_, L>,
    (parameters, k): (&Parameters<L>, usize),
    (dp, dn, dm): (Vec3<L>, Vec3<L>, Vec3<L>),
    workspace: &VaryingWorkspace<L>,
) -> (Vec3<L>, Vec3<L>) {
    let df = dn - parameters.df_tip[k];
    let moment = parameters.sources.dl_tip[k] - dm;
    let Some(wall) = &workspace.wall else { return (-df, moment) };
    let rows = wall.rows_by((problem.rod, &workspace.tip), dp, df, &parameters.wall[k]);
    (-Vec3::select(wall.touching, rows, df), moment)
}

/// How a wall meets the tip: force of the wall, its normal component and its error, gap and normal.
pub struct Meeting<L> {
    force: Vec3<L>,
    along: L,
    error: L,
    gap: L,
    normal: Vec3<L>,
}

impl<L: Lane> Answered<L> {
    #[inline(always)]
    pub fn meeting(&self, rod: &Rod<L>, wall: &Wall<L>, matrix: &Mat6<L>) -> Meeting<L> {
        let one = self.p.x.constant(1.0);
        let none = Vec3::splat(one.constant(0.0));
        let touches = |f: Vec3<L>| Vec3::select(wall.touching, f, none);
        let force = |tip: &State<L>, change: Load<L>| wall.force(rod, tip) + matrix.on(change.0, change.1).0;
        let (f, rough) = (touches(force(&self.check, self.step)), touches(force(&self.fine, self.left)));
        let Near { gap, normal, .. } = wall.near(self.p);
        let along = dot(normal, f);
        // A sliding tip is pressed along the normal alone.
        let force = if wall.kind.sticks { f } else { normal * along };
        let error = length(force - rough) * one.constant(DIFFERENCE) * self.share + self.noise;
        Meeting { force, along, error, gap, normal }
    }
}

impl<L: Lane> Meeting<L> {
    /// Lanes whose tip slides and is pulled by more than the force may be off: it has left the wall on the way. W2
    #[inline(always)]
    pub fn pulls(&self, wall: &Wall<L>) -> L::Mask {
        let zero = self.error.constant(0.0);
        wall.touching & if wall.kind.sticks { zero.lt(zero) } else { self.error.lt(-self.along) }
    }
}

/// Writes the contact of each sample.
#[inline(always)]
pub fn write_contact<L: Lane>(
    problem: &Problem<'_, L>,
    meeting: &Meeting<L>,
    body_gap: L,
    wall: &Wall<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Some(first) = problem.program.contact else { return };
    let Meeting { force: f, along, error, gap, normal } = *meeting;
    let one = along.constant(1.0);
    let none = Vec3::splat(one.constant(0.0));
    out.store(first + ContactColumn::Touching as usize, L::select(wall.touching, one, none.x));
    out.store(first + ContactColumn::Gap as usize, gap);
    out.store(first + ContactColumn::NormalForce as usize, along);
    out.store_vector(first + ContactColumn::Force as usize, f);
    out.store_vector(first + ContactColumn::Normal as usize, normal);
    out.store(first + ContactColumn::BodyGap as usize, body_gap);
    out.store(first + ContactColumn::ForceError as usize, L::select(wall.touching, error, none.x));
    out.store(first + ContactColumn::Friction as usize, wall.friction);
}

/// Writes how normal force and force follow derivative `number`, from how the tip's place and the load at the base do.
#[inline(always)]
pub fn write_force_rows<L: Lane>(
    problem: &Problem<'_, L>,
    number: usize,
    (parameters, k): (&Parameters<L>, usize),
    (dp, df): (Vec3<L>, Vec3<L>),
    workspace: &VaryingWorkspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let (Some(first), Some(wall)) = (problem.program.contact, &workspace.wall) else { return };
    let column = first + ContactColumn::COUNT + 4 * number;
    let zero = dp.x.constant(0.0);
    let along = wall.normal_force_by((problem.rod, &workspace.tip), dp, df, &parameters.wall[k]);
    out.store(column, L::select(wall.touching, along, zero));
    out.store_vector(column + 1, Vec3::select(wall.touching, df, Vec3::splat(zero)));
}
