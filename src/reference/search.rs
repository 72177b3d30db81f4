//! Equilibria from given base moments by single shooting, whatever the growth exponent supposes: what counts is by how much the
//! columns of a pass grow. Newton's steps are of least norm, so that they also arrive where equilibria form a ring.

use super::answer::{Equilibrium, RESIDUAL_FACTOR, TOLERANCE};
use super::by_base;
use super::chain::{self, Chain};
use super::extrapolation::Extrapolation;
use super::places::Node;
use super::shooting::{Passage, pass};
use super::stability;
use crate::model::{Rod, Slot, Status, Vector};
use nalgebra::{Matrix3, Vector3};

/// Error of a step while a search is on its way.
const ON_THE_WAY: f64 = 1e-7;
/// Passes of a search, the longest step of one (units of moment), and how often a step is halved.
const MOST_PASSES: usize = 60;
const LONGEST: f64 = 1.0;
const MOST_HALVES: usize = 6;
/// A residual that small ends the way; the rest is done to the last digits.
const NEAR: f64 = 1e-5;
const MOST_LAST_STEPS: usize = 8;
/// Columns that grow by more leave no digits.
const MOST_GROWTH: f64 = 1e6;
/// A singular value below this share of the largest is none: nothing holds the rod in that direction.
const NEUTRAL: f64 = 1e-7;
/// Eigenvalues of a pivot below this share of its size count as none.
const NEUTRAL_PIVOT: f64 = 1e-7;

/// By how much the columns of a pass from this base moment (N·m, world frame) grow: what its errors are multiplied by. `None` where
/// the rod cannot be integrated, and in a field that varies.
pub fn column_growth(rod: &Rod, m0: Vector) -> Option<f64> {
    if rod.field.is_some() {
        return None;
    }
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units);
    let m0_body = chain.R0.tr_mul(&Vector3::from(m0)) / units.moment();
    let passage = pass(&chain, m0_body, &chain.base_moment_variations(), &mut Extrapolation::new(ON_THE_WAY)).ok()?;
    Some(passage.growth())
}

/// An equilibrium away from rest, with its derivatives by `slots`; those of one that is free to move are not numbers.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Reached {
    /// Its margin is zero where it is free to move.
    pub equilibrium: Equilibrium,
    /// The change of the base moment (unit vector, world frame) along which every rod is in equilibrium, too; `None`: it is alone.
    pub neutral: Option<Vector>,
}

/// The equilibrium that Newton's method finds from a base moment (N·m, world frame). `None` where it finds none or where the columns
/// leave no digits, and in a field that varies.
pub fn equilibrium_near(rod: &Rod, m0: Vector, slots: &[Slot]) -> Option<Reached> {
    if rod.field.is_some() || !rod.is_valid() {
        return None;
    }
    let units = chain::units(rod);
    let chain = Chain::new(rod, &units);
    let start = chain.R0.tr_mul(&Vector3::from(m0)) / units.moment();
    let (m0_body, on_the_way) = approach(&chain, start)?;
    let mut integrator = Extrapolation::new(TOLERANCE);
    let (m0_body, passage, passes) = finish(&chain, m0_body, &mut integrator)?;
    let growth = passage.growth();
    if passage.residual.norm() > RESIDUAL_FACTOR * TOLERANCE * growth || growth > MOST_GROWTH {
        return None;
    }
    let is_neutral = is_neutral(&passage.matrix());
    let svd = passage.matrix().svd(false, true);
    let least = svd.singular_values.imin();
    let neutral = svd.v_t.filter(|_| is_neutral).map(|v_t| chain.R0 * v_t.row(least).transpose());
    let share = if is_neutral { NEUTRAL_PIVOT } else { 0.0 };
    let nodes = vec![Node::base(&chain, m0_body)];
    let index = stability::index_beyond(&chain, &nodes, &mut integrator, share)?;
    let is_unstable = stability::is_unstable(&chain, passage.matrix().determinant(), index);
    let (derivatives, error_estimate, margin) = match is_neutral {
        true => (Vec::new(), by_base::error_across(&passage, pseudo_inverse(&passage.matrix())?), 0.0),
        false => (
            by_base::differentiate(&chain, &units, m0_body, slots, &mut integrator)?,
            by_base::error_estimate(&passage),
            stability::margin(passage.matrix().try_inverse(), is_unstable),
        ),
    };
    let equilibrium = Equilibrium {
        error_estimate,
        index,
        margin,
        status: if is_unstable { Status::Unstable } else { Status::Ok },
        load_fraction: 1.0,
        iterations: on_the_way + passes,
        derivatives,
        nodes,
        ..by_base::posed(rod, &units, (&chain, m0_body), &passage)
    };
    Some(Reached { equilibrium, neutral: neutral.map(Into::into) })
}

/// Newton's method with steps of bounded length that lower the residual, as far as is near.
fn approach(chain: &Chain, start: Vector3<f64>) -> Option<(Vector3<f64>, usize)> {
    let base = chain.base_moment_variations();
    let mut integrator = Extrapolation::new(ON_THE_WAY);
    let mut at = start;
    let mut passage = pass(chain, at, &base, &mut integrator).ok()?;
    let mut passes = 1;
    while passage.residual.norm() > NEAR {
        if passage.growth() > MOST_GROWTH {
            return None;
        }
        let step = -pseudo_inverse(&passage.matrix())? * passage.residual;
        let mut share = (LONGEST / step.norm()).min(1.0);
        let mut halves = 0;
        loop {
            passes += 1;
            if passes > MOST_PASSES {
                return None;
            }
            match pass(chain, at + share * step, &base, &mut integrator) {
                Ok(next) if next.residual.norm() < passage.residual.norm() => {
                    at += share * step;
                    passage = next;
                    break;
                }
                _ if halves == MOST_HALVES => return None,
                _ => (share, halves) = (0.5 * share, halves + 1),
            }
        }
    }
    Some((at, passes))
}

/// Full steps until the residual gets no smaller.
fn finish(chain: &Chain, m0: Vector3<f64>, integrator: &mut Extrapolation) -> Option<(Vector3<f64>, Passage, usize)> {
    let base = chain.base_moment_variations();
    let mut best = (m0, pass(chain, m0, &base, integrator).ok()?);
    for passes in 1..=MOST_LAST_STEPS {
        let next = best.0 - pseudo_inverse(&best.1.matrix())? * best.1.residual;
        let passage = pass(chain, next, &base, integrator).ok()?;
        // Also false for NaN.
        let is_better = passage.residual.norm() < best.1.residual.norm();
        if !is_better {
            return Some((best.0, best.1, passes + 1));
        }
        best = (next, passage);
    }
    Some((best.0, best.1, MOST_LAST_STEPS + 1))
}

/// Whether a change of the base moment leaves the residual dr/dm0 as it is.
pub(super) fn is_neutral(matrix: &Matrix3<f64>) -> bool {
    // The decomposition of a matrix that is not finite would not end.
    if !matrix.iter().all(|x| x.is_finite()) {
        return false;
    }
    let values = matrix.singular_values();
    values.min() < NEUTRAL * values.max()
}

/// The inverse of dr/dm0, without directions in which nothing holds the rod.
pub(super) fn pseudo_inverse(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    if !matrix.iter().all(|x| x.is_finite()) {
        return None;
    }
    matrix.pseudo_inverse(NEUTRAL * matrix.norm()).ok()
}
