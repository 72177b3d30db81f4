//! The fold at which the path of one solution ends.

use super::Solved;
use crate::model::{Quantity, Status};

/// Where the path from rest ends in a fold, and how that load follows the parameters asked for.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FoldLoad {
    /// Share of the full load at which the rod snaps.
    pub load: f64,
    /// Estimated error of that share; `None` where its turn was not seen, as of a fold that the reference decided.
    pub error: Option<f64>,
    /// How it follows each parameter of the Jacobian (1 per unit), and the estimated error of that. Empty where no turn was seen, and
    /// where a straight rod buckles: a parameter that breaks its symmetry moves the fold infinitely fast.
    pub derivatives: Vec<(f64, f64)>,
}

impl Solved {
    /// The fold at which the path from rest ends; `None` where it does not end in one.
    pub fn fold(&self) -> Option<FoldLoad> {
        let solutions = self.solutions();
        if self.status() != Status::Fold {
            return None;
        }
        let error = solutions.is_seen_fold(0).then(|| solutions.get(0, Quantity::LoadFractionError));
        let derivative = |k: usize| {
            let column = solutions.fold_derivative_column(k)?;
            let [slope, error] = [column, column + 1].map(|column| solutions.values.get(0, column));
            slope.is_finite().then_some((slope, error))
        };
        let derivatives: Option<Vec<_>> = (0..self.plan().derivatives.len()).map(derivative).collect();
        Some(FoldLoad { load: self.load_fraction(), error, derivatives: derivatives.unwrap_or_default() })
    }
}
