//! A register of samples: their rods, their paths, their answers, each a kernel.

use super::kernels::{Answer, ByNodes, Follow, FollowNodes, Kernels, Load};
use super::tools::Tools;
use crate::cpu::algebra::{Mat3, Vec3};
use crate::cpu::equilibrium::bordered::follow_uniform;
use crate::cpu::equilibrium::path::{Path, PathEnd, RestSlope, follow_path};
use crate::cpu::equilibrium::search::search_start;
use crate::cpu::equilibrium::solve::solve_group;
use crate::cpu::multiple_shooting::{follow_quickly, solve_nodes};
use crate::cpu::rod::problem::Problem;
use crate::cpu::rod::program::{Inputs, Outputs};
use crate::cpu::simd::lane::Lane;
use pulp::{Simd, WithSimd};

impl<L: Lane> WithSimd for Load<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Load { program, token, inputs, rod } = self;
        rod.load(program, token, &inputs);
    }
}

impl<L: Lane> WithSimd for Follow<'_, L> {
    type Output = PathEnd<L>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> PathEnd<L> {
        let Follow { problem, path, rest, workspace } = self;
        match path {
            Path::Curve => follow_uniform(&problem, rest, workspace),
            _ => follow_path(&problem, path, rest, workspace),
        }
    }
}

impl<L: Kernels> WithSimd for Answer<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Answer { program, token, path, tools, mut out } = self;
        let Tools { rod, workspace, inputs, start } = tools;
        let inputs = Inputs { data: inputs, stride: L::COUNT, offset: 0 };
        let start = Inputs { data: start, stride: L::COUNT, offset: 0 };
        L::load_rods(Load { program, token, inputs, rod });
        let problem = Problem { program, inputs, rod };
        let end = match path {
            Path::Anchored | Path::Ramp => load_end(token, &start),
            Path::Curve | Path::GuardedRamp => {
                L::follow(Follow { problem, path, rest: load_rest(token, &start), workspace })
            }
            Path::Search => search_start(&problem, workspace),
        };
        solve_group(&problem, path, end, workspace, &mut out);
    }
}

impl<L: Kernels> WithSimd for ByNodes<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let ByNodes { program, token, nodes, quick, quick_end, offset, tools, mut out } = self;
        let Tools { rod, workspace, inputs, .. } = tools;
        let inputs = Inputs { data: inputs, stride: L::COUNT, offset: 0 };
        L::load_rods(Load { program, token, inputs, rod });
        let problem = Problem { program, inputs, rod };
        let arrived = nodes.take_over(&problem, quick, quick_end, offset);
        solve_nodes(&problem, nodes, arrived, workspace, &mut out);
    }
}

impl<L: Kernels> WithSimd for FollowNodes<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let FollowNodes { program, token, nodes, end, tools } = self;
        let Tools { rod, workspace, inputs, .. } = tools;
        let inputs = Inputs { data: inputs, stride: L::COUNT, offset: 0 };
        L::load_rods(Load { program, token, inputs, rod });
        follow_quickly(&Problem { program, inputs, rod }, nodes, workspace, end);
    }
}

/// Writes how samples set out from rest.
#[inline(always)]
pub fn store_rest<L: Lane>(rest: &RestSlope<L>, out: &mut Outputs<'_, L::Scalar>) {
    out.store_vector(0, rest.m0);
    out.store(3, rest.largest);
}

/// Reads it again.
#[inline(always)]
pub fn load_rest<L: Lane>(token: L::Token, from: &Inputs<'_, L::Scalar>) -> RestSlope<L> {
    RestSlope { m0: from.vector(token, 0), largest: from.column(token, 3) }
}

/// Writes what an answer needs of the end of a path from rest.
#[inline(always)]
pub fn store_end<L: Lane>(end: &PathEnd<L>, out: &mut Outputs<'_, L::Scalar>) {
    let (zero, one) = (end.lambda.constant(0.0), end.lambda.constant(1.0));
    out.store(0, L::select(end.reached, one, zero));
    out.store(1, L::select(end.ramped, one, zero));
    out.store(2, end.passes);
    out.store(3, end.lambda);
    out.store_vector(4, end.m0);
    (0..3).for_each(|k| out.store_vector(7 + 3 * k, end.inverse[k]));
    out.store(16, L::select(end.close, one, zero));
}

/// Reads it again.
#[inline(always)]
pub fn load_end<L: Lane>(token: L::Token, from: &Inputs<'_, L::Scalar>) -> PathEnd<L> {
    let [reached, ramped, passes, lambda] = [0, 1, 2, 3].map(|column| from.column::<L>(token, column));
    let [half, zero] = [0.5, 0.0].map(|value| L::splat(token, value));
    let nobody = half.lt(zero);
    PathEnd {
        m0: from.vector(token, 4),
        inverse: Mat3 { x: from.vector(token, 7), y: from.vector(token, 10), z: from.vector(token, 13) },
        lambda,
        heading: Vec3::splat(zero),
        passes,
        reached: half.lt(reached),
        ramped: half.lt(ramped),
        close: half.lt(from.column(token, 16)),
        exhausted: nobody,
        fold: nobody,
        turned: nobody,
        load_error: half + half,
    }
}
