//! What the reference answers: an equilibrium, how it moves, how stable it is.

use super::chain::{Chain, Variation, rows};
use super::flexible::Flexible;
use super::places::Node;
use crate::model::{Matrix, Slot, Status, Units, Vector};
use nalgebra::{Matrix3, Vector3};

/// Error of one integration step, against the size of the numbers integrated (in units of the rod).
pub(super) const TOLERANCE: f64 = 1e-13;
/// A residual above this many tolerances, grown along the rod, is no equilibrium.
pub(super) const RESIDUAL_FACTOR: f64 = 1e3;
/// How an equilibrium moves with one slot: total derivatives, SI units per unit of the slot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlotDerivative {
    /// d(tip position) (m)
    pub dp: Vector,
    /// Virtual rotation of the tip, world frame (rad)
    pub w: Vector,
    /// d(base moment), world frame (N·m)
    pub dm0: Vector,
    /// d(force at the base), world frame (N); zero where the field is uniform and loads alone tell it.
    pub dn0: Vector,
    /// d(u0), body frame (1/m)
    pub du0: Vector,
    /// d(force of the wall on the tip), world frame (N)
    pub df: Vector,
    /// d(force of the wall along its normal) (N)
    pub dnormal_force: f64,
}

/// What tip and wall do to each other; SI units, world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TipContact {
    /// The wall presses; true of a held tip.
    pub touching: bool,
    /// Between the tip's ball and the wall; negative where tissue yields (m)
    pub gap: f64,
    /// From the wall to where the rod is, at the tip.
    pub normal: Vector,
    /// Of the wall on the rod, along the normal (N)
    pub normal_force: f64,
    /// Of the wall on the rod (N)
    pub force: Vector,
    /// Least gap of the rod beyond where it first is before the wall, plus what tissue yields to a tip that slides; 0 where such a
    /// tip is nearest (m)
    pub body_gap: f64,
    /// Estimated error of the force (N)
    pub force_error: f64,
}

/// An equilibrium of a rod; SI units.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Equilibrium {
    /// Force at s = 0+, world frame (N)
    pub n0: Vector,
    /// Moment at s = 0+, world frame (N·m)
    pub m0: Vector,
    /// Curvature at the start of the first flexible segment, body frame (1/m)
    pub u0: Vector,
    /// Tip position, world frame (m)
    pub p_tip: Vector,
    /// Tip rotation, body to world, by rows.
    pub R_tip: Matrix,
    /// Curvature at the end of the last flexible segment, body frame (1/m)
    pub u_tip: Vector,
    /// |m(L) - l_tip| (N·m)
    pub residual: f64,
    /// Estimated error of tip position over rod length, or of tip rotation (rad).
    pub error_estimate: f64,
    /// Negative eigenvalues of the second variation, under a dead tip moment of its symmetric part; 0 is stable.
    pub index: usize,
    /// sqrt(3) / |(dr/dm0)^-1|, negative when unstable: 1 at rest, 0 at a fold.
    pub margin: f64,
    /// How the path from rest ended.
    pub status: Status,
    /// Share of the full load reached from rest; what is above 1 is the share of the wall's way to the tip where that ends.
    pub load_fraction: f64,
    /// Passages over the rod.
    pub iterations: usize,
    /// One for each slot asked for.
    pub derivatives: Vec<SlotDerivative>,
    /// `None`: there is no wall, or no equilibrium to tell of.
    pub contact: Option<TipContact>,
    /// States along the rod, where the base moment alone does not tell them.
    pub(super) nodes: Vec<Node>,
}

/// Stability of a state that need not lie on the branch from rest.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Stability {
    /// Negative eigenvalues of the second variation; 0 is stable.
    pub index: usize,
    /// sqrt(3) / |(dr/dm0)^-1|, negative when unstable: 1 at rest, 0 at a fold.
    pub margin: f64,
    /// |m(L) - l_tip| (N·m)
    pub residual: f64,
}

impl Equilibrium {
    /// A row for a rod that has no solution.
    pub(super) fn without_solution(status: Status, slot_count: usize) -> Self {
        Self {
            n0: [0.0; 3],
            m0: [0.0; 3],
            u0: [0.0; 3],
            p_tip: [0.0; 3],
            R_tip: rows(&Matrix3::identity()),
            u_tip: [0.0; 3],
            residual: 0.0,
            error_estimate: 0.0,
            index: 0,
            margin: 0.0,
            status,
            load_fraction: 0.0,
            iterations: 0,
            derivatives: vec![SlotDerivative::default(); slot_count],
            contact: None,
            nodes: Vec::new(),
        }
    }
}

/// What became of a rod whose path from rest came to a share of the load, gave up or not, in so many steps. Of Newton's
/// method there is something left over and a most that may be; the end is known to be unstable, or not, or nothing is known.
pub(super) fn status(
    (lambda, gave_up, steps): (f64, bool, usize),
    (left_over, most): (f64, f64),
    is_unstable: Option<bool>,
) -> Status {
    match is_unstable {
        _ if lambda < 1.0 && gave_up => Status::StepLimit,
        _ if lambda < 1.0 => Status::Fold,
        _ if left_over.is_nan() => Status::NonFinite,
        _ if left_over > most => Status::NotConverged,
        None => Status::NotConverged,
        Some(false) if steps > 1 => Status::Ramped,
        Some(false) => Status::Ok,
        Some(true) => Status::Unstable,
    }
}

/// A vector in SI.
#[expect(non_snake_case)]
pub(super) fn SI(v: Vector3<f64>, unit: f64) -> Vector {
    (v * unit).into()
}

/// Total change by one slot, in the units of the chain.
pub(super) struct TotalChange {
    pub dp: Vector3<f64>,
    pub w: Vector3<f64>,
    /// What is left of the base moment's change where the base stands still in its own frame.
    pub dm0_body: Vector3<f64>,
    /// Of the curvature at the start of the first flexible segment.
    pub du_first: Vector3<f64>,
}

impl TotalChange {
    /// In SI, with the base moment in the world frame.
    pub(super) fn by_slot(
        &self,
        chain: &Chain,
        units: &Units,
        (slot, variation): (Slot, &Variation),
        m0_body: Vector3<f64>,
        u_first: Vector3<f64>,
    ) -> SlotDerivative {
        let mut dm0 = variation.w0.cross(&(chain.R0 * m0_body)) + chain.R0 * self.dm0_body;
        let mut du0 = self.du_first;
        if slot == Slot::Insertion {
            // So far at the former base; the new one lies proximal to it.
            if chain.is_flexible[0] || chain.rigid_force_arm {
                dm0 += chain.tangent_base().cross(&chain.n_start(0));
            }
            if chain.is_flexible[0] {
                dm0 += (chain.R0 * chain.numbers.segments[0].mu).cross(&chain.numbers.B);
                du0 -= Flexible::at_base(chain).u_slope(0.0, &chain.R0, u_first);
            }
        }
        let per = 1.0 / slot.unit(units);
        SlotDerivative {
            dp: SI(self.dp, units.length * per),
            w: SI(self.w, per),
            dm0: SI(dm0, units.moment() * per),
            du0: SI(du0, units.curvature() * per),
            ..SlotDerivative::default()
        }
    }
}
