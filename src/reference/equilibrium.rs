//! One rod: its equilibrium on the branch from rest, how that moves with the rod's numbers, and its shape.

use super::chain::{self, Chain, rows};
use super::extrapolation::Extrapolation;
use super::flexible::Flexible;
use super::shooting::{Passage, pass, polish};
use super::{ramp, stability};
use crate::model::{Matrix, Rod, Slot, Status, Units, Vector};
use nalgebra::{Matrix3, Vector3};

/// Error of one integration step, against the size of the numbers integrated (in units of the rod).
pub(super) const TOLERANCE: f64 = 1e-13;
/// A residual above this many tolerances, grown along the rod, is no equilibrium.
const RESIDUAL_FACTOR: f64 = 1e3;
/// Steps that a passage may take at this tolerance: bounds the sum of their errors.
const STEPS: f64 = 10.0;

/// How an equilibrium moves with one slot: total derivatives, SI units per unit of the slot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlotDerivative {
    /// d(tip position) (m)
    pub dp: Vector,
    /// Virtual rotation of the tip, world frame (rad)
    pub w: Vector,
    /// d(base moment), world frame (N·m)
    pub dm0: Vector,
    /// d(u0), body frame (1/m)
    pub du0: Vector,
}

/// An equilibrium of a rod; SI units.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Equilibrium {
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
    /// Negative eigenvalues of the second variation; 0 is stable.
    pub index: usize,
    /// sqrt(3) / |(dr/dm0)^-1|, negative when unstable: 1 at rest, 0 at a fold.
    pub margin: f64,
    /// How the path from rest ended.
    pub status: Status,
    /// Share of the full load reached from rest.
    pub load_fraction: f64,
    /// Passages over the rod.
    pub iterations: usize,
    /// One for each slot asked for.
    pub derivatives: Vec<SlotDerivative>,
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
    fn without_solution(status: Status, slot_count: usize) -> Self {
        Self {
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
        }
    }
}

/// Solves a rod (SI) on the branch from rest and differentiates the solution by `slots`.
///
/// What went wrong is told by the status; the rod that was reached then bears only a share of its load.
pub fn solve_rod(rod: &Rod, slots: &[Slot]) -> Equilibrium {
    if !rod.is_valid() {
        return Equilibrium::without_solution(Status::BadParameter, slots.len());
    }
    let units = chain::units(rod);
    let full = Chain::new(rod, &units);
    let path = ramp::from_rest(&full);
    let chain = full.loaded(path.lambda);
    let mut integrator = Extrapolation::new(TOLERANCE);
    let Ok((m0_body, passage, passes)) = polish(&chain, path.m0_body, &mut integrator) else {
        return Equilibrium::without_solution(Status::NonFinite, slots.len());
    };
    let index = stability::index(&chain, m0_body, &mut integrator);
    let status = if path.lambda < 1.0 {
        if path.gave_up { Status::StepLimit } else { Status::Fold }
    } else if passage.residual.norm().is_nan() {
        Status::NonFinite
    } else if passage.residual.norm() > RESIDUAL_FACTOR * TOLERANCE * passage.growth() || index.is_none() {
        Status::NotConverged
    } else if index != Some(0) {
        Status::Unstable
    } else if path.steps > 1 {
        Status::Ramped
    } else {
        Status::Ok
    };
    let index = index.unwrap_or_default();
    let derivatives = differentiate(&chain, &units, m0_body, slots, &mut integrator);
    Equilibrium {
        m0: SI(chain.R0 * m0_body, units.moment()),
        u0: SI(passage.u_first, units.curvature()),
        p_tip: SI(passage.tip.p + Vector3::from(rod.base_position) / units.length, units.length),
        R_tip: rows(&passage.tip.R),
        u_tip: SI(passage.u_last, units.curvature()),
        residual: passage.residual.norm() * units.moment(),
        error_estimate: error_estimate(&passage),
        index,
        margin: stability::margin(&passage, index),
        status,
        load_fraction: path.lambda,
        iterations: path.passes + passes,
        derivatives: derivatives.unwrap_or_else(|| vec![SlotDerivative::default(); slots.len()]),
    }
}

/// A vector in SI.
#[expect(non_snake_case)]
pub(super) fn SI(v: Vector3<f64>, unit: f64) -> Vector {
    (v * unit).into()
}

