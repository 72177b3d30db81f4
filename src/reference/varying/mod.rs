//! The reference in fields that vary in space: forces act along with torques, and the force at the base is unknown, too.
//! F0 to F8
//!
//! The literature's form (p, R, u integrated) with the internal force as a part of the state.

mod energy;
mod field;
mod flexible;
mod hessian;
mod map;
mod ramp;
mod rigid;
mod shape;
mod shooting;
mod state;

pub(super) use energy::{Of, energy};
pub(super) use shape::{poses, poses_with_derivatives};

use super::answer::{Equilibrium, RESIDUAL_FACTOR, SI, SlotDerivative, Stability, TOLERANCE, status};
use super::chain::{self, rows};
use super::extrapolation::Extrapolation;
use super::stability::{is_unstable, margin};
use crate::model::{BaseWrench, Rod, Slot, Status, Units, Vector};
use flexible::Flexible;
use nalgebra::{Matrix3, Vector3, Vector6};
use ramp::End;
use shooting::{Passage, balanced_force, pass, polish};
use state::{BaseLoad, Change, Varying};

/// Steps that a passage may take at this tolerance: bounds the sum of their errors.
const STEPS: f64 = 20.0;
/// Base moments that differ by no more than this, against the larger of theirs and EI / L, are those of one equilibrium.
const SAME_MOMENT: f64 = 1e-3;

/// Solves the rod from rest and differentiates the solution by `slots`; `None` where its field is uniform.
pub(super) fn solve(rod: &Rod, slots: &[Slot]) -> Option<Equilibrium> {
    let units = chain::units(rod);
    let full = Varying::new(rod, &units)?;
    let (path, is_sure) = ramp::from_rest(&full);
    let loaded = full.loaded(path.lambda);
    let mut integrator = Extrapolation::new(TOLERANCE);
    let Ok((base, passage, passes)) = polish(&loaded, path.base, &mut integrator) else {
        return Some(Equilibrium::without_solution(Status::NonFinite, slots.len()));
    };
    let index = hessian::stability(&loaded, &base, &mut integrator).and_then(|found| found.index());
    let most = RESIDUAL_FACTOR * TOLERANCE * passage.growth();
    let determinant = passage.matrix().determinant();
    let is_unstable = index.map(|index| is_unstable(&loaded.chain, determinant, index));
    let status = match path.end {
        _ if !is_sure => Status::Doubtful,
        End::TooNear => Status::TooNearMagnet,
        End::Outside => Status::OutsideMap,
        end => status((path.lambda, end == End::GaveUp, path.steps), (passage.residual.norm(), most), is_unstable),
    };
    let index = index.unwrap_or_default();
    let derivatives = differentiate(&loaded, &units, &base, slots, &mut integrator);
    Some(Equilibrium {
        n0: SI(base.n, units.force),
        m0: SI(loaded.chain.R0 * base.m_body, units.moment()),
        u0: SI(passage.u_first, units.curvature()),
        p_tip: SI(passage.tip.p + Vector3::from(rod.base_position) / units.length, units.length),
        R_tip: rows(&passage.tip.R),
        u_tip: SI(passage.u_last, units.curvature()),
        residual: passage.residual.norm() * units.moment(),
        error_estimate: error_estimate(&passage),
        index,
        margin: margin(passage.moment_inverse(), is_unstable.unwrap_or_default()),
        status,
        load_fraction: path.lambda,
        iterations: path.passes + passes,
        derivatives: derivatives.unwrap_or_else(|| vec![SlotDerivative::default(); slots.len()]),
        nodes: Vec::new(),
    })
}

/// What the integrator's and the residual's errors do to the tip, by the solution's own sensitivities.
fn error_estimate(passage: &Passage) -> f64 {
    let integration = STEPS * TOLERANCE * passage.growth();
    let Some(inverse) = passage.matrix().try_inverse() else { return 1.0 };
    let of = |take: fn(&state::Column) -> Vector3<f64>| {
        (0..6).map(|k| passage.combined(take, &inverse.column(k).into()).norm_squared()).sum::<f64>().sqrt()
    };
    let answers = of(|column| column.dp).max(of(|column| column.w));
    STEPS * TOLERANCE + answers * (integration.min(1.0) + passage.residual.norm())
}

/// Total derivatives by the implicit function theorem (33).
fn differentiate(
    rod: &Varying,
    units: &Units,
    base: &BaseLoad,
    slots: &[Slot],
    integrator: &mut Extrapolation,
) -> Option<Vec<SlotDerivative>> {
    let changes = all_changes(rod, base, slots);
    let passage = pass(rod, base, &changes, integrator).ok()?;
    let matrix = passage.matrix().lu();
    let derivative = |(k, slot): (usize, &Slot)| {
        let of_slot = 6 + k;
        let by: Vector6<f64> = matrix.solve(&-passage.dresidual[of_slot])?; // (33)
        let total =
            |of: fn(&state::Column) -> Vector3<f64>| of(&passage.tip.columns[of_slot]) + passage.combined(of, &by);
        let mut du0 = passage.du_first[of_slot] + (0..6).map(|c| passage.du_first[c] * by[c]).sum::<Vector3<f64>>();
        let (R0, dn0) = (rod.chain.R0, by.fixed_rows::<3>(0).into_owned());
        let mut dm0 = changes[of_slot].of.w0.cross(&(R0 * base.m_body)) + R0 * by.fixed_rows::<3>(3);
        if *slot == Slot::Insertion {
            let (slope, u_slope) = at_base(rod, base);
            dm0 -= slope;
            du0 -= u_slope;
        }
        let per = 1.0 / slot.unit(units);
        Some(SlotDerivative {
            dp: SI(total(|column| column.dp), units.length * per),
            w: SI(total(|column| column.w), per),
            dm0: SI(dm0, units.moment() * per),
            dn0: SI(dn0, units.force * per),
            du0: SI(du0, units.curvature() * per),
        })
    };
    slots.iter().enumerate().map(derivative).collect()
}

