//! The evidence for what a row says of stability.

use crate::model::record::{COUPLE_AT, TIP_MOMENT_AT, WEIGHT_AT};
use crate::model::{Batch, Parameter, Plan, Quantity, SegmentPlan, Solutions};
use crate::spec::SweepSpec;

/// The evidence for an equilibrium's stability. Under a dead moment, and under a load that turns with the rod, no energy tells it: the work
/// depends on the way of a rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StabilityEvidence {
    /// All loads have an energy, whose second variation decides: stable where it is positive, unstable where it is not.
    Energy,
    /// A load without energy acts, and the symmetric part of the stiffness is positive: a damped rod returns from every small
    /// deviation. That is enough, and it is not needed.
    SymmetricPart,
    /// A load without energy acts, and det(dr/dm0) tells divergence: a row that is solved has not diverged on its way from rest, one
    /// that is `unstable` has. Flutter is not excluded.
    Divergence,
    /// A load without energy acts away from the path from rest, where det(dr/dm0) above zero says nothing.
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
        Some(if !has_no_energy(plan, batch, sample) {
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

/// Whether a load without energy acts on a sample.
pub(crate) fn has_no_energy(plan: &Plan, batch: &Batch, sample: usize) -> bool {
    let acts = |at: usize| (at..at + 3).any(|entry| plan.entry(batch, sample, entry) != 0.0);
    let on = |segment: &SegmentPlan| {
        segment.has_couple && acts(segment.record + COUPLE_AT) || segment.follows && acts(segment.record + WEIGHT_AT)
    };
    acts(TIP_MOMENT_AT) || plan.segments.iter().any(on)
}

/// Whether a load without energy may act on some sample.
pub(super) fn may_have_no_energy(spec: &SweepSpec) -> bool {
    if spec.scene.has_load_without_energy() {
        return true;
    }
    let is_given = spec.scene.loads.tip_moment.is_some_and(|moment| moment != [0.0; 3]);
    let moves = |parameter: &Parameter| matches!(parameter, Parameter::TipMoment(_));
    is_given || spec.axis_parameters().iter().flatten().any(moves)
}
