//! What a plan with anchors fixes in the shaders, and the numbers of its anchors.

use super::specialise::{Specialisation, Value};
use crate::model::{ANCHOR_STRIDE, Anchors, Entry, Plan, tolerances};

/// The grid of a plan and the input column of the first coordinate. A search starts from moments of its own.
fn grid(plan: &Plan) -> Option<(&Anchors, usize)> {
    let anchors = plan.anchors.as_ref().filter(|_| plan.start.is_none())?;
    match plan.entries.get(anchors.entry) {
        Some(Entry::Varying(column)) => Some((anchors.grid.as_ref(), *column)),
        _ => None,
    }
}

/// Whether samples of a plan may start from anchors.
pub(crate) fn has_anchors(plan: &Plan) -> bool {
    grid(plan).is_some()
}

/// Terms `ANCHORS` and, in the kernel that starts from them, `ANCHORED`; constants of the grid.
pub(super) fn add_anchors(s: &mut Specialisation, plan: &Plan, anchored: bool) {
    let found = grid(plan);
    s.term("ANCHORS", found.is_some());
    s.term("ANCHORED", found.is_some() && anchored);
    s.constant("ANCHOR_TRUST", Value::Float(tolerances::ANCHOR_TRUST));
    s.constant("ANCHOR_CONTRACTION", Value::Float(tolerances::ANCHOR_CONTRACTION));
    let Some((grid, column)) = found else { return };
    let axes = 0..grid.axes().len();
    for (name, value) in [("AXES", axes.len()), ("CORNERS", grid.corners()), ("COLUMN", column)] {
        s.constant(format!("ANCHOR_{name}"), Value::U32(value as u32));
    }
    s.constant("ANCHOR_POINTS", Value::u32_array(grid.axes().iter().map(|axis| axis.points)));
    s.constant("ANCHOR_STRIDES", Value::u32_array(axes.map(|axis| grid.stride(axis))));
}

/// The anchors of a plan as `shaders/equilibrium/anchors.wgsl` reads them; none without anchors.
pub(crate) fn anchor_numbers(plan: &Plan) -> Vec<f64> {
    let Some((grid, _)) = grid(plan) else { return Vec::new() };
    let width = ANCHOR_STRIDE * (grid.axes().len() + 4);
    let mut numbers: Vec<f64> = grid.rows().iter().map(|x| f64::from(*x)).collect();
    for (row, mismatch) in numbers.chunks_mut(width).zip(grid.mismatches()) {
        row[ANCHOR_STRIDE - 1] = if mismatch.is_finite() { f64::from(*mismatch) } else { -1.0 };
    }
    numbers
}
