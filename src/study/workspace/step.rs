//! A bounded step of least norm: towards a point, within the limits of the inputs.

use super::tip_map::{Inputs, MOST_INPUTS, Tip, dot, norm};
use crate::model::Vector;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// Singular values below this share of the largest are round-off.
const RANK_TOLERANCE: f64 = 1e-9;

/// A change of the inputs and what it leaves, to first order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub change: Inputs,
    /// What is still missing (m).
    pub left: Vector,
    /// Whether a limit holds an input back.
    pub is_held: bool,
    /// How far the tip moves by relaxation (m).
    pub relaxation: f64,
}

/// The change d that leaves least of `missing` - J d within the limits, and of those the smallest; along the `rank`
/// strongest directions only.
pub(super) fn bounded_step(tip: &Tip, at: &Inputs, count: usize, missing: Vector, rank: usize) -> Step {
    let jacobian = &tip.jacobian[..count];
    let mut change = [0.0; MOST_INPUTS];
    let mut free = [false; MOST_INPUTS];
    free[..count].fill(true);
    let mut is_held = false;
    for _ in 0..=count {
        let mut left = missing;
        for (k, column) in jacobian.iter().enumerate().filter(|(k, _)| !free[*k]) {
            (0..3).for_each(|axis| left[axis] -= column[axis] * change[k]);
        }
        let pull = pseudo_inverse(jacobian, &free, left, rank);
        for (k, column) in jacobian.iter().enumerate().filter(|(k, _)| free[*k]) {
            change[k] = dot(*column, pull);
        }
        let past = |k: usize| (at[k] + change[k]).abs() - 1.0;
        let worst = (0..count).filter(|k| free[*k]).max_by(|a, b| past(*a).total_cmp(&past(*b)));
        match worst.filter(|k| past(*k) > 0.0) {
            None => break,
            Some(k) => {
                change[k] = (at[k] + change[k]).clamp(-1.0, 1.0) - at[k];
                (free[k], is_held) = (false, true);
            }
        }
    }
    let reached = tip.position_after(&change);
    let left = std::array::from_fn(|axis| missing[axis] - (reached[axis] - tip.position[axis]));
    Step { change, left, is_held, relaxation: 0.0 }
}

impl Step {
    /// Moves the inputs towards the middle of their ranges as far as the strongest directions do not notice.
    pub(super) fn relax(&mut self, tip: &Tip, at: &Inputs, count: usize, rank: usize) {
        let jacobian = &tip.jacobian[..count];
        let towards: Inputs = std::array::from_fn(|k| if k < count { -(at[k] + self.change[k]) } else { 0.0 });
        let moves = |change: &Inputs| {
            let to = tip.position_after(change);
            std::array::from_fn(|axis| to[axis] - tip.position[axis])
        };
        let all = [true; MOST_INPUTS];
        let pull = pseudo_inverse(jacobian, &all, moves(&towards), rank);
        let mut relaxed = towards;
        jacobian.iter().enumerate().for_each(|(k, column)| relaxed[k] -= dot(*column, pull));
        for k in 0..count {
            relaxed[k] = (at[k] + self.change[k] + relaxed[k]).clamp(-1.0, 1.0) - at[k] - self.change[k];
            self.change[k] += relaxed[k];
        }
        self.relaxation = norm(moves(&relaxed));
    }

    /// The step, shortened: the tip moves at most `travel` (m), no input more than `longest`.
    pub(super) fn shortened(&self, tip: &Tip, travel: f64, longest: f64) -> Inputs {
        let reached = tip.position_after(&self.change);
        let moves = norm(std::array::from_fn(|axis| reached[axis] - tip.position[axis]));
        let largest = self.change.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
        let share = (travel / moves).min(longest / largest).min(1.0);
        if share.is_finite() { self.change.map(|x| share * x) } else { self.change }
    }
}

