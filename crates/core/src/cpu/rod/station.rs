//! How far along the rod its stability index has been counted. S1

use crate::cpu::algebra::Mat3;
use crate::cpu::simd::lane::Lane;

/// The distal end of the intervals that have been counted.
#[derive(Clone, Copy, Debug)]
pub struct Station<L> {
    /// w of the first two threes.
    pub by_moment: Mat3<L>,
    pub by_rotation: Mat3<L>,
    /// How much of the rod lies before it, rigid segments not counted.
    pub s: L,
    /// Negative eigenvalues so far.
    pub index: L,
}

impl<L: Lane> Station<L> {
    /// The base.
    pub fn new(zero: L) -> Self {
        Self { by_moment: Mat3::zero(zero), by_rotation: Mat3::identity(zero), s: zero, index: zero }
    }
}
