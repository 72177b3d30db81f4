//! How the equilibrium sets out from rest in a field that varies.

use super::pass::Pass;
use super::path::Load;
use super::workspace::{VaryingWorkspace, What};
use crate::lanes::algebra::Vec3;
use crate::lanes::kernels::Kernels;
use crate::lanes::problem::{Problem, stiff};
use crate::model::CoilLoad;

/// Numbers of how a sample sets out: d(n0, m0)/dlambda.
pub const REST_COLUMNS: usize = 6;

/// How all lanes set out from rest: the loads on the unbent rod. Those too near to a magnet there, or outside of a map, do not.
#[inline(always)]
pub fn set_out<L: Kernels>(problem: &Problem<'_, L>, workspace: &mut VaryingWorkspace<L>) -> Load<L> {
    let Problem { program, rod, .. } = *problem;
    let problem = Problem { rod: &stiff(rod), ..*problem };
    let none = Vec3::splat(rod.t.x.constant(0.0));
    let (resolution, what, points) = (&program.coarse, What::State, CoilLoad::Middle.points());
    let lambda = rod.t.x.constant(1.0);
    L::varying_pass(Pass { problem, resolution, lambda, base: (none, none), what, points, workspace });
    let n = rod.f_tip - workspace.tip.n;
    // It acts on the arms of that rod.
    L::varying_pass(Pass { problem, resolution, lambda, base: (n, none), what, points, workspace });
    let zero = lambda.constant(0.0);
    let stands = zero.lt(workspace.clearance) & zero.lt(workspace.inside);
    let nowhere = Vec3::splat(lambda.constant(f64::NAN));
    (Vec3::select(stands, n, nowhere), Vec3::select(stands, rod.l_tip - workspace.tip.m, nowhere))
}
