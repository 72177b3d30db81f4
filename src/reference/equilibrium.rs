//! One rod: its equilibrium on the branch from rest, and what can be said of a base moment.

use super::answer::{Equilibrium, SI, Stability, TOLERANCE};
use super::chain::{self, Chain, rows};
use super::extrapolation::Extrapolation;
use super::places::{Node, first_curvature, growth};
use super::shooting::pass;
use super::state::base_state;
use super::{by_base, by_nodes, stability, varying};
use crate::model::{BaseWrench, Matrix, Rod, RodSegment, Slot, Status, Vector};
use nalgebra::Vector3;

/// Below this growth exponent single shooting keeps its digits, and where both of its paths end alike is a fold.
const LITTLE_GROWTH: f64 = 6.0;

/// Solves a rod (SI) on the branch from rest and differentiates the solution by `slots`.
///
/// What went wrong is told by the status; the rod that was reached then bears only a share of its load. A rod on which
/// errors grow much is solved by multiple shooting. So is one that ends without an answer: where errors grow at all, a fold is one
/// only if it comes again there, on two meshes.
pub fn solve_rod(rod: &Rod, slots: &[Slot]) -> Equilibrium {
    if !rod.is_valid() {
        return Equilibrium::without_solution(Status::BadParameter, slots.len());
    }
    if let Some(found) = varying::solve(rod, slots) {
        return found;
    }
    let units = chain::units(rod);
    let full = Chain::new(rod, &units);
    if by_nodes::is_limp(&full) {
        return by_nodes::solve(rod, &units, &full, slots);
    }
    let found = by_base::solve(rod, &units, &full, slots);
    let is_sure_end = found.status == Status::Fold && growth(&full) <= LITTLE_GROWTH;
    if found.status.is_converged() || is_sure_end {
        return found;
    }
    let again = by_nodes::solve(rod, &units, &full, slots);
    if again.status == found.status { found } else { again }
}

/// As [`solve_rod`], by multiple shooting whatever the rod.
pub fn solve_rod_by_nodes(rod: &Rod, slots: &[Slot]) -> Equilibrium {
    if !rod.is_valid() {
        return Equilibrium::without_solution(Status::BadParameter, slots.len());
    }
    let units = chain::units(rod);
    by_nodes::solve(rod, &units, &Chain::new(rod, &units), slots)
}

/// Growth exponent of a rod: base moment and tip tell of each other to e to this power. Above about 12 multiple
/// shooting solves it. MS1
pub fn growth_exponent(rod: &Rod) -> f64 {
    growth(&Chain::new(rod, &chain::units(rod)))
}

/// Stability of the equilibrium with this moment (N·m, world frame), or moment and force, at the base; `None` where it cannot
/// be integrated.
///
/// A base moment does not tell the state of a limp rod: there it must be that of the equilibrium from rest.
pub fn stability_at(rod: &Rod, base: impl Into<BaseWrench>) -> Option<Stability> {
    let base = base.into();
    if let Some(found) = varying::stability_at(rod, base) {
        return found;
    }
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units);
    let m0_body = chain.R0.tr_mul(&Vector3::from(base.moment)) / units.moment();
    if by_nodes::is_limp(&chain) {
        return by_nodes::stability_from_rest(&chain, &units, m0_body);
    }
    let mut integrator = Extrapolation::new(TOLERANCE);
    let passage = pass(&chain, m0_body, &chain.base_moment_variations(), &mut integrator).ok()?;
    let index = stability::index(&chain, &[Node::base(&chain, m0_body)], &mut integrator)?;
    let residual = passage.residual.norm() * units.moment();
    let is_unstable = stability::is_unstable(&chain, passage.matrix().determinant(), index);
    let margin = stability::margin(passage.matrix().try_inverse(), is_unstable);
    Some(Stability { index, margin, residual })
}

/// d(residual)/d(base moment), both in the world frame, by rows, at base moment `m0` (N·m, world frame). `None` where
/// the rod cannot be integrated, as a limp one from its base, and in a field that varies, where it is no such matrix.
///
/// Times the change of the base moment by a parameter, and negated, it is the change of the residual by that parameter
/// with the base moment held.
pub fn residual_by_base_moment(rod: &Rod, m0: Vector) -> Option<Matrix> {
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units);
    let m0_body = chain.R0.tr_mul(&Vector3::from(m0)) / units.moment();
    if by_nodes::is_limp(&chain) || rod.field.is_some() {
        return None;
    }
    let base = chain.base_moment_variations();
    let passage = pass(&chain, m0_body, &base, &mut Extrapolation::new(TOLERANCE)).ok()?;
    Some(rows(&(passage.tip.R * passage.matrix() * chain.R0.transpose())))
}

/// Curvature at the start of the first flexible segment for a base moment (N·m, world frame); body frame (1/m). `None`
/// where it is not finite. Beyond a rigid segment in a field that varies it is that of an equilibrium, which must have this
/// base moment.
pub fn base_curvature(rod: &Rod, m0: Vector) -> Option<Vector> {
    if !rod.segments.first().is_some_and(RodSegment::is_flexible)
        && let Some(found) = varying::base_curvature(rod, m0.into())
    {
        return found;
    }
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units);
    let m0_body = chain.R0.tr_mul(&Vector3::from(m0)) / units.moment();
    let (u, _) = first_curvature(&chain, &[], base_state(&chain, m0_body, &[]));
    u.iter().all(|x| x.is_finite()).then(|| SI(u, units.curvature()))
}
