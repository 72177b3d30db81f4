//! Which segments the kernels integrate, and whether their numbers vary from sample to sample.

use crate::model::{Entry, FLEXIBLE_RECORD, Plan, RIGID_RECORD, SegmentPlan};

/// The segments that are integrated: all but the unloaded distal part.
pub(crate) fn integrated(plan: &Plan) -> &[SegmentPlan] {
    &plan.segments[..plan.free.map_or(plan.segments.len(), |free| free.segment)]
}

/// Whether any number of an integrated segment varies.
pub(super) fn segments_vary(plan: &Plan) -> bool {
    let vary = |segment: &SegmentPlan| {
        let length = if segment.is_flexible { FLEXIBLE_RECORD } else { RIGID_RECORD };
        (segment.record..segment.record + length).any(|entry| varies(plan, entry))
    };
    integrated(plan).iter().any(vary)
}

/// Whether an entry of the plan varies.
pub(super) fn varies(plan: &Plan, entry: usize) -> bool {
    matches!(plan.entries[entry], Entry::Varying(_))
}