/// m' in the world frame and u' at the base: what is inserted lies proximal to it.
fn at_base(rod: &Varying, base: &BaseLoad) -> (Vector3<f64>, Vector3<f64>) {
    if !rod.chain.is_flexible[0] {
        let t: Vector3<f64> = rod.chain.R0.column(2).into();
        let arm = if rod.chain.rigid_force_arm { 1.0 } else { 0.0 };
        return (-arm * t.cross(&base.n), Vector3::zeros());
    }
    let mut still = rod.clone();
    // Pieces of no length say nothing of the slope.
    let segments = &rod.chain.numbers.segments;
    if let Some(sloped) = segments.iter().find(|segment| segment.length > 0.0) {
        let first = &mut still.chain.numbers.segments[0];
        (first.length, first.K_rise, first.u_star_rise) = (sloped.length, sloped.K_rise, sloped.u_star_rise);
    }
    let state = still.base_state(base, &[]);
    let flexible = Flexible::new(&still, 0, &[]);
    let (u, _) = flexible.curvature(0.0, &state);
    let slope: Vector3<f64> = state.R * (u.cross(&state.m_body) + flexible.moment_slope(&state));
    (slope, flexible.u_slope(&state))
}

/// Stability of the equilibrium with this load at the base.
pub(super) fn stability_at(rod: &Rod, base: BaseWrench) -> Option<Option<Stability>> {
    let units = chain::units(rod);
    let full = Varying::new(rod, &units)?;
    let found = equilibrium_at(&full, &units, base);
    Some(found.and_then(|base| {
        let mut integrator = Extrapolation::new(TOLERANCE);
        let passage = pass(&full, &base, &full.base_changes(), &mut integrator).ok()?;
        let index = hessian::stability(&full, &base, &mut integrator)?.index()?;
        let residual = passage.residual.norm() * units.moment();
        let is_unstable = is_unstable(&full.chain, passage.matrix().determinant(), index);
        Some(Stability { index, margin: margin(passage.moment_inverse(), is_unstable), residual })
    }))
}

/// Curvature at the start of the first flexible segment of the equilibrium with this load at the base; the first `None` where the
/// field is uniform.
pub(super) fn base_curvature(rod: &Rod, base: BaseWrench) -> Option<Option<Vector>> {
    let units = chain::units(rod);
    let full = Varying::new(rod, &units)?;
    let found = equilibrium_at(&full, &units, base);
    let passed = found.and_then(|base| pass(&full, &base, &[], &mut Extrapolation::new(TOLERANCE)).ok());
    Some(passed.map(|passage| SI(passage.u_first, units.curvature())))
}

/// The equilibrium with this load at the base. Where the force is not known, that is taken which goes with the moment, or where
/// that leads elsewhere, as it may in a strong field, that of the equilibrium from rest.
fn equilibrium_at(rod: &Varying, units: &Units, base: BaseWrench) -> Option<BaseLoad> {
    let m_body = rod.chain.R0.tr_mul(&Vector3::from(base.moment)) / units.moment();
    let mut integrator = Extrapolation::new(TOLERANCE);
    let mut polished = |base: BaseLoad| {
        let (base, passage, _) = polish(rod, base, &mut integrator).ok()?;
        let most = RESIDUAL_FACTOR * TOLERANCE * passage.growth();
        let is_same = (base.m_body - m_body).norm() <= SAME_MOMENT * base.m_body.norm().max(1.0);
        (is_same && passage.residual.norm() <= most).then_some(base)
    };
    if let Some(n) = base.force {
        return polished(BaseLoad { n: Vector3::from(n) / units.force, m_body });
    }
    let balanced = balanced_force(rod, m_body, &mut Extrapolation::new(TOLERANCE));
    balanced.and_then(|n| polished(BaseLoad { n, m_body })).or_else(|| {
        let (path, _) = ramp::from_rest(rod);
        if path.end == End::Arrived { polished(path.base) } else { None }
    })
}

/// The load at the base of an equilibrium, in the units of the chain.
fn base_load(rod: &Varying, units: &Units, equilibrium: &Equilibrium) -> BaseLoad {
    let m = Vector3::from(equilibrium.m0) / units.moment();
    BaseLoad { n: Vector3::from(equilibrium.n0) / units.force, m_body: rod.chain.R0.tr_mul(&m) }
}

/// Changes by slots after those of the unknown.
fn all_changes(rod: &Varying, base: &BaseLoad, slots: &[Slot]) -> Vec<Change> {
    let mut changes = rod.base_changes();
    changes.extend(slots.iter().map(|slot| rod.slot_change(*slot, base)));
    changes
}

/// A rotation matrix by its columns turned by a small vector.
fn turned(w: Vector3<f64>, R: &Matrix3<f64>) -> Matrix3<f64> {
    nalgebra::Rotation3::new(w).matrix() * R
}