/// What the integrator's and the residual's errors do to the tip, by the solution's own sensitivities.
fn error_estimate(passage: &Passage) -> f64 {
    let integration = STEPS * TOLERANCE * passage.growth();
    let Some(inverse) = passage.matrix().try_inverse() else { return 1.0 };
    let columns = &passage.tip.columns[..3];
    let dp = Matrix3::from_columns(&[0, 1, 2].map(|k| columns[k].dp)) * inverse;
    let w = Matrix3::from_columns(&[0, 1, 2].map(|k| columns[k].w)) * inverse;
    STEPS * TOLERANCE + dp.norm().max(w.norm()) * (integration.min(1.0) + passage.residual.norm())
}

/// Total derivatives by the implicit function theorem (33).
fn differentiate(
    chain: &Chain,
    units: &Units,
    m0_body: Vector3<f64>,
    slots: &[Slot],
    integrator: &mut Extrapolation,
) -> Option<Vec<SlotDerivative>> {
    let mut variations = chain.base_moment_variations().to_vec();
    variations.extend(slots.iter().map(|slot| chain.slot_variation(*slot, m0_body)));
    let passage = pass(chain, m0_body, &variations, integrator).ok()?;
    let matrix = passage.matrix().lu();
    let m0 = chain.R0 * m0_body;
    let derivative = |(k, slot): (usize, &Slot)| {
        let column = 3 + k;
        let dm0_body: Vector3<f64> = matrix.solve(&-passage.dresidual[column])?; // (33)
        let total = |of: &dyn Fn(usize) -> Vector3<f64>| -> Vector3<f64> {
            of(column) + (0..3).map(|base| of(base) * dm0_body[base]).sum::<Vector3<f64>>()
        };
        let mut dm0 = variations[column].w0.cross(&m0) + chain.R0 * dm0_body;
        let mut du0 = total(&|c| passage.du_first[c]);
        if *slot == Slot::Insertion {
            // So far at the former base; the new one lies proximal to it.
            if chain.is_flexible[0] || chain.rigid_force_arm {
                dm0 += chain.tangent_base().cross(&chain.n_start(0));
            }
            if chain.is_flexible[0] {
                dm0 += (chain.R0 * chain.numbers.segments[0].mu).cross(&chain.numbers.B);
                du0 -= Flexible::at_base(chain).u_slope(0.0, &chain.R0, passage.u_first);
            }
        }
        let per = 1.0 / slot.unit(units);
        Some(SlotDerivative {
            dp: SI(total(&|c| passage.tip.columns[c].dp), units.length * per),
            w: SI(total(&|c| passage.tip.columns[c].w), per),
            dm0: SI(dm0, units.moment() * per),
            du0: SI(du0, units.curvature() * per),
        })
    };
    slots.iter().enumerate().map(derivative).collect()
}

/// Stability of the equilibrium with base moment `m0` (N·m, world frame); `None` where it cannot be integrated.
pub fn stability_at(rod: &Rod, m0: Vector) -> Option<Stability> {
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units);
    let m0_body = chain.R0.tr_mul(&Vector3::from(m0)) / units.moment();
    let mut integrator = Extrapolation::new(TOLERANCE);
    let passage = pass(&chain, m0_body, &chain.base_moment_variations(), &mut integrator).ok()?;
    let index = stability::index(&chain, m0_body, &mut integrator)?;
    let residual = passage.residual.norm() * units.moment();
    Some(Stability { index, margin: stability::margin(&passage, index), residual })
}

/// d(residual)/d(base moment), both in the world frame, by rows, at base moment `m0` (N·m, world frame). `None` where
/// the rod cannot be integrated.
///
/// Times the change of the base moment by a parameter, and negated, it is the change of the residual by that parameter
/// with the base moment held.
pub fn residual_by_base_moment(rod: &Rod, m0: Vector) -> Option<Matrix> {
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units);
    let m0_body = chain.R0.tr_mul(&Vector3::from(m0)) / units.moment();
    let base = chain.base_moment_variations();
    let passage = pass(&chain, m0_body, &base, &mut Extrapolation::new(TOLERANCE)).ok()?;
    Some(rows(&(passage.tip.R * passage.matrix() * chain.R0.transpose())))
}

/// Curvature at the start of the first flexible segment for a base moment (N·m, world frame); body frame (1/m). `None`
/// where the rod cannot be integrated.
pub fn base_curvature(rod: &Rod, m0: Vector) -> Option<Vector> {
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units);
    let m0_body = chain.R0.tr_mul(&Vector3::from(m0)) / units.moment();
    let passage = pass(&chain, m0_body, &[], &mut Extrapolation::new(TOLERANCE)).ok()?;
    Some(SI(passage.u_first, units.curvature()))
}
