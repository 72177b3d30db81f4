//! The rod at one place in a field that varies, and three columns there.

use crate::cpu::algebra::{Mat3, Vec3};
use crate::cpu::simd::lane::Lane;

/// The rod at one place.
#[derive(Clone, Copy, Debug)]
pub struct State<L> {
    pub p: Vec3<L>,
    pub d1: Vec3<L>,
    pub t: Vec3<L>,
    pub m: Vec3<L>,
    pub n: Vec3<L>,
}

impl<L: Lane> State<L> {
    #[inline(always)]
    pub fn select(mask: L::Mask, a: &Self, b: &Self) -> Self {
        Self {
            p: Vec3::select(mask, a.p, b.p),
            d1: Vec3::select(mask, a.d1, b.d1),
            t: Vec3::select(mask, a.t, b.t),
            m: Vec3::select(mask, a.m, b.m),
            n: Vec3::select(mask, a.n, b.n),
        }
    }
}

/// Three columns.
#[derive(Clone, Copy, Debug)]
pub struct Columns<L> {
    pub w: Mat3<L>,
    pub dp: Mat3<L>,
    pub dm: Mat3<L>,
    pub dn: Mat3<L>,
}
