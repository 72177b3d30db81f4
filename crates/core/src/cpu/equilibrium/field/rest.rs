//! How the equilibrium sets out from rest in a field that varies.

use super::base_load::{Load, norm};
use crate::cpu::algebra::{Vec3, cross_sub, length};
use crate::cpu::rod::field::pass::{Pass, VaryingPasses};
use crate::cpu::rod::field::workspace::{Carried, VaryingWorkspace};
use crate::cpu::rod::problem::{Problem, stiff};
use crate::cpu::rod::program::{Inputs, Outputs};
use crate::cpu::simd::lane::Lane;
use crate::model::CoilLoad;

/// Numbers of how a sample sets out: d(n0, m0)/dlambda, the tip, its leeway, how far the dipoles are inside of maps, the largest moment.
pub const REST_COLUMNS: usize = 12;

/// How samples set out from rest.
pub struct Rest<L: Lane> {
    /// d(n0, m0)/dlambda
    pub slope: Load<L>,
    /// The largest of its size and of the moments by all loads inside the unbent rod.
    pub largest: L,
    pub tip: Vec3<L>,
    /// How far it may move before the rod is too near to a magnet.
    pub leeway: L,
    /// How far the rod's dipoles are inside of every map.
    pub inside: L,
}

impl<L: Lane> Rest<L> {
    #[inline(always)]
    pub fn store(&self, out: &mut Outputs<'_, L::Scalar>) {
        out.store_vector(0, self.slope.0);
        out.store_vector(3, self.slope.1);
        out.store_vector(6, self.tip);
        out.store(9, self.leeway);
        out.store(10, self.inside);
        out.store(11, self.largest);
    }

    /// Reads it again.
    #[inline(always)]
    pub fn load(token: L::Token, from: &Inputs<'_, L::Scalar>) -> Self {
        let [slope, moment, tip] = [0, 3, 6].map(|column| from.vector(token, column));
        let [leeway, inside, largest] = [9, 10, 11].map(|column| from.column(token, column));
        Self { slope: (slope, moment), largest, tip, leeway, inside }
    }
}

/// How all lanes set out from rest: the loads on the unbent rod.
#[inline(always)]
pub fn set_out<L: VaryingPasses>(problem: &Problem<'_, L>, workspace: &mut VaryingWorkspace<L>) -> Rest<L> {
    let Problem { program, rod, .. } = *problem;
    let problem = Problem { rod: &stiff(rod), ..*problem };
    let none = Vec3::splat(rod.t.x.constant(0.0));
    let (resolution, what, points) = (&program.coarse, Carried::Place, CoilLoad::Middle.points());
    let lambda = rod.t.x.constant(1.0);
    L::varying_pass(Pass { problem, resolution, lambda, base: (none, none), what, points, workspace });
    let n = rod.f_tip - workspace.tip.n;
    // It acts on the arms of that rod, which stays where it is.
    let arm = if program.rigid_force_arm { n } else { none };
    if program.rigid_force_arm {
        workspace.tip.m = cross_sub(workspace.tip.p, n, workspace.tip.m);
    } else {
        L::varying_pass(Pass { problem, resolution, lambda, base: (n, none), what, points, workspace });
    }
    let slope = (n, rod.l_tip - workspace.tip.m);
    let moments = std::mem::take(&mut workspace.moments);
    // Force and moment at the base of a rod that stays where it is add to the moments inside.
    let inside = |(p, m): &(Vec3<L>, Vec3<L>)| length(cross_sub(*p, arm, *m + slope.1));
    let largest = moments.iter().fold(norm(slope), |largest, at| largest.max(inside(at)));
    workspace.moments = moments;
    Rest { slope, largest, tip: workspace.tip.p, leeway: workspace.leeway, inside: workspace.inside }
}
