//! A register of samples: their slopes at rest, their paths, their answers, each a function compiled once.

use super::algebra::{Mat3, Vec3};
use super::lane::Lane;
use super::path::{Path, PathEnd, follow_path, rest_slope};
use super::program::{Inputs, Outputs, Program};
use super::rod::{Rod, Terms};
use super::search::search_start;
use super::shoot::Workspace;
use super::solve::solve_group;
use pulp::{Simd, WithSimd};
use std::marker::PhantomData;

/// Numbers of the end of a path from rest: reached, in several load steps, passes, lambda, base moment, inverse of W.
pub const END_COLUMNS: usize = 16;

/// What registers of one kind need.
pub struct Tools<L: Lane> {
    pub rod: Rod<L>,
    pub workspace: Workspace<L>,
    /// Inputs of the samples in hand.
    pub inputs: Vec<L::Scalar>,
    /// Their slopes at rest, or the ends of their paths.
    pub start: Vec<L::Scalar>,
}

impl<L: Lane> Tools<L> {
    pub fn new(token: L::Token, program: &Program, columns: usize) -> Self {
        Self {
            rod: Rod::new(token),
            workspace: Workspace::new(token, program),
            inputs: vec![L::Scalar::default(); columns * L::COUNT],
            start: vec![L::Scalar::default(); END_COLUMNS * L::COUNT],
        }
    }
}

/// The arguments of [`rest_slope`].
pub struct AtRest<'a, L: Lane, T: Terms> {
    pub program: &'a Program,
    pub token: L::Token,
    pub inputs: Inputs<'a, L::Scalar>,
    pub tools: &'a mut Tools<L>,
    pub terms: PhantomData<T>,
}

impl<L: Lane, T: Terms> WithSimd for AtRest<'_, L, T> {
    type Output = Vec3<L>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec3<L> {
        let AtRest { program, token, inputs, tools, .. } = self;
        tools.rod.load(program, token, &inputs);
        rest_slope::<L, T>(program, &tools.rod, &mut tools.workspace)
    }
}

/// The arguments of [`follow_path`] on the ramp; its end takes the place of the slope at rest.
pub struct Follow<'a, L: Lane, T: Terms> {
    pub program: &'a Program,
    pub token: L::Token,
    pub tools: &'a mut Tools<L>,
    pub terms: PhantomData<T>,
}

impl<L: Lane, T: Terms> WithSimd for Follow<'_, L, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Follow { program, token, tools, .. } = self;
        tools.rod.load(program, token, &Inputs { data: &tools.inputs, stride: L::COUNT, offset: 0 });
        let slope = Inputs { data: &tools.start, stride: L::COUNT, offset: 0 }.vector(token, 0);
        let end = follow_path::<L, T>(program, &tools.rod, Path::Ramp, slope, &mut tools.workspace);
        store_end(&end, &mut Outputs { data: &mut tools.start, stride: L::COUNT, offset: 0 });
    }
}

/// The arguments of [`solve_group`]: one compiled function for all paths.
pub struct Group<'a, L: Lane, T: Terms> {
    pub program: &'a Program,
    pub token: L::Token,
    pub path: Path,
    pub tools: &'a mut Tools<L>,
    pub out: Outputs<'a, L::Scalar>,
    pub terms: PhantomData<T>,
}

impl<L: Lane, T: Terms> WithSimd for Group<'_, L, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Group { program, token, path, tools, mut out, .. } = self;
        let Tools { rod, workspace, inputs, start } = tools;
        let inputs = Inputs { data: inputs, stride: L::COUNT, offset: 0 };
        let start = Inputs { data: start, stride: L::COUNT, offset: 0 };
        rod.load(program, token, &inputs);
        let end = match path {
            Path::Ramp => load_end(token, &start),
            Path::GuardedRamp => follow_path::<L, T>(program, rod, path, start.vector(token, 0), workspace),
            Path::Search => search_start::<L, T>(program, token, &inputs, rod, workspace),
        };
        solve_group::<L, T>(program, token, &inputs, path, end, rod, workspace, &mut out);
    }
}

/// Writes what an answer needs of the end of a path from rest.
#[inline(always)]
fn store_end<L: Lane>(end: &PathEnd<L>, out: &mut Outputs<'_, L::Scalar>) {
    let (zero, one) = (end.lambda.constant(0.0), end.lambda.constant(1.0));
    out.store(0, L::select(end.reached, one, zero));
    out.store(1, L::select(end.ramped, one, zero));
    out.store(2, end.passes);
    out.store(3, end.lambda);
    out.store_vector(4, end.m0);
    (0..3).for_each(|k| out.store_vector(7 + 3 * k, end.inverse[k]));
}

/// Reads it again.
#[inline(always)]
fn load_end<L: Lane>(token: L::Token, from: &Inputs<'_, L::Scalar>) -> PathEnd<L> {
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
        exhausted: nobody,
        fold: nobody,
    }
}
