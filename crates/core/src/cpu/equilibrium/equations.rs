//! What a curve of equilibria is made of: points, passes near them, and where it ends. C1, C2

use crate::cpu::simd::lane::{Lane, Scalar};
use pulp::{Simd, WithSimd};

/// Share of the load over which a residual is differenced: its truncation and its round-off are about the same.
pub fn further<L: Lane>() -> f64 {
    if L::Scalar::SHARP { 1.0 / 33_554_432.0 } else { 1.0 / 512.0 }
}

/// A point of the curve, or a change of it: load at the base and load fraction.
pub trait Point<L: Lane>: Copy {
    fn select(mask: L::Mask, a: Self, b: Self) -> Self;
    /// `s a + self`
    fn plus(self, s: L, a: Self) -> Self;
    fn times(self, s: L) -> Self;
    fn lambda(&self) -> L;
    fn with_lambda(self, lambda: L) -> Self;
    /// Size of the load at the base.
    fn size(&self) -> L;
}

/// A pass at a point near the curve.
pub struct Seen<L: Lane, P, M> {
    /// Newton's step to the curve, and its size: plan units, radians of the tip or shares of the load, whichever is larger. C1
    pub delta: P,
    pub size: L,
    /// Along the curve, of length 1. C2
    pub tangent: P,
    /// Determinant of C1: above 0 but beyond a point where curves cross.
    pub whole: L,
    /// How lengths are measured here.
    pub metric: M,
    /// Squared norm of (dr/dm0)^-1, where it bounds what a grid resolves.
    pub square: L,
}

/// What the curve is of: residual and derivatives of a rod under part of its loads.
pub trait Equations<L: Lane> {
    type Point: Point<L>;
    type Metric: Copy;
    /// Whether a curve that comes to the full load is led onto it.
    const ARRIVES: bool;

    fn product(metric: &Self::Metric, a: Self::Point, b: Self::Point) -> L;
    /// The row that measures along a change of length 1.
    fn row(metric: &Self::Metric, a: Self::Point) -> Self::Point;
    fn select_metric(mask: L::Mask, a: &Self::Metric, b: &Self::Metric) -> Self::Metric;
    /// A pass, and Newton's step in the plane `row`.
    fn look(&mut self, fine: bool, at: Self::Point, row: Self::Point) -> Seen<L, Self::Point, Self::Metric>;
    /// Stability index of the last pass.
    fn index(&mut self) -> L;
    /// Whether the rod of the last pass touches nothing.
    fn is_clear(&mut self) -> L::Mask;
    /// Takes lanes of the last pass for points of the curve.
    fn keep(&mut self, lanes: L::Mask);
    /// The share of a correction's bound that holds at the point kept last.
    fn caution(&self, one: L) -> L {
        one
    }
    /// What a pass on twice the fine steps adds to the load fraction, and what round-off may.
    fn check(&mut self, at: Self::Point) -> (L, L);
}

/// A pass at a point near the curve of some equations; where it is looked at from, it is one function.
#[inline(always)]
pub fn look<L: Lane, E: Equations<L>>(
    equations: &mut E,
    fine: bool,
    at: E::Point,
    row: E::Point,
) -> Seen<L, E::Point, E::Metric> {
    L::apart(at.lambda().token(), Look { equations, fine, at, row })
}

/// The arguments of [`look`].
struct Look<'a, L: Lane, E: Equations<L>> {
    equations: &'a mut E,
    fine: bool,
    at: E::Point,
    row: E::Point,
}

impl<L: Lane, E: Equations<L>> WithSimd for Look<'_, L, E> {
    type Output = Seen<L, E::Point, E::Metric>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        self.equations.look(self.fine, self.at, self.row)
    }
}

/// Where curves end.
pub struct CurveEnd<L: Lane, P> {
    pub at: P,
    pub tangent: P,
    /// At the full load, within the tolerance of a step.
    pub reached: L::Mask,
    /// At a turn of the load, or where curves cross.
    pub fold: L::Mask,
    /// At a turn.
    pub turned: L::Mask,
    /// Error of its load fraction, else 1.
    pub load_error: L,
    pub passes: L,
}
