//! Which segments the kernels integrate, in how many steps, and whether their numbers, or those of the field along them, vary
//! from sample to sample.

use crate::model::record::field_offset;
use crate::model::{Entry, FLEXIBLE_RECORD, Plan, RIGID_RECORD, SegmentPlan};
use std::ops::Range;

/// The segments that are integrated: all but the unloaded distal part.
pub(crate) fn integrated(plan: &Plan) -> &[SegmentPlan] {
    &plan.segments[..plan.free.map_or(plan.segments.len(), |free| free.segment)]
}

/// Steps over each segment while following the path.
pub(super) fn path_steps(plan: &Plan) -> Vec<usize> {
    integrated(plan).iter().map(|segment| plan.options.stepper.path_steps(segment.steps)).collect()
}

/// The same with care, by the method of the answer.
pub(super) fn careful_steps(plan: &Plan) -> Vec<usize> {
    let stepper = plan.options.stepper;
    integrated(plan).iter().map(|segment| stepper.careful_steps(segment.steps, stepper)).collect()
}

/// Whether any number of an integrated segment varies, or of what of the field varies in space.
pub(super) fn segments_vary(plan: &Plan) -> bool {
    let vary = |segment: &SegmentPlan| {
        let length = if segment.is_flexible { FLEXIBLE_RECORD } else { RIGID_RECORD };
        (segment.record..segment.record + length).any(|entry| varies(plan, entry))
    };
    integrated(plan).iter().any(vary) || field_entries(plan).any(|entry| varies(plan, entry))
}

/// Entries of the record of what of the field varies in space; none of a uniform one.
pub(super) fn field_entries(plan: &Plan) -> Range<usize> {
    let rod = plan.scene.rod();
    let first = field_offset(&rod.segments);
    first..first + rod.field.map_or(0, |field| field.record_len())
}

/// Whether an entry of the plan varies.
pub(super) fn varies(plan: &Plan, entry: usize) -> bool {
    matches!(plan.entries[entry], Entry::Varying(_))
}
