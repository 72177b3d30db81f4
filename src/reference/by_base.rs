//! The equilibrium by its base moment alone: single shooting, for rods on which errors grow little.

use super::answer::{Equilibrium, RESIDUAL_FACTOR, SI, SlotDerivative, TOLERANCE, TotalChange, status};
use super::chain::{Chain, rows};
use super::extrapolation::Extrapolation;
use super::places::Node;
use super::shooting::{Passage, pass, polish};
use super::{ramp, stability};
use crate::model::{Rod, Slot, Status, Units};
use nalgebra::{Matrix3, Vector3};

/// Steps that a passage may take at this tolerance: bounds the sum of their errors.
const STEPS: f64 = 10.0;

/// Solves the rod from rest and differentiates the solution by `slots`.
pub(super) fn solve(rod: &Rod, units: &Units, full: &Chain, slots: &[Slot]) -> Equilibrium {
    let (path, is_sure) = ramp::from_rest(full);
    let chain = full.loaded(path.lambda);
    let mut integrator = Extrapolation::new(TOLERANCE);
    let Ok((m0_body, passage, passes)) = polish(&chain, path.m0_body, &mut integrator) else {
        return Equilibrium::without_solution(Status::NonFinite, slots.len());
    };
    let index = stability::index(&chain, &[Node::base(&chain, m0_body)], &mut integrator);
    let most = RESIDUAL_FACTOR * TOLERANCE * passage.growth();
    let determinant = passage.matrix().determinant();
    let is_unstable = index.map(|index| stability::is_unstable(&chain, determinant, index));
    let status = status((path.lambda, path.gave_up, path.steps), (passage.residual.norm(), most), is_unstable);
    let status = if is_sure { status } else { Status::Doubtful };
    let index = index.unwrap_or_default();
    let derivatives = differentiate(&chain, units, m0_body, slots, &mut integrator);
    Equilibrium {
        error_estimate: error_estimate(&passage),
        index,
        margin: stability::margin(passage.matrix().try_inverse(), is_unstable.unwrap_or_default()),
        status,
        load_fraction: path.lambda,
        iterations: path.passes + passes,
        derivatives: derivatives.unwrap_or_else(|| vec![SlotDerivative::default(); slots.len()]),
        ..posed(rod, units, (&chain, m0_body), &passage)
    }
}

/// The pose, the loads at the base and the residual of a passage from this base moment; nothing else is known yet.
pub(super) fn posed(
    rod: &Rod,
    units: &Units,
    (chain, m0_body): (&Chain, Vector3<f64>),
    passage: &Passage,
) -> Equilibrium {
    Equilibrium {
        n0: SI(chain.n_start(0), units.force),
        m0: SI(chain.R0 * m0_body, units.moment()),
        u0: SI(passage.u_first, units.curvature()),
        p_tip: SI(passage.tip.p + Vector3::from(rod.base_position) / units.length, units.length),
        R_tip: rows(&passage.tip.R),
        u_tip: SI(passage.u_last, units.curvature()),
        residual: passage.residual.norm() * units.moment(),
        ..Equilibrium::without_solution(Status::NotConverged, 0)
    }
}

/// What the integrator's and the residual's errors do to the tip, by the solution's own sensitivities.
pub(super) fn error_estimate(passage: &Passage) -> f64 {
    passage.matrix().try_inverse().map_or(1.0, |inverse| error_across(passage, inverse))
}

/// Estimates as [`error_estimate`] with an inverse of dr/dm0 that may leave out directions which nothing holds.
pub(super) fn error_across(passage: &Passage, inverse: Matrix3<f64>) -> f64 {
    let integration = STEPS * TOLERANCE * passage.growth();
    let columns = &passage.tip.columns[..3];
    let dp = Matrix3::from_columns(&[0, 1, 2].map(|k| columns[k].dp)) * inverse;
    let w = Matrix3::from_columns(&[0, 1, 2].map(|k| columns[k].w)) * inverse;
    STEPS * TOLERANCE + dp.norm().max(w.norm()) * (integration.min(1.0) + passage.residual.norm())
}

/// Total derivatives by the implicit function theorem (33).
pub(super) fn differentiate(
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
    let derivative = |(k, slot): (usize, &Slot)| {
        let column = 3 + k;
        let dm0_body: Vector3<f64> = matrix.solve(&-passage.dresidual[column])?; // (33)
        let total = |of: &dyn Fn(usize) -> Vector3<f64>| -> Vector3<f64> {
            of(column) + (0..3).map(|base| of(base) * dm0_body[base]).sum::<Vector3<f64>>()
        };
        let change = TotalChange {
            dp: total(&|c| passage.tip.columns[c].dp),
            w: total(&|c| passage.tip.columns[c].w),
            dm0_body,
            du_first: total(&|c| passage.du_first[c]),
        };
        Some(change.by_slot(chain, units, (*slot, &variations[column]), m0_body, passage.u_first))
    };
    slots.iter().enumerate().map(derivative).collect()
}
