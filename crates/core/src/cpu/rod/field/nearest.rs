//! The least distance of a straight piece from a body without hollows.

use crate::cpu::simd::lane::Lane;

/// The least of a function on [0, 1] that has one least value: along a line the distance from what is convex.
#[inline(always)]
pub fn least_on<L: Lane>(zero: L, at: impl Fn(L) -> L) -> L {
    /// Each takes a third of the interval that is left.
    const CUTS: usize = 10;
    let (mut low, mut high) = (zero, zero.constant(1.0));
    for _ in 0..CUTS {
        let third = (high - low) * zero.constant(1.0 / 3.0);
        let (one, other) = (low + third, high - third);
        let is_first = at(one).lt(at(other));
        (low, high) = (L::select(is_first, low, one), L::select(is_first, other, high));
    }
    at(low).min(at(high))
}
