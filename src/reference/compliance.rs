//! How far a rod is from a fold anywhere along it: what a moment at each cut turns there. N6

use super::chain::Chain;
use super::extrapolation::Extrapolation;
use super::places::Node;
use super::stability::{intervals, margin};
use nalgebra::Matrix3;

/// Relative to the unloaded rod, the compliance at a cut (norm over sqrt(3)) that tells of no fold.
const USUAL: f64 = 2.0;
/// Panels of the integral over an interval.
const PANELS: usize = 4;

/// The stability margin of a rod on which a bend far from the base does not tell at the base: by W^-1, and by the largest
/// compliance.
pub(super) fn node_margin(
    chain: &Chain,
    nodes: &[Node],
    integrator: &mut Extrapolation,
    inverse: Matrix3<f64>,
    (index, is_unstable): (usize, bool),
) -> f64 {
    let by_tip = margin(Some(inverse), is_unstable);
    let beyond = largest(chain, nodes, integrator).map_or(0.0, |largest| largest - USUAL);
    if index > 0 { by_tip } else { 1.0 / beyond.max(1.0 / by_tip) }
}

/// The largest compliance at a cut, relative to that of the same shape without loads: the second variation's inverse there,
/// with what is beyond and what is before it eliminated.
fn largest(chain: &Chain, nodes: &[Node], integrator: &mut Extrapolation) -> Option<f64> {
    let intervals = intervals(chain, nodes, integrator, PANELS)?;
    let mut beyond = vec![Matrix3::zeros(); intervals.len()];
    for j in (1..intervals.len()).rev() {
        let it = &intervals[j];
        let pivot = it.h11 + it.h_rigid + beyond[j];
        beyond[j - 1] = it.h00 - it.h01 * pivot.try_inverse()? * it.h01.transpose();
    }
    let (mut before, mut at_rest, mut largest) = (Matrix3::zeros(), Matrix3::zeros(), 0.0_f64);
    for (j, it) in intervals.iter().enumerate() {
        // The base is held.
        let own = if j == 0 { it.h11 } else { it.h11 - it.h01.transpose() * before * it.h01 };
        at_rest += it.give;
        let relative = ((own + it.h_rigid + beyond[j]) * at_rest).try_inverse()?;
        largest = largest.max(((relative * relative).trace() / 3.0).sqrt());
        if let Some(next) = intervals.get(j + 1) {
            before = (own + it.h_rigid + next.h00).try_inverse()?;
        }
    }
    Some(largest)
}
