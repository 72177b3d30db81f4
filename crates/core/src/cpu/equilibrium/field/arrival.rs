//! How samples in a varying field are led, where their paths end, and the numbers that keep an end until its rod is answered.

use crate::cpu::algebra::Vec3;
use crate::cpu::rod::field::matrix::Mat6;
use crate::cpu::rod::program::{Inputs, Outputs, Resolution};
use crate::cpu::simd::lane::Lane;

/// How samples are led to their answers.
#[derive(Clone, Copy)]
pub enum Led<'a> {
    /// Their paths have ended before.
    Before,
    /// They are free rods, solved before: only how they stand to the wall is asked.
    Free,
    /// From rest along the curve of equilibria, with care and on the fine grid, or without.
    Curve { careful: bool },
    /// They are free rods, solved before; a wall comes along the curve of equilibria.
    FreeCurve,
    /// They are free rods, solved before; a wall comes by guarded steps.
    FreeWithCare,
    /// With care on this grid, from rest or, in a search, from a start.
    Ramp(&'a Resolution),
}

/// Where the paths of a register ended.
pub struct VaryingPath<L: Lane> {
    /// Force and moment at the base.
    pub base: (Vec3<L>, Vec3<L>),
    /// Of dr/d(n0, m0) there.
    pub inverse: Mat6<L>,
    pub reached: L::Mask,
    pub fold: L::Mask,
    /// Its load was seen to turn there, along this change of the load at the base.
    pub turned: L::Mask,
    pub along: (Vec3<L>, Vec3<L>),
    pub too_near: L::Mask,
    /// A magnetic part leaves a map.
    pub outside: L::Mask,
    pub exhausted: L::Mask,
    pub lambda: L,
    /// Its error at a fold whose turn was seen, else 1.
    pub load_error: L,
    pub passes: L,
}

/// Numbers of the end of a path: reached, passes, lambda, force and moment at the base, the inverse, whether the wall presses, with the sign of its frame.
pub const VARYING_END_COLUMNS: usize = 9 + 36 + 1;
/// The last of them.
pub const TOUCHING_AT: usize = 9 + 36;

impl<L: Lane> VaryingPath<L> {
    /// The full load, reached after so many passes; of its matrix nothing is known.
    #[inline(always)]
    pub fn under_full_load(base: (Vec3<L>, Vec3<L>), passes: L) -> Self {
        let one = passes.constant(1.0);
        let nobody = one.lt(one);
        Self {
            base,
            inverse: Mat6::identity(one),
            reached: !nobody,
            fold: nobody,
            turned: nobody,
            along: base,
            too_near: nobody,
            outside: nobody,
            exhausted: nobody,
            lambda: one,
            load_error: one,
            passes,
        }
    }

    /// Writes what an answer needs of the end of a path without care.
    #[inline(always)]
    pub fn store(&self, out: &mut Outputs<'_, L::Scalar>) {
        let (zero, one) = (self.lambda.constant(0.0), self.lambda.constant(1.0));
        out.store(0, L::select(self.reached, one, zero));
        out.store(1, self.passes);
        out.store(2, self.lambda);
        out.store_vector(3, self.base.0);
        out.store_vector(6, self.base.1);
        for (k, x) in self.inverse.0.as_flattened().iter().enumerate() {
            out.store(9 + k, *x);
        }
    }

    /// Reads it again.
    #[inline(always)]
    pub fn load(token: L::Token, from: &Inputs<'_, L::Scalar>) -> Self {
        let [reached, passes, lambda] = [0, 1, 2].map(|column| from.column::<L>(token, column));
        let [half, zero] = [0.5, 0.0].map(|value| L::splat(token, value));
        let nobody = half.lt(zero);
        let mut inverse = Mat6::zero(zero);
        for (k, x) in inverse.0.as_flattened_mut().iter_mut().enumerate() {
            *x = from.column(token, 9 + k);
        }
        let base = (from.vector(token, 3), from.vector(token, 6));
        let reached = half.lt(reached);
        let [fold, too_near, outside, exhausted] = [nobody; 4];
        let (turned, along, load_error) = (nobody, base, half + half);
        Self { base, inverse, reached, fold, turned, along, too_near, outside, exhausted, lambda, load_error, passes }
    }
}
