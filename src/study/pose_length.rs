//! The length that makes rotations comparable with positions.

use crate::model::{Scene, SegmentKind};

/// What rotations (rad) are multiplied by beside positions (m): the length that was asked for, else that of the last flexible
/// segment.
pub(super) fn pose_length(scene: &Scene, asked: Option<f64>) -> f64 {
    let flexible = scene.segments.iter().rev().find(|segment| matches!(segment.kind, SegmentKind::Flexible(_)));
    asked.unwrap_or_else(|| flexible.map_or_else(|| scene.total_length(), |segment| segment.length))
}
