//! Block elimination over the nodes, from the free tip to the base and back: Newton's steps, responses, stability. N2, N3

use super::interval::Transfer;
use crate::cpu::algebra::{Mat3, Vec3, cross, dot, inverse, transpose};
use crate::cpu::rod::stability::negative_count;
use crate::cpu::simd::apart::apart;
use crate::cpu::simd::lane::Lane;
use std::ops::{Add, Mul, Sub};

/// Changes of (w, mu) at every node by three loads.
pub type Changes<L> = Vec<(Mat3<L>, Mat3<L>)>;

/// What elimination leaves at the start of an interval: mu = s w + g.
#[derive(Clone, Copy, Debug)]
pub struct Pivot<L> {
    pub inverse: Mat3<L>,
    pub s: Mat3<L>,
}

/// The elimination of all nodes.
#[derive(Clone, Debug)]
pub struct Elimination<L> {
    /// At the tip.
    s_tip: Mat3<L>,
    pub pivots: Vec<Pivot<L>>,
    /// (dr/dm0)^-1
    pub w_inverse: Mat3<L>,
    /// Negative eigenvalues of the second variation.
    pub index: L,
    /// The least pivot, its determinant relative to that of the interval alone, whose end is free.
    pub least: L,
}

impl<L: Lane> Elimination<L> {
    pub fn new(zero: L) -> Self {
        let none = Mat3::zero(zero);
        Self { s_tip: none, pivots: Vec::new(), w_inverse: none, index: zero, least: zero }
    }

    /// Eliminates the nodes of a rod whose tip asks for mu = `s_tip` w + g.
    #[inline(always)]
    pub fn factor(&mut self, transfers: &[Transfer<L>], s_tip: Mat3<L>) {
        L::apart(s_tip.x.x.token(), Factor { elimination: self, transfers, s_tip })
    }

    #[inline(always)]
    fn factor_apart(&mut self, transfers: &[Transfer<L>], s_tip: Mat3<L>) {
        let one = s_tip.x.x.constant(1.0);
        let (mut s, mut index, mut w_inverse) = (s_tip, one.constant(0.0), Mat3::identity(one));
        self.s_tip = s_tip;
        let mut least = one;
        self.pivots.resize(transfers.len(), Pivot { inverse: s_tip, s: s_tip });
        for (transfer, pivot) in transfers.iter().zip(&mut self.pivots).rev() {
            let Transfer { a, b, c, d, .. } = transfer;
            let p = *d - s * *b; // N2
            if transfer.bends {
                // A piece of no length has no pivot. P b^-1 is that of the interval alone less what lies beyond.
                let alone = *d * inverse(*b);
                let form = alone - s;
                let negative = negative_count(form); // N3
                let odd = dot(p.x, cross(p.y, p.z)).lt(one.constant(0.0));
                let negative = L::select(odd, negative.max(one), negative);
                let bends = one.constant(0.0).lt(transfer.length);
                index = L::select(bends, index + negative, index);
                let of_pivot = symmetric_determinant(form) / symmetric_determinant(alone);
                least = L::select(bends & of_pivot.lt(least), of_pivot, least);
            }
            let inverse = inverse(p);
            s = inverse * (s * *a - *c); // N2
            w_inverse = inverse * w_inverse;
            (pivot.inverse, pivot.s) = (inverse, s);
        }
        (self.w_inverse, self.index, self.least) = (w_inverse, index, least);
    }

    /// The least pivot as it is, its symmetric part aside, relative to that of the interval alone. The product of all such has
    /// the sign of det(dr/dm0).
    #[inline(always)]
    pub fn least_whole(&self, transfers: &[Transfer<L>]) -> L {
        let one = self.least.constant(1.0);
        let mut least = one;
        for (Transfer { d, .. }, pivot) in transfers.iter().zip(&self.pivots) {
            let of_pivot = one / (determinant(&pivot.inverse) * determinant(d));
            least = L::select(of_pivot.lt(least), of_pivot, least);
        }
        least
    }

    /// Changes (w, mu) at all nodes, the tip among them, from the defects of the intervals, what the tip asks for, and the
    /// rotation of the base. Nothing drives them where there is no defect.
    #[inline(always)]
    pub fn solve<T>(
        &self,
        transfers: &[Transfer<L>],
        defect: impl Fn(usize) -> Option<(T, T)>,
        g_tip: T,
        w_base: T,
        changes: &mut Vec<(T, T)>,
    ) where
        T: Copy + Add<Output = T> + Sub<Output = T>,
        Mat3<L>: Mul<T, Output = T>,
    {
        let count = transfers.len();
        changes.resize(count + 1, (w_base, g_tip));
        let mut g = g_tip;
        for (i, (change, pivot)) in changes.iter_mut().zip(&self.pivots).enumerate().rev() {
            if let Some((e_w, e_mu)) = defect(i) {
                let s = if i + 1 < count { self.pivots[i + 1].s } else { self.s_tip };
                g = s * e_w + g - e_mu;
            }
            g = pivot.inverse * g; // N2
            change.1 = g;
        }
        let mut w = w_base;
        for (i, (change, (transfer, pivot))) in changes.iter_mut().zip(transfers.iter().zip(&self.pivots)).enumerate() {
            let mu = pivot.s * w + change.1;
            *change = (w, mu);
            w = transfer.a * w + transfer.b * mu; // N2
            if let Some((e_w, _)) = defect(i) {
                w = w + e_w;
            }
        }
        changes[count] = (w, self.s_tip * w + g_tip);
    }
}

apart!(
    Factor<'a, L: Lane>(elimination: &'a mut Elimination<L>, transfers: &'a [Transfer<L>], s_tip: Mat3<L>) -> (),
    elimination.factor_apart(transfers, s_tip)
);

#[inline(always)]
fn determinant<L: Lane>(a: &Mat3<L>) -> L {
    dot(a.x, cross(a.y, a.z))
}

/// Determinant of the symmetric part, times 8.
#[inline(always)]
fn symmetric_determinant<L: Lane>(a: Mat3<L>) -> L {
    let s = a + transpose(a);
    dot(s.x, cross(s.y, s.z))
}

/// Rotates `v` by a small rotation vector.
#[inline(always)]
pub fn rotate<L: Lane>(w: Vec3<L>, v: Vec3<L>) -> Vec3<L> {
    let one = w.x.constant(1.0);
    let r = w * one.constant(0.5);
    let turn = cross(r, v);
    v + (turn + cross(r, turn)) * (one.constant(2.0) / (one + dot(r, r)))
}
