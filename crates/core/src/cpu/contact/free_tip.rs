//! A free rod beside a wall: how its tip and the rest of it stand to that, after the kernel of free rods has solved it. W1

use super::wall::Near;
use crate::cpu::algebra::Vec3;
use crate::cpu::equilibrium::field::chord::check_pass;
use crate::cpu::rod::field::pass::VaryingPasses;
use crate::cpu::rod::field::workspace::VaryingWorkspace;
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::program::{Inputs, Outputs};
use crate::model::tolerances::THROUGH_WALL;
use crate::model::{ContactColumn, Quantity, Status};

/// Numbers of a free rod: moment at the base, tip (from the base), passes.
pub const FREE_COLUMNS: usize = 7;
/// The last of them.
pub const FREE_PASSES_AT: usize = 6;

/// Writes the contact of free tips, and their status: `Ok`, `ThroughWall`, or `Pending` where the wall presses the tip.
#[inline(always)]
pub fn write_free_tip<L: VaryingPasses>(
    problem: &Problem<'_, L>,
    free: &Inputs<'_, L::Scalar>,
    workspace: &mut VaryingWorkspace<L>,
    out: &mut Outputs<'_, L::Scalar>,
) {
    let Problem { program, rod, .. } = *problem;
    let Some(first) = program.contact else { return };
    let token = problem.token();
    let (m0, p) = (free.vector(token, 0), free.vector(token, 3));
    let pass = check_pass(problem, (rod.base_force(program.terms), m0), workspace);
    let Some(wall) = &workspace.wall else { return };
    let Near { gap, normal, .. } = wall.near(p);
    let body_gap = wall.body_gap(&pass.tip).min(gap);
    let one = gap.constant(1.0);
    let zero = one.constant(0.0);
    let code = |status: Status| one.constant(f64::from(status.code()));
    let is_through = body_gap.lt(one.constant(-THROUGH_WALL));
    let status = L::select(is_through, code(Status::ThroughWall), code(Status::Ok));
    // A gap that is no number is not before the wall.
    let is_free = !gap.lt(zero) & gap.is_finite();
    out.store(Quantity::Status.column(), L::select(is_free, status, code(Status::Pending)));
    let mut put = |column: ContactColumn, value: L| out.store(first + column as usize, value);
    put(ContactColumn::Touching, zero);
    put(ContactColumn::Gap, gap);
    put(ContactColumn::NormalForce, zero);
    put(ContactColumn::BodyGap, body_gap);
    put(ContactColumn::ForceError, zero);
    put(ContactColumn::Friction, wall.friction);
    out.store_vector(first + ContactColumn::Normal as usize, normal);
    out.store_vector(first + ContactColumn::Force as usize, Vec3::splat(zero));
    for column in 0..4 * program.derivatives.len() {
        out.store(first + ContactColumn::COUNT + column, zero);
    }
}
