//! One passage from base to tip with six unknowns, and Newton's iteration on them. F5

use super::contact::{Balance, Touch, of_base};
use super::flexible::Flexible;
use super::passage::Passage;
use super::rigid;
use super::state::{BaseLoad, Change, Column, State, Varying};
use crate::reference::extrapolation::{Extrapolation, RunAway};
use nalgebra::{Matrix3, Vector3, Vector6};

/// An equilibrium to the last digits.
pub(super) struct Polished {
    pub base: BaseLoad,
    /// `None`: the tip is free.
    pub touch: Option<Touch>,
    pub passage: Passage,
    pub balance: Balance,
}

/// Integrates the rod from the base with the given load.
pub(super) fn pass(
    rod: &Varying,
    base: &BaseLoad,
    changes: &[Change],
    integrator: &mut Extrapolation,
) -> Result<Passage, RunAway> {
    pass_by_sections(rod, base, changes, 1, integrator)
}

/// [`pass`] with so many stations, equally far from each other, on each flexible segment.
pub(super) fn pass_by_sections(
    rod: &Varying,
    base: &BaseLoad,
    changes: &[Change],
    sections: usize,
    integrator: &mut Extrapolation,
) -> Result<Passage, RunAway> {
    let mut state = rod.base_state(base, changes);
    let mut stations = Vec::new();
    let mut first = None;
    let mut u_last = Vector3::zeros();
    for j in 0..rod.chain.is_flexible.len() {
        if rod.chain.is_flexible[j] {
            let flexible = Flexible::new(rod, j, changes);
            first.get_or_insert_with(|| flexible.curvature(0.0, &state));
            let length = rod.chain.numbers.segments[j].length;
            for section in 0..sections {
                let [start, end] = [section, section + 1].map(|at| length * at as f64 / sections as f64);
                flexible.advance(integrator, start, end, &mut state)?;
                stations.push(state.columns.clone());
            }
            flexible.lengthen(&mut state);
            u_last = flexible.curvature(length, &state).0;
        } else {
            rigid::cross(rod, j, changes, &mut state);
        }
    }
    let (u_first, du_first) = first.unwrap_or_default();
    Ok(Passage { stations, u_first, du_first, u_last, ..tip_passage(rod, changes, state) })
}

/// What a state at the tip alone tells of a passage.
pub(super) fn tip_passage(rod: &Varying, changes: &[Change], tip: State) -> Passage {
    let (residual, dresidual) = tip_residual(rod, changes, &tip);
    let none = Vector3::zeros();
    Passage { tip, stations: Vec::new(), u_first: none, du_first: Vec::new(), u_last: none, residual, dresidual }
}

fn join(n: Vector3<f64>, m: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(n.x, n.y, n.z, m.x, m.y, m.z)
}

/// The tip conditions and their changes. F5
fn tip_residual(rod: &Varying, changes: &[Change], tip: &State) -> (Vector6<f64>, Vec<Vector6<f64>>) {
    let numbers = &rod.chain.numbers;
    let residual = join(tip.n - numbers.f_tip, tip.m_body - tip.R.tr_mul(&numbers.l_tip));
    let change = |(column, change): (&Column, &Change)| {
        let d = &change.of.numbers;
        let dl = d.l_tip - column.w.cross(&numbers.l_tip);
        join(column.dn - d.f_tip, column.dm_body - tip.R.tr_mul(&dl))
    };
    (residual, tip.columns.iter().zip(changes).map(change).collect())
}

/// The force at the base that, with this moment there, makes the force at the tip that of the loads; by Newton's iteration.
pub(super) fn balanced_force(
    rod: &Varying,
    m_body: Vector3<f64>,
    integrator: &mut Extrapolation,
) -> Option<Vector3<f64>> {
    const MOST_PASSES: usize = 12;
    let changes = rod.base_changes();
    let mut base = BaseLoad { n: Vector3::zeros(), m_body };
    base.n = -pass(rod, &base, &[], integrator).ok()?.residual.fixed_rows::<3>(0);
    for _ in 0..MOST_PASSES {
        let passage = pass(rod, &base, &changes[..3], integrator).ok()?;
        let columns: Vec<Vector3<f64>> = passage.dresidual.iter().map(|dr| dr.fixed_rows::<3>(0).into()).collect();
        let residual: Vector3<f64> = passage.residual.fixed_rows::<3>(0).into();
        let step = Matrix3::from_columns(&columns).lu().solve(&-residual)?;
        if step.norm() <= 1e-6 * (1.0 + base.n.norm()) {
            return Some(base.n + step);
        }
        base.n += step * ((1.0 + base.n.norm()) / step.norm()).min(1.0);
    }
    None
}

/// Full steps of Newton's iteration until neither residual nor step gets smaller.
///
/// Returns the last that came nearer by either, and the passages spent.
pub(super) fn polish(
    rod: &Varying,
    base: BaseLoad,
    touch: Option<&Touch>,
    integrator: &mut Extrapolation,
) -> Result<(Polished, usize), RunAway> {
    const MOST_PASSES: usize = 12;
    let changes = rod.base_changes();
    let mut at = |base: BaseLoad, touch: Option<Touch>| {
        let passage = pass(rod, &base, &changes, integrator)?;
        let balance = Balance::new(&passage, touch.as_ref());
        Ok(Polished { base, touch, passage, balance })
    };
    let mut best = at(base, touch.cloned())?;
    let mut last_step = f64::INFINITY;
    for passes in 2..=MOST_PASSES {
        let Some(step) = best.balance.step() else { return Ok((best, passes - 1)) };
        if step.norm() >= 0.5 * last_step || step.norm() <= f64::EPSILON * best.base.norm() {
            return Ok((best, passes - 1));
        }
        last_step = step.norm();
        let next = at(best.base.moved(&of_base(&step)), best.touch.as_ref().map(|touch| touch.moved(&step)))?;
        // Where errors grow much along the rod, their noise hides in the residual what the step mends. Both are also false for NaN.
        let is_smaller = next.balance.residual.norm() < best.balance.residual.norm();
        let contracts = || next.balance.step().is_some_and(|step| step.norm() < 0.5 * last_step);
        if !is_smaller && !contracts() {
            return Ok((best, passes));
        }
        best = next;
    }
    Ok((best, MOST_PASSES))
}
