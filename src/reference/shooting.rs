//! One passage from base to tip, the tip condition (3) and Newton's iteration on the base moment.
//!
//! The paper's unknown is u(0); the moment at s = 0+ in the body frame, K (u(0) - u*(0)) where the first segment is
//! flexible, takes its place so that a rod may also start rigid. Newton's iterates are the same.

use super::chain::{Chain, Variation};
use super::extrapolation::{Extrapolation, RunAway};
use super::flexible::Flexible;
use super::rigid;
use super::state::{Column, State, base_state};
use nalgebra::{Matrix3, Vector3};

/// What one passage yields.
#[derive(Clone, Debug)]
pub(super) struct Passage {
    /// At the tip.
    pub tip: State,
    /// Columns at the end of each section of the flexible segments.
    pub stations: Vec<Vec<Column>>,
    /// u and its columns at the start of the first flexible segment.
    pub u_first: Vector3<f64>,
    pub du_first: Vec<Vector3<f64>>,
    /// u at the end of the last flexible segment.
    pub u_last: Vector3<f64>,
    /// m(L) - l_tip in the tip's frame.
    pub residual: Vector3<f64>,
    pub dresidual: Vec<Vector3<f64>>,
}

/// Integrates the rod from the base with the given moment.
pub(super) fn pass(
    chain: &Chain,
    m0_body: Vector3<f64>,
    variations: &[Variation],
    integrator: &mut Extrapolation,
) -> Result<Passage, RunAway> {
    pass_by_sections(chain, m0_body, variations, 1, integrator)
}

/// [`pass`] with so many stations, equally far from each other, on each flexible segment.
pub(super) fn pass_by_sections(
    chain: &Chain,
    m0_body: Vector3<f64>,
    variations: &[Variation],
    sections: usize,
    integrator: &mut Extrapolation,
) -> Result<Passage, RunAway> {
    let mut state = base_state(chain, m0_body, variations);
    let mut stations = Vec::new();
    let mut first = None;
    let mut u_last = Vector3::zeros();
    for j in 0..chain.is_flexible.len() {
        if chain.is_flexible[j] {
            let flexible = Flexible::new(chain, j, variations);
            first.get_or_insert_with(|| flexible.curvature(0.0, &state));
            let length = chain.numbers.segments[j].length;
            for section in 0..sections {
                let [start, end] = [section, section + 1].map(|at| length * at as f64 / sections as f64);
                flexible.advance(integrator, start, end, &mut state)?;
                stations.push(state.columns.clone());
            }
            flexible.lengthen(&mut state);
            u_last = flexible.curvature(length, &state).0;
        } else {
            rigid::cross(chain, j, variations, &mut state);
        }
    }
    let (residual, dresidual) = tip_residual(chain, variations, &state);
    let (u_first, du_first) = first.unwrap_or_default();
    Ok(Passage { tip: state, stations, u_first, du_first, u_last, residual, dresidual })
}

/// m(L) - l_tip in the tip's frame, and its change by each variation.
pub(super) fn tip_residual(chain: &Chain, variations: &[Variation], tip: &State) -> (Vector3<f64>, Vec<Vector3<f64>>) {
    let l_tip = chain.numbers.l_tip;
    let residual = tip.m_body - tip.R.tr_mul(&l_tip); // (3)
    let change = |(column, variation): (&Column, &Variation)| {
        column.dm_body - tip.R.tr_mul(&(variation.numbers.l_tip - column.w.cross(&l_tip))) // (31)
    };
    (residual, tip.columns.iter().zip(variations).map(change).collect())
}

impl Passage {
    /// dr/dm0 in tip and base frames; the first three columns must be those of the base moment.
    pub(super) fn matrix(&self) -> Matrix3<f64> {
        Matrix3::from_columns(&self.dresidual[..3])
    }

    /// The largest of what is measured at each station and at the tip, which a rigid segment may be alone.
    pub(super) fn largest(&self, measure: impl Fn(&[Column]) -> f64) -> f64 {
        self.stations.iter().chain([&self.tip.columns]).map(|columns| measure(columns)).fold(0.0, f64::max)
    }

    /// Largest entry of the base moment's columns: by how much errors grow along the rod.
    pub(super) fn growth(&self) -> f64 {
        self.tip.columns[..3].iter().fold(1.0, |m: f64, c| m.max(c.w.amax()).max(c.dp.amax()).max(c.dm_body.amax()))
    }
}

/// Full steps of Newton's iteration until neither residual nor step gets smaller.
///
/// Returns the base moment with the least residual, that passage, and the passages spent.
pub(super) fn polish(
    chain: &Chain,
    m0_body: Vector3<f64>,
    integrator: &mut Extrapolation,
) -> Result<(Vector3<f64>, Passage, usize), RunAway> {
    const MOST_PASSES: usize = 12;
    let base = chain.base_moment_variations();
    let mut best = (m0_body, pass(chain, m0_body, &base, integrator)?);
    let mut last_step = f64::INFINITY;
    for passes in 2..=MOST_PASSES {
        let Some(step) = best.1.matrix().lu().solve(&-best.1.residual) else {
            return Ok((best.0, best.1, passes - 1));
        };
        if step.norm() >= 0.5 * last_step || step.norm() <= f64::EPSILON * best.0.norm() {
            return Ok((best.0, best.1, passes - 1));
        }
        last_step = step.norm();
        let next = best.0 + step;
        let passage = pass(chain, next, &base, integrator)?;
        if passage.residual.norm() >= best.1.residual.norm() {
            return Ok((best.0, best.1, passes));
        }
        best = (next, passage);
    }
    Ok((best.0, best.1, MOST_PASSES))
}
