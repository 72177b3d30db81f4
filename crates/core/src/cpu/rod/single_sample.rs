//! One sample alone: its three columns lie side by side in the lanes of a register, where those of several lie one after
//! the other. Every number comes about by the same operations.

use crate::cpu::algebra::{Mat3, Vec3};
use crate::cpu::rod::columns::Columns;
use crate::cpu::rod::program::Collect;
use crate::cpu::rod::source::Source;
use crate::cpu::rod::trace::Trace;
use crate::cpu::simd::lane::{Lane, Scalar, WIDEST};

/// Which lanes hold the first column, and the first two.
#[derive(Clone, Copy)]
pub struct Beside<L: Lane> {
    first: L::Mask,
    second: L::Mask,
}

impl<L: Lane> Beside<L> {
    /// `None` where several samples are in hand, or a register has no room for three columns.
    #[inline(always)]
    pub fn new(alone: bool, one: L) -> Option<Self> {
        if !alone || L::COUNT < 3 {
            return None;
        }
        let mut numbers = [L::Scalar::default(); WIDEST];
        for (lane, number) in numbers.iter_mut().enumerate() {
            *number = Scalar::from_f64(lane as f64);
        }
        let lane = L::load(one.token(), &numbers);
        Some(Self { first: lane.lt(one.constant(0.5)), second: lane.lt(one.constant(1.5)) })
    }

    /// Three columns in the place of the first.
    #[inline(always)]
    fn put(self, a: Mat3<L>) -> Mat3<L> {
        Mat3 { x: Vec3::select(self.first, a.x, Vec3::select(self.second, a.y, a.z)), ..a }
    }

    /// Those of a pass.
    #[inline(always)]
    pub fn put_columns(self, columns: &mut Columns<L>) {
        let Columns { w, dp, dM, dn, .. } = columns;
        for three in [w, dp, dM, dn] {
            *three = self.put(*three);
        }
    }

    /// Those of a source, as far as steps ask for them.
    #[inline(always)]
    pub fn put_source(self, source: &Source<L>) -> Source<L> {
        Source {
            dK: self.put(source.dK),
            dK_rise: self.put(source.dK_rise),
            du_star: self.put(source.du_star),
            du_star_rise: self.put(source.du_star_rise),
            dC_se: self.put(source.dC_se),
            dmu: self.put(source.dmu),
            dload: self.put(source.dload),
            dB: self.put(source.dB),
            ..*source
        }
    }
}

/// The first three lanes, each in a register of its own.
#[inline(always)]
fn apart<L: Lane>(lanes: L) -> [L; 3] {
    let mut numbers = [L::Scalar::default(); WIDEST];
    lanes.store(&mut numbers);
    [lanes.constant(numbers[0].to_f64()), lanes.constant(numbers[1].to_f64()), lanes.constant(numbers[2].to_f64())]
}

/// Three columns out of the place of the first.
#[inline(always)]
fn take<L: Lane>(a: Vec3<L>) -> Mat3<L> {
    let [x, y, z] = [apart(a.x), apart(a.y), apart(a.z)];
    Mat3 {
        x: Vec3 { x: x[0], y: y[0], z: z[0] },
        y: Vec3 { x: x[1], y: y[1], z: z[1] },
        z: Vec3 { x: x[2], y: y[2], z: z[2] },
    }
}

/// Those of a pass.
#[inline(always)]
pub fn take_columns<L: Lane>(columns: &mut Columns<L>) {
    let Columns { w, dp, dM, dn, .. } = columns;
    for three in [w, dp, dM, dn] {
        *three = take(three.x);
    }
}

/// The integrals of a segment, which were collected in the place of the first column.
#[inline(always)]
pub fn take_integrals<L: Lane>(collect: Collect, trace: &mut Trace<L>) {
    let bends = collect.rest_curvature || collect.stiffness;
    for (is_collected, integral) in [
        (bends, &mut trace.rest_curvature),
        (bends, &mut trace.stiffness),
        (bends && collect.rise, &mut trace.rest_curvature_rise),
        (bends && collect.rise, &mut trace.stiffness_rise),
        (collect.shear_compliance, &mut trace.shear_compliance),
        (collect.load, &mut trace.load),
        (collect.dipole, &mut trace.dipole),
        (collect.field, &mut trace.field),
    ] {
        if is_collected {
            for row in integral {
                let [x, y, z] = apart(row.x);
                *row = Vec3 { x, y, z };
            }
        }
    }
}

#[cfg(test)]
mod tests;