/// (J Jᵀ)⁺ v over the free columns, along the strongest directions.
fn pseudo_inverse(jacobian: &[Vector], free: &[bool; MOST_INPUTS], v: Vector, rank: usize) -> Vector {
    let mut gram = Matrix3::zeros();
    for column in jacobian.iter().zip(free).filter(|(_, free)| **free).map(|(column, _)| Vector3::from(*column)) {
        gram += column * column.transpose();
    }
    let eigen = SymmetricEigen::new(gram);
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let largest = eigen.eigenvalues[order[0]];
    let (v, mut sum) = (Vector3::from(v), Vector3::zeros());
    for k in order.into_iter().take(rank) {
        if eigen.eigenvalues[k] > RANK_TOLERANCE * RANK_TOLERANCE * largest && eigen.eigenvalues[k] > 0.0 {
            let direction = eigen.eigenvectors.column(k);
            sum += direction * (direction.dot(&v) / eigen.eigenvalues[k]);
        }
    }
    sum.into()
}

/// Left singular vectors and singular values of a Jacobian, the largest first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Singular {
    pub values: [f64; 3],
    pub directions: [Vector; 3],
}

impl Singular {
    pub(super) fn new(jacobian: &[Vector]) -> Singular {
        // Of the matrix itself, not of its square: small values would drown.
        let mut rows = nalgebra::Matrix3xX::zeros(jacobian.len().max(1));
        for (k, column) in jacobian.iter().enumerate() {
            rows.set_column(k, &Vector3::from(*column));
        }
        let svd = rows.svd(true, false);
        let mut singular = Singular { values: [0.0; 3], directions: [[0.0; 3]; 3] };
        let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
        order.sort_by(|a, b| svd.singular_values[*b].total_cmp(&svd.singular_values[*a]));
        for (place, k) in order.into_iter().enumerate() {
            singular.values[place] = svd.singular_values[k];
            if let Some(u) = &svd.u {
                singular.directions[place] = [u[(0, k)], u[(1, k)], u[(2, k)]];
            }
        }
        if jacobian.len() == 2 {
            let [a, b, _] = singular.directions.map(Vector3::from);
            singular.directions[2] = a.cross(&b).into();
        }
        singular
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tip(columns: &[Vector]) -> Tip {
        let mut tip = Tip { usable: true, position: [0.0; 3], ..Tip::NONE };
        tip.jacobian[..columns.len()].copy_from_slice(columns);
        tip
    }

    #[test]
    fn steps_are_the_shortest_that_arrive() {
        let tip = tip(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);
        let step = bounded_step(&tip, &[0.0; MOST_INPUTS], 4, [0.4, 0.1, -0.2], 3);
        assert!(norm(step.left) < 1e-15 && !step.is_held);
        for (found, wanted) in step.change.iter().zip([0.2, 0.1, -0.2, 0.2]) {
            assert!((found - wanted).abs() < 1e-15);
        }
    }

    #[test]
    fn what_one_input_cannot_another_does() {
        let tip = tip(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);
        let mut at = [0.0; MOST_INPUTS];
        at[0] = 0.9;
        let step = bounded_step(&tip, &at, 4, [0.6, 0.0, 0.0], 3);
        assert!(norm(step.left) < 1e-14 && step.is_held);
        assert!((step.change[0] - 0.1).abs() < 1e-15 && (step.change[3] - 0.5).abs() < 1e-14);
        let step = bounded_step(&tip, &at, 4, [5.0, 0.0, 0.0], 3);
        assert!((step.left[0] - 3.9).abs() < 1e-14);
    }

    #[test]
    fn weak_directions_are_left_alone() {
        let tip = tip(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1e-3]]);
        let step = bounded_step(&tip, &[0.0; MOST_INPUTS], 3, [0.1, 0.2, 0.3], 2);
        assert_eq!(step.change[2], 0.0);
        assert!((step.left[2] - 0.3).abs() < 1e-15 && step.left[0].abs() < 1e-15);
        let singular = Singular::new(&tip.jacobian[..3]);
        assert!((singular.values[2] - 1e-3).abs() < 1e-15);
        assert!(singular.directions[2][2].abs() > 1.0 - 1e-12);
    }
}
