//! The evidence for what a row says of stability.

use crate::model::record::TIP_MOMENT_AT;
use crate::model::{Batch, Parameter, Plan, Quantity, Solutions};
use crate::spec::SweepSpec;

/// The evidence for an equilibrium's stability. Under a dead tip moment no energy tells it: its work depends on the
/// way of a rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StabilityEvidence {
    /// All loads have an energy, whose second variation decides: stable where it is positive, unstable where it is not.
    Energy,
    /// A dead tip moment acts, and the symmetric part of the stiffness is positive: a damped rod returns from every small
    /// deviation. That is enough, and it is not needed.
    SymmetricPart,
    /// A dead tip moment acts, and det(dr/dm0) tells divergence: a row that is solved has not diverged on its way from rest, one
    /// that is `unstable` has. Flutter is not excluded.
    Divergence,
    /// A dead tip moment acts away from the path from rest, where det(dr/dm0) above zero says nothing.
    None,
}

impl StabilityEvidence {
    /// The word in files: `energy`, `symmetric-part`, `divergence`, `none`.
    pub fn name(self) -> &'static str {
        match self {
            StabilityEvidence::Energy => "energy",
            StabilityEvidence::SymmetricPart => "symmetric-part",
            StabilityEvidence::Divergence => "divergence",
            StabilityEvidence::None => "none",
        }
    }

    /// The evidence of a row of some solutions, a sample of a batch of the plan; nothing where the row holds no equilibrium.
    pub(crate) fn of(
        plan: &Plan,
        (batch, sample): (&Batch, usize),
        (solutions, row): (&Solutions, usize),
        is_from_rest: bool,
    ) -> Option<StabilityEvidence> {
        let index = solutions.get(row, Quantity::StabilityIndex);
        if !solutions.is_equilibrium(row) {
            return None;
        }
        Some(if !has_dead_moment(plan, batch, sample) {
            StabilityEvidence::Energy
        } else if index == 0.0 {
            StabilityEvidence::SymmetricPart
        } else if is_from_rest || solutions.get(row, Quantity::StabilityMargin) < 0.0 {
            StabilityEvidence::Divergence
        } else {
            StabilityEvidence::None
        })
    }
}

/// Whether a dead moment acts at the tip of a sample.
pub(crate) fn has_dead_moment(plan: &Plan, batch: &Batch, sample: usize) -> bool {
    (0..3).any(|axis| plan.entry(batch, sample, TIP_MOMENT_AT + axis) != 0.0)
}

/// Whether a dead moment may act at the tip of some sample.
pub(super) fn may_have_dead_moment(spec: &SweepSpec) -> bool {
    let is_given = spec.scene.loads.tip_moment.is_some_and(|moment| moment != [0.0; 3]);
    let moves = |parameter: &Parameter| matches!(parameter, Parameter::TipMoment(_));
    is_given || spec.axis_parameters().iter().flatten().any(moves)
}
