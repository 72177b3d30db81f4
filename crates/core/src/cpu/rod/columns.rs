//! Three sensitivity columns, and what they are the change by. J3

use super::terms::Terms;
use crate::cpu::algebra::{Mat3, Vec3, cross, cross_add, cross_sub};
use crate::cpu::simd::lane::Lane;

/// Three columns.
#[derive(Clone, Copy, Debug)]
pub struct Columns<L> {
    pub w: Mat3<L>,
    pub dp: Mat3<L>,
    pub dM: Mat3<L>,
    pub by: By,
    /// Change of the internal force.
    pub dn: Mat3<L>,
}

/// What three columns are the change by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    BaseMoment,
    /// dn = e_k all along the rod.
    TipForce,
    /// Forward columns: dn as their sources say.
    Parameters,
    BaseRotation,
}

impl By {
    #[inline(always)]
    fn changes_force(self) -> bool {
        matches!(self, By::TipForce | By::Parameters)
    }
}

/// dm of a column, from dM.
#[inline(always)]
pub fn column_moment<L: Lane>(
    terms: impl Terms,
    by: By,
    dn: Vec3<L>,
    p: Vec3<L>,
    n: Vec3<L>,
    dp: Vec3<L>,
    dM: Vec3<L>,
) -> Vec3<L> {
    let mut dm = dM;
    if by.changes_force() {
        dm = cross_add(dn, p, dm); // J3
    }
    if terms.force() { cross_sub(dp, n, dm) } else { dm } // J3
}

impl<L: Lane> Columns<L> {
    /// dm of the three, where the rod is at `p` with force `n`.
    #[inline(always)]
    pub fn moment(&self, terms: impl Terms, p: Vec3<L>, n: Vec3<L>) -> Mat3<L> {
        let Self { dp, dM, dn, .. } = self;
        Mat3 {
            x: column_moment(terms, self.by, dn.x, p, n, dp.x, dM.x),
            y: column_moment(terms, self.by, dn.y, p, n, dp.y, dM.y),
            z: column_moment(terms, self.by, dn.z, p, n, dp.z, dM.z),
        }
    }
}

/// dn - w x n of a column: what the force changes by in the body frame.
#[inline(always)]
pub fn column_force<L: Lane>(by: By, dn: Vec3<L>, n: Vec3<L>, w: Vec3<L>) -> Vec3<L> {
    if by.changes_force() { cross_add(n, w, dn) } else { cross(n, w) }
}
